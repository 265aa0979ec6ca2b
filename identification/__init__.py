"""Parameter identification from records of the rig."""
