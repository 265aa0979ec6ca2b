"""The estimates beyond their standard errors: profiles of the likelihood, and the posterior."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from scipy.special import chdtri

from identification.report.base import PageStyle, Picture, panels
from identification.result.result import FitResult, LikelihoodProfile, ParameterEstimate
from identification.wording.names import symbol_text
from identification.wording.numbers import unit_text
from vibrojax.drawing import few_ticks

_LEVEL = float(chdtri(1, 0.05))
_MARKS = 1500
"""Most draws that are marked in a panel of a pair."""


def likelihood_profiles(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture, a panel a parameter, where profiles were worked out."""
    if result.profiles is None or not result.profiles.single:
        return
    listed, curves = {p.spec.name: p for p in result.parameters}, result.profiles.single
    columns = min(3, len(curves))
    figure, grid = panels((1.2,) * -(-len(curves) // columns), columns, gap=(0.6, 0.2), sharey=True)
    for axes, curve in zip(grid.ravel(), curves, strict=False):
        _profile(axes, curve, listed[curve.name], style)
    for axes in grid.ravel()[len(curves) :]:
        axes.set_axis_off()
    for axes in grid[:, 0]:
        axes.set_ylabel("2 Δ log L")
    yield Picture(
        name="profiles",
        section="estimates",
        caption="Likelihood profiles: twice the fall of the log-likelihood with all else at its optimum (line with marks), and the parabola"
        f" of the standard error (thin). Below the dotted line, {_LEVEL:.2f}, lies the 95 % interval.",
        alt=f"Likelihood profiles of {', '.join(symbol_text(listed[curve.name].spec.symbol) for curve in curves)}.",
        figure=figure,
    )


def _profile(axes: Axes, curve: LikelihoodProfile, estimate: ParameterEstimate, style: PageStyle) -> None:
    """One profile and the parabola of the standard error in the coordinate of the fit, on an axis of values."""
    spec = estimate.spec
    axes.axhline(_LEVEL, color="#c8c8c8", linewidth=0.8, linestyle=":")
    if estimate.stderr:
        shifts = np.array([spec.to_internal(value) for value in curve.values]) - spec.to_internal(estimate.value)
        axes.plot(curve.values, (shifts * spec.slope(estimate.value) / estimate.stderr) ** 2, color=style.model, linewidth=0.8)
    axes.plot(curve.values, curve.rise, "o-", color=style.nominal, markersize=2.5, linewidth=1.0)
    axes.set_ylim(0.0, 10.0)
    few_ticks(axes, x=3, y=4)
    axes.set_xlabel(_axis(estimate))


def posterior(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """Corner plot: a histogram of every parameter, and the draws of every pair; one picture, where the posterior was sampled."""
    if result.posterior is None:
        return
    listed, draws = {p.spec.name: p for p in result.parameters}, result.posterior.pooled
    found = [listed[name] for name in result.posterior.names]
    count, few = len(found), draws[:: max(1, len(draws) // _MARKS)]
    figure, grid = panels((1.05,) * count, count, gap=(0.1, 0.1), width=1.0 + 1.15 * count)
    for (row, column), axes in np.ndenumerate(grid):
        axes.tick_params(labelsize=6, labelbottom=row == count - 1, labelleft=column == 0 < row)
        few_ticks(axes, x=2, y=3)
        if column > row:
            axes.set_axis_off()
        elif column == row:
            axes.hist(draws[:, row], bins=24, histtype="step", color=style.nominal, linewidth=1.0)
            axes.set_yticks([])
        else:
            marks = {"markersize": 2.4, "alpha": 0.5, "markeredgewidth": 0, "rasterized": True}
            axes.plot(few[:, column], few[:, row], ".", color=style.nominal, **marks)
            axes.set_ylabel("" if column else _axis(found[row]))
        for offset, shown in ((axes.xaxis, row == count - 1), (axes.yaxis, column == 0)):
            offset.get_offset_text().set(fontsize=6, visible=shown)
        if row == count - 1:
            axes.set_xlabel(_axis(found[column]))
    yield Picture(
        name="posterior",
        section="estimates",
        caption="Draws of the posterior: every parameter, and every pair.",
        alt=f"Corner plot of {len(draws)} draws of {', '.join(symbol_text(p.spec.symbol) for p in found)}.",
        figure=figure,
    )


def _axis(estimate: ParameterEstimate) -> str:
    unit = unit_text(estimate.spec.unit)
    return symbol_text(estimate.spec.symbol) + (f" ({unit})" if unit else "")
