"""A figure a study, each drawn from the study's data set alone."""

from collections.abc import Callable

import xarray as xr
from matplotlib.figure import Figure

from vibrojax.studies.figures.lines import draw_bifurcation, draw_frequency_response, draw_hammer_design, draw_lyapunov, draw_section
from vibrojax.studies.figures.maps import draw_basins as draw_basins
from vibrojax.studies.figures.maps import draw_basins_along
from vibrojax.studies.figures.maps import draw_peterka as draw_peterka
from vibrojax.studies.figures.uncertain import UNCERTAIN as UNCERTAIN

FIGURES: dict[str, Callable[[xr.Dataset], Figure]] = {
    "response": draw_frequency_response,
    "bifurcation": draw_bifurcation,
    "peterka": draw_peterka,
    "section": draw_section,
    "basins": draw_basins,
    "basins_along": draw_basins_along,
    "lyapunov": draw_lyapunov,
    "design": draw_hammer_design,
}
"""By the name of the command."""
