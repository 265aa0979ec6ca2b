"""How a command ends: every expected error becomes one line on standard error and an exit status.

A reader of standard output or error that goes away, or a disk that is full behind them, does not end the work.
"""

import atexit
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, NoReturn

import typer

from vibrojax.cli import interrupt
from vibrojax.errors import InputError, NoConvergenceError, one_line

BAD_INPUT = 2
NO_CONVERGENCE = 3
_BAD_USAGE: type[Exception] = typer.BadParameter.mro()[1]
"""A command line that cannot be read; Typer gives this class no public name."""


def run(app: typer.Typer) -> NoReturn:
    """Run a command-line app on `sys.argv` and exit: 0 done, 2 bad input, 3 no convergence, 130 ended on request.

    Errors that nobody expects keep their traceback.
    """
    with interrupt.watched(), lasting_streams() as out:
        status = _status(app)
        out.flush()
        if out.error is not None and not isinstance(out.error, BrokenPipeError):
            status = _fail(f"standard output cannot be written ({out.error.strerror}): make room, or send it elsewhere", BAD_INPUT)
    atexit.register(interrupt.ignore)
    sys.exit(status)


def _status(app: typer.Typer) -> int:
    """Exit status of an app, once it has said what is wrong."""
    try:
        return app(standalone_mode=False) or 0  # else Typer draws errors itself, as a box of several lines
    except _BAD_USAGE as error:
        return _fail(_usage_text(error), BAD_INPUT)
    except InputError as error:
        return _fail(str(error), BAD_INPUT)
    except NoConvergenceError as error:
        return _fail(str(error), NO_CONVERGENCE)


def _usage_text(error: Any) -> str:
    """What was given, what was expected, where to read on; empty where the help has been printed instead."""
    given = error.format_message().rstrip(".")
    if not given:
        return ""
    if error.ctx is None:
        return f"{given}; see the same command with --help"
    parameter: Any = error.param if isinstance(error, typer.BadParameter) else None
    if parameter is None:
        expected = error.ctx.get_usage().partition(": ")[2]
    else:
        about = parameter.help.partition(". ")[0].rstrip(".")
        expected = f"{parameter.metavar or parameter.name.upper()} ({about})"
    stop = "" if given.endswith("?") else ";"
    return f"{given}{stop} expected {expected}; see {error.ctx.command_path} --help"


def _fail(message: str, status: int) -> int:
    """One line, whatever the message holds."""
    if message:
        typer.echo(f"error: {one_line(message)}", err=True)
    return status


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
