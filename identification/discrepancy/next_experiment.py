"""Which record would part the causes that these records cannot."""

import dataclasses
from collections.abc import Iterator

import numpy as np

from identification.discrepancy.diagnosis import Asserted
from identification.discrepancy.refit import Fitted
from identification.discrepancy.search import Search
from identification.experiment import Record
from identification.simulate import simulate_record
from vibrojax.effects import EFFECTS
from vibrojax.errors import NoConvergenceError

_SECONDS = 1.0
"""Longer motions with impacts diverge by themselves, and part nothing."""
_SAMPLING_HZ = 2000.0
_FAR = 50.0
"""Sigma by which causes are told apart beyond doubt; more is not worth asking for."""


def next_experiment(found: Search, effects: tuple[Asserted, ...], ambiguous: tuple[str, ...]) -> str:
    """One sentence; empty where nothing is in doubt.

    Both models, each fitted to the present records, are run along records that have not been taken: other heights of release, drives
    faster, slower and stronger, other gaps. The one whose displacement differs most, in the noise of its sensor, is advised.
    """
    pair = _doubt(found, ambiguous)
    if pair is None:
        return ""
    first, second = pair
    best = max(((_sigma(first, second, record), words) for record, words in _trials(first)), default=(0.0, ""))
    if best[0] < 1.0:
        return f"No simple further record would part {first.names[-1]} and {second.names[-1]}."
    parted = f"by more than {_FAR:.0f} sigma" if best[0] > _FAR else f"by {best[0]:.0f} sigma"
    return f"A {best[1]} would part {_words(first)} and {_words(second)} {parted}."


def _doubt(found: Search, ambiguous: tuple[str, ...]) -> tuple[Fitted, Fitted] | None:
    """The model that was chosen, and the one that these records allow in its place."""
    for one in found.rounds:
        for rival in one.rivals[1:]:
            if rival.name in ambiguous:
                return one.rivals[0].fitted, rival.fitted
    return None


def _words(fitted: Fitted) -> str:
    return EFFECTS[fitted.names[-1]].summary if fitted.names[-1] in EFFECTS else fitted.names[-1]


def _trials(fitted: Fitted) -> Iterator[tuple[Record, str]]:
    """Records that one might take, in words."""
    time = np.arange(0.0, _SECONDS, 1.0 / _SAMPLING_HZ)
    f_n = float(fitted.model.values().get("f_n", 0.0))
    amplitudes = fitted.outcome.estimate.nuisances[:, 0]
    amplitude = float(np.abs(amplitudes).max(initial=0.0))
    lowest = min((float(motion.u.min()) for motion in fitted.prepared.motions if motion is not None), default=-1e-3)
    still = Record(file="trial", kind="drop-test", gap=0.0, time=time, initial_displacement=0.0, initial_velocity=0.0)
    for factor in (0.5, 2.0):
        height = factor * lowest
        yield dataclasses.replace(still, initial_displacement=height), f"drop from {-1e3 * height:.1f} mm"
        free = dataclasses.replace(still, kind="free-decay", gap=10.0 * abs(height), initial_displacement=height)
        yield free, f"free decay from {-1e3 * height:.1f} mm, clear of the stop"
    if amplitude > 0 and f_n > 0:
        for ratio in (0.7, 1.0, 1.5, 3.0):
            for stronger in (1.0, 2.0):
                drive = stronger * amplitude
                record = dataclasses.replace(
                    still,
                    kind="cart-excitation",
                    gap=2.0 * amplitude,
                    excitation_frequency=ratio * f_n,
                    base_amplitude=drive,
                    base_phase=0.0,
                    initial_velocity=-drive * 2.0 * np.pi * ratio * f_n,
                )
                yield record, f"drive of {1e3 * drive:.1f} mm at {ratio * f_n:.2f} Hz with a gap of {2e3 * amplitude:.1f} mm"


def _sigma(first: Fitted, second: Fitted, record: Record) -> float:
    """Distance of the two predictions of the hammer's displacement, in standard deviations of its noise per sample."""
    noise = [r.noise["hammer_displacement"] for r in first.prepared.experiment.records if "hammer_displacement" in r.noise]
    try:
        one, other = (simulate_record(fitted.model, record)["hammer_displacement"] for fitted in (first, second))
    except NoConvergenceError:
        return 0.0
    return float(np.sqrt(np.mean((one - other) ** 2)) / (noise[0] if noise else 1e-5))
