"""How a command ends: every expected error becomes one line on standard error and an exit status."""

import sys
from typing import NoReturn

import typer

from vibrojax.errors import InputError, NoConvergenceError

BAD_INPUT = 2
NO_CONVERGENCE = 3


def run(app: typer.Typer) -> NoReturn:
    """Run a command-line app on `sys.argv` and exit: 0 done, 2 bad input, 3 no convergence.

    Errors that nobody expects keep their traceback.
    """
    try:
        app()
    except ValueError as error:
        if not _is_bad_input(error):
            raise
        _fail(error, BAD_INPUT)
    except NoConvergenceError as error:
        _fail(error, NO_CONVERGENCE)
    sys.exit(0)


def _is_bad_input(error: ValueError) -> bool:
    """Only now is the reader of experiments worth importing."""
    from identification.experiment import ExperimentError

    return isinstance(error, InputError | ExperimentError)


def _fail(error: Exception, status: int) -> NoReturn:
    """One line, whatever the message holds."""
    typer.echo(f"error: {' '.join(str(error).split())}", err=True)
    sys.exit(status)
