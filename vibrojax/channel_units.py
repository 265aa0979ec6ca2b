"""The channels that a recorder can have, and their units; free of physics, so that effects may import it."""

CHANNELS = (
    "hammer_displacement",
    "cart_displacement",
    "hammer_acceleration",
    "cart_acceleration",
    "impact_force",
    "applied_force",
    "relative_displacement",
)
"""What sensors on the rig read, in the order of the tables."""
SUPPORT_CHANNELS = ("reaction_force",)
"""What a gauge behind the suspension and the stop reads, as in a testing machine that prescribes the motion."""

EVERY_CHANNEL = (*CHANNELS, *SUPPORT_CHANNELS)

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
