"""One case: drawn, written to a temporary folder, diagnosed, and compared with its truth."""

import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path

import psutil

from benchmarks.concealed import bic, grey_box, sindy
from benchmarks.concealed.jobs import Job
from benchmarks.machine import revision
from benchmarks.simulator import Case, draw_case, write_case
from benchmarks.simulator.case import truth

_ATTEMPTS = 20
_KNOWN = ("effects", "where", "kind", "noise", "channels", "driven", "unrest", "corner", "colour", "scatter")
"""What of the truth is kept with a finished case."""
_MEMORY = 4 * 2**30
"""Bytes."""
BASELINES = {method.NAME: method.name_effect for method in (bic, sindy, grey_box)}
"""Simpler methods: what each names, given the folder of an experiment."""


def trial(job: Job, *, budget_minutes: float = 5.0, baselines: Sequence[str] = ()) -> dict:
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
            found |= {"baselines": _answers(folder, unanswered(baselines, found))}
    return found


def unanswered(baselines: Sequence[str], found: Mapping) -> list[str]:
    """Those of the simpler methods that have not answered, or failed; the model of flights only where nothing acts elsewhere."""
    answers, in_flight = found.get("baselines", {}), {effect["name"] for effect in found["effects"]} <= set(grey_box.TERMS)
    asked = [name for name in baselines if name != grey_box.NAME or in_flight]
    return [name for name in asked if "name" not in answers.get(name, {})]


def compared(finished: tuple[Job, dict], *, baselines: Sequence[str]) -> dict:
    """A finished case and what simpler methods say about it; its records are drawn again."""
    job, found = finished
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "rig"
        written(job, folder)
        return found | {"baselines": found.get("baselines", {}) | _answers(folder, unanswered(baselines, found))}


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
    diagnose = import_module("identification.diagnosis.diagnose")
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
        "largest_gain": max((one["drop"] for one in document["considered"] if one["drop"] is not None), default=None),
        "location": document["location"],
        "chi2_nominal": document["nominal"]["chi2_reduced"],
        "chi2_augmented": document["augmented"]["chi2_reduced"],
        "held_out_nominal": document["nominal"]["held_out_nrmse"],
        "held_out_augmented": document["augmented"]["held_out_nrmse"],
        "sealed_nominal": sealed_errors(diagnosis.nominal_model, sealed),
        "sealed_augmented": sealed_errors(diagnosis.model, sealed),
    }


def _answers(folder: Path, baselines: Sequence[str]) -> dict:
    """What simpler methods name, on the same records."""
    return {name: _kept("name", lambda name=name: BASELINES[name](folder)) for name in baselines}


def _kept(key: str, compute: Callable[[], object]) -> dict:
    """The result under its key, or the failure."""
    try:
        return {key: compute()}
    except Exception as error:  # noqa: BLE001 - whatever goes wrong is counted, and told
        return {"failure": f"{type(error).__name__}: {error}"}
