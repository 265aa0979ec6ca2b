"""The channels that a recorder can have, and their units; free of physics, so that effects may import it."""

UNITS = {
    "hammer_displacement": "m",
    "cart_displacement": "m",
    "hammer_acceleration": "m/s^2",
    "cart_acceleration": "m/s^2",
    "impact_force": "N",
    "applied_force": "N",
    "relative_displacement": "m",
    "reaction_force": "N",
}
EVERY_CHANNEL = tuple(UNITS)
"""In the order of the tables."""
CHANNELS = tuple(channel for channel in EVERY_CHANNEL if channel != "reaction_force")
"""What sensors on the rig read; the other one is that of a gauge behind the suspension and the stop, as in a testing machine."""
