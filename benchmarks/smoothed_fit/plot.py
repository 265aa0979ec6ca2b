"""Differences from the exact contact against the width, on logarithmic axes."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.smoothed_fit.trial import Law
from vibrojax.drawing import COLOURS, new_figure, save, style

_MARKERS = "os^Dv<>"
_LABELS = {"estimate": "largest shift of a parameter (σ)", "stderr": "largest relative difference\nof a standard error"}


def plot(laws: Sequence[Law], path: Path) -> None:
    """Two panels, of the estimates and of their standard errors; a curve a law, and what the exact integration leaves open."""
    with style():
        figure = new_figure(3.6, 7.4, layout="constrained")
        for axes, (quantity, label) in zip(figure.subplots(1, 2), _LABELS.items(), strict=True):
            for law, colour, marker in zip(laws, COLOURS * len(laws), _MARKERS * len(laws), strict=False):
                name = f"{law.name}: slope {law.slope(quantity):.2f}"
                axes.loglog(law.widths, law.largest[quantity], f"{marker}-", color=colour, ms=4, mfc="none", lw=0.8, label=name)
            axes.axhline(max(law.floor[quantity] for law in laws), color="#888888", lw=0.8, ls=":")
            axes.set(xlabel="width of the contact switch (m)", ylabel=label)
            axes.legend(loc="upper left", fontsize=6)
        save(figure, path)
