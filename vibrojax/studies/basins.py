"""Basins of attraction over the initial state."""

from typing import Any

import numpy as np
import xarray as xr

from vibrojax.batch import Span, grid, integrate
from vibrojax.model import Model
from vibrojax.studies.base import Labelled, Values, axis, labelled, outcome
from vibrojax.studies.classify import FAILED, NO_IMPACT, classify


def basins(
    model: Model,
    *,
    u0: Values,
    v0: Values,
    frequency_hz: float,
    gap: float,
    base_amplitude: float,
    span: Span | None = None,
    **options: Any,
) -> xr.Dataset:
    """Which initial states lead to a motion with impacts, and which to one without.

    Arguments:
        model: the rig.
        u0: initial displacements relative to the cart, m.
        v0: initial velocities, m/s.
        frequency_hz: Hz.
        gap: m.
        base_amplitude: A0, m.
        span: how long.
        options: of `vibrojax.batch.integrate`.

    Returns:
        `impacting` (1, 0; -1 where the integration failed), `impacts` and `period` of z = p/q and `displacement` at the last strobe on the
        axes (`v0`, `u0`); the attribute `basin_measure` is the share of the initial states whose motion keeps impacting.
    """
    points = grid({"v0": v0, "u0": u0}, frequency_hz=frequency_hz, gap=gap, base_amplitude=base_amplitude)
    found = integrate(model, points, span=span, **options)
    kind = classify(found, base_amplitude, np.asarray(frequency_hz))
    impacting = np.where(kind.kind == FAILED, -1, (kind.kind != NO_IMPACT).astype(int))
    dims = ("v0", "u0")
    data = labelled(
        "basins of attraction",
        model,
        found,
        coords={name: axis(model, name, values) for name, values in points.coords.items()},
        variables={
            "impacting": Labelled(dims, impacting, "1", "whether the motion keeps impacting"),
            "impacts": Labelled(dims, kind.impacts, "1", "impacts in one period, p"),
            "period": Labelled(dims, kind.period, "1", "cycles of excitation in one period, q"),
            "displacement": Labelled(dims, found.u[..., -1], "m", "displacement at the last strobe"),
            "result": outcome(dims, found.result),
        },
        settings={"frequency_hz": frequency_hz, "gap": gap, "base_amplitude": base_amplitude},
    )
    return measured(data)


def measured(data: xr.Dataset) -> xr.Dataset:
    """The study with its attribute `basin_measure`; NaN where no initial state could be integrated."""
    impacting = data["impacting"].values
    return data.assign_attrs(basin_measure=float(np.mean(impacting[impacting >= 0] == 1)) if np.any(impacting >= 0) else float("nan"))
