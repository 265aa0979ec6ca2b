"""Contact laws, one a file. A law is known to the program by being listed here."""

from vibrojax.contact.base import AbstractCompliantLaw, AbstractContactLaw, AbstractInstantaneousLaw, smoothed_force
from vibrojax.contact.flores import Flores
from vibrojax.contact.hertz import Hertz
from vibrojax.contact.hunt_crossley import HuntCrossley
from vibrojax.contact.hunt_crossley_separate import HuntCrossleySeparate
from vibrojax.contact.kelvin_voigt import KelvinVoigt
from vibrojax.contact.kelvin_voigt_clipped import KelvinVoigtClipped
from vibrojax.contact.lankarani_nikravesh import LankaraniNikravesh
from vibrojax.contact.newton import Newton
from vibrojax.contact.no_contact import NoContact

LAWS: dict[str, type[AbstractContactLaw]] = {
    law.name: law
    for law in (HuntCrossley, HuntCrossleySeparate, Hertz, KelvinVoigt, KelvinVoigtClipped, LankaraniNikravesh, Flores, Newton, NoContact)
}

__all__ = [
    "LAWS",
    "AbstractCompliantLaw",
    "AbstractContactLaw",
    "AbstractInstantaneousLaw",
    "Flores",
    "Hertz",
    "HuntCrossley",
    "HuntCrossleySeparate",
    "KelvinVoigt",
    "KelvinVoigtClipped",
    "LankaraniNikravesh",
    "Newton",
    "NoContact",
    "smoothed_force",
]
