"""First guesses of all parameters, read directly from the records."""

from identification.windows.start.base_motion import harmonic_acceleration, harmonic_start
from identification.windows.start.guess import first_guesses
from identification.windows.start.unseen_base import unseen_bases

__all__ = ["first_guesses", "harmonic_acceleration", "harmonic_start", "unseen_bases"]
