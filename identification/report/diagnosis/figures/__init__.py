"""Figures of the diagnosis's report, one kind a file. A figure is known to the report by being listed here."""

from identification.report.diagnosis.figures.base import Drawer
from identification.report.diagnosis.figures.before_after import before_after
from identification.report.diagnosis.figures.candidates import candidates
from identification.report.diagnosis.figures.learned import learned
from identification.report.diagnosis.figures.loop_kink import loop_kink
from identification.report.diagnosis.figures.maps import maps
from identification.report.diagnosis.figures.misfits import misfits
from identification.report.diagnosis.figures.profiles import best_profile, other_profiles
from identification.report.diagnosis.figures.restitution import restitution
from identification.report.diagnosis.figures.ring_downs import ring_downs

FIGURES: tuple[Drawer, ...] = (
    best_profile,
    other_profiles,
    loop_kink,
    restitution,
    ring_downs,
    maps,
    learned,
    misfits,
    before_after,
    candidates,
)

__all__ = ["FIGURES", "Drawer"]
