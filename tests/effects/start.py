"""Effects at the start values of their parameters."""

from vibrojax.effects import AbstractEffect


def at_start(effect: type[AbstractEffect], **texts: str) -> AbstractEffect:
    """An effect with every parameter at its start value."""
    return effect(**{p.field: p.start for p in effect.parameters}, **texts)
