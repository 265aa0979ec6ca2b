"""Folders that appear whole: made beside their place under a name of their own, and moved there in one step.

A run holds a lock on the folder that it makes; one without a lock is what a killed run has left, and the next run removes it.
"""

import contextlib
import ctypes
import dataclasses
import errno
import fcntl
import hashlib
import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path

STATING = ("fit.json", "diagnosis.json")
"""Files that state, under "files", the SHA-256 of each other file of their set."""
_UNFINISHED, _REPLACED = "unfinished", "replaced"
_HERE, _EXCHANGE = -100, 2
"""Arguments of Linux's `renameat2`: paths as they are, and exchange."""
_NOT_KNOWN = (errno.ENOSYS, errno.EINVAL, errno.ENOTSUP)
_FOLDER_STAYS = (errno.EXDEV, errno.EBUSY, errno.EPERM, errno.EACCES)


@dataclasses.dataclass(frozen=True)
class Aside:
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
    around it, is not replaced as a whole: there the files are moved one by one, and back again if that fails.

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
    parking = next(path for path in (out.parent, *out.parents) if os.path.lexists(path))
    inside = out.is_dir() and (_must_stay(out) or not os.access(parking, os.W_OK | os.X_OK))
    with made_aside(out, out if inside else parking) as aside:
        made(aside.path)
        yield aside.path
        _refuse_other_kinds(aside.path, out)
        gone = {file for file in outdated(out) if not os.path.lexists(aside.path / file)} if out.is_dir() else set()
        with commit():
            out.parent.mkdir(parents=True, exist_ok=True)
            if not out.exists():
                os.rename(aside.path, out)
            elif inside or _other_folders(aside.path, out) or not _exchanged(aside.path, out, gone):
                _move(aside.path, out, gone)


def of_earlier_set(out: Path) -> set[Path]:
    """Files of a fit or diagnosis in a folder, relative to it; one that has been changed since is not of the set any more."""
    found = set()
    for name in STATING:
        try:
            files = json.loads((out / name).read_text(encoding="utf-8"))["files"]
            listed = {Path(file): digest for file, digest in files.items() if file == Path(file).name}
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError):  # none there, or not one of ours
            continue
        plain = {file: digest for file, digest in listed.items() if (out / file).is_file() and not (out / file).is_symlink()}
        found |= {file for file, digest in plain.items() if hashlib.sha256((out / file).read_bytes()).hexdigest() == digest}
        found.add(Path(name))
    return found


def remove(path: Path) -> None:
    """Remove a folder, also while a thread still writes into it."""
    for _ in range(3):
        if path.exists():
            shutil.rmtree(path, ignore_errors=True)


def _named(target: Path, parent: Path, what: str) -> Path:
    return parent / f".{target.name}-{what}-{secrets.token_hex(4)}"


def _clear(target: Path, parent: Path) -> None:
    """Put back the folder that a killed run has moved away, and remove what such runs have left."""
    with contextlib.suppress(OSError):
        for name in os.listdir(parent):
            if name.startswith(f".{target.name}-{_REPLACED}-") and not target.exists():
                os.rename(parent / name, target)
            elif name.startswith((f".{target.name}-{_UNFINISHED}-", f".{target.name}-{_REPLACED}-")):
                with contextlib.suppress(OSError):
                    lock = os.open(parent / name, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
                    try:
                        if _try_lock(lock):
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


def _must_stay(out: Path) -> bool:
    """Whether somebody would miss the folder itself: who works in it, or the system that has mounted it."""
    try:
        current = Path.cwd()
    except OSError:
        return os.path.ismount(out)
    return os.path.ismount(out) or current.is_relative_to(out)


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


def _exchanged(aside: Path, out: Path, gone: set[Path]) -> bool:
    """Put a complete folder in the place of the old one, other files of the old one included; False where a folder cannot be moved."""
    kept = [Path(where, name).relative_to(out) for where, _, names in os.walk(out) for name in names]
    for file in kept:
        if file not in gone and not os.path.lexists(aside / file):
            _linked(out / file, aside / file)
    for folder in (aside, *(path for path in aside.rglob("*") if path.is_dir())):
        _as_before(out / folder.relative_to(aside), folder)
    try:
        old = aside if _renamed_both(aside, out) else _renamed_in_turn(aside, out)
    except OSError as error:
        if error.errno in _FOLDER_STAYS:
            return False
        raise
    with contextlib.suppress(OSError):  # the results are in place
        for where, _, names in os.walk(old):  # a file that came while the others were linked
            for file in (Path(where, name).relative_to(old) for name in names):
                if file not in gone and not os.path.lexists(out / file):
                    os.rename(old / file, out / file)
    remove(old)
    return True


def _renamed_in_turn(aside: Path, out: Path) -> Path:
    """Move the old folder away and the new one to its place; where the old one then is. `_clear` mends what a kill in between leaves."""
    away = _named(out, out.parent, _REPLACED)
    os.rename(out, away)
    try:
        os.rename(aside, out)
    except OSError:
        os.rename(away, out)
        raise
    return away


def _as_before(old: Path, new: Path) -> None:
    """Give a folder the rights and the owner of the one that it replaces, where there was one."""
    with contextlib.suppress(OSError):
        shutil.copystat(old, new)
        os.utime(new)
        os.chown(new, old.stat().st_uid, old.stat().st_gid)


def _renamed_both(one: Path, other: Path) -> bool:
    """Exchange two folders in one step; False where the system or the file system does not know how."""
    try:
        rename = ctypes.CDLL(None, use_errno=True).renameat2
    except (OSError, AttributeError):
        return False
    if rename(_HERE, os.fsencode(one), _HERE, os.fsencode(other), _EXCHANGE) == 0:
        return True
    number = ctypes.get_errno()
    if number in _NOT_KNOWN:
        return False
    raise OSError(number, os.strerror(number), str(one), None, str(other))


def _linked(file: Path, name: Path) -> None:
    """One more name for a file, or a copy where there are no links."""
    try:
        os.link(file, name, follow_symlinks=False)
    except OSError:
        shutil.copy2(file, name, follow_symlinks=False)


def _move(source: Path, target: Path, gone: set[Path]) -> None:
    """Move files one by one, and remove those that go; on an error everything is put back."""
    back: list[tuple[Path, Path | None]] = []
    with made_aside(target, source.parent) as old:
        try:
            for item in sorted(path for path in source.rglob("*") if not path.is_dir()):
                place = target / item.relative_to(source)
                place.parent.mkdir(parents=True, exist_ok=True)
                kept = old.path / str(len(back)) if os.path.lexists(place) else None
                if kept is not None:
                    _linked(place, kept)
                back.append((place, kept))
                os.replace(item, place)
            for place in (target / file for file in sorted(gone) if os.path.lexists(target / file)):
                kept = old.path / str(len(back))
                _linked(place, kept)
                back.append((place, kept))
                os.unlink(place)
            for folder in (path for path in source.rglob("*") if path.is_dir()):
                (target / folder.relative_to(source)).mkdir(parents=True, exist_ok=True)
        except BaseException:
            for place, kept in reversed(back):
                if kept is not None:
                    os.replace(kept, place)
                else:
                    place.unlink(missing_ok=True)
            raise
