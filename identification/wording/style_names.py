"""Names of the styles of a report. They stand apart from the styles, so that the command line lists them without loading JAX."""

ON_SCREEN = "screen"
ON_PAPER = "print"
STYLE_NAMES = (ON_SCREEN, ON_PAPER)
"""The first is taken where none is chosen."""
