"""Commands that are killed, asked to end or left without room, while they replace an earlier set of results."""

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from benchmarks.reliability.inputs import kinds

_OLD = "old"
_RUN = "from vibrojax.cli.main import main; main()"
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
        self.files = sorted(str(path.relative_to(self.out)) for path in self.out.rglob("*") if path.is_file())

    @property
    def command(self) -> list[str]:
        """As a process is started with it."""
        return [sys.executable, "-c", _RUN, *self.arguments]

    def begun(self) -> None:
        """Put an old set where the results go."""
        shutil.rmtree(self.out, ignore_errors=True)
        for name in self.files:
            (self.out / name).parent.mkdir(parents=True, exist_ok=True)
            (self.out / name).write_text(_OLD)

    def is_one_set(self) -> bool:
        """Whether all files are of the old set, or none."""
        try:
            old = {(self.out / name).read_bytes() == _OLD.encode() for name in self.files}
        except OSError:
            return False
        return len(old) == 1

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
            subprocess.run([sys.executable, "-c", _RUN, "fit", "experiment.toml", "--out", ".", "--quiet"], cwd=place, check=True)
        arguments = {
            "fit": ["fit", "experiment.toml"],
            "diagnose": ["diagnose", "experiment.toml"],
            "report": ["report", "."],
            "simulate": ["simulate", "--model", "model.json", "--experiment", "experiment.toml"],
            "peterka": "peterka --model model.json --base-amplitude 2e-3 --ratios 1:3:12 --clearances 0.2:1:6 --cycles 20".split(),
        }[name]
        made.append(Command(name, arguments, place))
    return made


def kills(commands: list[Command], count: int, rng: random.Random) -> tuple[dict[str, int], list[str]]:
    """Kill them at random moments; every second time near the end, where results are written."""
    found, wrong = {"kills": 0, "mixed_results": 0, "remains_not_cleared": 0}, []
    for number in range(count):
        command = commands[number % len(commands)]
        command.begun()
        moment = command.seconds * (rng.uniform(0.0, 1.0) if number // len(commands) % 2 else rng.uniform(0.8, 1.1))
        with command.started() as process:
            try:
                process.wait(moment)
            except subprocess.TimeoutExpired:
                process.kill()
            process.communicate()
        found["kills"] += process.returncode == -signal.SIGKILL
        if not command.is_one_set():
            found["mixed_results"] += 1
            wrong.append(f"{command.name} killed after {moment:.3f} s: two sets are mixed")
    for command in commands:
        subprocess.run(command.command, cwd=command.folder, capture_output=True)
        found["remains_not_cleared"] += bool(command.remains())
    return found, wrong


def requests(commands: list[Command], count: int, rng: random.Random) -> tuple[dict[str, int], list[str]]:
    """Ask them to end at random moments, with one of three signals."""
    found, wrong = {"signals": 0, "after_the_end": 0, "late": 0, "other_status": 0, "said_something": 0, "left_something": 0}, []
    for number in range(count):
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
        bad = {"late": took > PATIENCE, "other_status": process.returncode != 130, "said_something": said != ""}
        bad["left_something"] = not command.is_one_set() or bool(command.remains())
        for name, is_so in bad.items():
            found[name] += is_so
        if any(bad.values()):
            wrong.append(
                f"{command.name}: {what.name} after {moment:.3f} s: status {process.returncode} after {took:.2f} s: {said[-300:]!r}"
            )
    return found, wrong


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
