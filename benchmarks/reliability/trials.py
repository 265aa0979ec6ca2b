"""Mutated inputs, one after the other in a process that is given 20 s and 2 GB for each."""

import gzip
import json
import logging
import os
import random
import resource
import select
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from benchmarks.reliability.inputs import kinds, peers
from benchmarks.reliability.mutations import mutated

SECONDS, MEMORY = 20, 2 * 2**30
REFUSED, ACCEPTED, TRACEBACK, CRASH, HANG = "refused", "accepted", "tracebacks", "crashes", "hangs"
OUTCOMES = (REFUSED, ACCEPTED, TRACEBACK, CRASH, HANG)
"""The last: more than 20 s or 2 GB."""


def outcome(kind: str, number: int, seed: int, folder: Path, *, peer: bool = False) -> tuple[str, str]:
    """What becomes of one mutated input, and the message or the error.

    Args:
        kind: a key of `kinds`.
        number: of the input; with the seed it says what is changed.
        seed: of the campaign.
        folder: for the file; what is sound of the kind is kept there.
        peer: read it with what others read it with.
    """
    from identification.experiment import ExperimentError
    from vibrojax.errors import InputError

    one = kinds()[kind]
    sound = folder / "sound"
    if not (sound / one.name).exists():
        sound.mkdir(exist_ok=True)
        one.write(sound / one.name)
        for beside in sound.iterdir():
            (folder / beside.name).write_bytes(beside.read_bytes())
    rng = random.Random(f"{seed} {kind} {number}")
    (folder / one.name).write_bytes(_changed((sound / one.name).read_bytes(), rng, packed=one.name.endswith(".gz")))
    try:
        (peers()[kind] if peer else one.use)(folder / one.name)
    except (ExperimentError, InputError) as error:
        return REFUSED, str(error)
    except MemoryError as error:
        return HANG, f"MemoryError: {error}"
    except Exception as error:
        return (REFUSED if peer else TRACEBACK), f"{type(error).__name__}: {error}"[:300]
    return ACCEPTED, ""


def _changed(content: bytes, rng: random.Random, *, packed: bool) -> bytes:
    """A mutated file; of a packed one half the time what is in it."""
    if packed and rng.random() < 0.5:
        return gzip.compress(mutated(gzip.decompress(content), rng), mtime=0)
    return mutated(content, rng)


def main() -> None:
    """Say what became of inputs BEGIN to END, a line of JSON for each."""
    kind, begin, end, seed, peer = sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), sys.argv[5] == "peer"
    logging.disable()
    said = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
    from vibrojax.cli.environment import prepare_jax

    prepare_jax()
    with tempfile.TemporaryDirectory(prefix="trials-") as folder:
        outcome(kind, -1, seed, Path(folder), peer=peer)  # imports everything
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        limit = pages * resource.getpagesize() + MEMORY
        resource.setrlimit(resource.RLIMIT_AS, (limit, resource.RLIM_INFINITY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        print(json.dumps(["ready"]), file=said)
        for number in range(begin, end):
            print(json.dumps([number, *outcome(kind, number, seed, Path(folder), peer=peer)]), file=said)


def campaign(kind: str, inputs: int, seed: int, *, peer: bool = False) -> tuple[Counter[str], list[str]]:
    """Outcomes of so many inputs of a kind, and a line for each that should not have been."""
    counts: Counter[str] = Counter()
    wrong: list[str] = []
    begin = 0
    while begin < inputs:
        for number, what, text in _answers(kind, begin, inputs, seed, peer):
            counts[what] += 1
            if what in (TRACEBACK, CRASH, HANG):
                wrong.append(f"{kind} {number} of seed {seed}: {what}: {text}")
            begin = number + 1
    return counts, wrong


def _answers(kind: str, begin: int, end: int, seed: int, peer: bool) -> Iterator[tuple[int, str, str]]:
    """From one process, as long as it lives."""
    command = [sys.executable, "-m", "benchmarks.reliability.trials", kind, str(begin), str(end), str(seed), "peer" if peer else "own"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, bufsize=0)
    assert process.stdout is not None
    try:
        if not process.stdout.readline():
            raise RuntimeError(f"{' '.join(command)} does not start")
        for number in range(begin, end):
            if not select.select([process.stdout], [], [], SECONDS)[0]:
                yield number, HANG, f"more than {SECONDS} s"
                return
            if not (line := process.stdout.readline()):
                yield number, CRASH, f"exit status {process.wait()}"
                return
            yield tuple(json.loads(line))
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


if __name__ == "__main__":
    main()
