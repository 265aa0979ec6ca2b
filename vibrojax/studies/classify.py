"""What kind of motion each operating point settles on."""

from typing import NamedTuple

import numpy as np

from vibrojax.batch import Responses
from vibrojax.batch.run import repeats
from vibrojax.integrate.base import SUCCESS

NO_IMPACT, PERIODIC, APERIODIC, FAILED = 0, 1, 2, 3
KINDS = {NO_IMPACT: "no impact", PERIODIC: "periodic impacts", APERIODIC: "aperiodic impacts", FAILED: "not integrated"}
MEANING = "kind of motion: " + ", ".join(f"{code} {words}" for code, words in KINDS.items())
LONGEST = 8
"""Cycles; an orbit of a longer period counts as aperiodic."""


class Kind(NamedTuple):
    """Shaped like the axes of the batch."""

    kind: np.ndarray
    """A key of `KINDS`."""
    impacts: np.ndarray
    """p of z = p/q: impacts in one period of the motion; 0 where there is none."""
    period: np.ndarray
    """q of z = p/q: cycles of excitation in one period; 0 where none up to `LONGEST` is seen."""


def classify(found: Responses, base_amplitude: float | np.ndarray, frequency_hz: np.ndarray, *, tolerance: float = 1e-5) -> Kind:
    """Kind of motion from the recorded cycles.

    Arguments:
        found: the batch; periods up to half of its recorded cycles can be seen.
        base_amplitude: A0, m, broadcasting to the axes.
        frequency_hz: of the excitation, broadcasting to the axes.
        tolerance: two strobes closer than this part of A0, and of A0 Omega in velocity, are the same.
    """
    shape, cycles = found.result.shape, found.u.shape[-1]
    u, v, hits = (np.moveaxis(part.reshape(-1, cycles), -1, 0) for part in (found.u, found.v, found.impacts))
    amplitude = np.broadcast_to(base_amplitude, shape).reshape(-1)
    scale_u = np.where(amplitude > 0, amplitude, 1e-3)
    scale_v = scale_u * 2.0 * np.pi * np.broadcast_to(frequency_hz, shape).reshape(-1)
    period = repeats(u, v, scale_u, scale_v, tolerance, LONGEST)
    back = np.arange(cycles)[::-1, None] < period[None, :]
    impacts = np.sum(np.where(back, hits, 0), axis=0)
    quiet = (hits.sum(axis=0) == 0) & (np.moveaxis(found.peak_force.reshape(-1, cycles), -1, 0).max(axis=0) == 0)
    kind = np.where(quiet, NO_IMPACT, np.where(period > 0, PERIODIC, APERIODIC))
    kind = np.where(found.result.reshape(-1) == SUCCESS, kind, FAILED)
    return Kind(kind.reshape(shape), impacts.reshape(shape), period.reshape(shape))
