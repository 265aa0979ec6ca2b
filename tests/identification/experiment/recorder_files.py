"""Files as recorders write them, made with each format's own library."""

import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np

RATE, SAMPLES = 4096.0, 200
TIME = np.arange(SAMPLES) / RATE
"""Exact in binary, so that steps and stamps agree to the last bit."""


def values() -> dict[str, np.ndarray]:
    """Two channels in the units of `UNITS`."""
    rng = np.random.default_rng(3)
    return {
        "hammer": 2.0 * np.sin(40.0 * TIME) + rng.normal(0.0, 0.01, SAMPLES),
        "load cell": 0.1 + np.maximum(0.0, np.sin(60.0 * TIME)) + rng.normal(0.0, 1e-3, SAMPLES),
    }


UNITS = {"hammer": "mm", "load cell": "kN"}


def write_tdms(path: Path, channels: Mapping[str, np.ndarray], units: Mapping[str, str] = UNITS, **properties: object) -> None:
    """Write one group; `properties` come on top of those of every waveform, None takes one away."""
    from nptdms import ChannelObject, TdmsWriter

    known = {"wf_increment": 1.0 / RATE, "wf_start_offset": 0.0} | properties
    objects = [
        ChannelObject("run", name, column, {k: v for k, v in {**known, "unit_string": units.get(name, "")}.items() if v is not None})
        for name, column in channels.items()
    ]
    with TdmsWriter(path) as writer:
        writer.write_segment(objects)


def write_uff(
    path: Path,
    channels: Mapping[str, np.ndarray],
    units: Mapping[str, str] = UNITS,
    *,
    time: np.ndarray = TIME,
    even: bool = True,
    binary: bool = False,
    **fields: object,
) -> None:
    """Write one data set 58 for each channel; `fields` replace those of the data sets."""
    import pyuff

    file = pyuff.UFF(str(path))
    for node, (name, column) in enumerate(channels.items(), start=1):
        axis = time[: len(column)]
        data = {
            "type": 58,
            "binary": int(binary),
            "func_type": 1,
            "id1": name,
            "rsp_node": node,
            "rsp_dir": 3,
            "ref_node": 0,
            "ref_dir": 0,
            "ord_data_type": 4,
            "num_pts": len(column),
            "abscissa_spacing": int(even),
            "abscissa_min": float(axis[0]),
            "abscissa_inc": float(axis[1] - axis[0]),
            "abscissa_spec_data_type": 17,
            "orddenom_spec_data_type": 0,
            "z_axis_spec_data_type": 0,
            "ordinate_spec_data_type": 0,
            "abscissa_axis_units_lab": "s",
            "ordinate_axis_units_lab": units.get(name, "NONE"),
            "x": axis,
            "data": column,
        }
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)  # the library leaves the closing of a binary file to the interpreter
            file.write_sets([data | fields], "add")


def write_mdf4(
    path: Path, channels: Mapping[str, np.ndarray], units: Mapping[str, str] = UNITS, *, time: np.ndarray = TIME, apart: bool = False
) -> None:
    """Write one group, or `apart` one for each channel."""
    from asammdf import MDF, Signal

    signals = [
        Signal(column, time[: len(column)], name=name, unit=units.get(name, ""), encoding="utf-8") for name, column in channels.items()
    ]
    with MDF(version="4.10") as file:
        for group in [[signal] for signal in signals] if apart else [signals]:
            file.append(group)
        file.save(path, overwrite=True)
