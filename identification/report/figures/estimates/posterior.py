"""Corner plot of the posterior: every parameter, and every pair."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from scipy.special import chdtri

from identification.report.figures.base import Picture
from identification.report.page_style import PageStyle
from identification.result.result import FitResult, ParameterEstimate
from identification.wording.names import symbol_text
from vibrojax.drawing import few_ticks, new_figure

_BINS = 24
_MARKS = 1500
"""Most draws that are marked in a panel of a pair."""


def posterior(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture, where the posterior was sampled."""
    sample = result.posterior
    if sample is None:
        return
    listed = {p.spec.name: p for p in result.parameters}
    estimates, draws = [listed[name] for name in sample.names], sample.pooled
    count = len(estimates)
    side = max(0.35 + 1.15 * count, 2.2)
    figure = new_figure(side, side + 0.2)
    grid = figure.subplots(
        count, count, squeeze=False, gridspec_kw={"wspace": 0.08, "hspace": 0.08, "left": 0.13, "right": 0.98, "top": 0.98}
    )
    for row in range(count):
        for column in range(count):
            panel = grid[row, column]
            if column > row:
                panel.set_axis_off()
            elif column == row:
                _single(panel, draws[:, row], estimates[row], style)
            else:
                _pair(panel, draws[:, [column, row]], (estimates[column], estimates[row]), result, style)
            _label(panel, estimates, row, column, count)
    names = ", ".join(symbol_text(p.spec.symbol) for p in estimates)
    yield Picture(
        name="posterior",
        section="posterior",
        record=None,
        caption="Draws of the posterior: every parameter, and every pair. Lines and ellipses are the normal approximation that the standard"
        " errors stand for, the ellipses with 95 % of it. Axes are in the parameters' own units.",
        alt=f"Corner plot of {len(draws)} draws of {names}.",
        figure=figure,
    )


def _single(axes: Axes, values: np.ndarray, estimate: ParameterEstimate, style: PageStyle) -> None:
    """Histogram of a parameter with the normal density of its standard error."""
    axes.hist(values, bins=_BINS, density=True, histtype="step", color=style.accent.colour, linewidth=1.0)
    if estimate.stderr:
        x = np.linspace(*axes.get_xlim(), 200)
        density = np.exp(-0.5 * ((x - estimate.value) / estimate.stderr) ** 2) / (np.sqrt(2.0 * np.pi) * estimate.stderr)
        axes.plot(x, density, color=style.model.colour, linewidth=0.9)


def _pair(axes: Axes, values: np.ndarray, pair: tuple[ParameterEstimate, ParameterEstimate], result: FitResult, style: PageStyle) -> None:
    """Draws of two parameters with the 95 % ellipse of their standard errors and correlation."""
    few = values[:: max(1, len(values) // _MARKS)]
    axes.plot(few[:, 0], few[:, 1], ".", color=style.accent.colour, markersize=2.4, alpha=0.5, markeredgewidth=0, rasterized=True)
    first, second = (result.correlated.index(one.spec.name) for one in pair)
    sigma = np.array([one.stderr or 0.0 for one in pair])
    correlation = float(result.correlation[first, second])
    covariance = np.outer(sigma, sigma) * np.array([[1.0, correlation], [correlation, 1.0]])
    scale = np.where(sigma > 0, sigma, 1.0)
    lengths, axes_of = np.linalg.eigh(covariance / np.outer(scale, scale))
    angle = np.linspace(0.0, 2.0 * np.pi, 120)
    circle = np.stack([np.cos(angle), np.sin(angle)]) * np.sqrt(chdtri(2, 0.05) * np.maximum(lengths, 0.0))[:, None]
    x, y = np.array([one.value for one in pair])[:, None] + scale[:, None] * (axes_of @ circle)
    axes.plot(x, y, color=style.model.colour, linewidth=0.9)


def _label(axes: Axes, estimates: list[ParameterEstimate], row: int, column: int, count: int) -> None:
    """Names at the left and below, and few ticks."""
    few_ticks(axes, x=2, y=3)
    axes.tick_params(labelsize=6)
    axes.xaxis.get_offset_text().set_fontsize(6)
    axes.yaxis.get_offset_text().set_fontsize(6)
    if row < count - 1:
        axes.tick_params(labelbottom=False)
        axes.xaxis.get_offset_text().set_visible(False)
    else:
        axes.set_xlabel(symbol_text(estimates[column].spec.symbol))
        axes.tick_params(axis="x", labelrotation=30)
    if row == column:
        axes.set_yticks([])
    elif column > 0:
        axes.tick_params(labelleft=False)
        axes.yaxis.get_offset_text().set_visible(False)
    else:
        axes.set_ylabel(symbol_text(estimates[row].spec.symbol))
