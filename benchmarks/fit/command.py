"""The whole command in a fresh process: wall time and peak memory."""

import dataclasses
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

_COMMAND = "from vibrojax.cli.fit import main; main()"


@dataclasses.dataclass(frozen=True, kw_only=True)
class CommandRun:
    """One run of `fit-parameters`."""

    seconds: float
    processor_seconds: float
    """Of all cores."""
    peak_mb: float
    """Largest resident memory, 10^6 bytes."""
    chi_square: float
    """Over degrees of freedom."""


def cold_and_warm(experiment: Path | None, *, repeats: int) -> tuple[CommandRun, CommandRun]:
    """`fit-parameters` with an empty compilation cache, then the fastest of `repeats` with the cache that this has filled."""
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder) / "cache"
        cold = _run(experiment, cache, Path(folder) / "cold")
        warm = [_run(experiment, cache, Path(folder) / f"warm{number}") for number in range(repeats)]
    return cold, min(warm, key=lambda run: run.seconds)


def _run(experiment: Path | None, cache: Path, out: Path) -> CommandRun:
    environment = {name: value for name, value in os.environ.items() if name != "JAX_COMPILATION_CACHE_DIR"}
    arguments = [*([] if experiment is None else [str(experiment)]), "--out", str(out), "--quiet"]
    before = time.perf_counter()
    process = subprocess.Popen([sys.executable, "-c", _COMMAND, *arguments], env=environment | {"VIBROJAX_CACHE": str(cache)})
    _, status, usage = os.wait4(process.pid, 0)
    seconds = time.perf_counter() - before
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise RuntimeError(f"fit-parameters ended with exit status {process.returncode}")
    kilobyte = 1 if sys.platform == "darwin" else 1024
    fitted = json.loads((out / "fit.json").read_text(encoding="utf-8"))
    return CommandRun(
        seconds=seconds,
        processor_seconds=usage.ru_utime + usage.ru_stime,
        peak_mb=usage.ru_maxrss * kilobyte / 1e6,
        chi_square=fitted["chi2_reduced"],
    )
