"""One case: drawn, written to a temporary folder, diagnosed, and compared with its truth."""

import tempfile
import time
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import psutil

from benchmarks.concealed.jobs import Job
from benchmarks.machine import revision
from benchmarks.simulator import Case, draw_case, write_case
from benchmarks.simulator.case import truth

_ATTEMPTS = 20
_KNOWN = ("effects", "where", "kind", "noise", "channels", "driven", "unrest", "corner", "colour", "scatter")
"""What of the truth is kept with a finished case."""
_MEMORY = 4 * 2**30
"""Bytes."""


def trial(job: Job, *, budget_minutes: float = 5.0, baselines: bool = True) -> dict:
    """Draw, write and diagnose one case; a failure is a result too, with its message."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "rig"
        known = truth(written(job, folder))
        found = {name: known[name] for name in _KNOWN}
        found = {"key": job.key, "group": job.group, "job": job.settings} | found
        found |= {"revision": revision(), "budget_minutes": budget_minutes}
        before, of_cores = time.perf_counter(), time.process_time()
        said = _kept("diagnosis", lambda: diagnosed(folder, budget_minutes=budget_minutes))
        found |= {"seconds": time.perf_counter() - before, "cpu_seconds": time.process_time() - of_cores}
        found |= _kept("diagnosis", lambda: scored(said["diagnosis"], folder)) if "diagnosis" in said else said
        if baselines:
            found |= {"baselines": _baselines(folder)}
    return found


def compared(finished: tuple[Job, dict]) -> dict:
    """A finished case and what simpler methods say about it; its records are drawn again."""
    job, found = finished
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "rig"
        written(job, folder)
        return found | {"baselines": _baselines(folder)}


def written(job: Job, folder: Path) -> Case:
    """Draw the case and write it; where the hammer runs away in one of the motions, the case is drawn anew."""
    for attempt in range(_ATTEMPTS):
        rng = job.rng(attempt)
        try:
            case = draw_case(rng, job.order)
            write_case(folder, case, rng)
        except ArithmeticError:
            continue
        return case
    raise ArithmeticError(f"the hammer ran away in {_ATTEMPTS} drawings of {job.key}: choose weaker effects")


def diagnosed(folder: Path, *, budget_minutes: float = 5.0):
    """The program's diagnosis of an experiment. This is the only place that calls the program."""
    import jax

    from identification.experiment import load_experiment

    if psutil.Process().memory_info().rss > _MEMORY:
        jax.clear_caches()  # compiled programs of case after case would fill the memory; they come back from disk
    diagnose = import_module("identification.diagnose")
    return diagnose.diagnose_experiment(load_experiment(folder), budget_minutes=budget_minutes)


def scored(diagnosis, folder: Path) -> dict:
    """The verdict, as the document that `vibrojax diagnose` writes has it, and how well both models predict the sealed records."""
    from benchmarks.concealed.prediction import sealed_errors
    from identification.experiment import load_experiment

    document = diagnosis.document()
    sealed = load_experiment(folder.with_name(f"{folder.name}.sealed"))
    return {
        "verdict": document["verdict"],
        "effects": [effect["name"] for effect in document["effects"]],
        "probabilities": [effect["probability"] for effect in document["effects"]],
        "ambiguous_with": list(document["ambiguous_with"]),
        "warnings": document["warnings"],
        "chances": [one["chance"] for one in document["considered"] if not one["beside"]],
        "location": document["location"],
        "chi2_nominal": document["nominal"]["chi2_reduced"],
        "chi2_augmented": document["augmented"]["chi2_reduced"],
        "held_out_nominal": document["nominal"]["held_out_nrmse"],
        "held_out_augmented": document["augmented"]["held_out_nrmse"],
        "sealed_nominal": sealed_errors(diagnosis.nominal_model, sealed),
        "sealed_augmented": sealed_errors(diagnosis.model, sealed),
    }


def _baselines(folder: Path) -> dict:
    """What simpler methods name, on the same records."""
    from benchmarks.concealed import bic, sindy
    from benchmarks.concealed.force_balance import force_balance

    found = _kept("balance", lambda: force_balance(folder))
    if "failure" in found:
        return {"bic": found, "sindy": found}
    return {module.NAME: _kept("name", lambda module=module: module.name_effect(found["balance"])) for module in (bic, sindy)}


def _kept(key: str, compute: Callable[[], object]) -> dict:
    """The result under its key, or the failure."""
    try:
        return {key: compute()}
    except Exception as error:  # noqa: BLE001 - whatever goes wrong is counted, and told
        return {"failure": f"{type(error).__name__}: {error}"}
