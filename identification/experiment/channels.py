"""The channels a record may hold, their dimensions, and the kinds of record."""

import re

from identification.experiment.units import SI_UNITS

TIME = "time"
TIME_WORDS = frozenset(
    ("time", "zeit", "tempo", "temps", "tiempo", "timestamp", "timestamps", "seconds", "sekunden", "segundos", "uhrzeit")
)
TIME_SYMBOLS = frozenset(("t", "t s", "t ms", "t us", "x value", "zeitachse"))

# relative_displacement is u = x - y, for rigs that measure only the distance between hammer and cart.
# reaction_force is what suspension and stop resist with, positive against motion towards the stop, the hammer's inertia not included.
CHANNELS: dict[str, str] = {
    "hammer_displacement": "displacement",
    "cart_displacement": "displacement",
    "relative_displacement": "displacement",
    "hammer_acceleration": "acceleration",
    "cart_acceleration": "acceleration",
    "impact_force": "force",
    "applied_force": "force",
    "reaction_force": "force",
}
MOTION_CHANNELS = ("relative_displacement", "hammer_displacement")
CART_CHANNELS = ("cart_displacement", "cart_acceleration")
KINDS = ("drop-test", "cart-excitation", "free-decay", "forced", "prescribed")


def means_time(column: str) -> bool:
    """Say whether a column's name says that it holds time stamps.

    Args:
        column: as the file names it.

    Returns:
        Whether it does, in English, German or Portuguese.

    Example:
        >>> means_time("Zeit  1 - Messrate [s]"), means_time("t_ms"), means_time("Impact")
        (True, True, False)
    """
    bare = re.sub(r"[\W_\d]+", " ", re.split(r"[\[(]", column.lower())[0]).strip()
    return bare in TIME_SYMBOLS or not TIME_WORDS.isdisjoint(bare.split())


def si_unit(channel: str) -> str:
    """Name the SI unit of a channel.

    Args:
        channel: a key of `CHANNELS`.

    Returns:
        "m", "m/s^2" or "N".

    Example:
        >>> si_unit("impact_force")
        'N'
    """
    return SI_UNITS[CHANNELS[channel]]
