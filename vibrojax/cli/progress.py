"""What a command says while it works: stages on standard error, results on standard output."""

import dataclasses
import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console, RenderableType
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar
from rich.text import Text

from vibrojax.cli.interrupt import at_end
from vibrojax.errors import WarningLine

Progress = Callable[[str], None]
_EVERY = 10.0
"""s between two lines in a log file."""
_LEAST_LEFT = 10.0
"""s; less time left is not said."""
_COUNT = re.compile(r"(?P<what>.*?)(?P<number>\d+) of (?P<all>\d+)\b")
_LONG = 900.0
"""s, over which the rate of experiments is averaged."""


@dataclasses.dataclass(frozen=True)
class Stages:
    """Called with each stage of the work; `show` prints results in between."""

    say: Progress
    show: Callable[[RenderableType], None]

    def __call__(self, stage: str) -> None:
        """Say what is done next."""
        self.say(stage)


class _TimeLeft:
    """How long the work still takes, by stages that say "4 of 13" when the fourth part begins."""

    def __init__(self) -> None:
        self._what, self._first, self._last, self._since = ("", ""), 0, 0, 0.0

    def after(self, stage: str) -> str:
        """The stage, with the seconds left where they are known and worth saying."""
        found = None if isinstance(stage, WarningLine) else _COUNT.match(stage)
        if found is None:
            return stage
        number, what, now = int(found["number"]), (found["what"], found["all"]), time.perf_counter()
        if what != self._what or number <= self._last:
            self._what, self._first, self._since = what, number, now
        self._last = number
        if number == self._first:
            return stage
        left = (int(found["all"]) + 1 - number) * (now - self._since) / (number - self._first)
        return f"{stage}, about {left:.0f} s left" if left > _LEAST_LEFT else stage


@contextmanager
def stages(*, quiet: bool, since: float | None = None) -> Iterator[Stages]:
    """A function to call with each stage of the work, which also prints results that are there before its end.

    On a terminal one line with a spinner is kept up to date, above which warnings stay; elsewhere (a log file) every stage gets its own
    line, with the seconds since the start, or since `since` of `time.perf_counter` where the work has begun before; a stage that counts
    ("4 of 13") says how long the rest takes. `quiet` says nothing.
    """
    left = _TimeLeft()
    console, start = Console(stderr=True, quiet=quiet, highlight=False), time.perf_counter() if since is None else since
    results = Console(quiet=quiet, highlight=False)
    if not console.is_terminal:

        def line(stage: str) -> None:
            console.print(f"{time.perf_counter() - start:7.1f} s  {left.after(stage)}", soft_wrap=True, markup=False)

        yield Stages(line, results.print)
        return
    with at_end(console.show_cursor), console.status("starting") as status:

        def said(stage: str) -> None:
            if isinstance(stage, WarningLine):
                console.print(stage, soft_wrap=True, markup=False)
            else:
                status.update(f"{escape(left.after(stage))}  [dim]({time.perf_counter() - start:.0f} s)[/dim]")

        def shown(result: RenderableType) -> None:
            status.stop()
            results.print(result)
            status.start()

        yield Stages(said, shown)


@contextmanager
def points_done(total: int, *, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """A function to call with the number of operating points done, and of those done before this run.

    On a terminal a bar with the rate of this run and the time left; elsewhere a line now and then.
    """
    console, start, said = Console(stderr=True, quiet=quiet, highlight=False), time.perf_counter(), [0.0]

    def line(done: int, before: int) -> None:
        seconds = time.perf_counter() - start
        if done < total and seconds - said[0] < _EVERY:
            return
        said[0] = seconds
        rate = (done - before) / seconds
        left = f"{(total - done) / rate:.0f} s left" if rate > 0 else "time left unknown"
        console.print(f"{seconds:7.1f} s  {done} of {total} operating points, {rate:.0f} a second, {left}", soft_wrap=True)

    if not console.is_terminal:
        yield line
        return
    columns = TextColumn("operating points"), BarColumn(), MofNCompleteColumn(), _Rate(), TimeRemainingColumn()
    with at_end(console.show_cursor), Bar(*columns, console=console, transient=True) as bar:
        task = bar.add_task("points", total=total)

        def shown(done: int, before: int) -> None:
            if before and not bar.tasks[0].completed:
                bar.reset(task, total=total, completed=before)
            bar.update(task, completed=done)

        yield shown


@contextmanager
def experiments_done(total: int, before: int, *, quiet: bool) -> Iterator[Callable[[str], None]]:
    """A function to call with a line on each experiment as it ends; `before` of the `total` had ended before this run.

    On a terminal a bar with the time left, above which warnings stay; elsewhere a line an experiment, with the time left.
    """
    console, start, done = Console(stderr=True, quiet=quiet, highlight=False), time.perf_counter(), before

    def line(said: str) -> None:
        nonlocal done
        done += 1
        seconds = time.perf_counter() - start
        left = seconds * (total - done) / (done - before)
        console.print(f"{seconds:7.1f} s  {done} of {total} experiments, {left:.0f} s left  {said}", soft_wrap=True, markup=False)

    if before:
        console.print(f"{before} of {total} experiments are done already", soft_wrap=True)
    if not console.is_terminal:
        yield line
        return
    columns = TextColumn("experiments"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}")
    bar = Bar(*columns, console=console, transient=True, speed_estimate_period=_LONG)
    with at_end(console.show_cursor), bar:
        task = bar.add_task("", total=total, completed=before)

        def shown(said: str) -> None:
            if isinstance(said, WarningLine):
                console.print(said, soft_wrap=True, markup=False)
            bar.update(task, advance=1, description=escape(said))

        yield shown


class _Rate(ProgressColumn):
    """Steps a second of late."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.speed:.0f}/s" if task.speed else "")
