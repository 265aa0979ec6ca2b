"""Saddle orbits of the stroboscopic map, and their stable and unstable manifolds: the curves that bound basins of attraction."""

from vibrojax.manifolds.base import AbstractPlaneMap
from vibrojax.manifolds.saddles import Saddle, saddles
from vibrojax.manifolds.stable import Steps, stable_branch
from vibrojax.manifolds.strobe_map import StrobeMap
from vibrojax.manifolds.unstable import unstable_branch

__all__ = ["AbstractPlaneMap", "Saddle", "Steps", "StrobeMap", "saddles", "stable_branch", "unstable_branch"]
