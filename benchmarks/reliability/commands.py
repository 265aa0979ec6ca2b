"""Commands that are killed, asked to end or left without room, while they replace an earlier set of results."""

import itertools
import math
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from benchmarks.reliability.forks import Send, Work, ended, started
from benchmarks.reliability.inputs import kinds
from benchmarks.reliability.own_files import RUN
from vibrojax.aside import STATING

_OLD = "old"
PATIENCE = 2.0
"""s between a request and the end of the process."""


class Command:
    """A command with an earlier set of results, in a folder of its own."""

    def __init__(self, name: str, arguments: list[str], folder: Path) -> None:
        """Run it once, undisturbed: its files are the set, its seconds those from which moments are drawn."""
        self.name, self.folder, self.out = name, folder, folder / "out"
        self.arguments = [*arguments, "--out", "out", "--quiet"]
        begin = time.perf_counter()
        done = subprocess.run(self.command, cwd=folder, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{name}: {done.stderr}")
        self.seconds = time.perf_counter() - begin
        written = sorted((path.stat().st_mtime_ns, str(path.relative_to(self.out))) for path in self.out.rglob("*") if path.is_file())
        self.files = sorted(name for _, name in written)
        self.last = [name for _, name in written if name not in STATING][-1]  # those are written first, and once more in the end

    @property
    def command(self) -> list[str]:
        """As a process is started with it."""
        return [sys.executable, "-c", RUN, *self.arguments]

    def begun(self) -> None:
        """Put an old set where the results go."""
        shutil.rmtree(self.out, ignore_errors=True)
        for name in self.files:
            (self.out / name).parent.mkdir(parents=True, exist_ok=True)
            (self.out / name).write_text(_OLD)

    def is_one_set(self) -> bool:
        """Whether all files are of the old set, or none; a folder that the next run puts back counts."""
        if not self.out.exists():
            return any(name.startswith(".out-replaced-") for name in self.remains())
        try:
            old = {(self.out / name).read_bytes() == _OLD.encode() for name in self.files}
        except OSError:
            return False
        return len(old) == 1

    def has_last_file(self) -> bool:
        """Whether the process has begun the file that it writes last."""
        return any((self.folder / name / self.last).exists() for name in self.remains())

    def is_old(self) -> bool:
        """Whether the old set is as it was, with nothing beside it."""
        return all((self.out / name).read_bytes() == _OLD.encode() for name in self.files) and not self.remains()

    def remains(self) -> list[str]:
        """What the process has left beside the results."""
        return [name for name in os.listdir(self.folder) if name.startswith(".out-")]

    @contextmanager
    def started(self, limit: int | None = None) -> Iterator[subprocess.Popen[str]]:
        """The process, with a limit on the size of files, bytes."""

        def prepared() -> None:
            signal.signal(signal.SIGINT, signal.default_int_handler)
            if limit is not None:
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

        process = subprocess.Popen(self.command, cwd=self.folder, stderr=subprocess.PIPE, text=True, preexec_fn=prepared)
        try:
            yield process
        finally:
            process.kill()
            process.wait()


def small_commands(folder: Path, names: tuple[str, ...]) -> list[Command]:
    """Some of fit, diagnose, report, simulate and peterka, each on a small rig."""
    made = []
    for name in names:
        place = folder / name
        place.mkdir()
        kinds()["model.json"].write(place / "model.json")
        kinds()["experiment"].write(place / "experiment.toml")
        if name == "report":
            subprocess.run([sys.executable, "-c", RUN, "fit", "experiment.toml", "--out", ".", "--quiet"], cwd=place, check=True)
        arguments = {
            "fit": ["fit", "experiment.toml"],
            "diagnose": ["diagnose", "experiment.toml", "--only", "coulomb_friction"],
            "report": ["report", "."],
            "simulate": ["simulate", "--model", "model.json", "--experiment", "experiment.toml"],
            "peterka": "peterka --model model.json --base-amplitude 2e-3 --sweep 1:3:12 --sweep clearance=0.2:1:6 --cycles 20".split(),
        }[name]
        made.append(Command(name, arguments, place))
    return made


def _whole(arguments: list[str], send: Send) -> None:
    """A command from its first line on."""
    from vibrojax.cli.main import main

    sys.argv = ["vibrojax", *arguments]
    send("begun")
    main()


def _written(arguments: list[str], send: Send) -> None:
    """A command from where its result is known: that of `saved`, which is drawn and written anew."""
    from identification.commands.run import write_diagnosed, write_fit
    from identification.diagnosis.files import StoredDiagnosis, stored_diagnosis
    from identification.result.files import stored_fit
    from identification.result.store import read_stored
    from vibrojax.aside import of_earlier_set
    from vibrojax.cli.output import output_folder

    builders: dict[str, Any] = {"fit": stored_fit, "diagnosis": stored_diagnosis}
    stored = read_stored(Path("saved/result.nc"), builders)
    send("begun")
    with output_folder(Path("out"), outdated=of_earlier_set) as folder:
        if isinstance(stored, StoredDiagnosis):
            write_diagnosed(stored.diagnosis, folder)
        else:
            write_fit(stored.result, folder, stored.reference)


def kills(
    commands: list[Command], count: int, rng: random.Random, *, until: float = math.inf, say: Callable[[str], None] = lambda line: None
) -> tuple[dict[str, dict[str, int]], list[str]]:
    """Kill each so often, in turn: somewhere in the whole command; while a known result is written; and when its last file is there.

    A command without a `result.nc` has no known result: it runs whole. Every moment is drawn; none comes after `until` of `time.monotonic`.
    """
    names = ("kills", "while_computing", "too_late", "mixed", "remains_not_cleared")
    commands = commands if count else []
    found: dict[str, dict[str, int]] = {command.name: dict.fromkeys(names, 0) for command in commands}
    wrong: list[str] = []
    works: dict[str, tuple[Work, ...]] = {each.name: (_whole, _written, _written) if _saved(each) else (_whole,) for each in commands}
    seconds = {(each.name, work): _run(each, work) for each in commands for work in dict.fromkeys(works[each.name])}
    for number, command in itertools.product(range(count), commands):
        if time.monotonic() > until:
            break
        counts, work = found[command.name], works[command.name][number % len(works[command.name])]
        last = number % 3 == 2
        command.begun()
        moment = seconds[command.name, work][last] * rng.uniform(0.0, 1.0)
        killed, wrote = _kill(command, work, moment, last=last)
        counts["kills" if killed else "too_late"] += 1
        counts["while_computing"] += killed and not wrote
        if not command.is_one_set():
            counts["mixed"] += 1
            wrong.append(f"{command.name}, {work.__name__}, killed after {moment:.3f} s: two sets are mixed")
        if not killed and command.is_old():
            wrong.append(f"{command.name}, {work.__name__}: ended by itself and wrote nothing")
    for command in commands:
        subprocess.run(command.command, cwd=command.folder, capture_output=True)
        found[command.name]["remains_not_cleared"] += bool(command.remains())
        wrong += [f"{command.name}: the next run leaves {command.remains()}"] if command.remains() else []
        say(f"killed: {command.name}: {found[command.name]}")
    return found, wrong


def _saved(command: Command) -> bool:
    """Keep the result of the undisturbed run."""
    if command.name not in ("fit", "diagnose"):
        return False
    (command.folder / "saved").mkdir()
    shutil.copyfile(command.out / "result.nc", command.folder / "saved" / "result.nc")
    return True


def _run(command: Command, work: Work) -> tuple[float, float]:
    """Seconds of an undisturbed fork, and those of them after its last file has appeared."""
    process, line = started(work, (command.arguments,), command.folder)
    line.recv()
    begin = time.perf_counter()
    while process.is_alive() and not command.has_last_file():
        time.sleep(0.001)
    last = time.perf_counter()
    process.join()
    ended(process, line)
    if process.exitcode != 0:
        raise RuntimeError(f"{command.name}, {work.__name__}: exit status {process.exitcode}")
    return time.perf_counter() - begin, time.perf_counter() - last


def _kill(command: Command, work: Work, moment: float, *, last: bool) -> tuple[bool, bool]:
    """Kill a fork so many seconds after it has begun, or after the last of its files has appeared.

    Returns:
        Whether it was killed before its end, and whether it had begun to write.
    """
    process, line = started(work, (command.arguments,), command.folder)
    line.recv()
    while last and process.is_alive() and not command.has_last_file():
        time.sleep(0.001)
    process.join(moment)
    wrote = any(any((command.folder / name).iterdir()) for name in command.remains() if (command.folder / name).is_dir())
    ended(process, line)
    return process.exitcode == -signal.SIGKILL, wrote


def requests(commands: list[Command], count: int, rng: random.Random, seconds: float = 0.0) -> tuple[dict[str, Any], list[str]]:
    """Ask them to end at random moments, with one of three signals; so often, and for so many seconds at least."""
    found: dict[str, Any] = {"signals": 0, "after_the_end": 0, "late": 0, "other_status": 0, "said_something": 0, "left_something": 0}
    wrong, longest, start = [], 0.0, time.monotonic()
    for number in itertools.count():
        if number >= count and time.monotonic() - start >= seconds:
            break
        command = commands[number % len(commands)]
        command.begun()
        moment, what = rng.uniform(0.3, command.seconds), rng.choice((signal.SIGINT, signal.SIGTERM, signal.SIGHUP))
        with command.started() as process:
            try:
                process.wait(moment)
            except subprocess.TimeoutExpired:
                process.send_signal(what)
            begin = time.perf_counter()
            said = process.communicate()[1]
            took = time.perf_counter() - begin
        if process.returncode == 0:
            found["after_the_end"] += 1
            continue
        found["signals"] += 1
        longest = max(longest, took)
        bad = {"late": took > PATIENCE, "other_status": process.returncode != 130, "said_something": said != ""}
        bad["left_something"] = not command.is_one_set() or bool(command.remains())
        for name, is_so in bad.items():
            found[name] += is_so
        if any(bad.values()):
            wrong.append(
                f"{command.name}: {what.name} after {moment:.3f} s: status {process.returncode} after {took:.2f} s: {said[-300:]!r}"
            )
    return found | {"longest_s": round(longest, 3), "seconds": round(time.monotonic() - start)}, wrong


def without_room(commands: list[Command], limits: tuple[int, ...]) -> tuple[dict[str, int], list[str]]:
    """Let no file grow beyond a limit: one line, status 2, and the old set as it was."""
    found, wrong = {"attempts": 0, "not_one_line": 0, "changed": 0}, []
    for command in commands:
        for limit in limits:
            command.begun()
            with command.started(limit) as process:
                said = process.communicate()[1]
            if process.returncode == 0:
                continue
            found["attempts"] += 1
            plain = process.returncode == 2 and said.startswith("error: ") and said.count("\n") == 1
            found["not_one_line"] += not plain
            found["changed"] += not command.is_old()
            if not plain or not command.is_old():
                wrong.append(f"{command.name}, files of {limit} bytes at most: status {process.returncode}: {said[-300:]!r}")
    return found, wrong
