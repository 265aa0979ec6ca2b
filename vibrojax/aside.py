"""Folders that appear whole: made beside their place under a name of their own, and renamed.

A run holds a lock on the folder that it makes, and on the earlier one that it renames before the new one takes its name; one without a
lock is what a killed run has left: the next run removes it, or puts it back where no folder has its name.
"""

import contextlib
import errno
import fcntl
import hashlib
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import NamedTuple

from vibrojax.errors import InputError
from vibrojax.json_file import read_json

STATING = ("fit.json", "diagnosis.json")
"""Files that state, under "files", the SHA-256 of each other file of their set."""
_UNFINISHED, _REPLACED = "unfinished", "replaced"


class Aside(NamedTuple):
    """A folder that is being filled, and the open file that holds its lock."""

    path: Path
    lock: int


@contextmanager
def made_aside(target: Path, parent: Path | None = None) -> Iterator[Aside]:
    """Make an empty folder for what shall become `target`; what is left of it in the end is removed.

    Args:
        target: the place that it is for; remains of killed runs for the same place are cleared.
        parent: the folder that it is made in; by default the target's own.

    Raises:
        OSError: the parent cannot be written.
    """
    parent = target.parent if parent is None else parent
    _clear(target, parent)
    while True:
        path = _named(target, parent, _UNFINISHED)
        path.mkdir()
        lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
        _try_lock(lock)
        if path.exists():  # else another run has cleared it before it was locked
            break
        os.close(lock)
    try:
        yield Aside(path, lock)
    finally:
        remove(path)
        os.close(lock)


@contextmanager
def filled(
    out: Path,
    *,
    commit: Callable[[], AbstractContextManager[None]] = nullcontext,
    made: Callable[[Path], None] = lambda path: None,
    outdated: Callable[[Path], set[Path]] = lambda out: set(),
) -> Iterator[Path]:
    """Lend an empty folder; when the block ends without an error, `out` holds what is in it, all at once.

    Other files of `out` stay, but for the outdated ones. A folder that holds other folders, is a mount point, or is the current one or
    around it, keeps its place: there the files are moved one by one, and back again if that fails.

    Args:
        out: folder that shall hold the results; it and its parents are created on success.
        commit: makes the block in which the results are moved.
        made: called with the lent folder.
        outdated: files of `out`, relative to it, that go even if no new one takes their place; asked when all new ones are there.

    Yields:
        The folder to write into, on the same file system as `out`.

    Raises:
        OSError: `out` or what is around it cannot be written, or there is no room.
    """
    out = Path(os.path.realpath(out))
    parent = next(path for path in (out.parent, *out.parents) if os.path.lexists(path))
    stays = out.is_dir() and (os.path.ismount(out) or _is_around_here(out) or not os.access(parent, os.W_OK | os.X_OK))
    with made_aside(out, out if stays else parent) as aside:
        made(aside.path)
        yield aside.path
        _refuse_other_kinds(aside.path, out)
        gone = {file for file in outdated(out) if not os.path.lexists(aside.path / file)} if out.is_dir() else set()
        with commit():
            out.parent.mkdir(parents=True, exist_ok=True)
            if not out.exists():
                os.rename(aside.path, out)
            elif stays or _other_folders(aside.path, out):
                _move_files(aside.path, out, gone)
            else:
                _replace_folder(aside.path, out, gone)


def of_earlier_set(out: Path) -> set[Path]:
    """Files of a fit or diagnosis in a folder, relative to it; one that has been changed since is not of the set any more."""
    found = set()
    for name in STATING:
        try:
            files = read_json(out / name, "a set of results")["files"]
            listed = {Path(file): digest for file, digest in files.items() if file == Path(file).name}
        except (InputError, LookupError, TypeError, AttributeError):  # none there, or not one of ours
            continue
        plain = {file: digest for file, digest in listed.items() if (out / file).is_file() and not (out / file).is_symlink()}
        found |= {file for file, digest in plain.items() if hashlib.sha256((out / file).read_bytes()).hexdigest() == digest}
        found.add(Path(name))
    return found


def remove(path: Path) -> None:
    """Remove a folder; a thread that still writes under its name gets an error."""
    renamed = path.with_name(f"{path.name}-removed")
    with contextlib.suppress(OSError):
        path.rename(renamed)
    for place in (renamed, path):
        shutil.rmtree(place, ignore_errors=True)


def _named(target: Path, parent: Path, what: str) -> Path:
    return parent / f".{target.name}-{what}-{secrets.token_hex(4)}"


