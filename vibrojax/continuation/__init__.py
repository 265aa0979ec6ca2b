"""Periodic orbits of the rig under a harmonic cart: Newton shooting, Floquet multipliers, branches through folds, special points."""

from vibrojax.continuation.border import Border, border
from vibrojax.continuation.branch import Branch, End, Kind, SpecialPoint
from vibrojax.continuation.follow import doubled, follow
from vibrojax.continuation.orbit import Orbit, find_orbit, settle
from vibrojax.continuation.rig import ForcedRig

__all__ = [
    "Border",
    "Branch",
    "End",
    "ForcedRig",
    "Kind",
    "Orbit",
    "SpecialPoint",
    "border",
    "doubled",
    "find_orbit",
    "follow",
    "settle",
]
