"""Differences from the chain against the width, on logarithmic axes."""

from collections.abc import Sequence
from pathlib import Path

from benchmarks.smoothed_fit.trial import Law
from vibrojax.drawing import COLOURS, new_figure, save, style

_MARKERS = "os^Dv<>"


def plot(laws: Sequence[Law], path: Path) -> None:
    """A curve a law, and what the two fits leave open."""
    with style():
        figure = new_figure(3.6, 4.4, layout="constrained")
        axes = figure.subplots()
        for law, colour, marker in zip(laws, COLOURS * len(laws), _MARKERS * len(laws), strict=False):
            name = f"{law.name}: slope {law.slope:.2f}"
            axes.loglog(law.widths, law.largest, f"{marker}-", color=colour, ms=4, mfc="none", lw=0.8, label=name)
        axes.axhline(max(law.floor for law in laws), color="#888888", lw=0.8, ls=":")
        axes.set(xlabel="width of the contact switch (m)", ylabel="largest shift of a parameter (σ)")
        axes.legend(loc="upper left", fontsize=6)
        save(figure, path)
