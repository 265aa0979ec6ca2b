"""Contact laws. A law is known to the program by its import here."""

from vibrojax.contact.base import AbstractCompliantLaw as AbstractCompliantLaw
from vibrojax.contact.base import AbstractContactLaw as AbstractContactLaw
from vibrojax.contact.base import AbstractInstantaneousLaw as AbstractInstantaneousLaw
from vibrojax.contact.base import restitution as restitution
from vibrojax.contact.base import smoothed_force as smoothed_force
from vibrojax.contact.laws import NOWHERE as NOWHERE
from vibrojax.parameters import final_classes

# isort: off
# In the order of tables and choices.
from vibrojax.contact.laws import HuntCrossley as HuntCrossley
from vibrojax.contact.laws import HuntCrossleySeparate as HuntCrossleySeparate
from vibrojax.contact.laws import Hertz as Hertz
from vibrojax.contact.laws import KelvinVoigt as KelvinVoigt
from vibrojax.contact.laws import KelvinVoigtClipped as KelvinVoigtClipped
from vibrojax.contact.laws import LankaraniNikravesh as LankaraniNikravesh
from vibrojax.contact.laws import Flores as Flores
from vibrojax.contact.laws import Newton as Newton
from vibrojax.contact.laws import NoContact as NoContact
# isort: on

LAWS: dict[str, type[AbstractContactLaw]] = {law.name: law for law in final_classes(vars(), AbstractContactLaw)}
"""Every listed law by name."""
