"""Contact laws, one a file. A law is known to the program by its import here."""

from vibrojax.contact.base import AbstractCompliantLaw as AbstractCompliantLaw
from vibrojax.contact.base import AbstractContactLaw as AbstractContactLaw
from vibrojax.contact.base import AbstractInstantaneousLaw as AbstractInstantaneousLaw
from vibrojax.contact.base import smoothed_force as smoothed_force
from vibrojax.listing import final_classes

# isort: off
# In the order of tables and choices.
from vibrojax.contact.hunt_crossley import HuntCrossley as HuntCrossley
from vibrojax.contact.hunt_crossley_separate import HuntCrossleySeparate as HuntCrossleySeparate
from vibrojax.contact.hertz import Hertz as Hertz
from vibrojax.contact.kelvin_voigt import KelvinVoigt as KelvinVoigt
from vibrojax.contact.kelvin_voigt_clipped import KelvinVoigtClipped as KelvinVoigtClipped
from vibrojax.contact.lankarani_nikravesh import LankaraniNikravesh as LankaraniNikravesh
from vibrojax.contact.flores import Flores as Flores
from vibrojax.contact.newton import Newton as Newton
from vibrojax.contact.no_contact import NoContact as NoContact
# isort: on

LAWS: dict[str, type[AbstractContactLaw]] = {law.name: law for law in final_classes(vars(), AbstractContactLaw)}
"""Every listed law by name."""
