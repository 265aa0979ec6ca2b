"""Thousands of operating points at once."""

from vibrojax.batch.base import AbstractEngine, Cycles, Lanes, LaneState
from vibrojax.batch.exact_flight import ExactFlight
from vibrojax.batch.orbits import Orbits, find_orbits
from vibrojax.batch.points import SETTINGS, Points, Responses, grid
from vibrojax.batch.run import Batch, Span, Strobes, engine_for, integrate, packed, unpacked
from vibrojax.batch.sampled import Sampled
from vibrojax.batch.stepping import Stepping

__all__ = [
    "SETTINGS",
    "AbstractEngine",
    "Batch",
    "Cycles",
    "ExactFlight",
    "LaneState",
    "Lanes",
    "Orbits",
    "Points",
    "Responses",
    "Sampled",
    "Span",
    "Stepping",
    "Strobes",
    "engine_for",
    "find_orbits",
    "grid",
    "integrate",
    "packed",
    "unpacked",
]
