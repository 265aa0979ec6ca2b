"""What a batch hands back, shaped like its axes."""

import dataclasses
from collections.abc import Mapping

import numpy as np

from vibrojax.batch.base import LaneState
from vibrojax.integrate.base import RESULT_MESSAGES, SUCCESS


@dataclasses.dataclass(frozen=True, kw_only=True)
class Responses:
    """Recorded cycles of every operating point; `*axes` is the shape of the points.

    Attributes:
        coords: values along each axis.
        u: displacement at the strobe that ends each recorded cycle, m, `(*axes, cycle)`.
        v: velocity there, m/s.
        impacts: touches that began in the cycle.
        peak_force: largest push of the stop in the cycle, N.
        impact_speed: fastest approach in the cycle, m/s.
        u_max: largest displacement in the recorded cycles, m; of the fast path, also in up to three flights before them, `(*axes,)`.
        closed: cycles after which the orbit was seen to repeat itself, and integration stopped; 0 where it did not.
        cycles: integrated, `(*axes,)`.
        result: `SUCCESS` or why the lane stopped, a code of `vibrojax.integrate.base`.
        state: of every lane at the end, lanes in the order of the flattened axes.
        engine: its name.
        seconds: time of the integration, without compiling if it was compiled before.
    """

    coords: Mapping[str, np.ndarray]
    u: np.ndarray
    v: np.ndarray
    impacts: np.ndarray
    peak_force: np.ndarray
    impact_speed: np.ndarray
    u_max: np.ndarray
    closed: np.ndarray
    cycles: np.ndarray
    result: np.ndarray
    state: LaneState
    engine: str
    seconds: float

    @property
    def failures(self) -> dict[str, int]:
        """Count of lanes by why they stopped short; empty where all went through."""
        codes, counts = np.unique(self.result[self.result != SUCCESS], return_counts=True)
        return {RESULT_MESSAGES[int(code)]: int(count) for code, count in zip(codes, counts, strict=True)}
