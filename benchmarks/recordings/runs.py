"""One recipe diagnosed by the command that a reader would type, in a process of its own."""

import dataclasses
import json
import os
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.machine import machine, revision
from identification.recipes.load import load_recipe

_FIGURES = "run.json"
_VIBROJAX = "from vibrojax.cli.main import main; main()"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Run:
    """What came of one recipe.

    Attributes:
        recipe: its name.
        folder: of the results.
        document: `diagnosis.json`; None where the command failed.
        failure: its last line then.
        seconds: wall time of the whole command; None, like the other two, where the command was called by hand.
        cpu_seconds: of all its threads.
        peak_mb: largest memory of the process, 10^6 bytes.
        budget_minutes: that it was allowed.
        revision: of the program.
    """

    recipe: str
    folder: Path
    document: dict | None
    failure: str
    seconds: float | None
    cpu_seconds: float | None
    peak_mb: float | None
    budget_minutes: float | None = None
    revision: str | None = None

    @property
    def named(self) -> set[str]:
        """Names of the effects that are asserted."""
        return {one["name"] for one in (self.document or {"effects": []})["effects"]}

    @property
    def stated(self) -> set[str]:
        """Names of the listed effects that the search ended with, which an *unlisted* verdict states without asserting them."""
        rows = (self.document or {}).get("considered")
        return set(rows[-1]["beside"]) if rows else set()


def finished(recipe: str, out: Path) -> Run | None:
    """What an earlier run has left, None where there is nothing, or where it failed."""
    folder = out / recipe
    if not (folder / _FIGURES).exists():
        return None
    figures = json.loads((folder / _FIGURES).read_text(encoding="utf-8"))
    document = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    figures = {name: figures.get(name) for name in ("seconds", "cpu_seconds", "peak_mb", "budget_minutes", "revision")}
    return Run(recipe=recipe, folder=folder, document=document, failure="", **figures)


def run(recipe: str, data: Path, out: Path, *, budget_minutes: float) -> Run:
    """Diagnose one recipe; a failure is a result too."""
    folder = out / recipe
    command = [sys.executable, "-c", _VIBROJAX, *arguments(recipe, data), "--budget-minutes", f"{budget_minutes:g}", "--out", str(folder)]
    out.mkdir(parents=True, exist_ok=True)
    log, before = out / f"{recipe}.txt", time.monotonic()
    with log.open("wb") as file:
        process = subprocess.Popen(command, stdout=file, stderr=subprocess.STDOUT)
        _, status, used = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    figures = {
        "seconds": time.monotonic() - before,
        "cpu_seconds": used.ru_utime + used.ru_stime,
        "peak_mb": used.ru_maxrss * 1024.0 / 1e6,
        "budget_minutes": budget_minutes,
        "revision": revision(),
    }
    if process.returncode:
        last = log.read_text(encoding="utf-8", errors="replace").strip().rsplit("\n", 1)[-1]
        return Run(recipe=recipe, folder=folder, document=None, failure=last, **figures)
    document = figures | {"machine": machine()}
    (folder / _FIGURES).write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    found = finished(recipe, out)
    assert found is not None
    return found


def arguments(recipe: str, data: Path | str) -> list[str]:
    """Of the command line, after its name."""
    return ["diagnose", "--recipe", recipe, "--data", str(Path(data) / load_recipe(recipe).data_folder)]
