"""A figure a study, each drawn from the study's data set alone."""

from collections.abc import Callable

import xarray as xr
from matplotlib.figure import Figure

from vibrojax.studies.figures import basins, basins_along, bifurcation, frequency_response, hammer_design, lyapunov, peterka, section
from vibrojax.studies.figures.uncertain import UNCERTAIN

FIGURES: dict[str, Callable[[xr.Dataset], Figure]] = {
    "response": frequency_response.draw,
    "bifurcation": bifurcation.draw,
    "peterka": peterka.draw,
    "section": section.draw,
    "basins": basins.draw,
    "basins_along": basins_along.draw,
    "lyapunov": lyapunov.draw,
    "design": hammer_design.draw,
}
"""By the name of the command."""

__all__ = ["FIGURES", "UNCERTAIN"]
