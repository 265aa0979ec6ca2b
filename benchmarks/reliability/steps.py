"""Work that is killed, or meets an error of the system, at each of its steps in turn.

Python announces every call that opens, makes, moves or removes a file to its audit hooks before it is made: there the process is killed, or
the call fails, as on a full or faulty disk. Each attempt is a fork of this process, which must not have started threads.
"""

import os
import signal
import sys
from collections.abc import Callable

STEPS = ("open", "os.mkdir", "os.rename", "os.link", "os.remove", "os.rmdir", "os.chmod", "os.utime")
"""Names of the events that count as a step."""
DONE, FAILED = 0, 1


def interrupted(work: Callable[[], None], number: int, fault: int | None) -> int:
    """Do some work in a fork of this process, and disturb it at one of its steps.

    Args:
        work: what is done.
        number: of the step, from 0.
        fault: `errno` of the error with which the step fails; None: the process is killed before it.

    Returns:
        `DONE`, `FAILED` (an `InputError`), or minus the signal that ended it; any other number is an error that nobody expected.
    """
    child = os.fork()
    if child == 0:
        status = 2
        try:
            status = _disturbed(work, number, fault)
        finally:
            os._exit(status)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


def _disturbed(work: Callable[[], None], number: int, fault: int | None) -> int:
    """In the fork."""
    from vibrojax.errors import InputError

    left = number

    def hook(event: str, arguments: object) -> None:
        nonlocal left
        if event not in STEPS:
            return
        left -= 1
        if left == -1:
            if fault is None:
                os.kill(os.getpid(), signal.SIGKILL)
            else:
                raise OSError(fault, os.strerror(fault))

    sys.addaudithook(hook)
    try:
        work()
    except InputError:
        return FAILED
    return DONE
