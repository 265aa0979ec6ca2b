"""One operating point in full: Poincaré section, phase plane, and histories over a few cycles."""

import dataclasses
import math

import jax
import jax.numpy as jnp
import numpy as np
import xarray as xr

from vibrojax.batch import Span, grid, integrate
from vibrojax.batch.points import lanes_of
from vibrojax.channels import channels
from vibrojax.errors import NoConvergenceError
from vibrojax.integrate.base import RESULT_MESSAGES, SUCCESS
from vibrojax.integrate.landing import landing_for
from vibrojax.model import Model
from vibrojax.studies.base import Labelled, labelled


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
) -> xr.Dataset:
    """Section points of many cycles, and the histories of the few that follow them.

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

    Returns:
        `displacement` (m) and `velocity` (m/s) at the strobes on the axis `strobe`; `u`, `v`, `impact_force`, `hammer_acceleration`
        on the axis `time` (s, from a strobe on).

    Raises:
        NoConvergenceError: the motion could not be integrated, such as chatter on a rigid stop.
    """
    points = grid({"frequency_hz": [frequency_hz]}, gap=gap, base_amplitude=base_amplitude, u0=u0, v0=v0)
    found = integrate(model, points, span=Span(transient=transient, recorded=strobes, closed=None), chunk=1, threads=1)
    if found.failures:
        raise NoConvergenceError(f"the motion at {frequency_hz:g} Hz could not be integrated: {', '.join(found.failures)}")
    system = jax.tree.map(lambda leaf: leaf[0], lanes_of(model, points)[0].systems)
    begin = float(found.state.cycle[0]) / frequency_hz
    ts = jnp.asarray(begin + np.arange(cycles * samples + 1) / (samples * frequency_hz))
    start = jnp.concatenate([jnp.stack([found.state.u[0], found.state.v[0]]), found.state.own[0]])
    landing = landing_for(system.effects, frequency_hz, flight_steps=samples)
    most_steps = 1000 + 3 * math.ceil(cycles / (frequency_hz * landing.flight_step))
    path = dataclasses.replace(landing, most_steps=most_steps)(system, ts, start)
    if int(path.result) != SUCCESS:
        raise NoConvergenceError(f"the histories at {frequency_hz:g} Hz could not be integrated: {RESULT_MESSAGES[int(path.result)]}")
    readings = channels(system, path)
    return labelled(
        "Poincaré section and histories",
        model,
        found,
        coords={"time": Labelled(("time",), np.asarray(ts) - begin, "s", "time since a strobe")},
        variables={
            "displacement": Labelled(("strobe",), found.u[0], "m", "displacement at the strobes"),
            "velocity": Labelled(("strobe",), found.v[0], "m/s", "velocity at the strobes"),
            "u": Labelled(("time",), path.u, "m", "displacement relative to the cart"),
            "v": Labelled(("time",), path.v, "m/s", "velocity relative to the cart"),
            "impact_force": Labelled(("time",), readings["impact_force"], "N", "impact force"),
            "hammer_acceleration": Labelled(("time",), readings["hammer_acceleration"], "m/s^2", "absolute acceleration of the hammer"),
        },
        settings={"frequency_hz": frequency_hz, "gap": gap, "base_amplitude": base_amplitude, "u0": u0, "v0": v0},
    )
