"""Contact laws, one a file. A law is known to the program by being listed here."""

from vibrojax.contact.base import AbstractCompliantLaw, AbstractContactLaw, AbstractInstantaneousLaw, smoothed_force
from vibrojax.contact.hunt_crossley import HuntCrossley

LAWS: dict[str, type[AbstractContactLaw]] = {law.name: law for law in (HuntCrossley,)}

__all__ = ["LAWS", "AbstractCompliantLaw", "AbstractContactLaw", "AbstractInstantaneousLaw", "HuntCrossley", "smoothed_force"]
