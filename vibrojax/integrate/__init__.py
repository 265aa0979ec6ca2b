"""Integrators, one a file."""

from vibrojax.integrate.base import NOT_FINITE, RESULT_MESSAGES, STEP_LIMIT, SUCCESS, AbstractIntegrator, Trajectory
from vibrojax.integrate.landing import Landing

__all__ = ["NOT_FINITE", "RESULT_MESSAGES", "STEP_LIMIT", "SUCCESS", "AbstractIntegrator", "Landing", "Trajectory"]
