"""What the faults of one channel share."""

import equinox as eqx

from vibrojax.effects.base import AbstractEffect


class AbstractChannelFault(AbstractEffect):
    """A fault of the recorder in one channel, of either sign; it implements `probes`, `scaled` and `read`."""

    of_channel: eqx.AbstractVar[str]
    """Name of the channel; empty before `probes` has chosen one."""

    @property
    def is_fault(self) -> bool:
        """Yes."""
        return True

    @property
    def one_signed(self) -> bool:
        """Either sign."""
        return False

    @property
    def channel(self) -> str | None:
        """The one that is wrong."""
        return self.of_channel or None
