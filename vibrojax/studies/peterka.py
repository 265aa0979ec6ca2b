"""Peterka map: kinds of motion over frequency ratio and clearance."""

from typing import Any

import numpy as np
import xarray as xr

from vibrojax.batch import Points, Span, integrate
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies.base import GRAVITY, Labelled, Values, labelled, natural_frequency, outcome
from vibrojax.studies.classify import APERIODIC, MEANING, classify
from vibrojax.studies.lyapunov import exponents


def peterka(
    model: Model,
    *,
    ratio: Values,
    clearance: Values,
    base_amplitude: float,
    span: Span | None = None,
    lyapunov_cycles: int = 200,
    **options: Any,
) -> xr.Dataset:
    """Map of z = p/q (p impacts in q cycles of excitation) that is reached from rest.

    Where no period of up to 8 cycles is seen, the largest Lyapunov exponent separates chaos (above zero) from motion with a longer
    period, and from motion that has not settled yet.

    Arguments:
        model: the rig; its suspension has a natural frequency omega.
        ratio: Omega / omega.
        clearance: gap / A0.
        base_amplitude: A0 > 0, m.
        span: how long; by default 300 cycles or until the orbit has closed.
        lyapunov_cycles: over which the exponent of an aperiodic motion is averaged; 0 leaves it out.
        options: of `vibrojax.batch.integrate`.

    Returns:
        `kind`, `impacts` (p), `period` (q), `impact_force` (N), `force_over_weight` (1), `lyapunov` (1 per cycle; NaN where not asked) on
        the axes (`clearance`, `ratio`).

    Source: F. Peterka, Bifurcations and transition phenomena in an impact oscillator, Chaos, Solitons & Fractals 7 (1996) 1635-1647, for
    maps of impact motions and the quantity z = p/n; the reading of the exponent is ours.
    """
    if not base_amplitude > 0:
        raise InputError(f"base_amplitude is {base_amplitude:g}: expected a number above 0, since clearances are relative to it")
    f_n = natural_frequency(model, "a Peterka map")
    ratio, clearance = np.atleast_1d(np.asarray(ratio, dtype=float)), np.atleast_1d(np.asarray(clearance, dtype=float))
    settings = {"frequency_hz": ratio[None, :] * f_n, "gap": clearance[:, None] * base_amplitude, "base_amplitude": base_amplitude}
    points = Points(coords={"clearance": clearance, "ratio": ratio}, values=settings)
    found = integrate(model, points, span=span, **options)
    kind = classify(found, base_amplitude, settings["frequency_hz"])
    growth = np.full(points.shape, np.nan)
    wild = kind.kind == APERIODIC
    if lyapunov_cycles > 0 and wild.any():
        growth[wild] = exponents(model, points, found.state, wild.reshape(-1), cycles=lyapunov_cycles, threads=options.get("threads"))[:, 0]
    force, dims = found.peak_force.max(axis=-1), ("clearance", "ratio")
    weight = GRAVITY * float(np.asarray(model.mass))
    return labelled(
        "Peterka map",
        model,
        found,
        coords={
            "clearance": Labelled(("clearance",), clearance, "1", "gap over base amplitude"),
            "ratio": Labelled(("ratio",), ratio, "1", "excitation frequency over natural frequency"),
        },
        variables={
            "kind": Labelled(dims, kind.kind, "1", MEANING),
            "impacts": Labelled(dims, kind.impacts, "1", "impacts in one period, p"),
            "period": Labelled(dims, kind.period, "1", "cycles of excitation in one period, q"),
            "impact_force": Labelled(dims, force, "N", "largest impact force"),
            "force_over_weight": Labelled(dims, force / weight, "1", "largest impact force over the hammer's weight"),
            "lyapunov": Labelled(dims, growth, "1", "largest Lyapunov exponent per cycle of excitation"),
            "result": outcome(dims, found.result),
        },
        settings={"base_amplitude": base_amplitude},
    )
