"""How often is what a rig conceals found, and how often is something claimed that is not there? `python -m benchmarks.concealed`."""
