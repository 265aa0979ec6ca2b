"""Where the misfit is, and which record would settle what is open."""
