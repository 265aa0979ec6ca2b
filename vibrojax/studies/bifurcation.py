"""Bifurcation diagram: section points and forces along a parameter that is swept up and down."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from vibrojax.batch import LaneState, Points, Responses, Span, integrate, packed, unpacked
from vibrojax.errors import InputError
from vibrojax.integrate.base import SUCCESS
from vibrojax.model import Model
from vibrojax.studies.base import APERIODIC, FAILED, Kind, Labelled, Values, axis, classify, labelled, motions

DIRECTIONS = ("up", "down")
_TIMES, _SHARE = 2.0, 0.02
"""A jump is off the line through its neighbours by so many of their changes and this share of the whole range."""


def bifurcation(
    model: Model,
    *,
    parameter: str,
    values: Values,
    base_amplitude: float,
    span: Span | None = None,
    **fixed: float,
) -> xr.Dataset:
    """Follow the motion along a parameter, up and down, each value starting from where the last one ended.

    A jump is where the mean of the section points is off the straight line through the two values before, and the value before off the line
    through the two after, by more than twice the change between those two and 2 % of the whole range. A side on which the motion is
    aperiodic is not asked; between two such values no jump is looked for, since inside chaos every change is large. A value that could not
    be integrated says nothing, and the next starts from where it did.

    Arguments:
        model: the rig.
        parameter: `frequency_hz`, `gap`, or a parameter of the model.
        values: increasing, at least 3.
        base_amplitude: A0, m.
        span: cycles at each value; by default 150, or fewer where the orbit closes; the last 32 are recorded.
        fixed: the other settings, among them `frequency_hz` and `gap` unless swept.

    Returns:
        What `sweep` does for both directions, and `jump` (1 where the motion jumps on the way to this value).

    Raises:
        InputError: too few values, or not increasing.
    """
    others: dict[str, Any] = {"values": increasing(parameter, values), "base_amplitude": base_amplitude, "span": span} | fixed
    return with_jumps(sweep(model, parameter=parameter, **others))


def increasing(parameter: str, values: Values) -> np.ndarray:
    """The values of a parameter that can be swept.

    Raises:
        InputError: too few values, or not increasing.
    """
    values = np.asarray(values, dtype=float)
    if values.ndim != 1 or values.size < 3 or not np.all(np.diff(values) > 0):
        raise InputError(f"{parameter} has {values.size} values: expected at least 3 that increase; correct the range")
    return values


def sweep(
    model: Model,
    *,
    parameter: str,
    values: Values,
    base_amplitude: float,
    direction: Sequence[str] = DIRECTIONS,
    before: np.ndarray | None = None,
    span: Span | None = None,
    **fixed: float,
) -> xr.Dataset:
    """One stretch of the sweeps: the motion along increasing values, met in that order upwards and in the other downwards.

    Arguments:
        model: the rig.
        parameter: what is swept.
        values: increasing.
        base_amplitude: A0, m.
        direction: "up", "down", or both.
        before: `state` at the value that was met before, one row a direction; None starts at rest.
        span: cycles at each value.
        fixed: the other settings.

    Returns:
        `displacement` (m) and `velocity` (m/s) at the strobes, `impact_force` (N) and `impacts` of each cycle on the axes (`direction`,
        parameter, `cycle`); `period`, `kind` and `result` without the last; `state`, from which the next value goes on.
    """
    if parameter in (given := {"base_amplitude": base_amplitude} | fixed):
        raise InputError(f"{parameter} is given both as what is swept and as a fixed value: expected one of the two; leave one out")
    values = np.asarray(values, dtype=float)
    ways = np.stack([values if name == "up" else values[::-1] for name in direction])
    start = None if before is None else unpacked(jnp.asarray(before.T))
    found = _followed(model, parameter, ways, given, span or Span(transient=118), start)
    frequency = ways if parameter == "frequency_hz" else np.full(ways.shape, fixed.get("frequency_hz", np.nan))
    kinds = [classify(one, base_amplitude, frequency[:, i]) for i, one in enumerate(found)]

    def part(of: list, name: str) -> np.ndarray:
        return _rising(np.stack([getattr(one, name) for one in of], axis=1), direction)

    kind = Kind(*(part(kinds, name) for name in Kind._fields))
    state = _rising(np.stack([packed(one.state).T for one in found], axis=1), direction)
    dims = ("direction", parameter)
    return labelled(
        f"bifurcation diagram along {parameter}",
        model,
        found[-1],
        coords={
            "direction": Labelled(("direction",), np.array(list(direction), dtype=object), "1", "of the sweep"),
            parameter: axis(model, parameter, values),
        },
        variables={
            **motions(dims, kind, part(found, "result")),
            "displacement": Labelled((*dims, "cycle"), part(found, "u"), "m", "displacement at the strobes"),
            "velocity": Labelled((*dims, "cycle"), part(found, "v"), "m/s", "velocity at the strobes"),
            "impact_force": Labelled((*dims, "cycle"), part(found, "peak_force"), "N", "largest impact force of a cycle"),
            "impacts": Labelled((*dims, "cycle"), part(found, "impacts"), "1", "impacts in a cycle"),
            "state": Labelled((*dims, "row"), state, "SI", "state after the last cycle, from which the next value goes on"),
        },
        settings=given | {"parameter": parameter},
    )


def with_jumps(data: xr.Dataset) -> xr.Dataset:
    """The whole of both sweeps, with the variable `jump`."""
    dims = data["kind"].dims
    found = jumps(data["displacement"].values.mean(axis=-1), data["kind"].values)
    return data.assign(jump=(dims, found, {"units": "1", "long_name": "whether the motion jumps on the way to this value"}))


def jumps(mean: np.ndarray, kind: np.ndarray) -> np.ndarray:
    """Where a branch jumps, 0 or 1, `(direction, values)`: up on the way from the value below, down from the value above.

    Arguments:
        mean: of the section points, `(direction, values)`.
        kind: of the motion, a key of `base.KINDS`.

    Example:
        >>> jumps(np.array([[0.0, 0.01, 0.02, 1.0, 1.01], [0.0, 0.01, 0.02, 1.0, 1.01]]), np.ones((2, 5), int)).tolist()
        [[0, 0, 0, 1, 0], [0, 0, 1, 0, 0]]
    """
    calm, known = (kind != APERIODIC) & (kind != FAILED), kind != FAILED
    least = float(_SHARE * np.ptp(mean[known])) if known.any() else 0.0
    mean = np.where(known, mean, np.nan)
    down = _jumps_on_the_way(mean[1, ::-1], calm[1, ::-1], least)[::-1]
    return np.stack([_jumps_on_the_way(mean[0], calm[0], least), down])


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


def _followed(model: Model, parameter: str, ways: np.ndarray, fixed: dict, span: Span, state: LaneState | None) -> list[Responses]:
    """The sweeps side by side, a lane each, one value after the other; one sweep alone runs the same program, which takes two lanes."""
    found = []
    for number in range(ways.shape[1]):
        points = Points(coords={"direction": np.arange(float(len(ways)))}, values=fixed | {parameter: ways[:, number]})
        one = integrate(model, points, span=span, start=state, chunk=len(DIRECTIONS), threads=1)
        state = _going_on(one, state)
        found.append(dataclasses.replace(one, state=state))
    return found


def _going_on(found: Responses, before: LaneState | None) -> LaneState:
    """The last states, as the beginning of a motion: cycles are counted anew. A lane that stopped short goes on from where it began."""
    reached = found.state._replace(cycle=jnp.zeros(found.state.u.shape, int))
    begun = jax.tree.map(jnp.zeros_like, reached) if before is None else before
    stopped = jnp.asarray(found.result != SUCCESS)
    return jax.tree.map(lambda old, new: jnp.where(stopped if new.ndim == 1 else stopped[:, None], old, new), begun, reached)


def _rising(met: np.ndarray, direction: Sequence[str]) -> np.ndarray:
    """Values in rising order; a sweep down met them in falling order."""
    return np.stack([row if name == "up" else row[::-1] for row, name in zip(met, direction, strict=True)])
