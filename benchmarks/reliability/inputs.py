"""Every kind of file that the program reads: a sound one of each, and what reads it."""

import json
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

_SAMPLES = 300
_TIME = np.arange(_SAMPLES) / 1000.0
_MOTION = {"hammer": 1e-3 * np.exp(-3.0 * _TIME) * np.cos(30.0 * _TIME), "force": np.maximum(0.0, np.sin(40.0 * _TIME))}


class Kind(NamedTuple):
    """How a kind of file is made and read."""

    name: str
    write: Callable[[Path], None]
    use: Callable[[Path], object]


def kinds() -> dict[str, Kind]:
    """By a short name; formats whose library is not installed are left out."""
    tables = {
        "csv": ("a.csv", _csv),
        "csv.gz": ("a.csv.gz", _csv_gz),
        "npz": ("a.npz", lambda path: np.savez(path, time=_TIME, **_MOTION)),
        "h5": ("a.h5", _hdf5),
        "mat": ("a.mat", _mat),
        "tdms": ("a.tdms", _tdms),
        "uff": ("a.uff", _uff),
        "mf4": ("a.mf4", _mf4),
    }
    found = {name: Kind(file, write, _inspect) for name, (file, write) in tables.items()}
    return found | {
        "experiment": Kind("experiment.toml", _experiment, _load),
        "reference": Kind("reference.toml", _reference, _read_reference),
        "model.json": Kind("model.json", _model, _read_model),
        "fit.json": Kind("fit.json", _fit, _read_fit),
        "result.nc": Kind("result.nc", _result, _read_result),
    }


def peers() -> dict[str, Callable[[Path], object]]:
    """What others read the same files with, by the kind."""
    return {"csv": _pandas, "h5": _h5py, "mat": _scipy, "mf4": _asammdf}


def _csv(path: Path) -> None:
    np.savetxt(path, np.column_stack([_TIME, *_MOTION.values()]), delimiter=",", header="time,hammer,force", comments="", fmt="%.7g")


_csv_gz = _csv


def _hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for name, values in {"time": _TIME, **_MOTION}.items():
            file.create_dataset(name, data=values, compression="gzip")


def _mat(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"time": _TIME, **_MOTION})


def _tdms(path: Path) -> None:
    from nptdms import ChannelObject, TdmsWriter

    with TdmsWriter(path) as writer:
        writer.write_segment([ChannelObject("run", name, values, {"wf_increment": 1e-3}) for name, values in _MOTION.items()])


def _uff(path: Path) -> None:
    import pyuff

    head = {"type": 58, "binary": 0, "func_type": 1, "rsp_node": 1, "rsp_dir": 3, "ref_node": 0, "ref_dir": 0, "ord_data_type": 4}
    axis = {"num_pts": _SAMPLES, "abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 1e-3, "abscissa_spec_data_type": 17}
    more = {"orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0, "ordinate_spec_data_type": 0}
    units = {"abscissa_axis_units_lab": "s", "ordinate_axis_units_lab": "m"}
    for name, values in _MOTION.items():
        pyuff.UFF(str(path)).write_sets([{**head, **axis, **more, **units, "id1": name, "x": _TIME, "data": values}], "add")


def _mf4(path: Path) -> None:
    import asammdf

    with asammdf.MDF(version="4.10") as file:
        file.append(
            [asammdf.Signal(values, _TIME, name=name, unit="m", conversion={"a": 2.0, "b": 0.0}) for name, values in _MOTION.items()]
        )
        file.save(path, overwrite=True)


def _experiment(path: Path) -> None:
    _csv(path.parent / "run.csv")
    path.write_text(
        'schema = 1\n[experiment]\nname = "rig"\n[hammer]\nmass = 0.4\n[suspension]\nkind = "linear"\n'
        '[sensors.hammer_displacement]\nunit = "m"\nnoise = 1e-6\n[parameters.k_i]\nstart = 1e6\n'
        '[[record]]\nfile = "run.csv"\nkind = "free-decay"\ngap = 1.0\ncolumns = { hammer_displacement = "hammer" }\n'
    )


def _reference(path: Path) -> None:
    row = '[[value]]\nname = "k_i"\nsymbol = "k_i"\nvalue = 1.9e6\nunit = "N/m^n"\nsource = "figure 1"\nstderr = 3.0\n'
    path.write_text(f'schema = 1\ntitle = "known"\n{row}')


def _model(path: Path) -> None:
    from vibrojax.contact import HuntCrossley
    from vibrojax.effects import CoulombFriction
    from vibrojax.effects.free_form import FreeForm
    from vibrojax.model import Model
    from vibrojax.model_file import write_model
    from vibrojax.suspension import Linear

    effects = (CoulombFriction(0.2), FreeForm(terms=("u^3", "|u| u'"), c1=-2e5, c2=-30.0))
    write_model(Model(mass=0.5, suspension=Linear(0.02, 4.0), law=HuntCrossley(1e6, 1.5, 0.3), effects=effects), path)


def _fit(path: Path) -> None:
    _model(path.parent / "model.json")
    values = {"k_i": 1e6, "n": 1.5, "lambda_i": 0.3, "zeta": 0.02, "f_n": 4.0}
    parameters = {name: {"value": value, "stderr": 0.01 * value} for name, value in values.items()}
    matrix = np.eye(len(values)).tolist()
    path.write_text(json.dumps({"schema": 1, "parameters": parameters, "correlation": {"names": list(values), "matrix": matrix}}, indent=1))


def _result(path: Path) -> None:
    """Of a fit of one short record, without a search."""
    from identification import fit, load_experiment
    from identification.result.json_file import provenance
    from identification.result.netcdf_result import StoredFit, write_result

    _experiment(path.parent / "experiment.toml")
    result = fit(load_experiment(path.parent / "experiment.toml")).result
    write_result(StoredFit(result=result, reference=None, provenance=provenance(result)), path)


def _inspect(path: Path) -> object:
    from identification.inspection import inspect_path, propose

    found = inspect_path(path)
    return propose(found, path.parent)


def _load(path: Path) -> object:
    from identification.experiment import load_experiment

    return load_experiment(path)


def _read_reference(path: Path) -> object:
    from identification.result.reference import read_reference

    return read_reference(path)


def _read_model(path: Path) -> object:
    from vibrojax.model_file import read_model

    return read_model(path)


def _read_fit(path: Path) -> object:
    from vibrojax.studies.draws import read_fit

    return read_fit(path.parent).draw(10, seed=0)


def _read_result(path: Path) -> object:
    from identification.report.diagnosis.result_file import stored_diagnosis
    from identification.result.netcdf_file import DIAGNOSIS, FIT, read_netcdf
    from identification.result.netcdf_result import stored_fit

    builders: dict[str, Any] = {FIT: stored_fit, DIAGNOSIS: stored_diagnosis}
    return read_netcdf(path, builders)


def _pandas(path: Path) -> object:
    import pandas

    return pandas.read_csv(path)


def _h5py(path: Path) -> object:
    import h5py

    with h5py.File(path, "r", locking=False) as file:
        return {name: file[name][()] for name in file}  # type: ignore[index]


def _scipy(path: Path) -> object:
    from scipy.io import loadmat

    return loadmat(path)


def _asammdf(path: Path) -> object:
    import asammdf

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        with asammdf.MDF(path) as file:
            return [file.get(name) for name in ("hammer", "force")]
