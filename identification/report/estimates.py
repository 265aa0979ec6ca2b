"""The estimates beyond their standard errors: profiles of the likelihood, the region of a pair, and the posterior."""

import dataclasses
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
_MARKS = 1500
"""Most draws that are marked in a panel of a pair."""


def likelihood_profiles(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture with a panel a parameter, and one of the pair that is hardest to separate, where profiles were worked out."""
    if result.profiles is None or not result.profiles.single:
        return
    listed, curves = {p.spec.name: p for p in result.parameters}, result.profiles.single
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
        yield _region(result, result.profiles.pair, listed, style)


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
    axes.set_xlabel(heading(estimate.spec.symbol, estimate.spec.unit))


def _region(result: FitResult, pair: ProfileMap, listed: dict[str, ParameterEstimate], style: PageStyle) -> Picture:
    """Contours of a pair: the first parameter as its departure from the long axis of the ellipse, which would hide a bend."""
    figure, grid = panels((2.3,), 1)
    axes, departs = grid[0, 0], _Departure(first=listed[pair.names[0]], second=listed[pair.names[1]], result=result)
    x, y, rise = np.array(pair.second), departs(np.array(pair.first), np.array(pair.second)), np.array(pair.rise)
    if np.isfinite(rise).all():
        x, y, rise = (zoom(values, 5, order=3) for values in (x, y, rise))
    lines = axes.contour(x, y, rise, levels=list(_PAIR_LEVELS.values()), colors=[style.nominal], linewidths=[0.8, 1.4])
    axes.clabel(lines, fmt=dict(zip(lines.levels, _PAIR_LEVELS, strict=True)), fontsize=7)
    axes.plot(departs.second.value, 0.0, "+", color="black", markersize=7)
    axes.plot(*departs.ellipse(_PAIR_LEVELS["95 %"]), color=style.model, linewidth=0.8)
    first, second = (symbol_text(one.spec.symbol) for one in (departs.first, departs.second))
    few_ticks(axes, x=5, y=5)
    axes.set_xlabel(heading(departs.second.spec.symbol, departs.second.spec.unit))
    axes.set_ylabel(f"{first} off the line, {departs.unit}")
    return Picture(
        name="profile-contour",
        section="estimates",
        caption=f"Likelihood of {first} and {second} with all else at its optimum: regions of 68 % and 95 % confidence (lines with numbers)"
        f" and the 95 % ellipse of standard errors and correlation (thin). {first} is shown as its departure from the line of their"
        " correlation, along which both vary most. Where the regions leave the ellipse, trust the regions.",
        alt=f"Contours of the likelihood over {first} and {second}.",
        figure=figure,
    )


@dataclasses.dataclass(frozen=True)
class _Departure:
    """Departure of one parameter from its regression on another, both in the coordinates of the fit; in per cent of a logarithmic one."""

    first: ParameterEstimate
    second: ParameterEstimate
    result: FitResult

    @property
    def unit(self) -> str:
        """For the label of the axis."""
        return "%" if self.first.spec.logarithmic else (unit_text(self.first.spec.unit) or "1")

    def __call__(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Of pairs of values."""
        shift = _internal(self.first, first) - self._correlation * _sigma(self.first) / _sigma(self.second) * _internal(self.second, second)
        return shift * (100.0 if self.first.spec.logarithmic else self.first.spec.scale)

    def ellipse(self, level: float) -> tuple[np.ndarray, np.ndarray]:
        """Region of the normal approximation: values of the second, and departures."""
        angle = np.linspace(0.0, 2.0 * np.pi, 200)
        along = np.sqrt(level) * _sigma(self.second) * np.cos(angle)
        across = np.sqrt(level * (1.0 - self._correlation**2)) * _sigma(self.first) * np.sin(angle)
        spec = self.second.spec
        values = np.array([spec.to_physical(spec.to_internal(self.second.value) + one) for one in along])
        return values, across * (100.0 if self.first.spec.logarithmic else self.first.spec.scale)

    @property
    def _correlation(self) -> float:
        index = [self.result.correlated.index(one.spec.name) for one in (self.first, self.second)]
        return float(self.result.correlation[index[0], index[1]])


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
