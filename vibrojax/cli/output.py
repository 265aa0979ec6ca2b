"""Results appear all at once or not at all: they are written aside and moved into place on success."""

import errno
import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from vibrojax.aside import filled, made_aside
from vibrojax.cli import interrupt
from vibrojax.errors import InputError

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_FAULT = (*_NO_ROOM, errno.EIO, errno.EROFS, errno.EACCES, errno.EPERM, errno.EMFILE, errno.ENAMETOOLONG)


@contextmanager
def output_folder(out: Path, *, outdated: Callable[[Path], set[Path]] = lambda out: set()) -> Iterator[Path]:
    """Lend an empty folder to write results into; `out` holds them when the block ends without an error (see `vibrojax.aside.filled`).

    Files of the same name from an earlier run are replaced, and outdated ones removed; other files in `out` are left alone. When the block
    fails, or is interrupted, `out` is as it was before, or is not there.

    Raises:
        InputError: `out` is a file, or cannot be written, or there is no room left.
    """
    out = Path(out).absolute()
    parking = next(path for path in (out, *out.parents) if os.path.lexists(path))
    if not parking.is_dir():
        raise InputError(f"cannot write results to {out}: {parking} is not a folder; name another folder with --out")
    lent: list[Path] = []
    try:
        with interrupt.removed_at_end(lent), filled(out, commit=interrupt.held, made=lent.append, outdated=outdated) as folder:
            yield folder
    except OSError as error:
        raise explained(error, out, lent) from error


@contextmanager
def output_file(out: Path) -> Iterator[Path]:
    """Lend a path to write one file to, which takes the place of `out`, or of what that links to, when the block ends without an error.

    A pipe or a device is lent itself: it is written to, and not replaced.

    Raises:
        InputError: as `output_folder`, for the folder that `out` is in, which must be there.
    """
    if out.exists() and not out.is_file():
        yield out
        return
    target, lent = out.resolve(), []
    if not target.parent.is_dir():
        raise InputError(f"cannot write {out}: {target.parent} is not a folder; name another file with --out")
    try:
        with interrupt.removed_at_end(lent), made_aside(target) as aside:
            lent.append(aside.path)
            yield aside.path / target.name
            os.replace(aside.path / target.name, target)
    except OSError as error:
        raise explained(error, out, lent) from error


def explained(error: OSError, out: Path, lent: Sequence[Path] = ()) -> Exception:
    """A fault of the place that results go to, in one line; any other error as it is. `lent` are folders that stand for it meanwhile."""
    out = out.absolute()
    place = str(error.filename2 or error.filename or "")
    for path in lent:
        place = place.replace(str(path), str(out))
    of_place = not lent or Path(place).is_relative_to(out) or Path(place) in out.parents if place else error.errno in _FAULT
    if not of_place and error.errno not in _NO_ROOM:
        return error
    remedy = "make room, or name another place with --out" if error.errno in _NO_ROOM else "name another folder with --out"
    return InputError(f"cannot write results to {out}: {place + ': ' if place else ''}{error.strerror or error}; {remedy}")
