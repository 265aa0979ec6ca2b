"""`python -m benchmarks.reliability --inputs N --kills K --seed S --json FILE`: a campaign of damage, and what came of it.

Mutated inputs of every kind of file that the program reads, in processes that are given 20 s and 2 GB for each; commands killed, asked to
end and left without room while they replace results; every step of replacing a set, killed or failing; studies killed and resumed; damaged
stores.
"""

import argparse
import json
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from rich.console import Console

from benchmarks.machine import machine
from benchmarks.reliability.commands import kills, requests, small_commands, without_room
from benchmarks.reliability.inputs import kinds, peers
from benchmarks.reliability.stores import UNNOTICED, damaged_stores
from benchmarks.reliability.trials import OUTCOMES, campaign
from vibrojax.cli.environment import prepare_jax

_LIMITS = (0, 100, 2_000, 50_000)
"""Bytes."""


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.reliability", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--inputs", type=int, default=1000, metavar="N", help="mutated inputs over all kinds")
    parser.add_argument(
        "--kills", type=int, default=12, metavar="K", help="kills of commands; as many of studies, requests and damaged stores"
    )
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of everything that is drawn")
    parser.add_argument("--peers", type=int, default=0, metavar="N", help="mutated inputs of each kind that others read, read by them")
    parser.add_argument("--commands", nargs="+", default=["fit", "simulate", "report"], metavar="NAME", help="that are disturbed")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where the figures go")
    options = parser.parse_args()
    console, begin = Console(highlight=False), time.perf_counter()
    found, wrong = figures(options, console)
    found |= {"wrong": wrong, "options": {name: str(value) for name, value in vars(options).items()}}
    found |= {"seconds": round(time.perf_counter() - begin), "machine": machine()}
    for line in wrong:
        console.print(line, markup=False, soft_wrap=True)
    if options.json is not None:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    sys.exit(1 if wrong else 0)


def figures(options: argparse.Namespace, console: Console) -> tuple[dict[str, Any], list[str]]:
    """Counts by name, and a line for everything that should not have been."""
    rng, wrong = random.Random(options.seed), []
    by_kind: dict[str, dict[str, int]] = {}
    for kind in kinds():
        counts, lines = campaign(kind, -(-options.inputs // len(kinds())), options.seed)
        by_kind[kind], wrong = dict(counts), wrong + lines
        console.print(f"{kind}: {dict(counts)}")
    total = sum((Counter(each) for each in by_kind.values()), Counter())
    found: dict[str, Any] = {"inputs": total.total(), **{name: total[name] for name in OUTCOMES}, "by_kind": by_kind}
    found |= dict.fromkeys(("kills", "mixed_results", "resumed_identical", "damaged", "damage_unnoticed"), 0) | {"peers": {}}
    for kind in peers() if options.peers else ():
        found["peers"][kind] = dict(campaign(kind, options.peers, options.seed, peer=True)[0])
        console.print(f"{kind}, read by others: {found['peers'][kind]}")
    with tempfile.TemporaryDirectory(prefix="reliability-") as folder:
        lines = _disturbed(options, rng, Path(folder), found, console) if options.kills else []
    return found, wrong + lines


def _disturbed(options: argparse.Namespace, rng: random.Random, folder: Path, found: dict[str, Any], console: Console) -> list[str]:
    """Everything but inputs; fills `found`."""
    steps = subprocess.run([sys.executable, "-m", "benchmarks.reliability.result_sets"], capture_output=True, text=True, check=True)
    found["steps_of_writing"] = json.loads(steps.stdout)
    wrong = [f"steps of writing: {found['steps_of_writing']}"] if any(list(found["steps_of_writing"].values())[1:]) else []
    commands = small_commands(folder, tuple(options.commands))
    killed, lines = kills(commands, options.kills, rng)
    found |= killed
    found["mixed_results"] += found["steps_of_writing"]["mixed"]
    console.print(f"killed: {killed}")
    found["requests_to_end"], more = requests(commands, options.kills, rng)
    console.print(f"asked to end: {found['requests_to_end']}")
    found["without_room"], most = without_room(commands, _LIMITS)
    console.print(f"without room: {found['without_room']}")
    wrong += [*lines, *more, *most]
    resumed = folder / "resumed.json"
    command = [
        sys.executable,
        "-m",
        "benchmarks.resume",
        "--kills",
        str(options.kills),
        "--seed",
        str(options.seed),
        "--json",
        str(resumed),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    found["studies_killed"] = options.kills
    found["resumed_identical"] = json.loads(resumed.read_text(encoding="utf-8"))["same_bytes"] if resumed.exists() else 0
    wrong += [f"studies: {done.stdout[-300:]}{done.stderr[-300:]}"] if done.returncode else []
    console.print(f"studies resumed to the same bytes: {found['resumed_identical']} of {options.kills}")
    prepare_jax()
    stores, lost = damaged_stores(options.kills, options.seed, folder)
    found |= {"damaged": sum(stores.values()), "damage_unnoticed": stores[UNNOTICED], "stores": stores}
    console.print(f"damaged stores: {stores}")
    return wrong + lost


if __name__ == "__main__":
    main()
