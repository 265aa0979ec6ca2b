"""`python -m benchmarks.borders`: grazing and fold borders in two parameters beside brute force.

The borders of one branch of a compliant stop are followed in the plane of excitation frequency and gap. At points spread along each, the
rig starts on the border's own orbit, half a cell to either side in frequency, and runs until it settles (`vibrojax.batch`, exact flight, no
step shared with the continuation). A grazing is found where impacts go on for good on one side alone; a fold where the motions on both
sides settle far apart. Points at which another border lies within two cells are counted apart.
"""

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.machine import machine
from vibrojax.cli.environment import prepare_jax

MASS, ZETA, F_N, K_I, N, LAMBDA_I, AMPLITUDE, GAP = 1.0, 0.05, 5.0, 1e6, 1.5, 0.3, 1e-3, 3e-3
FREQUENCIES, GAPS = (4.0, 9.0), (1e-3, 6e-3)
_FAR = 0.3
"""Distance of section points over A0 and A0 omega beyond which two motions are not of one family."""


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.borders", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--points", type=int, default=900, help="looked for along all borders together; each stored one counts once")
    parser.add_argument("--cell", type=float, default=0.005, metavar="HZ", help="width of a cell in frequency")
    parser.add_argument("--cycles", type=int, default=2000, help="cycles after which a motion has settled")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    options = parser.parse_args()
    prepare_jax()
    console = Console()
    with console.status("following the borders"):
        found = _borders()
    rows = [row for one in found for row in compared(one, found, options, -(-options.points // len(found)))]
    table = Table("border", "points", "within a cell", "apart: another border near")
    for kind in dict.fromkeys(row["kind"] for row in rows):
        own = [row for row in rows if row["kind"] == kind]
        alone = [row for row in own if not row["crowded"]]
        table.add_row(kind, str(len(own)), f"{sum(row['found'] for row in alone)} of {len(alone)}", str(len(own) - len(alone)))
    console.print(table)
    good = all(row["found"] for row in rows if not row["crowded"])
    if options.json is not None:
        report = {"points": rows, "cell_hz": options.cell, "machine": machine()}
        options.json.write_text(json.dumps(report, indent=1) + "\n", encoding="utf-8")
    sys.exit(0 if good else 1)


def _borders() -> list[Any]:
    """The borders of the branch that begins without impact."""
    from vibrojax.continuation import Kind, find_orbit, follow, settle
    from vibrojax.continuation.border import borders

    rig = _rig(GAP, FREQUENCIES[0])
    state, cycles = settle(rig, np.zeros(2))
    branch = follow(find_orbit(rig, state, cycles=cycles), "frequency", FREQUENCIES)
    found, lost = borders(branch, "gap", (FREQUENCIES, GAPS))
    if any(one.kind not in (Kind.FOLD, Kind.GRAZING) or (one.kind is Kind.GRAZING and one.touches) for one in found):
        raise SystemExit("a border is neither a fold nor a grazing of the motion without impact, which alone are compared")
    if lost:
        raise SystemExit(f"not followed: {'; '.join(lost)}")
    return found


def _rig(gap: float, frequency: float) -> Any:
    from vibrojax.contact import HuntCrossley
    from vibrojax.continuation import ForcedRig
    from vibrojax.model import Model
    from vibrojax.suspension import Linear

    return ForcedRig(Model(MASS, Linear(ZETA, F_N), HuntCrossley(K_I, N, LAMBDA_I)), gap, AMPLITUDE, frequency)


def compared(one: Any, every: list[Any], options: argparse.Namespace, count: int) -> list[dict[str, Any]]:
    """Points spread along one border: whether the motion changes within a cell."""
    from vibrojax.batch import Points, Span, integrate

    length = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(one.first) / 5.0, np.diff(one.second) / 5e-3))])
    at = np.unique(np.searchsorted(length, np.linspace(0.0, length[-1], count + 2)[1:-1]))
    count = len(at)
    frequency, gap, state = one.first[at], one.second[at], one.states[at]
    values: dict[str, Any] = {
        "gap": np.tile(gap, 2),
        "base_amplitude": AMPLITUDE,
        "u0": np.tile(state[:, 0], 2),
        "v0": np.tile(state[:, 1], 2),
    }
    values["frequency_hz"] = np.concatenate([frequency - 0.5 * options.cell, frequency + 0.5 * options.cell])
    lanes = Points(coords={"lane": np.arange(2.0 * count)}, values=values)
    ran = integrate(_rig(GAP, 5.0).model, lanes, span=Span(transient=options.cycles, recorded=16))
    if one.kind.value.startswith("grazing"):
        low, high = np.any(ran.impacts > 0, axis=1).reshape(2, -1)
        found = low != high
    else:
        scale = AMPLITUDE * np.array([1.0, 2.0 * np.pi * F_N])
        low, high = (np.stack([ran.u, ran.v], axis=-1) / scale).reshape(2, count, -1, 2)
        found = np.max(np.abs(high - low), axis=(1, 2)) > _FAR
    crowded = np.array([_crowded(one, every, float(f), float(g), options.cell) for f, g in zip(frequency, gap, strict=True)])
    rows = zip(frequency, gap, found, crowded, strict=True)
    return [
        {"kind": one.kind.value, "frequency_hz": float(f), "gap_m": float(g), "found": bool(ok), "crowded": bool(near)}
        for f, g, ok, near in rows
    ]


def _crowded(one: Any, every: list[Any], frequency: float, gap: float, cell: float) -> bool:
    """Whether another border, or another part of this one, lies within two cells in frequency at the same gap."""
    near = 0  # its own crossing counts as one
    for other in every:
        crossings = np.flatnonzero(np.diff(other.second <= gap))
        for k in crossings:
            part = (gap - other.second[k]) / (other.second[k + 1] - other.second[k])
            near += bool(abs(other.first[k] + part * (other.first[k + 1] - other.first[k]) - frequency) < 2.0 * cell)
    return near > 1


if __name__ == "__main__":
    main()
