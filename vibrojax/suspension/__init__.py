"""Suspensions, one a file. A suspension is known to the program by being listed here."""

from vibrojax.suspension.base import AbstractSuspension
from vibrojax.suspension.free import Free
from vibrojax.suspension.linear import Linear
from vibrojax.suspension.pendulum import Pendulum
from vibrojax.suspension.pivot import Pivot

SUSPENSIONS: dict[str, type[AbstractSuspension]] = {suspension.name: suspension for suspension in (Linear, Pendulum, Pivot, Free)}

__all__ = ["SUSPENSIONS", "AbstractSuspension", "Free", "Linear", "Pendulum", "Pivot"]
