"""A sound file of each recorded format, of two channels."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np

_SAMPLES = 300
TIME = np.arange(_SAMPLES) / 1000.0
MOTION = {"hammer": 1e-3 * np.exp(-3.0 * TIME) * np.cos(30.0 * TIME), "force": np.maximum(0.0, np.sin(40.0 * TIME))}
"""m and N."""
_LABVIEW = """LabVIEW Measurement\t
Writer_Version\t2
Separator\tTab
Decimal_Separator\t,
X_Columns\tOne
Time_Pref\tRelative
Date\t2024/03/01
Time\t10:11:12,3456789012345678901
***End_of_Header***\t
\t
Channels\t2\t\t
Samples\t300\t300\t
Y_Unit_Label\tmm\tNewtons\t
X_Dimension\tTime\tTime\t
X0\t0,0000000000000000E+0\t0,0E+0\t
Delta_X\t0,001\t0,001\t
***End_of_Header***\t\t\t
X_Value\tHammer LVDT\tLoad cell\tComment
"""


def csv(path: Path) -> None:
    """Comma and point; packed where the name ends so."""
    np.savetxt(path, np.column_stack([TIME, *MOTION.values()]), delimiter=",", header="time,hammer,force", comments="", fmt="%.7g")


def labview(path: Path) -> None:
    """A measurement file with lines above the header row, and decimal commas."""
    rows = zip(TIME, 1e3 * MOTION["hammer"], MOTION["force"], strict=True)
    lines = ("\t".join(f"{value:.6f}".replace(".", ",") for value in row) for row in rows)
    path.write_text(_LABVIEW + "\n".join(lines) + "\n", encoding="cp1252", newline="\r\n")


def npz(path: Path) -> None:
    """Not compressed."""
    np.savez(path, time=TIME, **MOTION)


def hdf5(path: Path) -> None:
    """Compressed data sets; also a MATLAB file of version 7.3."""
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in {"time": TIME, **MOTION}.items():
            file.create_dataset(name, data=values, compression="gzip")


def mat(path: Path, *, packed: bool = False) -> None:
    """Version 5."""
    from scipy.io import savemat

    savemat(path, {"time": TIME, **MOTION}, do_compression=packed)


def packed_mat(path: Path) -> None:
    """The same, compressed."""
    mat(path, packed=True)


def tdms(path: Path) -> None:
    """One group."""
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("run", name, values, {"wf_increment": 1e-3}) for name, values in MOTION.items()])


def uff(path: Path, *, binary: int = 0) -> None:
    """A data set 58 for each channel."""
    import pyuff

    head: dict[str, Any] = {"type": 58, "binary": binary, "func_type": 1, "rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0}
    axis = {"num_pts": _SAMPLES, "abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 1e-3, "abscissa_spec_data_type": 17}
    more = {"ord_data_type": 4, "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0, "ordinate_spec_data_type": 0}
    units = {"abscissa_axis_units_lab": "s", "ordinate_axis_units_lab": "m"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        for name, values in MOTION.items():
            pyuff.UFF(str(path)).write_sets([{**head, **axis, **more, **units, "id1": name, "x": TIME, "data": values}], "add")


def binary_uff(path: Path) -> None:
    """The same, data set 58b."""
    uff(path, binary=1)


def mf4(path: Path) -> None:
    """Two groups with linear conversions."""
    import asammdf

    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(values, TIME, name=name, unit="m", conversion={"a": 2.0, "b": 0.0}) for name, values in MOTION.items()])
        file.save(path, overwrite=True)
