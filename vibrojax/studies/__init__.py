"""Nonlinear studies of a model, each a data set with units and provenance."""

from vibrojax.studies.basins import basins as basins
from vibrojax.studies.basins_along import basins_along as basins_along
from vibrojax.studies.bifurcation import bifurcation as bifurcation
from vibrojax.studies.force_curves import frequency_response as frequency_response
from vibrojax.studies.force_curves import hammer_design as hammer_design
from vibrojax.studies.lyapunov import lyapunov as lyapunov
from vibrojax.studies.peterka import peterka as peterka
from vibrojax.studies.section import section as section
