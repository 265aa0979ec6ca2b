"""Recordings made by others as experiments: readers of raw layouts, one a file, and the recipes that name them."""

from identification.recipes import air_track, cyberdiver, free_swing, friction_backlash, pcb_shock, pendulum, silverbox, table
from identification.recipes.base import Cut, RawReader, Recipe

RAW_READERS: dict[str, RawReader] = {
    "air-track": air_track.read,
    "cyberdiver": cyberdiver.read,
    "free-swing": free_swing.read,
    "friction-backlash": friction_backlash.read,
    "pcb-shock": pcb_shock.read,
    "pendulum": pendulum.read,
    "silverbox": silverbox.read,
    "table": table.read,
}

__all__ = ["RAW_READERS", "Cut", "RawReader", "Recipe"]
