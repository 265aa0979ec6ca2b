"""Mutated inputs, many one after the other in a process that is given 20 s and 2 GB for each.

A server that has imported everything forks the process of each block. In most blocks it reads recorded files itself; what crashes, hangs or
raises there is read again as the program reads it, with compiled formats in a process of their own, and so is every twentieth block.
"""

import gzip
import json
import os
import random
import resource
import shutil
import time
import warnings
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

from benchmarks.machine import revision
from benchmarks.reliability.forks import Send, forked
from benchmarks.reliability.inputs import kinds, peers
from benchmarks.reliability.mutations import mutated
from benchmarks.resumable import finished

SECONDS, MEMORY = 20, 2 * 2**30
REFUSED, ACCEPTED, TRACEBACK, CRASH, HANG = "refused", "accepted", "tracebacks", "crashes", "hangs"
OUTCOMES = (REFUSED, ACCEPTED, TRACEBACK, CRASH, HANG)
"""The last: more than 20 s or 2 GB."""
WRONG = (TRACEBACK, CRASH, HANG)
CONTAINED = "contained"
"""Inputs on which a library crashed, hung or filled the memory, and the program did not."""
BLOCK, APART_BLOCKS = 200, 20
"""Inputs of a block; of so many blocks one is read as the program reads."""


class Reading(NamedTuple):
    """How inputs of a kind are read.

    Attributes:
        kind: a key of `kinds`.
        seed: of the campaign; with kind and number it says what is changed.
        peer: with what others read it with.
        apart: compiled formats in a process of their own, as the program does it.
    """

    kind: str
    seed: int
    peer: bool = False
    apart: bool = True


def outcome(reading: Reading, number: int, folder: Path) -> tuple[str, str]:
    """What becomes of one mutated input, and the message or the error.

    Args:
        reading: how it is read.
        number: of the input.
        folder: for the file; what is sound of the kind is kept there.
    """
    from vibrojax.errors import InputError

    one = kinds()[reading.kind]
    _put_damaged(reading, number, folder)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore" if reading.peer else "error", RuntimeWarning)  # one of NumPy's in a terminal is no message
            (peers()[reading.kind] if reading.peer else one.use)(folder / one.name)
    except InputError as error:
        return REFUSED, str(error)
    except MemoryError as error:
        return HANG, f"MemoryError: {error}"
    except Exception as error:
        return (REFUSED if reading.peer else TRACEBACK), f"{type(error).__name__}: {error}"[:300]
    return ACCEPTED, ""


def _put_damaged(reading: Reading, number: int, folder: Path) -> None:
    """Put a mutated file where the sound one is expected; of a folder one of its files is mutated."""
    one, sound = kinds()[reading.kind], folder / "sound"
    rng = random.Random(f"{reading.seed} {reading.kind} {number}")
    if not (sound / one.name).exists():
        make_sound(reading.kind, folder)
    if (sound / one.name).is_file():
        (folder / one.name).write_bytes(_changed((sound / one.name).read_bytes(), rng, packed=one.name.endswith(".gz")))
        return
    last = folder / "damaged"
    if last.exists():
        shutil.copyfile(sound / last.read_text(), folder / last.read_text())
    file = rng.choice(sorted(path.relative_to(sound) for path in (sound / one.name).rglob("*") if path.is_file()))
    last.write_text(str(file))
    (folder / file).write_bytes(mutated((sound / file).read_bytes(), rng))


def make_sound(kind: str, folder: Path) -> None:
    """Write a sound file of a kind, and what it needs beside it, into the folder and into `sound` there."""
    (folder / "sound").mkdir(parents=True, exist_ok=True)
    one = kinds()[kind]
    one.write(folder / "sound" / one.name)
    shutil.copytree(folder / "sound", folder, dirs_exist_ok=True)


def _changed(content: bytes, rng: random.Random, *, packed: bool) -> bytes:
    """A mutated file; of a packed one half the time what is in it."""
    if packed and rng.random() < 0.5:
        return gzip.compress(mutated(gzip.decompress(content), rng), mtime=0)
    return mutated(content, rng)


def read_block(reading: Reading, begin: int, end: int, folder: Path, send: Send) -> None:
    """Send the outcome of each input of a block, then the processor time of all; runs in a process of its own, which it limits."""
    import identification.experiment.readers as readers
    from identification.experiment.readers.apart import APART

    if not reading.apart:
        readers.APART = _InHere()  # type: ignore[assignment]
    outcome(reading, -1, folder)  # imports everything
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for number in range(begin, end):
        send((number, *outcome(reading, number, folder)))
    APART.close()
    used = os.times()
    send(used.user + used.system + used.children_user + used.children_system)


