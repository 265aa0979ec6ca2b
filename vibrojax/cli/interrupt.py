"""Ctrl-C, or a batch system's request to end, during long work: it always ends the command, and never in a traceback."""

import dataclasses
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

_REQUESTS = (signal.SIGINT, signal.SIGTERM)


@dataclasses.dataclass
class Interruption:
    """Whether the user has asked to stop.

    Raising out of a signal handler alone does not do: a compiled module that is being imported turns the exception into an `ImportError`,
    and JAX's callback of the garbage collector swallows it.
    """

    asked: bool = False
    waiting: bool = False

    @contextmanager
    def deferred(self) -> Iterator[None]:
        """A block that one Ctrl-C does not break off: it ends first, then the command does. A second Ctrl-C does not wait."""
        self.waiting = True
        try:
            yield
        finally:
            self.waiting = False
        self.check()

    def check(self) -> None:
        """Raise `KeyboardInterrupt` if the user has asked to stop."""
        if self.asked:
            raise KeyboardInterrupt

    def watched(self, say: Callable[[str], None]) -> Callable[[str], None]:
        """The same progress function, which ends the work where an interrupt was swallowed."""

        def checked(stage: str) -> None:
            self.check()
            say(stage)

        return checked

    def handle(self, number: int, frame: FrameType | None) -> None:
        """The signal handler."""
        wait, self.asked = self.waiting and not self.asked, True
        if not wait:
            raise KeyboardInterrupt


@contextmanager
def interruptible() -> Iterator[Interruption]:
    """A block that Ctrl-C or SIGTERM leaves with `KeyboardInterrupt`, whatever exception it has become on its way.

    Outside the main thread, which alone may handle signals, nothing is changed.
    """
    interruption = Interruption()
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
        yield interruption
        return
    before = {number: signal.signal(number, interruption.handle) for number in _REQUESTS}
    try:
        yield interruption
    except Exception:
        if interruption.asked:
            raise KeyboardInterrupt from None
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
