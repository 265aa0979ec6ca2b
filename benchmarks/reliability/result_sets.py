"""Result sets that are replaced while the process is killed, or the disk fails, at each step: is one of them ever mixed with another?"""

import errno
import json
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks.reliability.steps import DONE, FAILED, interrupted
from vibrojax.cli.output import output_folder

FILES = (*(f"{name}.json" for name in "abcdefghij"), "plots/one.svg", "plots/two.svg")
FAULTS = (None, errno.EIO, errno.ENOSPC, errno.EFBIG, errno.EACCES)
"""None: killed."""
_OTHER, _ONLY_OLD = "notes.txt", "posterior.nc"
"""A file of somebody else, and one of the old set that the new one lacks."""


def main() -> None:
    """Print what became of the sets, as JSON."""
    with tempfile.TemporaryDirectory(prefix="result-sets-") as folder:
        print(json.dumps(every_step(Path(folder))))


def every_step(folder: Path) -> dict[str, int]:
    """Replace a set once for each way of moving it, fault and step.

    Args:
        folder: empty; it is left so.

    Returns:
        Attempts that were disturbed, how many ended with mixed sets or lost a foreign file, how many with an unexpected error, and how many
        of the next runs did not give their whole set or left something behind.
    """
    count: dict[str, int] = dict.fromkeys(("steps", "mixed", "unexpected", "not_mended"), 0)
    for way in WAYS:
        steps = _undisturbed(folder, way)
        for fault in FAULTS if way is not _in_place else FAULTS[1:]:  # files that are moved one by one are not safe from SIGKILL
            for number in range(steps):
                _attempt(folder, way, number, fault, count)
    return count


def _attempt(folder: Path, way: Callable[[], None], number: int, fault: int | None, count: dict[str, int]) -> None:
    _begun(folder, way)
    status = interrupted(lambda: _replaced(folder / "out", "new", way), number, fault)
    count["steps"] += 1
    there = (folder / "out").exists() or fault is not None  # after a kill, the next run puts it back
    count["mixed"] += there and not _one_set(folder / "out", {"old"} if status == FAILED else {"old", "new"})
    count["unexpected"] += status not in ({-signal.SIGKILL} if fault is None else {DONE, FAILED})
    _replaced(folder / "out", "next")
    count["not_mended"] += not _one_set(folder / "out", {"next"}) or len(list(folder.iterdir())) != 1
    shutil.rmtree(folder / "out")


def _undisturbed(folder: Path, way: Callable[[], None]) -> int:
    """How many steps there are."""
    number = 0
    while True:
        _begun(folder, way)
        if interrupted(lambda: _replaced(folder / "out", "new", way), number, None) == DONE:
            shutil.rmtree(folder / "out")
            return number
        _replaced(folder / "out", "next")
        shutil.rmtree(folder / "out")
        number += 1


def _begun(folder: Path, way: Callable[[], None]) -> None:
    """An old set, and a file of somebody else."""
    _replaced(folder / "out", "old")
    (folder / "out" / _OTHER).write_text("mine")
    if way is _in_place:
        (folder / "out" / "archive").mkdir()


def _at_once() -> None:
    """The folder is renamed."""


def _in_place() -> None:
    """The folder holds another one, which stays where it is."""


WAYS = (_at_once, _in_place)


def _replaced(out: Path, text: str, way: Callable[[], None] = _at_once) -> None:
    """Write a set."""
    way()
    with output_folder(out, outdated=lambda out: {Path(_ONLY_OLD)}) as folder:
        (folder / "plots").mkdir()
        for name in (*FILES, *([_ONLY_OLD] if text == "old" else [])):
            (folder / name).write_text(text)


def _one_set(out: Path, texts: set[str]) -> bool:
    """Whether every file is of one of these sets, that of the old one alone included, and the foreign one is there."""
    try:
        found = {(out / name).read_text() for name in FILES}
        whole = len(found) == 1 and found <= texts and (out / _ONLY_OLD).exists() == (found == {"old"})
        return whole and (out / _OTHER).read_text() == "mine"
    except OSError:
        return False


if __name__ == "__main__":
    sys.exit(main())
