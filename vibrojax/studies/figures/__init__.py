"""A figure a study, each drawn from the study's data set alone."""

from collections.abc import Callable

import xarray as xr
from matplotlib.figure import Figure

from vibrojax.studies.figures import basins, bifurcation, forces, lyapunov, peterka, section
from vibrojax.studies.figures.uncertain import UNCERTAIN

FIGURES: dict[str, Callable[[xr.Dataset], Figure]] = {
    "response": forces.draw_response,
    "bifurcation": bifurcation.draw,
    "peterka": peterka.draw,
    "section": section.draw,
    "basins": basins.draw,
    "basins_along": basins.draw_along,
    "lyapunov": lyapunov.draw,
    "design": forces.draw_design,
}
"""By the name of the command."""

__all__ = ["FIGURES", "UNCERTAIN"]
