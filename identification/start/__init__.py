"""First guesses read directly from the records, so that the fit starts near its end."""

from identification.start.base_motion import harmonic_start
from identification.start.contact import contact_start
from identification.start.suspension import suspension_start

__all__ = ["contact_start", "harmonic_start", "suspension_start"]
