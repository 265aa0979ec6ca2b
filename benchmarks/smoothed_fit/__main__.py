"""Estimates with the smoothed contact law against the width, beside those of the exact contact.

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

WIDTHS = (3e-4, 2e-4, 1.4e-4, 1e-4, 3e-5, 1e-5, 1e-6)
"""m."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run, print and write."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.smoothed_fit", description="Fits with the smoothed contact law against the width of the smoothing."
    )
    parser.add_argument("--laws", nargs="+", metavar="NAME", help="contact laws; left out: every compliant one")
    parser.add_argument("--widths", nargs="+", type=float, default=WIDTHS, metavar="METRES", help="widths of the contact switch")
    parser.add_argument("--samples", type=int, default=2000, metavar="N", help="of each of the two records, at 4 kHz")
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="of the noise")
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
    laws = [trial(name, widths, samples=options.samples, seed=options.seed) for name in track(names, "laws", console=Console(stderr=True))]
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
        "widths": law.widths.tolist(),
        "largest_shift_in_sigma": law.largest["estimate"].tolist(),
        "largest_relative_difference_of_stderr": law.largest["stderr"].tolist(),
        "shift_in_sigma": {name: law.shift[:, i].tolist() for i, name in enumerate(law.parameters)},
        "slope": {quantity: law.slope(quantity) for quantity in law.largest},
        "between_two_exact_integrations": law.floor,
        "seconds_per_evaluation": law.seconds,
    }


def _table(laws) -> Table:
    """A row for each law."""
    shown = [0, len(laws[0].widths) // 2, -1]
    widths = [f"{1e6 * laws[0].widths[place]:g} µm" for place in shown]
    headings = (*widths, "slope", "(errors)", "exact ±", "time")
    table = Table(title="Smoothed less exact contact: largest shift of a parameter, in its standard error", pad_edge=False)
    table.add_column("law", no_wrap=True)
    for heading in headings:
        table.add_column(heading, justify="right", no_wrap=True)
    for law in laws:
        numbers = [f"{value:.0e}".replace("e-0", "e-") for value in (*law.largest["estimate"][shown], law.floor["estimate"])]
        slopes = [f"{law.slope(quantity):.2f}" for quantity in law.largest]
        table.add_row(law.name, *numbers[:-1], *slopes, numbers[-1], f"{law.seconds['smoothed'] / law.seconds['landing']:.1f}")
    table.caption = (
        "slope: of the shift against the width, logarithmic; (errors): that of the relative difference of the standard errors; exact ±:"
        " shift between two integrations of the exact contact; time: of residuals and derivatives at the smallest width, over that of"
        " the exact contact"
    )
    return table


if __name__ == "__main__":
    main()
