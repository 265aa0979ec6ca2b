"""One operating point in full: Poincaré section, phase plane, and histories over a few cycles."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr
from jaxtyping import Array, Float

from vibrojax.batch import Points, Span, grid, integrate
from vibrojax.batch.points import lanes_of
from vibrojax.channels import channels
from vibrojax.errors import NoConvergenceError
from vibrojax.integrate.base import RESULT_MESSAGES, STEP_LIMIT, SUCCESS, Trajectory
from vibrojax.integrate.impacts import Impacts, impacts
from vibrojax.integrate.landing import at_samples, landing_for
from vibrojax.model import Model
from vibrojax.studies.base import Labelled, labelled

_IN_CONTACT = 41
"""Instants of an impact at which the histories are given, touch and release among them."""


def section(
    model: Model,
    *,
    frequency_hz: float,
    gap: float,
    base_amplitude: float,
    strobes: int = 1000,
    transient: int = 300,
    cycles: int = 4,
    samples: int = 500,
    u0: float = 0.0,
    v0: float = 0.0,
    even: bool = False,
) -> xr.Dataset:
    """Section points of many cycles, and the histories of the few that follow them, with every impact in these.

    Arguments:
        model: the rig.
        frequency_hz: Hz.
        gap: m.
        base_amplitude: A0, m.
        strobes: section points.
        transient: cycles before them.
        cycles: whose histories are kept.
        samples: of a history in one cycle.
        u0: displacement relative to the cart from which the motion starts, m.
        v0: velocity relative to the cart, m/s.
        even: whether histories have equal steps and no more, so that those of several models have one axis; impacts are then left out.

    Returns:
        `displacement` (m) and `velocity` (m/s) at the strobes on the axis `strobe`, with `peak_force` (N), `impact_speed` (m/s) and
        `touches` of the cycle before each; `u`, `v`, `impact_force`, `hammer_acceleration` on the axis `time` (s, from a strobe on),
        whose instants are denser in contact; `impact_time` (s), `impact_approach_speed` (m/s), `impact_peak_force` (N), `impact_impulse`
        (N s) and `impact_duration` (s) of each impact in the histories, on the axis `impact`.

    Raises:
        NoConvergenceError: the motion could not be integrated, such as chatter on a rigid stop.
    """
    points = grid({"frequency_hz": [frequency_hz]}, gap=gap, base_amplitude=base_amplitude, u0=u0, v0=v0)
    found = integrate(model, points, span=Span(transient=transient, recorded=strobes, closed=None), chunk=1, threads=1)
    if found.failures:
        raise NoConvergenceError(f"the motion at {frequency_hz:g} Hz could not be integrated: {', '.join(found.failures)}")
    system = jax.tree.map(lambda leaf: leaf[0], lanes_of(model, points)[0].systems)
    begin = float(found.state.cycle[0]) / frequency_hz
    start = jnp.concatenate([jnp.stack([found.state.u[0], found.state.v[0]]), found.state.own[0]])
    even_times = begin + np.arange(cycles * samples + 1) / (samples * frequency_hz)
    path, struck = _histories(model, points, even_times, start, even, samples)
    readings = channels(system, path)
    each = {} if struck is None else _impacts_labelled(struck, begin)
    return labelled(
        "Poincaré section and histories",
        model,
        found,
        coords={"time": Labelled(("time",), np.asarray(path.ts) - begin, "s", "time since a strobe")},
        variables={
            "displacement": Labelled(("strobe",), found.u[0], "m", "displacement at the strobes"),
            "velocity": Labelled(("strobe",), found.v[0], "m/s", "velocity at the strobes"),
            "peak_force": Labelled(("strobe",), found.peak_force[0], "N", "largest impact force of the cycle before a strobe"),
            "impact_speed": Labelled(("strobe",), found.impact_speed[0], "m/s", "largest approach speed of the cycle before a strobe"),
            "touches": Labelled(("strobe",), found.impacts[0], "1", "impacts in the cycle before a strobe"),
            "u": Labelled(("time",), path.u, "m", "displacement relative to the cart"),
            "v": Labelled(("time",), path.v, "m/s", "velocity relative to the cart"),
            "impact_force": Labelled(("time",), readings["impact_force"], "N", "impact force"),
            "hammer_acceleration": Labelled(("time",), readings["hammer_acceleration"], "m/s^2", "absolute acceleration of the hammer"),
            **each,
        },
        settings={"frequency_hz": frequency_hz, "gap": gap, "base_amplitude": base_amplitude, "u0": u0, "v0": v0},
    )


def _histories(
    model: Model, points: Points, even_times: np.ndarray, start: Float[Array, " states"], even: bool, samples: int
) -> tuple[Trajectory, Impacts | None]:
    """The motion from a strobe on at equal steps, and, unless `even`, at more instants of each impact; and the impacts."""
    (lanes, _), frequency = lanes_of(model, points), float(points.flat()["frequency_hz"][0])
    landing = landing_for(model.rig.effects, frequency, flight_steps=samples)
    span = even_times[-1] - even_times[0]
    landing = dataclasses.replace(landing, most_steps=1000 + 3 * math.ceil(span / landing.flight_step))
    ts = jnp.asarray(even_times)
    count, last, ends, _ = landing.steps(lanes.systems, ts[None], start[None], jnp.full((1,), len(ts)))
    if not bool(last.t[0] >= ts[-1]):
        raise NoConvergenceError(f"the histories at {frequency:g} Hz could not be integrated: {RESULT_MESSAGES[STEP_LIMIT]}")
    struck = None
    if not even:
        system, lane = jax.tree.map(lambda leaf: leaf[0], lanes.systems), jax.tree.map(lambda leaf: leaf[:, 0], ends)
        struck = impacts(system, lane, int(count))
        inside = struck.touch[:, None] + struck.duration[:, None] * np.linspace(0.0, 1.0, _IN_CONTACT)
        ts = jnp.asarray(np.unique(np.concatenate([even_times, inside.ravel(), struck.peak_time])))
    u, v, in_contact, approach_speed, own = (part[0] for part in at_samples(ends, count, ts[None]))
    return Trajectory(ts, u, v, in_contact, approach_speed, jnp.asarray(SUCCESS), count, own), struck


def _impacts_labelled(struck: Impacts, begin: float) -> dict[str, Labelled]:
    parts = (
        ("time", struck.touch - begin, "s", "time of the touch since a strobe"),
        ("approach_speed", struck.approach_speed, "m/s", "approach speed"),
        ("peak_force", struck.peak_force, "N", "largest force of the impact"),
        ("impulse", struck.impulse, "N s", "impulse of the impact"),
        ("duration", struck.duration, "s", "time from touch to release"),
    )
    return {f"impact_{name}": Labelled(("impact",), values, unit, meaning) for name, values, unit, meaning in parts}
