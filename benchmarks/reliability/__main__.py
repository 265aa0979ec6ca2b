"""`python -m benchmarks.reliability --inputs N --kills K --seed S --json FILE`: a campaign of damage, and what came of it.

Mutated inputs of every kind of file that the program reads, in processes that are given 20 s and 2 GB for each; commands killed, asked to
end and left without room while they replace results; every step of replacing a set, killed or failing; studies killed and resumed; damaged
stores. `--resume` goes on with the inputs that an earlier call with the same `--json` has read.
"""

import argparse
import json
import math
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
from benchmarks.reliability.page import write_page
from benchmarks.reliability.stores import UNNOTICED, damaged_stores
from benchmarks.reliability.trials import CONTAINED, OUTCOMES, campaign
from benchmarks.resumable import finished, lines_beside
from vibrojax.cli.environment import prepare_jax

_LIMITS = (0, 100, 2_000, 50_000)
"""Bytes."""


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    if options.page is not None:
        write_page(options.page, [json.loads(file.read_text(encoding="utf-8")) for file in options.figures])
        return
    console, begin = Console(highlight=False), time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="reliability-") as name:
        found, wrong = _inputs(options, Path(name), console)
        wrong += _disturbed(options, Path(name), found, console)
    found |= {"wrong": wrong, "options": {name: str(value) for name, value in vars(options).items()}}
    found |= {"seconds": round(time.perf_counter() - begin), "machine": machine()}
    for line in wrong:
        console.print(line, markup=False, soft_wrap=True)
    if options.json is not None:
        options.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    sys.exit(1 if wrong else 0)


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.reliability", description=(__doc__ or "").splitlines()[0])
    made.add_argument("--inputs", type=int, default=1000, metavar="N", help="mutated inputs over all kinds")
    made.add_argument(
        "--minutes", type=float, default=math.inf, metavar="M", help="after which no further inputs are read, and no command killed"
    )
    made.add_argument("--kills", type=int, default=12, metavar="K", help="kills of each command")
    made.add_argument("--studies", type=int, metavar="K", help="kills of studies; left out: as --kills")
    made.add_argument("--stores", type=int, metavar="K", help="damaged stores; left out: as --kills")
    made.add_argument(
        "--signal-seconds", type=float, default=0.0, metavar="S", help="ask commands to end for so long; left out: as often as --kills"
    )
    made.add_argument("--full-disks", type=int, default=len(_LIMITS), metavar="N", help="limits on the size of files, of each command")
    made.add_argument("--seed", type=int, default=1, metavar="S", help="of everything that is drawn")
    made.add_argument("--peers", type=int, default=0, metavar="N", help="mutated inputs of each kind that others read, read by them")
    made.add_argument("--commands", nargs="+", default=["fit", "simulate", "report"], metavar="NAME", help="that are disturbed")
    made.add_argument("--json", type=Path, metavar="FILE", help="where the figures go; a line for each block of inputs beside it")
    made.add_argument("--resume", action="store_true", help="keep the inputs that an earlier call has read")
    made.add_argument("--page", type=Path, metavar="FILE", help="run nothing: write the tables of this page, between its two marks")
    made.add_argument("--figures", type=Path, nargs="+", default=[], metavar="FILE", help="of earlier calls, for --page")
    return made