def _clear(target: Path, parent: Path) -> None:
    """Put back the folder that a killed run has moved away, and remove what such runs have left."""
    with contextlib.suppress(OSError):
        for name in os.listdir(parent):
            replaced = name.startswith(f".{target.name}-{_REPLACED}-")
            if replaced or name.startswith(f".{target.name}-{_UNFINISHED}-"):
                with contextlib.suppress(OSError):
                    lock = os.open(parent / name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
                    try:
                        if not _try_lock(lock):
                            continue
                        if replaced and not target.exists():
                            os.rename(parent / name, target)
                        else:
                            remove(parent / name)
                    finally:
                        os.close(lock)


def _try_lock(lock: int) -> bool:
    """Whether nobody else holds it."""
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True


def locked(path: Path, refusal: str) -> int:
    """The open file that holds the lock of a folder as long as the process lives; `InputError` with a refusal where another run has it."""
    lock = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(lock)
        raise InputError(refusal) from error
    return lock


def _is_around_here(out: Path) -> bool:
    """Whether somebody works in the folder, who would be left in one that is gone."""
    try:
        return Path.cwd().is_relative_to(out)
    except OSError:
        return False


def _refuse_other_kinds(source: Path, target: Path) -> None:
    """Before anything is moved: a folder in the place of a file, or a file in that of a folder."""
    for item in sorted(source.rglob("*")):
        there = target / item.relative_to(source)
        if there.exists() and there.is_dir() != item.is_dir():
            number = errno.EISDIR if there.is_dir() else errno.ENOTDIR
            raise OSError(number, os.strerror(number), str(there))


def _other_folders(source: Path, target: Path) -> bool:
    """Whether the old folder holds folders that the new one does not."""
    folders = (Path(where, name).relative_to(target) for where, names, _ in os.walk(target) for name in names)
    return any(not (source / folder).is_dir() or (target / folder).is_symlink() for folder in folders)


def _files(folder: Path) -> list[Path]:
    """Files below a folder, relative to it."""
    return sorted(Path(where, name).relative_to(folder) for where, _, names in os.walk(folder) for name in names)


def _replace_folder(aside: Path, out: Path, gone: set[Path]) -> None:
    """Put a complete folder in the place of the old one, with the rights and the other files of that one."""
    for file in _files(out):
        if file not in gone and not os.path.lexists(aside / file):
            try:
                os.link(out / file, aside / file, follow_symlinks=False)
            except OSError:  # a file system without links
                shutil.copy2(out / file, aside / file, follow_symlinks=False)
    for folder in (Path(), *(path.relative_to(aside) for path in aside.rglob("*") if path.is_dir())):
        with contextlib.suppress(OSError):
            shutil.copystat(out / folder, aside / folder)
            os.utime(aside / folder)
            os.chown(aside / folder, (out / folder).stat().st_uid, (out / folder).stat().st_gid)
    away = _named(out, out.parent, _REPLACED)
    lock = os.open(out, os.O_RDONLY | os.O_DIRECTORY)
    try:
        _try_lock(lock)  # so that no run which begins now takes the folder for that of a killed one
        try:
            os.rename(out, away)
        except OSError:  # such as a folder of another layer of a container's file system
            _move_files(aside, out, gone)
            return
        try:
            os.rename(aside, out)
        except OSError:
            if not out.exists():
                os.rename(away, out)
                raise
            _replace_folder(aside, out, gone)  # that of another run, which has ended since
        remove(away)
    finally:
        os.close(lock)


def _move_files(source: Path, target: Path, gone: set[Path]) -> None:
    """Move files one by one, and remove those that go; on an error everything is put back."""
    moved: list[tuple[Path, Path, bool]] = []
    with made_aside(target, source.parent) as old:
        try:
            for file in [*_files(source), *sorted(gone)]:
                place, kept = target / file, old.path / str(len(moved))
                place.parent.mkdir(parents=True, exist_ok=True)
                moved.append((place, kept, os.path.lexists(place)))
                if os.path.lexists(place):
                    os.rename(place, kept)
                if file not in gone:
                    os.rename(source / file, place)
            for folder in (path for path in source.rglob("*") if path.is_dir()):
                (target / folder.relative_to(source)).mkdir(parents=True, exist_ok=True)
        except BaseException:
            for place, kept, was_there in reversed(moved):
                if os.path.lexists(kept):
                    os.rename(kept, place)
                elif not was_there:
                    place.unlink(missing_ok=True)
            raise
