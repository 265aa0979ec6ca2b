"""Estimates with the smoothed contact law against the width, beside those of the chain.

python -m benchmarks.smoothed_fit --json FILE --plot PNG
"""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

WIDTHS = (4e-4, 3e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-6)
"""m."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run, print and write."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.smoothed_fit", description="Fits with the smoothed contact law against the width of the smoothing."
    )
    parser.add_argument("--laws", nargs="+", metavar="NAME", help="contact laws; left out: every compliant one")
    parser.add_argument("--widths", nargs="+", type=float, default=WIDTHS, metavar="METRES", help="widths of the contact switch")
    parser.add_argument("--samples", type=int, default=2000, metavar="N", help="of each of the two records, at 4 kHz")
    parser.add_argument("--json", type=Path, metavar="FILE", help="where to write the figures")
    parser.add_argument("--plot", type=Path, metavar="PNG", help="where to draw them")
    options = parser.parse_args(arguments)

    from vibrojax.cli.environment import prepare_jax

    prepare_jax()
    from benchmarks.machine import machine
    from benchmarks.smoothed_fit.plot import plot
    from benchmarks.smoothed_fit.rig import compliant_laws
    from benchmarks.smoothed_fit.trial import trial

    console = Console(highlight=False)
    names = options.laws or compliant_laws()
    if unknown := sorted(set(names) - set(compliant_laws())):
        parser.error(f"no such compliant law: {', '.join(unknown)}; there are {', '.join(compliant_laws())}")
    widths = np.array(options.widths)
    laws = [trial(name, widths, samples=options.samples) for name in track(names, "laws", console=Console(stderr=True))]
    console.print(_table(laws))
    if options.plot is not None:
        plot(laws, options.plot)
    if options.json is not None:
        options.json.write_text(
            json.dumps({"laws": [_plain(law) for law in laws], "machine": machine()}, indent=1) + "\n", encoding="utf-8"
        )


def _plain(law) -> dict:
    return {
        "law": law.name,
        "parameters": law.parameters,
        "stderr": law.stderr.tolist(),
        "widths": law.widths.tolist(),
        "converged": law.converged.tolist(),
        "largest_shift_in_sigma": law.largest.tolist(),
        "shift_in_sigma": {name: law.shift[:, i].tolist() for i, name in enumerate(law.parameters)},
        "slope": law.slope,
        "left_open": law.floor,
        "seconds": law.seconds.tolist(),
    }


def _table(laws) -> Table:
    """A row for each law."""
    table = Table(title="Smoothed fit less chain: largest shift of a parameter, in its standard error", pad_edge=False)
    table.add_column("law", no_wrap=True)
    shown = [0, len(laws[0].widths) // 2, -1]
    for heading in (*(f"{1e6 * width:g} µm" for width in laws[0].widths[shown]), "slope", "converged", "s a fit"):
        table.add_column(heading, justify="right", no_wrap=True)
    for law in laws:
        numbers = [f"{value:.0e}".replace("e-0", "e-") for value in law.largest[shown]]
        converged = f"{law.converged.sum()} of {len(law.widths)}"
        table.add_row(law.name, *numbers, f"{law.slope:.2f}", converged, f"{np.median(law.seconds):.2f}")
    table.caption = (
        "slope: of the shift against the width, logarithmic, where it is four times what the two fits leave open; records without noise,"
        " standard errors under the declared one"
    )
    return table


if __name__ == "__main__":
    main()
