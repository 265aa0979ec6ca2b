"""One simulated experiment, fitted, beside its truth."""

import dataclasses
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks.simulator import KINDS, draw_plan, draw_rig, standard_sensors, write_experiment
from benchmarks.simulator.experiment import RecordPlan
from benchmarks.simulator.rig import Rig
from benchmarks.simulator.unrest import with_unrest

if TYPE_CHECKING:
    from identification.result.result import FitResult

_SERIES = 8_151
"""First word of every seed here: no other simulated experiment is drawn with it."""
_WITHOUT = ((), ("impact_force",), (), ("hammer_acceleration",))
"""Channels left out, in turn."""
_SAMPLES = (6001, 12001)
RIGS: Mapping[str, tuple[str, ...]] = {"quiet": (), "force": ("force",), "colour": ("colour",), "both": ("force", "colour")}
"""Unrest of the rigs, by the name of what they are."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Experiment:
    """One experiment to simulate and fit: complete models only."""

    rig: str
    """A name in `RIGS`; experiments that differ in nothing else have the same true values and the same white noise."""
    seed: int
    """Of all experiments."""
    index: int
    samples: tuple[int, int] = _SAMPLES

    @property
    def key(self) -> str:
        """Its name among all."""
        return f"{self.rig}-{self.seed}-{self.index:04d}"


def trial(experiment: Experiment) -> dict:
    """Simulate an experiment, fit it, and compare; a failure is a result too."""
    index = experiment.index
    rng = np.random.default_rng([_SERIES, experiment.seed, index])
    kind = list(KINDS)[index % len(KINDS)]
    left_out = _WITHOUT[(index // len(KINDS)) % len(_WITHOUT)]
    rig = draw_rig(rng, kind)
    plans = draw_plan(rng, kind, rig.f_n, samples=experiment.samples)
    sensors = standard_sensors(force="impact_force" not in left_out, acceleration="hammer_acceleration" not in left_out)
    unrest, plans, sensors = with_unrest(rng, RIGS[experiment.rig], rig, plans, sensors)
    found = {"key": experiment.key, "rig": experiment.rig, "kind": kind, "without": list(left_out)} | unrest.numbers()
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
    from identification.estimation.estimate import fit_experiment
    from identification.experiment import load_experiment

    result = fit_experiment(load_experiment(folder), seed=seed)
    return {
        "rows": beside_truth(result, rig, plans),
        "chi2_reduced": result.chi2_reduced,
        "converged": result.converged,
        "discretisation": result.discretisation,
        "warnings": list(result.warnings),
    }


def beside_truth(result: "FitResult", rig: Rig, plans: tuple[RecordPlan, ...]) -> list[dict]:
    """Estimates beside the truth; whatever else is estimated has none here."""
    rows = [
        _row(p.spec.name, rig.fitted[p.spec.name], p.value, p.stderr, p.ci95) | {"status": p.status, "interval": p.interval}
        for p in result.parameters
        if p.spec.name in rig.fitted
    ]
    for plan, record in zip(plans, result.records, strict=True):
        truth = {"gap_error": plan.true_gap - plan.gap, "base_amplitude": rig.base_amplitude, "base_phase": plan.base_phase}
        for nuisance in (one for one in record.nuisances if one.name in truth):
            at, value = truth[nuisance.name], nuisance.value
            if nuisance.name == "base_phase":
                value = at + np.angle(np.exp(1j * (value - at)))
            rows.append(_row(nuisance.name, at, float(value), nuisance.stderr, None) | {"record": plan.file})
    return rows


def _row(name: str, truth: float, value: float, stderr: float | None, ci95: tuple[float, float] | None) -> dict:
    """One estimate; without an interval of its own it is judged by 1.96 standard errors."""
    row = {"name": name, "truth": truth, "value": value, "stderr": stderr, "z": None, "covered": None}
    if stderr:
        low, high = ci95 or (value - 1.96 * stderr, value + 1.96 * stderr)
        row |= {"z": (value - truth) / stderr, "covered": bool(low <= truth <= high)}
    return row
