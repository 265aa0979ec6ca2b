"""How numbers, symbols and channels are written, in sentences, tables and figures alike; and the names of the styles of a report.

The names stand here, so that the command line lists them without loading JAX.
"""

ON_SCREEN = "screen"
ON_PAPER = "print"
STYLE_NAMES = (ON_SCREEN, ON_PAPER)
"""The first is taken where none is chosen."""
