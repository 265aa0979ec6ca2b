"""Hammer design: impact force against the hammer's mass at several excitation frequencies."""

from typing import Any

import numpy as np
import xarray as xr

from vibrojax.batch import Points, Span, integrate
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies.base import GRAVITY, Labelled, Values, axis, labelled, outcome
from vibrojax.studies.classify import MEANING, classify
from vibrojax.suspension import Linear, Pendulum


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
    found = integrate(model, points, span=span, **options)
    force = found.peak_force.max(axis=-1)
    kind, dims = classify(found, base_amplitude, settings["frequency_hz"]), ("frequency_hz", "mass_ratio")
    return labelled(
        "hammer design",
        model,
        found,
        coords={
            "frequency_hz": axis(model, "frequency_hz", frequency_hz),
            "mass_ratio": Labelled(("mass_ratio",), mass_ratio, "1", "mass of the hammer over that of the model"),
        },
        variables={
            "impact_force": Labelled(dims, force, "N", "largest impact force"),
            "force_over_weight": Labelled(dims, force / (GRAVITY * changed["m"]), "1", "largest impact force over the hammer's weight"),
            "impacts": Labelled(dims, kind.impacts, "1", "impacts in one period, p"),
            "period": Labelled(dims, kind.period, "1", "cycles of excitation in one period, q"),
            "kind": Labelled(dims, kind.kind, "1", MEANING),
            "result": outcome(dims, found.result),
        },
        settings={"gap": gap, "base_amplitude": base_amplitude},
    )
