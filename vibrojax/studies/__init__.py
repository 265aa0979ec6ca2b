"""Nonlinear studies of a model, each a data set with units and provenance."""

from vibrojax.studies.basins import basins
from vibrojax.studies.basins_along import basins_along
from vibrojax.studies.bifurcation import bifurcation
from vibrojax.studies.force_curves import frequency_response, hammer_design
from vibrojax.studies.lyapunov import lyapunov
from vibrojax.studies.peterka import peterka
from vibrojax.studies.section import section

__all__ = ["basins", "basins_along", "bifurcation", "frequency_response", "hammer_design", "lyapunov", "peterka", "section"]