class _InHere:
    """Reads every file in the process that asks for it."""

    def read(self, path: Path, wanted: Any, file: str, kind: str) -> Any:
        """As `ReadingProcess.read`."""
        from identification.experiment.readers import read_here

        return read_here(path, wanted, file)


def _sound(kind: str, folder: Path, send: Send) -> None:
    make_sound(kind, folder)
    send(0.0)


def block(reading: Reading, begin: int, end: int, folder: Path, work: Callable[..., None] = read_block) -> dict[str, Any]:
    """Read a block of inputs, in as many processes as it takes.

    Args:
        reading: how they are read.
        begin: number of the first input.
        end: after the last.
        folder: for the kind; what is sound is made there first, where it is not.
        work: what reads them.

    Returns:
        `counts` by outcome, a line for each that is `wrong`, `seconds`, `cpu_seconds` and the `slowest` input with its seconds.
    """
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    start, used, slowest, place = time.perf_counter(), 0.0, (0.0, begin), begin
    while place < end:
        before = None
        for said in _until_lost(reading, place, end, folder, work):
            if isinstance(said, float):
                used += said
                break
            number, what, text = said
            now = time.perf_counter()
            slowest = max(slowest, (now - before, number)) if before is not None else slowest
            before, place = now, number + 1
            if what in WRONG and not reading.apart:
                again = block(reading._replace(apart=True), number, number + 1, folder, work)
                counts, wrong, used = counts + again["counts"], wrong + again["wrong"], used + again["cpu_seconds"]
                counts[CONTAINED] += what != TRACEBACK and not again["wrong"]
                continue
            counts[what] += 1
            wrong += [f"{reading.kind} {number} of seed {reading.seed}: {what}: {text}"] if what in WRONG else []
    seconds = {"seconds": round(time.perf_counter() - start, 3), "cpu_seconds": round(used, 3)}
    return {"counts": counts, "wrong": wrong, **seconds, "slowest": [round(slowest[0], 3), slowest[1]]}


def _until_lost(reading: Reading, begin: int, end: int, folder: Path, work: Callable[..., None]) -> Iterator[Any]:
    """Outcomes from one process as long as it lives, that of the input included with which it ends; last the processor time."""
    number = begin
    try:
        for said in forked(work, (reading, begin, end, folder), folder, SECONDS):
            if said is None:
                yield number, HANG, f"more than {SECONDS} s"
                return
            number = number if isinstance(said, float) else said[0] + 1
            yield said
    except (EOFError, ConnectionError):
        yield number, CRASH, "the process ended"


def campaign(
    names: list[str], inputs: int, seed: int, folder: Path, lines: Path, *, peer: bool = False, until: float = float("inf")
) -> Iterator[dict[str, Any]]:
    """Read so many inputs of each kind, a block of each kind in turn, and append a line for every block to a file.

    Args:
        names: of the kinds.
        inputs: of each.
        seed: of all.
        folder: for the files.
        lines: blocks that stand there are not read again.
        peer: read with what others read them with.
        until: instant of `time.monotonic` after which no block is begun.

    Yields:
        Each block as it is done: what `block` returns, with `kind`, `seed`, `peer`, `block` and `revision`.
    """
    done, now = finished(lines, "block"), revision()
    for number, begin in enumerate(range(0, inputs, BLOCK)):
        for kind in names:
            end = min(begin + BLOCK, inputs)
            name = f"{kind}{', read by others' if peer else ''}: {begin} to {end} of seed {seed}"
            if name in done:
                continue
            if time.monotonic() > until:
                return
            place = folder / kind
            if not place.exists():
                place.mkdir()
                list(_forked_once(kind, place))
            reading = Reading(kind=kind, seed=seed, peer=peer, apart=peer or number % APART_BLOCKS == 0)
            found = {"block": name, "kind": kind, "seed": seed, "peer": peer, "revision": now} | block(reading, begin, end, place)
            with lines.open("a", encoding="utf-8") as file:
                file.write(json.dumps(found) + "\n")
            yield found


def _forked_once(kind: str, folder: Path) -> Iterator[Any]:
    """Make what is sound of a kind, in a process that may compute and start threads."""
    for said in forked(_sound, (kind, folder), folder, 600.0):
        if said is None:
            raise RuntimeError(f"no sound {kind} after 10 minutes")
        yield said
        return
