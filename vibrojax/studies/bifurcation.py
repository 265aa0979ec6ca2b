"""Bifurcation diagram: section points and forces along a parameter that is swept up and down."""

from collections.abc import Callable

import jax.numpy as jnp
import numpy as np
import xarray as xr

from vibrojax.batch import Points, Responses, Span, integrate
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies.base import Labelled, Values, axis, labelled
from vibrojax.studies.classify import APERIODIC, PERIODIC, classify

_TIMES, _SHARE = 2.0, 0.02
"""A jump is off the line through its neighbours by so many of their changes and this share of the whole range."""


def bifurcation(
    model: Model,
    *,
    parameter: str,
    values: Values,
    base_amplitude: float,
    span: Span | None = None,
    progress: Callable[[float], None] = lambda part: None,
    **fixed: float,
) -> xr.Dataset:
    """Follow the motion along a parameter, up and down, each value starting from where the last one ended.

    A jump is where the mean of the section points is off the straight line through the two values before, and the value before off the line
    through the two after, by more than twice the change between those two and 2 % of the whole range. A side on which the motion is
    aperiodic is not asked; between two such values no jump is looked for, since inside chaos every change is large.

    Arguments:
        model: the rig.
        parameter: `frequency_hz`, `gap`, or a parameter of the model.
        values: increasing, at least 3.
        base_amplitude: A0, m.
        span: cycles at each value; by default 150, or fewer where the orbit closes, of which 32 are recorded.
        progress: told the part that is done.
        fixed: the other settings, among them `frequency_hz` and `gap` unless swept.

    Returns:
        `displacement` (m) and `velocity` (m/s) at the strobes, `impact_force` (N) and `impacts` of each cycle on the axes (`direction`,
        parameter, `cycle`); `period`, `kind` and `jump` (1 where the motion jumps on the way to this value) without the last.

    Raises:
        InputError: too few values, or not increasing.
    """
    values = np.asarray(values, dtype=float)
    if values.ndim != 1 or values.size < 3 or not np.all(np.diff(values) > 0):
        raise InputError(f"{parameter} has {values.size} values: expected at least 3 that increase; correct the range")
    found = _followed(model, parameter, values, {"base_amplitude": base_amplitude} | fixed, span or Span(transient=118), progress)
    parts = {name: _two_ways(found, name) for name in ("u", "v", "peak_force", "impacts")}
    frequency = values if parameter == "frequency_hz" else np.full(values.size, fixed.get("frequency_hz", np.nan))
    kinds = [classify(one, base_amplitude, np.asarray(frequency[i])) for i, one in enumerate(found)]
    kind, period = (_directed(np.stack([getattr(one, name) for one in kinds], axis=1)) for name in ("kind", "period"))
    dims = ("direction", parameter)
    return labelled(
        f"bifurcation diagram along {parameter}",
        model,
        found[-1],
        coords={"direction": Labelled(("direction",), ["up", "down"], "1", "of the sweep"), parameter: axis(model, parameter, values)},
        variables={
            "displacement": Labelled((*dims, "cycle"), parts["u"], "m", "displacement at the strobes"),
            "velocity": Labelled((*dims, "cycle"), parts["v"], "m/s", "velocity at the strobes"),
            "impact_force": Labelled((*dims, "cycle"), parts["peak_force"], "N", "largest impact force of a cycle"),
            "impacts": Labelled((*dims, "cycle"), parts["impacts"], "1", "impacts in a cycle"),
            "period": Labelled(dims, period, "1", "cycles of excitation in one period, q"),
            "kind": Labelled(dims, kind, "1", "kind of motion"),
            "jump": Labelled(dims, jumps(parts["u"].mean(axis=-1), kind), "1", "whether the motion jumps on the way to this value"),
        },
        settings={"base_amplitude": base_amplitude, "parameter": parameter} | fixed,
    )


def jumps(mean: np.ndarray, kind: np.ndarray) -> np.ndarray:
    """Where a branch jumps, 0 or 1, `(direction, values)`: up on the way from the value below, down from the value above.

    Arguments:
        mean: of the section points, `(direction, values)`.
        kind: of the motion, a key of `classify.KINDS`.

    Example:
        >>> jumps(np.array([[0.0, 0.01, 0.02, 1.0, 1.01], [0.0, 0.01, 0.02, 1.0, 1.01]]), np.ones((2, 5), int)).tolist()
        [[0, 0, 0, 1, 0], [0, 0, 1, 0, 0]]
    """
    least = float(_SHARE * np.ptp(mean))
    down = _jumps_on_the_way(mean[1, ::-1], kind[1, ::-1] != APERIODIC, least)[::-1]
    return np.stack([_jumps_on_the_way(mean[0], kind[0] != APERIODIC, least), down])


def _jumps_on_the_way(mean: np.ndarray, calm: np.ndarray, least: float) -> np.ndarray:
    """The jumps of one sweep, values in the order in which they were met."""
    found = np.zeros(mean.size, dtype=int)
    for i in range(1, mean.size):
        sides = [(i, i - 1, i - 2)] * bool(calm[i - 1]) + [(i - 1, i, i + 1)] * bool(calm[i])
        found[i] = bool(sides) and all(_breaks(mean, *side, least) for side in sides)
    return found


def _breaks(mean: np.ndarray, to: int, near: int, far: int, least: float) -> bool:
    """Whether the value at `to` is off the straight line through its two neighbours on one side."""
    slope = mean[near] - mean[far] if 0 <= far < mean.size else 0.0
    return bool(abs(mean[to] - mean[near] - slope) > _TIMES * abs(slope) + least)


def _followed(model: Model, parameter: str, values: np.ndarray, fixed: dict, span: Span, progress) -> list[Responses]:
    """Both sweeps side by side, one value after the other: lane 0 goes up, lane 1 down."""
    found, state = [], None
    for number in range(values.size):
        pair = np.array([values[number], values[-1 - number]])
        points = Points(coords={"direction": np.arange(2.0)}, values=fixed | {parameter: pair})
        one = integrate(model, points, span=span, start=state, chunk=2, threads=1)
        state = one.state._replace(cycle=jnp.zeros(2, int))
        found.append(one)
        progress((number + 1) / values.size)
    return found


def _two_ways(found: list[Responses], name: str) -> np.ndarray:
    return _directed(np.stack([getattr(one, name) for one in found], axis=1))


def _directed(both: np.ndarray) -> np.ndarray:
    """Lane 1 met the values in falling order."""
    return np.stack([both[0], both[1, ::-1]])


def coexisting(data: xr.Dataset) -> np.ndarray:
    """Values at which the two directions end on different periodic motions."""
    up, down = data["displacement"].values
    periodic = (data["kind"].values == PERIODIC).all(axis=0)
    apart = np.abs(np.sort(up, axis=-1) - np.sort(down, axis=-1)).max(axis=-1)
    scale = np.ptp(data["displacement"].values)
    return periodic & (apart > 1e-3 * scale)
