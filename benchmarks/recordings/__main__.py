"""`python -m benchmarks.recordings --data DIR --out DIR`: diagnose the recordings one after another, and write the page about them.

What an earlier call has finished in `--out` with the same budget is kept; what failed is tried again. Each diagnosis is the command
`vibrojax diagnose --recipe` in a process of its own. The page shows all recipes finished there, whichever are named.
"""

import argparse
import json
from pathlib import Path

from benchmarks.machine import machine
from benchmarks.recordings.known import KNOWN
from benchmarks.recordings.page import row, said, write_page
from benchmarks.recordings.runs import finished, run


def main() -> None:
    """Command line."""
    options = parser().parse_args()
    if options.page is not None and not options.page.is_file():
        parser().error(f"--page {options.page} is no file: expected a page with the two marks between which the table is written")
    found = []
    for known in KNOWN:
        one = finished(known.recipe, options.out)
        wanted = not options.only_page and (not options.names or known.recipe in options.names)
        if wanted and (one is None or one.budget_minutes != options.budget_minutes):
            one = run(known.recipe, options.data, options.out, budget_minutes=options.budget_minutes)
        if one is not None:
            found.append((known, one))
            print(row(known, one), flush=True)
    if options.page is not None:
        write_page(options.page, found)
    if options.json is not None:
        rows = {
            known.recipe: {
                "said": None if one.document is None else said(one),
                "failure": one.failure,
                "held_out_nrmse": None if one.document is None else [one.document[s]["held_out_nrmse"] for s in ("nominal", "augmented")],
                "agrees": known.agreement(one.named, one.stated),
                "seconds": one.seconds,
                "cpu_seconds": one.cpu_seconds,
                "peak_mb": one.peak_mb,
                "revision": one.revision,
            }
            for known, one in found
        }
        options.json.write_text(json.dumps({"recordings": rows, "machine": machine()}, indent=1) + "\n", encoding="utf-8")


def parser() -> argparse.ArgumentParser:
    """The options."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.recordings", description=(__doc__ or "").splitlines()[0])
    made.add_argument("--data", type=Path, required=True, help="folder above the data sets")
    made.add_argument("--out", type=Path, required=True, help="folder of the results, one below it for each recipe")
    made.add_argument("--budget-minutes", type=float, default=5.0, help="of one diagnosis")
    made.add_argument("--page", type=Path, help="Markdown file whose table and sections are written anew, between its two marks")
    made.add_argument("--json", type=Path, help="file to write the figures to")
    made.add_argument("--only-page", action="store_true", help="run nothing: write of what there is")
    recipes = [known.recipe for known in KNOWN]
    made.add_argument(
        "names", nargs="*", metavar="NAME", choices=[[], *recipes], help=f"which to run, of {', '.join(recipes)}; all if none"
    )
    return made


if __name__ == "__main__":
    main()
