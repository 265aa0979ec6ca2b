"""The estimates beyond their standard errors: profiles of the likelihood, the region of a pair, and the posterior."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from scipy.ndimage import zoom
from scipy.special import chdtri

from identification.report.base import PageStyle, Picture, grid_of, panels
from identification.result.result import FitResult, LikelihoodProfile, ParameterEstimate, ProfileMap
from identification.wording.names import heading, symbol_text
from identification.wording.numbers import unit_text
from vibrojax.drawing import few_ticks

_LEVEL = float(chdtri(1, 0.05))
_PAIR_LEVELS = {"68 %": float(chdtri(2, 0.32)), "95 %": float(chdtri(2, 0.05))}


def likelihood_profiles(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture with a panel a parameter, and one of the pair that is hardest to separate, where profiles were worked out."""
    if result.profiles is None or not result.profiles.single:
        return
    listed, curves = result.named, result.profiles.single
    figure, grid, drawn = grid_of(len(curves), 1.2, min(3, len(curves)), gap=(0.6, 0.2), sharey=True)
    for axes, curve in zip(drawn, curves, strict=True):
        _profile(axes, curve, listed[curve.name], style)
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
    if result.profiles.pair is not None:
        yield _region(result, result.profiles.pair, style)


def _profile(axes: Axes, curve: LikelihoodProfile, estimate: ParameterEstimate, style: PageStyle) -> None:
    """One profile and the parabola of the standard error in the coordinate of the fit, on an axis of values."""
    axes.axhline(_LEVEL, color="#c8c8c8", linewidth=0.8, linestyle=":")
    if estimate.stderr:
        shifts = _internal(estimate, np.array(curve.values)) / _sigma(estimate)
        axes.plot(curve.values, shifts**2, color=style.model, linewidth=0.8)
    axes.plot(curve.values, curve.rise, "o-", color=style.nominal, markersize=2.5, linewidth=1.0)
    axes.set_ylim(0.0, 10.0)
    few_ticks(axes, x=3, y=4)
    axes.set_xlabel(heading(estimate.spec.symbol, estimate.spec.unit))


def _region(result: FitResult, pair: ProfileMap, style: PageStyle) -> Picture:
    """Contours of a pair: the first parameter as its departure from the long axis of the ellipse, which would hide a bend.

    The departure is from its regression on the second, both in the coordinates of the fit; in per cent of a logarithmic one.
    """
    one, other = (result.named[name] for name in pair.names)
    correlation = float(result.correlation[tuple(result.correlated.index(name) for name in pair.names)])
    (of_one, of_other), per_internal = map(_sigma, (one, other)), 100.0 if one.spec.logarithmic else one.spec.scale
    x, rise = np.array(pair.second), np.array(pair.rise)
    y = per_internal * (_internal(one, np.array(pair.first)) - correlation * of_one / of_other * _internal(other, x))
    figure, grid = panels((2.3,), 1)
    axes = grid[0, 0]
    if np.isfinite(rise).all():
        x, y, rise = (zoom(values, 5, order=3) for values in (x, y, rise))
    lines = axes.contour(x, y, rise, levels=list(_PAIR_LEVELS.values()), colors=[style.nominal], linewidths=[0.8, 1.4])
    axes.clabel(lines, fmt=dict(zip(lines.levels, _PAIR_LEVELS, strict=True)), fontsize=7)
    axes.plot(other.value, 0.0, "+", color="black", markersize=7)
    angle, reach = np.linspace(0.0, 2.0 * np.pi, 200), np.sqrt(_PAIR_LEVELS["95 %"])
    along = other.spec.to_internal(other.value) + reach * of_other * np.cos(angle)
    across = per_internal * reach * np.sqrt(1.0 - correlation**2) * of_one * np.sin(angle)
    axes.plot([other.spec.to_physical(value) for value in along], across, color=style.model, linewidth=0.8)
    first, second = (symbol_text(each.spec.symbol) for each in (one, other))
    few_ticks(axes, x=5, y=5)
    axes.set_xlabel(heading(other.spec.symbol, other.spec.unit))
    axes.set_ylabel(f"{first} off the line, {'%' if one.spec.logarithmic else unit_text(one.spec.unit) or '1'}")
    return Picture(
        name="profile-contour",
        section="estimates",
        caption=f"Likelihood of {first} and {second} with all else at its optimum: regions of 68 % and 95 % confidence (lines with numbers)"
        f" and the 95 % ellipse of standard errors and correlation (thin). {first} is shown as its departure from the line of their"
        " correlation, along which both vary most. Where the regions leave the ellipse, trust the regions.",
        alt=f"Contours of the likelihood over {first} and {second}.",
        figure=figure,
    )


def _internal(estimate: ParameterEstimate, values: np.ndarray) -> np.ndarray:
    """Distance of values from the estimate, in the coordinate of the fit."""
    spec = estimate.spec
    return np.vectorize(spec.to_internal)(values) - spec.to_internal(estimate.value)


def _sigma(estimate: ParameterEstimate) -> float:
    """Standard error in the coordinate of the fit."""
    return (estimate.stderr or 0.0) / estimate.spec.slope(estimate.value)


def posterior(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """Corner plot: a histogram of every parameter, and the draws of every pair; one picture, where the posterior was sampled."""
    if result.posterior is None:
        return
    draws, found = result.posterior.pooled, [result.named[name] for name in result.posterior.names]
    count, few = len(found), draws[:: max(1, len(draws) // 1500)]
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
            axes.set_ylabel("" if column else heading(found[row].spec.symbol, found[row].spec.unit))
        for offset, shown in ((axes.xaxis, row == count - 1), (axes.yaxis, column == 0)):
            offset.get_offset_text().set(fontsize=6, visible=shown)
        if row == count - 1:
            axes.set_xlabel(heading(found[column].spec.symbol, found[column].spec.unit))
    yield Picture(
        name="posterior",
        section="estimates",
        caption="Draws of the posterior: every parameter, and every pair.",
        alt=f"Corner plot of {len(draws)} draws of {', '.join(symbol_text(p.spec.symbol) for p in found)}.",
        figure=figure,
    )
