"""Impact force against excitation frequency, for several gaps and any other parameter."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from vibrojax.batch import Span, grid, integrate
from vibrojax.model import Model
from vibrojax.studies.base import GRAVITY, Labelled, Values, axis, labelled, outcome
from vibrojax.studies.classify import MEANING, classify


def frequency_response(
    model: Model,
    *,
    frequency_hz: Values,
    gap: Values,
    base_amplitude: float,
    also: Mapping[str, Values] | None = None,
    span: Span | None = None,
    **options: Any,
) -> xr.Dataset:
    """Largest impact force, F_i and F_i / (m g), of the motion that is reached from rest, against frequency.

    Arguments:
        model: the rig.
        frequency_hz: excitation frequencies, Hz.
        gap: m.
        base_amplitude: A0, m.
        also: values of further axes, such as `k_i`, by name.
        span: how long.
        options: of `vibrojax.batch.integrate`.

    Returns:
        `impact_force` (N), `force_over_weight` (1), `displacement` (largest, m), `impacts` and `period` of z = p/q, `kind`, on the axes
        (`also`, `gap`, `frequency_hz`). Forces are the largest of the recorded cycles.
    """
    axes = {**(also or {}), "gap": gap, "frequency_hz": frequency_hz}
    points = grid(axes, base_amplitude=base_amplitude)
    found = integrate(model, points, span=span, **options)
    kind = classify(found, base_amplitude, points.values["frequency_hz"])
    force = found.peak_force.max(axis=-1)
    weight = GRAVITY * np.broadcast_to(np.asarray(points.values.get("m", model.mass), dtype=float), points.shape)
    dims = tuple(points.coords)
    return labelled(
        "impact force against excitation frequency",
        model,
        found,
        coords={name: axis(model, name, values) for name, values in points.coords.items()},
        variables={
            "impact_force": Labelled(dims, force, "N", "largest impact force"),
            "force_over_weight": Labelled(dims, force / weight, "1", "largest impact force over the hammer's weight"),
            "displacement": Labelled(dims, found.u_max, "m", "largest displacement of the hammer relative to the cart"),
            "impacts": Labelled(dims, kind.impacts, "1", "impacts in one period, p"),
            "period": Labelled(dims, kind.period, "1", "cycles of excitation in one period, q"),
            "kind": Labelled(dims, kind.kind, "1", MEANING),
            "result": outcome(dims, found.result),
        },
        settings={"base_amplitude": base_amplitude},
    )
