"""Integrators, one a file."""

import importlib
from typing import TYPE_CHECKING, Any

from vibrojax.integrate.base import CHATTER as CHATTER
from vibrojax.integrate.base import NOT_FINITE as NOT_FINITE
from vibrojax.integrate.base import RESULT_MESSAGES as RESULT_MESSAGES
from vibrojax.integrate.base import STEP_LIMIT as STEP_LIMIT
from vibrojax.integrate.base import SUCCESS as SUCCESS
from vibrojax.integrate.base import AbstractIntegrator as AbstractIntegrator
from vibrojax.integrate.base import Trajectory as Trajectory
from vibrojax.integrate.guided import Guided as Guided
from vibrojax.integrate.landing import Landing as Landing

if TYPE_CHECKING:
    from vibrojax.integrate.smoothed import Smoothed as Smoothed
    from vibrojax.integrate.switch import Switch as Switch

_ON_DEMAND = {"Smoothed": "vibrojax.integrate.smoothed", "Switch": "vibrojax.integrate.switch"}
"""Those that need Diffrax, whose import takes as long as all the rest: a fit does without it."""


def __getattr__(name: str) -> Any:
    """Import an integrator when it is first asked for."""
    if name not in _ON_DEMAND:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module(_ON_DEMAND[name]), name)
