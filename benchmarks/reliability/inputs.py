"""Every kind of file that the program reads: what makes a sound one, and what reads it."""

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.reliability import own_files, recorded_files


class Kind(NamedTuple):
    """How a kind of file is made and read."""

    name: str
    write: Callable[[Path], None]
    use: Callable[[Path], object]


def kinds() -> dict[str, Kind]:
    """By a short name."""
    recorded = {
        "csv": ("a.csv", recorded_files.csv),
        "csv.gz": ("a.csv.gz", recorded_files.csv),
        "lvm": ("a.lvm", recorded_files.labview),
        "npz": ("a.npz", recorded_files.npz),
        "h5": ("a.h5", recorded_files.hdf5),
        "mat": ("a.mat", recorded_files.mat),
        "mat, compressed": ("a.mat", recorded_files.packed_mat),
        "mat, version 7.3": ("a.mat", recorded_files.hdf5),
        "tdms": ("a.tdms", recorded_files.tdms),
        "uff": ("a.uff", recorded_files.uff),
        "uff, binary": ("a.uff", recorded_files.binary_uff),
        "mf4": ("a.mf4", recorded_files.mf4),
    }
    return {name: Kind(file, write, _inspect) for name, (file, write) in recorded.items()} | {
        "experiment": Kind("experiment.toml", own_files.experiment, _load),
        "experiment, every key": Kind("experiment.toml", own_files.every_key, _load),
        "reference": Kind("reference.toml", own_files.reference, _read_reference),
        "model.json": Kind("model.json", own_files.model, _read_model),
        "fit.json": Kind("fit.json", own_files.fit, _read_fit),
        "result.nc": Kind("result.nc", own_files.fitted, _read_result),
        "result.nc, diagnosis": Kind("result.nc", own_files.diagnosed, _read_result),
        "store": Kind("a.zarr", own_files.store, _open_store),
    }


def peers() -> dict[str, Callable[[Path], object]]:
    """What others read the same files with, by the kind."""
    return {"csv": _pandas, "h5": _h5py, "mat": _scipy, "mf4": _asammdf}


def _inspect(path: Path) -> object:
    from identification.inspection import inspect_path, propose

    found = inspect_path(path)
    return propose(found, path.parent)


def _load(path: Path) -> object:
    """As a simulation does, and as a fit does, with the model that is declared."""
    from identification.experiment import load_experiment
    from identification.guesses.declared_model import check_wishes, nominal_model

    load_experiment(path, need_files=False)
    found = load_experiment(path)
    model = nominal_model(found, None)
    check_wishes(found, model.parameters)
    return model


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
    from identification.diagnosis.files import stored_diagnosis
    from identification.result.files import stored_fit
    from identification.result.store import read_stored

    builders: dict[str, Any] = {"fit": stored_fit, "diagnosis": stored_diagnosis}
    return read_stored(path, builders)


def _open_store(path: Path) -> object:
    """As a run does that goes on with it, up to the first tile that it would make anew; other numbers than those written are an error."""
    from vibrojax.errors import InputError
    from vibrojax.studies.store import opened, read

    def absent() -> Any:
        raise AssertionError("the store is not seen")

    job = own_files.store_job()
    with opened(path, job, absent, lambda text: None) as done:
        if not done.all():
            raise InputError(f"{path}: {int((~done).sum())} tiles are made again: expected none")
        found = read(path, job)
    if not found.identical(read(path.parent / "sound" / path.name, job)):
        raise AssertionError("the store gives other numbers than those written")
    return found


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
