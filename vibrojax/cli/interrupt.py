"""Ctrl-C, or a batch system's request to end: the one place that handles it, for every command.

An exception raised in a signal handler can be lost: a compiled module that is being imported turns it into an `ImportError`, JAX's callback
of the garbage collector prints and forgets it, and no handler runs while compiled code computes. So none is raised. The system writes each
signal's number into a pipe, and a thread that waits there cleans up and ends the process.
"""

import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from vibrojax.aside import remove

STATUS = 130
"""Exit status of a command that was asked to end."""
_REQUESTS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_undisturbed = threading.RLock()
_clean_up: list[Callable[[], object]] = []
_ending = threading.Event()


@contextmanager
def watched() -> Iterator[None]:
    """A block that a request ends, and the process with it.

    Outside the main thread, which alone may handle signals, nothing is changed; a request that is ignored stays ignored.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    waiting = threading.Thread(target=_wait, args=(reading,), daemon=True)
    waiting.start()
    pipe_before = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    requests = [number for number in _REQUESTS if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, lambda number, frame: None) for number in requests}
    try:
        yield
    except BaseException:
        if _ending.is_set():
            waiting.join()  # which ends the process: what the clean-up makes go wrong here is nobody's concern
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(pipe_before)
        os.close(writing)
        waiting.join()


def ignore() -> None:
    """Ignore requests from here on: the work is done, and the process is ending."""
    if threading.current_thread() is threading.main_thread():
        for number in _REQUESTS:
            signal.signal(number, signal.SIG_IGN)


@contextmanager
def held() -> Iterator[None]:
    """A short block that a request does not break off: it ends first, then the process does. A second request does not wait."""
    with _undisturbed:
        yield


@contextmanager
def at_end(action: Callable[[], object]) -> Iterator[None]:
    """A block with something to do before the process is ended in it."""
    _clean_up.append(action)
    try:
        yield
    finally:
        _clean_up.remove(action)


@contextmanager
def removed_at_end(folders: list[Path]) -> Iterator[None]:
    """A block in which folders are made that shall not outlive an ended process; the list may grow in it."""
    with at_end(lambda: [remove(folder) for folder in folders]):
        yield


def _wait(reading: int) -> None:
    """Read the numbers of signals until the other end is closed."""
    asked = 0
    with open(reading, "rb", buffering=0) as pipe:
        while numbers := pipe.read(64):
            for _ in (number for number in numbers if number in _REQUESTS):
                asked += 1
                if asked == 1:
                    threading.Thread(target=_end, daemon=True).start()
                else:
                    os._exit(STATUS)


def _end() -> None:
    with _undisturbed:
        _ending.set()
        for action in reversed(_clean_up):
            with contextlib.suppress(Exception):
                action()
        os._exit(STATUS)
