"""What became of every start of the multistart."""

from collections.abc import Iterator

import numpy as np
from matplotlib.ticker import MaxNLocator, NullLocator

from identification.report.figures.base import LINK, Picture
from identification.report.page_style import PageStyle
from identification.result.result import FitResult
from vibrojax.drawing import new_figure


def waterfall(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture, from two starts on: chi-square before and after, best start first."""
    starts = [start for start in sorted(result.starts, key=lambda s: s.final_cost) if np.isfinite(start.final_cost)]
    if len(starts) < 2:
        return
    figure = new_figure(2.7)
    axes = figure.subplots(gridspec_kw={"left": 0.125, "right": 0.985, "bottom": 0.17, "top": 0.96})
    order = np.arange(1, len(starts) + 1)
    before = np.array([2.0 * start.initial_cost for start in starts])
    after = np.array([2.0 * start.final_cost for start in starts])
    axes.vlines(order, after, np.where(np.isfinite(before), before, after), color=LINK, linewidth=1.0)
    axes.plot(order, before, "o", color=style.measured.colour, fillstyle="none", markersize=5, label="before")
    axes.plot(order, after, "o-", color=style.accent.colour, markersize=5, linewidth=0.8, label="after")
    axes.set_yscale("log")
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("start, best first")
    axes.set_ylabel("chi-square")
    axes.legend(loc="best")
    axes.set_xlim(0.5, len(starts) + 0.5)
    if len(starts) <= 12:
        axes.set_xticks(order, [start.origin for start in starts], rotation=0 if len(starts) < 8 else 30)
        axes.set_xlabel("")
    else:
        axes.xaxis.set_major_locator(MaxNLocator(8, integer=True))
    alike = int(np.sum(after <= after[0] * 1.01 + 1e-12))
    yield Picture(
        name="starts",
        section="starts",
        record=None,
        caption=f"Chi-square of every start before and after its screening; {alike} of {len(starts)} come within 1 % of the best.",
        alt=f"Chi-square of {len(starts)} starts before and after; {alike} reach the best value within 1 per cent.",
        figure=figure,
    )
