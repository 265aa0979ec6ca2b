"""Figures of the diagnosis's report, one kind a file. A figure is known to the report by being listed here."""

from identification.discrepancy.report.figures.base import Drawer
from identification.discrepancy.report.figures.before_after import before_after
from identification.discrepancy.report.figures.bend import bend
from identification.discrepancy.report.figures.candidates import candidates
from identification.discrepancy.report.figures.learned import learned
from identification.discrepancy.report.figures.maps import maps
from identification.discrepancy.report.figures.misfits import misfits
from identification.discrepancy.report.figures.profiles import best_profile, other_profiles
from identification.discrepancy.report.figures.restitution import restitution

FIGURES: tuple[Drawer, ...] = (best_profile, other_profiles, bend, restitution, maps, learned, misfits, before_after, candidates)

__all__ = ["FIGURES", "Drawer"]
