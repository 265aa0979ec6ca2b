"""Impact force against excitation frequency, and against the hammer's mass."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from vibrojax.batch import Points, Span, grid, integrate
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies.base import Labelled, Values, axis, classify, forces, labelled, motions
from vibrojax.suspension import Linear, Pendulum


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
    mass = np.broadcast_to(np.asarray(points.values.get("m", model.mass), dtype=float), points.shape)
    dims = tuple(points.coords)
    return labelled(
        "impact force against excitation frequency",
        model,
        found,
        coords={name: axis(model, name, values) for name, values in points.coords.items()},
        variables={
            **forces(dims, found.peak_force.max(axis=-1), mass),
            "displacement": Labelled(dims, found.u_max, "m", "largest displacement of the hammer relative to the cart"),
            **motions(dims, classify(found, base_amplitude, points.values["frequency_hz"]), found.result),
        },
        settings={"base_amplitude": base_amplitude},
    )


def hammer_design(
    model: Model,
    *,
    mass_ratio: Values,
    frequency_hz: Values,
    gap: float,
    base_amplitude: float,
    span: Span | None = None,
    **options: Any,
) -> xr.Dataset:
    """Largest impact force when the hammer's mass changes and its spring, damper and stop stay.

    With mass r m the suspension has omega_n / sqrt(r) and zeta / sqrt(r); on wires, where gravity holds the hammer, omega_n and zeta / r.

    Arguments:
        model: the rig with the hammer of ratio 1.
        mass_ratio: r > 0, mass over that of the model.
        frequency_hz: Hz.
        gap: m.
        base_amplitude: A0, m.
        span: how long.
        options: of `vibrojax.batch.integrate`.

    Raises:
        InputError: a ratio is not above 0, or the suspension is neither linear nor a pendulum.

    Returns:
        `impact_force` (N), `force_over_weight` (1), `impacts`, `period`, `kind` on the axes (`frequency_hz`, `mass_ratio`).
    """
    mass_ratio, frequency_hz = np.atleast_1d(np.asarray(mass_ratio, float)), np.atleast_1d(np.asarray(frequency_hz, float))
    if not np.all(mass_ratio > 0):
        raise InputError(f"mass_ratio is {mass_ratio.min():g} somewhere: expected numbers above 0; correct the range")
    if not isinstance(model.suspension, Linear | Pendulum):
        raise InputError(
            f"hammer design keeps spring and damper: the suspension {model.suspension.name!r} has no stiffness that could stay; "
            "use linear or pendulum"
        )
    f_n, zeta = float(np.asarray(model.values()["f_n"])), float(np.asarray(model.values()["zeta"]))
    ratio = mass_ratio[None, :]
    stiff = 0.5 if isinstance(model.suspension, Linear) else 0.0
    changed = {"m": float(np.asarray(model.mass)) * ratio, "f_n": f_n * ratio**-stiff, "zeta": zeta * ratio ** (stiff - 1.0)}
    settings = changed | {"frequency_hz": frequency_hz[:, None], "gap": gap, "base_amplitude": base_amplitude}
    points = Points(coords={"frequency_hz": frequency_hz, "mass_ratio": mass_ratio}, values=settings)
    found, dims = integrate(model, points, span=span, **options), tuple(points.coords)
    return labelled(
        "hammer design",
        model,
        found,
        coords={
            "frequency_hz": axis(model, "frequency_hz", frequency_hz),
            "mass_ratio": Labelled(("mass_ratio",), mass_ratio, "1", "mass of the hammer over that of the model"),
        },
        variables={
            **forces(dims, found.peak_force.max(axis=-1), changed["m"]),
            **motions(dims, classify(found, base_amplitude, settings["frequency_hz"]), found.result),
        },
        settings={"gap": gap, "base_amplitude": base_amplitude},
    )
