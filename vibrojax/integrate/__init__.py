"""Integrators, one a file."""

from vibrojax.integrate.base import CHATTER, NOT_FINITE, RESULT_MESSAGES, STEP_LIMIT, SUCCESS, AbstractIntegrator, Trajectory
from vibrojax.integrate.landing import Landing
from vibrojax.integrate.smoothed import Smoothed
from vibrojax.integrate.switch import Switch

__all__ = [
    "CHATTER",
    "NOT_FINITE",
    "RESULT_MESSAGES",
    "STEP_LIMIT",
    "SUCCESS",
    "AbstractIntegrator",
    "Landing",
    "Smoothed",
    "Switch",
    "Trajectory",
]
