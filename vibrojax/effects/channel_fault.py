"""What the faults of one channel share."""

import equinox as eqx

from vibrojax.effects.base import AbstractEffect


class AbstractChannelFault(AbstractEffect):
    """A fault of the recorder in one channel; it implements `scaled` and `read`."""

    of_channel: eqx.AbstractVar[str]
    """Name of the channel; empty for none."""

    @property
    def is_fault(self) -> bool:
        """Yes."""
        return True

    @property
    def channel(self) -> str | None:
        """The one that is wrong."""
        return self.of_channel or None
