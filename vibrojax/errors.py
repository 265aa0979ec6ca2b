"""The errors a caller is expected to meet: bad input, and a computation that did not converge."""


class InputError(ValueError):
    """What was given cannot be used; the message says what was given, what was expected, and the remedy.

    Raised before any computation starts. The command line turns it into one line and exit status 2.
    """


class NoConvergenceError(RuntimeError):
    """A computation on good input did not reach its tolerance; the message says how far it came.

    The command line turns it into one line and exit status 3.
    """