def _inputs(options: argparse.Namespace, folder: Path, console: Console) -> tuple[dict[str, Any], list[str]]:
    """Counts by name, and a line for everything that should not have been; inputs of every kind, then those that others read."""
    lines = folder / "blocks.jsonl" if options.json is None else lines_beside(options.json, resume=options.resume)
    until = time.monotonic() + 60.0 * options.minutes
    share = {False: (list(kinds()), -(-options.inputs // len(kinds()))), True: (list(peers()), options.peers)}
    for peer, (names, inputs) in share.items():
        place = folder / ("peers" if peer else "inputs")
        place.mkdir()
        for block in campaign(names, inputs, options.seed, place, lines, peer=peer, until=until):
            console.print(f"{block['block']}: {dict(block['counts'])} in {block['seconds']:.0f} s", markup=False)
    blocks = [one for one in finished(lines, "block").values() if one["seed"] == options.seed]
    found, total = gathered([one for one in blocks if not one["peer"]])
    by_peer, _ = gathered([one for one in blocks if one["peer"]])
    counts: dict[str, Any] = {"inputs": sum(total[name] for name in OUTCOMES), **{name: total[name] for name in (*OUTCOMES, CONTAINED)}}
    counts |= {"by_kind": found, "peers": by_peer, "input_revisions": sorted({one["revision"] for one in blocks if one["revision"]})}
    return counts, [line for one in blocks if not one["peer"] for line in one["wrong"]]


def gathered(blocks: list[dict[str, Any]]) -> tuple[dict[str, dict[str, Any]], Counter[str]]:
    """Blocks by kind: outcomes, inputs per second of the processor, the longest that one took; and the outcomes of all."""
    found: dict[str, dict[str, Any]] = {}
    for kind in dict.fromkeys(one["kind"] for one in blocks):
        own = [one for one in blocks if one["kind"] == kind]
        counts = sum((Counter(one["counts"]) for one in own), Counter())
        used = sum(one["cpu_seconds"] for one in own)
        read = sum(counts[name] for name in OUTCOMES)
        rate = {"per_cpu_second": round(read / used, 1) if used else None, "slowest_s": max(one["slowest"][0] for one in own)}
        found[kind] = {"inputs": read, **{name: counts[name] for name in (*OUTCOMES, CONTAINED)}, **rate}
    return found, sum((Counter(one["counts"]) for one in blocks), Counter())


def _disturbed(options: argparse.Namespace, folder: Path, found: dict[str, Any], console: Console) -> list[str]:
    """Everything but inputs; fills `found`."""
    found |= dict.fromkeys(("kills", "mixed_results", "resumed_identical", "damaged", "damage_unnoticed"), 0)
    studies, stores = (options.kills if each is None else each for each in (options.studies, options.stores))
    wrong: list[str] = []
    if options.kills or options.signal_seconds:
        wrong += _commands_disturbed(options, folder, found, console)
    if studies:
        wrong += _studies_killed(studies, options.seed, folder, found)
        console.print(f"studies resumed to the same bytes: {found['resumed_identical']} of {studies}")
    if stores:
        prepare_jax()
        outcomes, lost = damaged_stores(stores, options.seed, folder)
        found |= {"damaged": sum(outcomes.values()), "damage_unnoticed": outcomes[UNNOTICED], "stores": outcomes}
        console.print(f"damaged stores: {outcomes}")
        wrong += lost
    return wrong


def _commands_disturbed(options: argparse.Namespace, folder: Path, found: dict[str, Any], console: Console) -> list[str]:
    """Kills, requests to end, full disks, and every step of replacing a set."""
    rng = random.Random(options.seed)
    steps = subprocess.run([sys.executable, "-m", "benchmarks.reliability.result_sets"], capture_output=True, text=True, check=True)
    found["steps_of_writing"] = json.loads(steps.stdout)
    wrong = [f"steps of writing: {found['steps_of_writing']}"] if any(list(found["steps_of_writing"].values())[1:]) else []
    console.print(f"steps of writing: {found['steps_of_writing']}")
    commands, until = small_commands(folder, tuple(options.commands)), time.monotonic() + 60.0 * options.minutes
    found["killed"], lines = kills(commands, options.kills, rng, until=until, say=lambda line: console.print(line, markup=False))
    found["kills"] = sum(one["kills"] for one in found["killed"].values())
    found["mixed_results"] = sum(one["mixed"] for one in found["killed"].values()) + found["steps_of_writing"]["mixed"]
    found["requests_to_end"], more = requests(commands, 0 if options.signal_seconds else options.kills, rng, options.signal_seconds)
    console.print(f"asked to end: {found['requests_to_end']}")
    found["without_room"], most = without_room(commands, _LIMITS[: options.full_disks])
    console.print(f"without room: {found['without_room']}")
    return wrong + lines + more + most


def _studies_killed(kills_: int, seed: int, folder: Path, found: dict[str, Any]) -> list[str]:
    """Studies killed and resumed."""
    figures = folder / "resumed.json"
    command = [sys.executable, "-m", "benchmarks.resume", "--kills", str(kills_), "--seed", str(seed), "--json", str(figures)]
    done = subprocess.run(command, capture_output=True, text=True)
    rows = json.loads(figures.read_text(encoding="utf-8"))["kills"] if figures.exists() else []
    found["studies_killed"], found["resumed_identical"] = len(rows), sum(row["same_bytes"] for row in rows)
    found["studies_killed_between_tiles"] = sum(0 < row["tiles_done"] < row["tiles"] for row in rows)
    return [f"studies: {done.stdout[-300:]}{done.stderr[-300:]}"] if done.returncode else []


if __name__ == "__main__":
    main()
