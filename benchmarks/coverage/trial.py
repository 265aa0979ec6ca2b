"""One simulated experiment, fitted, beside its truth."""

import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.simulator import KINDS, draw_plan, draw_rig, standard_sensors, write_experiment
from benchmarks.simulator.experiment import RecordPlan
from benchmarks.simulator.rig import Rig

_SERIES = 8_151
"""First word of every seed here: no other simulated experiment is drawn with it."""
_WITHOUT = ((), ("impact_force",), (), ("hammer_acceleration",))
"""Channels left out, in turn."""
_SAMPLES = (6001, 12001)


def trial(index: int, samples: tuple[int, int] = _SAMPLES) -> dict:
    """Simulate experiment number `index`, fit it, and compare; a failure is a result too."""
    rng = np.random.default_rng([_SERIES, index])
    kind = list(KINDS)[index % len(KINDS)]
    left_out = _WITHOUT[(index // len(KINDS)) % len(_WITHOUT)]
    rig = draw_rig(rng, kind)
    plans = draw_plan(rng, kind, rig.f_n, samples=samples)
    sensors = standard_sensors(force="impact_force" not in left_out, acceleration="hammer_acceleration" not in left_out)
    found = {"index": index, "kind": kind, "without": list(left_out)}
    before = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        write_experiment(Path(folder), rig, plans, sensors, rng, truth=None)
        try:
            found |= _fitted(Path(folder), rig, plans, index)
        except Exception as error:  # noqa: BLE001 - whatever goes wrong is counted, and told
            found |= {"failure": f"{type(error).__name__}: {error}"}
    return found | {"seconds": time.perf_counter() - before}


def _fitted(folder: Path, rig: Rig, plans: tuple[RecordPlan, ...], seed: int) -> dict:
    """Fit the experiment in `folder` and set estimates beside the truth."""
    from identification.estimate import fit_experiment
    from identification.experiment import load_experiment

    result = fit_experiment(load_experiment(folder), seed=seed)
    rows = [
        _row(p.spec.name, rig.fitted[p.spec.name], p.value, p.stderr, p.ci95) | {"status": p.status, "interval": p.interval}
        for p in result.parameters
    ]
    for plan, record in zip(plans, result.records, strict=True):
        truth = {"gap_error": plan.true_gap - plan.gap, "base_amplitude": rig.base_amplitude, "base_phase": plan.base_phase}
        for nuisance in record.nuisances:
            at, value = truth[nuisance.name], nuisance.value
            if nuisance.name == "base_phase":
                value = at + np.angle(np.exp(1j * (value - at)))
            rows.append(_row(nuisance.name, at, float(value), nuisance.stderr, None) | {"record": plan.file})
    return {
        "rows": rows,
        "chi2_reduced": result.chi2_reduced,
        "converged": result.converged,
        "discretisation": result.discretisation,
        "warnings": list(result.warnings),
    }


def _row(name: str, truth: float, value: float, stderr: float | None, ci95: tuple[float, float] | None) -> dict:
    """One estimate; without an interval of its own it is judged by 1.96 standard errors."""
    row = {"name": name, "truth": truth, "value": value, "stderr": stderr, "z": None, "covered": None}
    if stderr:
        low, high = ci95 or (value - 1.96 * stderr, value + 1.96 * stderr)
        row |= {"z": (value - truth) / stderr, "covered": bool(low <= truth <= high)}
    return row
