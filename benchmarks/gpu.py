"""`python -m benchmarks.gpu --json FILE`: a frequency sweep of many lanes on JAX's default device, in float64 and float32.

The soft and the stiff rig of `benchmarks.sweep`, every cycle integrated. Speed: lanes times cycles a second, the faster of two runs. Error:
distance of the last section point from a float64 reference with 160 contact steps, over the base amplitude, of the lanes whose orbit has
closed. Without a GPU the same command runs on the processor.
"""

import argparse
import dataclasses
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from benchmarks.sweep.problem import PROBLEMS, Problem, Reference, error

PRECISIONS = ("float64", "float32")
_REFERENCE_STEPS = 160.0
_CLOSED = 1e-8
"""Change from cycle to cycle, over the base amplitude, of an orbit that has closed."""


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    if options.precision is not None:
        options.json.write_text(json.dumps(measured(options)), encoding="utf-8")
        return
    with tempfile.TemporaryDirectory(prefix="gpu-") as name:
        found = {precision: _in_its_own_process(precision, options, Path(name)) for precision in PRECISIONS}
    options.json.write_text(json.dumps({"precisions": found, "machine": machine()}, indent=1) + "\n", encoding="utf-8")
    show(found)


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.gpu", description=(__doc__ or "").splitlines()[0])
    made.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    made.add_argument("--lanes", type=int, nargs="+", default=[10_000, 100_000, 1_000_000], metavar="N", help="frequencies")
    made.add_argument("--cycles", type=int, default=100, metavar="N", help="of the excitation")
    made.add_argument("--checked", type=int, default=1000, metavar="N", help="lanes whose error is measured")
    made.add_argument("--chunk", type=int, metavar="N", help="lanes side by side, as `integrate` has them by default")
    made.add_argument("--precision", choices=PRECISIONS, help=argparse.SUPPRESS)
    made.add_argument("--reference", type=Path, help=argparse.SUPPRESS)
    return made


def _in_its_own_process(precision: str, options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Figures of one precision, which JAX chooses when it starts; float64 comes first and leaves the reference in the folder."""
    out = folder / f"{precision}.json"
    command = [sys.executable, "-m", "benchmarks.gpu", "--precision", precision, "--json", str(out), "--reference", str(folder)]
    command += ["--cycles", str(options.cycles), "--checked", str(options.checked), "--lanes", *map(str, options.lanes)]
    command += [] if options.chunk is None else ["--chunk", str(options.chunk)]
    status = subprocess.run(command, check=False, env=os.environ | {"JAX_ENABLE_X64": str(int(precision == "float64"))}).returncode
    if status:
        sys.exit(status)
    return json.loads(out.read_text(encoding="utf-8"))


def measured(options: argparse.Namespace) -> dict[str, Any]:
    """Speed and error of every problem in the precision of this process."""
    import jax

    device = jax.devices()[0]
    found: dict[str, Any] = {"device": device.device_kind, "platform": device.platform, "problems": {}}
    for name, problem in PROBLEMS.items():
        few = dataclasses.replace(problem, lanes=options.checked, cycles=options.cycles)
        file = options.reference / f"{name}.npz"
        if not file.exists():
            last, closed = _sections(few, options.chunk, steps=_REFERENCE_STEPS)
            if not closed.any():
                raise SystemExit(f"{name}: none of {few.lanes} orbits has closed after {few.cycles} cycles: ask for more of either")
            np.savez(file, u=last, periodic=closed)
        with np.load(file) as kept:
            truth = Reference(u=kept["u"], periodic=kept["periodic"])
        miss = error(few, truth, _sections(few, options.chunk)[0])
        speed = {}
        for lanes in options.lanes:
            many = dataclasses.replace(problem, lanes=lanes, cycles=options.cycles)
            speed[lanes] = lanes * options.cycles / min(_seconds(many, options.chunk) for _ in range(2))
        found["problems"][name] = {"error": miss, "lane_cycles_per_second": speed}
    return found


def _run(problem: Problem, chunk: int | None, steps: float | None = None) -> Any:
    from vibrojax.batch import ExactFlight, Span, grid, integrate

    points = grid({"frequency_hz": problem.frequencies}, base_amplitude=problem.base_amplitude, gap=problem.gap)
    engine = ExactFlight() if steps is None else ExactFlight(contact_steps=steps)
    span = Span(transient=problem.cycles - 5, recorded=5, closed=None)
    return integrate(problem.model, points, span=span, engine=engine, chunk=chunk)


def _sections(problem: Problem, chunk: int | None, steps: float | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Last section displacement of every lane, m, and whether its orbit has closed."""
    u = np.asarray(_run(problem, chunk, steps).u, float)
    back = np.abs(u[:, :-1] - u[:, -1:]) < _CLOSED * problem.base_amplitude
    return u[:, -1], np.asarray(back.any(axis=1))


def _seconds(problem: Problem, chunk: int | None) -> float:
    return float(_run(problem, chunk).seconds)


def show(found: dict[str, Any]) -> None:
    """The figures as a table."""
    table = Table("precision", "device", "problem", "error, median", "error, 90 %", "lanes", "lane-cycles a second")
    for precision, one in found.items():
        for name, each in one["problems"].items():
            for lanes, speed in each["lane_cycles_per_second"].items():
                miss = each["error"]
                row = (precision, one["device"], name, f"{miss['median']:.1e}", f"{miss['quantile90']:.1e}", lanes, f"{speed:.3g}")
                table.add_row(*map(str, row))
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
