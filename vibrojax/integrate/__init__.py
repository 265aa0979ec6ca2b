"""Integrators, one a file."""

import importlib
from typing import TYPE_CHECKING, Any

from vibrojax.integrate.base import (
    CHATTER,
    NOT_FINITE,
    RESULT_MESSAGES,
    STEP_LIMIT,
    SUCCESS,
    AbstractBatchIntegrator,
    AbstractIntegrator,
    Trajectory,
)
from vibrojax.integrate.guided import Guided
from vibrojax.integrate.landing import Landing

if TYPE_CHECKING:
    from vibrojax.integrate.smoothed import Smoothed
    from vibrojax.integrate.switch import Switch

_ON_DEMAND = {"Smoothed": "vibrojax.integrate.smoothed", "Switch": "vibrojax.integrate.switch"}
"""Those that need Diffrax, whose import takes as long as all the rest: a fit does without it."""


def __getattr__(name: str) -> Any:
    """Import an integrator when it is first asked for."""
    if name not in _ON_DEMAND:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_ON_DEMAND[name]), name)


__all__ = [
    "CHATTER",
    "NOT_FINITE",
    "RESULT_MESSAGES",
    "STEP_LIMIT",
    "SUCCESS",
    "AbstractBatchIntegrator",
    "AbstractIntegrator",
    "Guided",
    "Landing",
    "Smoothed",
    "Switch",
    "Trajectory",
]
