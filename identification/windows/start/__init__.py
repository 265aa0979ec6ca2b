"""First guesses read directly from the records, so that the fit starts near its end."""

from identification.windows.start.base_motion import harmonic_acceleration, harmonic_start
from identification.windows.start.guess import first_guesses

__all__ = ["first_guesses", "harmonic_acceleration", "harmonic_start"]
