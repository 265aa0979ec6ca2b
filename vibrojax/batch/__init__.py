"""Thousands of operating points at once."""

from vibrojax.batch.base import AbstractEngine, Cycles, Lanes, LaneState
from vibrojax.batch.exact_flight import ExactFlight
from vibrojax.batch.points import SETTINGS, Points, Responses, grid
from vibrojax.batch.run import Span, engine_for, integrate, packed, unpacked
from vibrojax.batch.sampled import Sampled
from vibrojax.batch.stepping import Stepping

__all__ = [
    "SETTINGS",
    "AbstractEngine",
    "Cycles",
    "ExactFlight",
    "LaneState",
    "Lanes",
    "Points",
    "Responses",
    "Sampled",
    "Span",
    "Stepping",
    "engine_for",
    "grid",
    "integrate",
    "packed",
    "unpacked",
]
