"""Results appear all at once or not at all: they are written aside and moved into place on success."""

import errno
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vibrojax.errors import InputError

_NO_ROOM = (errno.ENOSPC, errno.EDQUOT)


@contextmanager
def output_folder(out: Path) -> Iterator[Path]:
    """Lend an empty folder to write results into; move its files to `out` when the block ends without an error.

    Files of the same name from an earlier run are replaced, one by one; other files in `out` are left alone. When the
    block fails, `out` is as it was before, or is not there.

    Args:
        out: folder that shall hold the results; it and its parents are created on success.

    Yields:
        The folder to write into, on the same file system as `out`.

    Raises:
        InputError: `out` is a file, or cannot be written, or there is no room left.
    """
    out = Path(out).absolute()
    parking = next(path for path in (out, *out.parents) if os.path.lexists(path))
    if not parking.is_dir():
        raise InputError(f"cannot write results to {out}: {parking} is not a folder; name another folder with --out")
    try:
        aside = Path(tempfile.mkdtemp(prefix=f".{out.name}-unfinished-", dir=parking))
    except OSError as error:
        raise InputError(f"cannot write results to {out}: {parking}: {error.strerror}; name another folder with --out") from error
    try:
        yield aside
        try:
            _refuse_other_kinds(aside, out)
            _move_files(aside, out)
        except OSError as error:
            raise InputError(f"cannot write results to {out}: {error.filename2 or error.filename}: {error.strerror}") from error
    except OSError as error:
        if error.errno not in _NO_ROOM:
            raise
        raise InputError(f"cannot write results to {out}: {error.strerror}; make room, or name another place with --out") from error
    finally:
        shutil.rmtree(aside, ignore_errors=True)


@contextmanager
def output_file(out: Path) -> Iterator[Path]:
    """Lend a path to write one file to, which takes the place of `out`, or of what that links to, when the block ends without an error.

    A pipe or a device is lent itself: it is written to, and not replaced.

    Raises:
        InputError: as `output_folder`, for the folder that `out` is in.
    """
    if out.exists() and not out.is_file():
        yield out
        return
    target = out.resolve()
    with output_folder(target.parent) as folder:
        yield folder / target.name


def _refuse_other_kinds(source: Path, target: Path) -> None:
    """Before anything is moved: a folder in the place of a file, or a file in that of a folder."""
    for item in sorted(source.rglob("*")):
        there = target / item.relative_to(source)
        if there.exists() and there.is_dir() != item.is_dir():
            number = errno.EISDIR if there.is_dir() else errno.ENOTDIR
            raise OSError(number, os.strerror(number), str(there))


def _move_files(source: Path, target: Path) -> None:
    """Folders are made, never moved: the lent one is private to the user, those made here obey the umask."""
    target.mkdir(parents=True, exist_ok=True)
    for item in sorted(source.iterdir()):
        if item.is_dir():
            _move_files(item, target / item.name)
        else:
            os.replace(item, target / item.name)
