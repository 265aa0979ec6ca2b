"""`python -m benchmarks.maps --json FILE`: cost of a Peterka map against its size, agreement with the switch model, memory against cycles.

Cost: maps of 100, 200 and 400 points a side, 300 cycles and 16 recorded, compiled before; orbits that have closed are integrated no
further. Agreement: `benchmarks.maps.agreement`, which may also be run, and resumed, alone. Memory: peak resident size of fresh processes
with 100 and 1000 cycles, all of them integrated.
"""

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

_MEMORY = """
from vibrojax.cli.environment import prepare_jax
prepare_jax()
from benchmarks.machine import peak_mb
from benchmarks.maps.cases import whole_map
whole_map(60, transient={cycles}, closed=None)
print(peak_mb())
"""


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.maps", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    parser.add_argument("--sizes", type=int, nargs="*", default=[100, 200, 400], help="points a side")
    parser.add_argument("--cycles", type=int, default=300, help="transient cycles")
    parser.add_argument("--check", type=int, default=100, help="points a side of the map that the switch model repeats; 0 leaves it out")
    options = parser.parse_args()
    prepare_jax()
    console = Console()
    report = {"cost": cost(options.sizes, options.cycles, console), "memory_mb": memory(console), "machine": machine()}
    if options.check:
        from benchmarks.maps.agreement import both_maps, compare

        report["agreement"] = compare(*both_maps(options.check, options.cycles))
        console.print(report["agreement"])
    options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")


def cost(sizes: list[int], cycles: int, console: Console) -> list[dict]:
    """Wall time of maps of several sizes: of the study, exponents of aperiodic motions included, and of its integration alone."""
    from benchmarks.maps.cases import AMPLITUDE, MODEL, plane, whole_map
    from vibrojax.batch import Span
    from vibrojax.studies import peterka

    def study(side: int) -> None:
        axes = plane(side)
        peterka(MODEL, clearance=axes["clearance"], ratio=axes["ratio"], base_amplitude=AMPLITUDE, span=Span(transient=cycles))

    whole_map(8, transient=cycles)
    study(32)
    table, rows = Table("map", "seconds", "microseconds a point", "mean cycles", "seconds of the integration"), []
    for size in sizes:
        begin = time.perf_counter()
        found = whole_map(size, transient=cycles)
        between = time.perf_counter()
        study(size)
        seconds, integration = time.perf_counter() - between, between - begin
        each, mean = 1e6 * seconds / size**2, float(found.cycles.mean())
        row = {
            "side": size,
            "seconds": seconds,
            "microseconds_a_point": each,
            "mean_cycles": mean,
            "seconds_of_the_integration": integration,
        }
        rows.append(row)
        table.add_row(f"{size} x {size}", f"{seconds:.2f}", f"{each:.0f}", f"{mean:.0f}", f"{integration:.2f}")
    console.print(table)
    return rows


def memory(console: Console) -> dict[str, float]:
    """Peak resident memory by cycles, 10^6 bytes."""
    found = {}
    for cycles in (100, 1000):
        done = subprocess.run([sys.executable, "-c", _MEMORY.format(cycles=cycles)], capture_output=True, text=True, check=True)
        found[str(cycles)] = float(done.stdout.split()[-1])
    console.print(f"peak memory, MB, by cycles: {found}")
    return found


if __name__ == "__main__":
    main()
