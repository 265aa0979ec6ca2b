"""Periodic orbits of the rig under a harmonic cart: Newton shooting, Floquet multipliers, branches through folds, special points."""

from vibrojax.continuation.border import Border as Border
from vibrojax.continuation.border import border as border
from vibrojax.continuation.branch import Branch as Branch
from vibrojax.continuation.branch import End as End
from vibrojax.continuation.branch import Kind as Kind
from vibrojax.continuation.branch import SpecialPoint as SpecialPoint
from vibrojax.continuation.follow import doubled as doubled
from vibrojax.continuation.follow import follow as follow
from vibrojax.continuation.orbit import Orbit as Orbit
from vibrojax.continuation.orbit import find_orbit as find_orbit
from vibrojax.continuation.orbit import settle as settle
from vibrojax.continuation.rig import ForcedRig as ForcedRig
