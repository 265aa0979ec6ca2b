"""The peer's view of an experiment: short windows of the records, each with an initial state of its own (multiple shooting).

Errors grow from impact to impact, so that a plain simulator cannot be fitted to a whole record; a window holds about two impacts.
"""

import dataclasses

import numpy as np
from jaxtyping import Float, Int
from scipy.ndimage import distance_transform_edt

from identification.trajectory.start import Problem

_IMPACTS = 2.0
"""In a window, on the average."""
_FEWEST, _MOST = 64, 1000
"""Samples of a window."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Point:
    """Shared parameters in the coordinates of the chain, A0, phase and gap error of each record, and u, u' at the start of each window."""

    shared: Float[np.ndarray, " shared"]
    nuisances: Float[np.ndarray, "records 3"]
    states: Float[np.ndarray, "windows 2"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Windows:
    """Windows of all records in a row; every sample is in one of them.

    Attributes:
        channels: compared.
        record, first, counts: record of each window, its first sample there, and how many it has.
        time: of all samples, s.
        measured, weight: of all samples; the weight is 1 / noise.
        gap, frequency_hz: as set, by window.
        start: first guess, the same as the chain's.
    """

    channels: tuple[str, ...]
    record: Int[np.ndarray, " windows"]
    first: Int[np.ndarray, " windows"]
    counts: Int[np.ndarray, " windows"]
    time: Float[np.ndarray, " samples"]
    measured: Float[np.ndarray, "samples channels"]
    weight: Float[np.ndarray, "samples channels"]
    gap: Float[np.ndarray, " windows"]
    frequency_hz: Float[np.ndarray, " windows"]
    start: Point

    @property
    def offsets(self) -> Int[np.ndarray, " windows"]:
        """Place of the first sample of each window among all."""
        return np.concatenate([[0], np.cumsum(self.counts)[:-1]])


def windows_of(problem: Problem) -> Windows:
    """Cut the records of a problem in flight."""
    channels, records = problem.chains.channels, problem.experiment.records
    cuts, states = [], []
    for index, (record, motion) in enumerate(zip(records, problem.motions, strict=True)):
        if motion is None or set(record.channels) - set(channels):
            raise SystemExit(f"{record.file} does not show the motion against the stop: the peer needs one that does")
        borders = _borders(motion.touching)
        cuts += [(index, int(begin), int(end - begin)) for begin, end in zip(borders[:-1], borders[1:], strict=True)]
        states += [(motion.u[begin], motion.v[begin]) for begin in borders[:-1]]
    parts = [(records[index], slice(first, first + count)) for index, first, count in cuts]
    own = problem.start.own
    amplitude, phase = np.hypot(own[:, 0], own[:, 1]), np.arctan2(own[:, 1], own[:, 0])
    record, first, counts = np.array(cuts).T
    return Windows(
        channels=channels,
        record=record,
        first=first,
        counts=counts,
        time=np.concatenate([one.time[part] for one, part in parts]),
        measured=np.concatenate([np.stack([one.channels[name][part] for name in channels], axis=1) for one, part in parts]),
        weight=np.concatenate([np.tile([1.0 / one.noise[name] for name in channels], (part.stop - part.start, 1)) for one, part in parts]),
        gap=np.array([one.gap for one, _ in parts]),
        frequency_hz=np.array([one.excitation_frequency or 0.0 for one, _ in parts]),
        start=Point(shared=problem.start.shared, nuisances=np.stack([amplitude, phase, own[:, 2]], axis=1), states=np.array(states)),
    )


def _borders(touching: np.ndarray) -> np.ndarray:
    """First samples of the windows of a record, and its end: equal parts, each border moved away from contacts by a quarter at most."""
    touches = int(np.sum(np.diff(touching.astype(int)) == 1))
    samples = np.clip(len(touching) / max(touches / _IMPACTS, 1.0), _FEWEST, _MOST)
    borders = np.linspace(0, len(touching), max(1, round(len(touching) / samples)) + 1).round().astype(int)
    if touching.any():
        clear, reach = np.asarray(distance_transform_edt(~touching)), int(samples // 4)
        for place, border in enumerate(borders[1:-1], start=1):
            near = np.arange(max(border - reach, 1), min(border + reach, len(touching) - 1))
            quiet = near[clear[near] == clear[near].max()]
            borders[place] = quiet[np.argmin(np.abs(quiet - border))]
    return np.unique(borders)
