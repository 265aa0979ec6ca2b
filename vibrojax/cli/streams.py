"""Standard output and error as a command uses them: a reader that goes away, or a disk that is full, does not end the work."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class Lasting:
    """A stream that goes on as if it were written to after an error of the system.

    Attributes:
        error: the first one, or None.
    """

    def __init__(self, stream: Any) -> None:
        """Write to a stream."""
        self._stream = stream
        self.error: OSError | None = None

    def write(self, text: str) -> int:
        """Write, or lose, a text."""
        try:
            return self._stream.write(text)
        except OSError as error:
            self._lost(error)
            return len(text)

    def flush(self) -> None:
        """Write, or lose, what is waiting."""
        try:
            self._stream.flush()
        except OSError as error:
            self._lost(error)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def _lost(self, error: OSError) -> None:
        """From here on everything goes nowhere, what is still waiting to be written included."""
        self.error = self.error or error
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, self._stream.fileno())
        os.close(nowhere)


@contextmanager
def lasting_streams() -> Iterator[Lasting]:
    """A block in which both streams last; yields standard output."""
    out, err = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = lasting = Lasting(out), Lasting(err)
    try:
        yield lasting[0]
    finally:
        for stream in lasting:
            stream.flush()
        sys.stdout, sys.stderr = out, err
