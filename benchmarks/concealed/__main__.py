"""`python -m benchmarks.concealed --null N --per-effect K --json FILE`: conceal effects in simulated experiments and count what is found.

Each case is one line of `FILE` with the suffix .jsonl, written as soon as it is done; with --resume those already there are kept,
except for failures and for cases drawn with other settings or budget. Baselines that they lack are added, without diagnosing anew.
"""

import argparse
import functools
import json
from pathlib import Path

from rich.console import Console

from benchmarks.concealed.jobs import SERIES, Draw, Job, jobs
from benchmarks.concealed.summary import summary
from benchmarks.concealed.table import effects_table, methods_table, time_table, verdicts_table
from benchmarks.concealed.trial import BASELINES, compared, trial, unanswered
from benchmarks.machine import machine
from benchmarks.resumable import finished, lines_beside, run_trials
from benchmarks.simulator import EFFECTS, UNREST
from benchmarks.simulator.case import WITHOUT

_BUDGET = 5.0
"""Minutes; of cases that an earlier version has written, too."""


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    draw = drawn(options)
    lines = lines_beside(options.json, resume=options.resume)
    wanted = jobs(draw)
    done = finished(lines, "key")
    each = functools.partial(trial, budget_minutes=options.budget_minutes, baselines=options.baselines)
    run_trials("cases", each, [job for job in wanted if not is_done(job, done, options.budget_minutes)], lines, workers=options.workers)
    trials = finished(lines, "key")
    lacking = [(job, trials[job.key]) for job in wanted if unanswered(options.baselines, trials[job.key])]
    if lacking:
        run_trials("baselines", functools.partial(compared, baselines=options.baselines), lacking, lines, workers=options.workers)
        trials = finished(lines, "key")
    result = summary([trials[job.key] for job in wanted])
    settings = {
        "series": draw.series,
        "seed": draw.seed,
        "noise": draw.noise,
        "channels": draw.channels,
        "driven": draw.driven,
        "unrest": draw.unrest,
    }
    document = result | {"settings": settings, "machine": machine()}
    options.json.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    console = Console()
    console.print(methods_table(result))
    console.print(verdicts_table(result))
    console.print(effects_table(result))
    console.print(time_table(result))
    for key, failure in result["failures"].items():
        console.print(f"  {key}: {failure}", markup=False)


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.concealed", description=(__doc__ or "").splitlines()[0])
    made.add_argument("--null", type=int, default=0, metavar="N", help="cases that conceal nothing")
    made.add_argument("--per-effect", type=int, default=0, metavar="K", help="cases of each listed effect")
    made.add_argument("--off-list", type=int, metavar="J", help="cases of each effect that is on no list; K if left out")
    made.add_argument("--pairs", type=int, default=0, metavar="P", help="cases with two listed effects")
    made.add_argument("--weak", type=float, nargs="+", default=[], metavar="S", help="K more of each listed effect at these strengths")
    made.add_argument("--effects", nargs="+", choices=list(EFFECTS), default=list(EFFECTS), metavar="NAME", help="only these")
    made.add_argument("--noise", type=float, nargs="+", default=[1.0], metavar="F", help="factors on the noise, in turn")
    made.add_argument("--channels", nargs="+", choices=list(WITHOUT), help="what is recorded, in turn")
    made.add_argument("--driven", type=int, nargs="+", choices=(1, 2, 3), default=[3], help="driven records, in turn")
    made.add_argument("--unrest", nargs="+", choices=UNREST, default=[], help="in every case: random force, coloured noise, scatter")
    made.add_argument(
        "--series", choices=list(SERIES), default="calibration", help="thresholds are set on the first, figures come from the second"
    )
    made.add_argument("--seed", type=int, default=0, help="of the series")
    made.add_argument("--budget-minutes", type=float, default=_BUDGET, help="of one diagnosis")
    simpler = made.add_mutually_exclusive_group()
    simpler.add_argument(
        "--baselines",
        nargs="+",
        choices=list(BASELINES),
        default=["bic", "sindy"],
        help="simpler methods to ask; grey_box takes minutes a case",
    )
    simpler.add_argument("--no-baselines", dest="baselines", action="store_const", const=[], help="leave them out")
    made.add_argument("--json", type=Path, required=True, metavar="FILE", help="where the figures go")
    made.add_argument("--workers", type=int, default=1, metavar="W", help="processes")
    made.add_argument("--resume", action="store_true", help="keep the cases that an earlier run has finished without failure")
    return made


def drawn(options: argparse.Namespace) -> Draw:
    """What the options ask for."""
    chosen = {"channels": tuple(options.channels)} if options.channels else {}
    return Draw(
        null=options.null,
        per_effect=options.per_effect,
        off_list=options.per_effect if options.off_list is None else options.off_list,
        pairs=options.pairs,
        weak=tuple(options.weak),
        effects=tuple(options.effects),
        noise=tuple(options.noise),
        driven=tuple(options.driven),
        unrest=tuple(options.unrest),
        series=options.series,
        seed=options.seed,
        **chosen,
    )


def is_done(job: Job, done: dict[str, dict], budget_minutes: float) -> bool:
    """Whether an earlier run has finished this very case; what failed is tried again."""
    found = done.get(job.key)
    if found is None or "failure" in found or found["job"] != json.loads(json.dumps(job.settings)):
        return False
    return found.get("budget_minutes", _BUDGET) == budget_minutes


if __name__ == "__main__":
    main()
