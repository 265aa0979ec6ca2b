"""Figures of the report, one kind a file. A figure is known to the report by being listed here."""

from identification.report.figures.base import Drawer, Picture
from identification.report.figures.correlation import correlation
from identification.report.figures.estimates.posterior import posterior
from identification.report.figures.estimates.profiles import likelihood_profiles
from identification.report.figures.first_impact import first_impact
from identification.report.figures.impacts import impact_closeups
from identification.report.figures.loops import loops
from identification.report.figures.overlay import overlay
from identification.report.figures.phase_plane import phase_plane
from identification.report.figures.residuals import residuals
from identification.report.figures.restitution import restitution
from identification.report.figures.ring_downs import ring_downs
from identification.report.figures.waterfall import waterfall

FIGURES: tuple[Drawer, ...] = (
    first_impact,
    loops,
    restitution,
    phase_plane,
    ring_downs,
    overlay,
    impact_closeups,
    residuals,
    correlation,
    likelihood_profiles,
    posterior,
    waterfall,
)

__all__ = ["FIGURES", "Drawer", "Picture"]
