"""Profiles of the likelihood, and the contour of the pair that is hardest to separate."""

import dataclasses
from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from scipy.ndimage import zoom
from scipy.special import chdtri

from identification.report.figures.base import LINK, Picture
from identification.report.page_style import PageStyle
from identification.result.result import FitResult, LikelihoodProfile, ParameterEstimate
from identification.wording.names import symbol_text
from identification.wording.numbers import unit_text
from vibrojax.drawing import few_ticks, new_figure

_LEVEL = float(chdtri(1, 0.05))
_PAIR_LEVELS = {"68 %": float(chdtri(2, 0.32)), "95 %": float(chdtri(2, 0.05))}
_HIGHEST, _FINER = 10.0, 5


def likelihood_profiles(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture of all profiles, and one of the pair, where they were worked out."""
    if result.profiles is None or not result.profiles.single:
        return
    listed = {p.spec.name: p for p in result.parameters}
    curves = result.profiles.single
    columns = min(3, len(curves))
    rows = -(-len(curves) // columns)
    height = 0.2 + 1.75 * rows
    figure = new_figure(height)
    places = {"left": 0.085, "right": 0.985, "bottom": 0.5 / height, "top": 1 - 0.15 / height, "hspace": 0.55, "wspace": 0.12}
    grid = figure.subplots(rows, columns, squeeze=False, sharey=True, gridspec_kw=places)
    for panel, curve in zip(grid.ravel(), curves, strict=False):
        _profile(panel, curve, listed[curve.name], style)
    for panel in grid.ravel()[len(curves) :]:
        panel.set_axis_off()
    for panel in grid[:, 0]:
        panel.set_ylabel("2 Δ log L")
    names = ", ".join(symbol_text(listed[curve.name].spec.symbol) for curve in curves)
    yield Picture(
        name="profiles",
        section="correlation",
        record=None,
        caption="Likelihood profiles: twice the fall of the log-likelihood with all else at its optimum (line with marks), and the parabola"
        f" of the standard error (thin). Below the dotted line, {_LEVEL:.2f}, lies the 95 % interval.",
        alt=f"Likelihood profiles of {names}.",
        figure=figure,
    )
    yield from _contour(result, listed, style)


def _profile(axes: Axes, curve: LikelihoodProfile, estimate: ParameterEstimate, style: PageStyle) -> None:
    """One profile and its parabola, in the coordinate of the fit, on an axis of values."""
    spec, values = estimate.spec, np.array(curve.values)
    axes.axhline(_LEVEL, color=LINK, linewidth=0.8, linestyle=":")
    if estimate.stderr:
        internal = np.array([spec.to_internal(value) for value in values])
        sigma = estimate.stderr / spec.slope(estimate.value)
        axes.plot(values, ((internal - spec.to_internal(estimate.value)) / sigma) ** 2, color=style.model.colour, linewidth=0.8)
    axes.plot(values, curve.rise, "o-", color=style.accent.colour, markersize=2.5, linewidth=1.0)
    axes.set_ylim(0.0, _HIGHEST)
    few_ticks(axes, x=3, y=4)
    unit = unit_text(spec.unit)
    axes.set_xlabel(symbol_text(spec.symbol) + (f" ({unit})" if unit else ""))


def _contour(result: FitResult, listed: dict[str, ParameterEstimate], style: PageStyle) -> Iterator[Picture]:
    """Contours of the pair: the first parameter as its departure from the long axis of the ellipse, which would hide a bend."""
    pair = result.profiles.pair if result.profiles is not None else None
    if pair is None:
        return
    figure = new_figure(2.9)
    axes = figure.subplots(gridspec_kw={"left": 0.125, "right": 0.985, "bottom": 0.17, "top": 0.96})
    departs = _Departure(first=listed[pair.names[0]], second=listed[pair.names[1]], result=result)
    x, y = np.array(pair.second), departs(np.array(pair.first), np.array(pair.second))
    rise = np.array(pair.rise)
    if np.isfinite(rise).all():
        x, y, rise = (zoom(values, _FINER, order=3) for values in (x, y, rise))
    lines = axes.contour(x, y, rise, levels=list(_PAIR_LEVELS.values()), colors=[style.accent.colour], linewidths=[0.8, 1.4])
    axes.clabel(lines, fmt=dict(zip(lines.levels, _PAIR_LEVELS, strict=True)), fontsize=7)
    axes.plot(departs.second.value, 0.0, "+", color="black", markersize=7)
    axes.plot(*departs.ellipse(_PAIR_LEVELS["95 %"]), color=style.model.colour, linewidth=0.8)
    first, second = (symbol_text(one.spec.symbol) for one in (departs.first, departs.second))
    few_ticks(axes, x=5, y=5)
    unit = unit_text(departs.second.spec.unit)
    axes.set_xlabel(second + (f" ({unit})" if unit else ""))
    axes.set_ylabel(f"{first} off the line, {departs.unit}")
    yield Picture(
        name="profile-contour",
        section="correlation",
        record=None,
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
        shift = _internal(self.first, first) - self._slope * _internal(self.second, second)
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

    @property
    def _slope(self) -> float:
        return self._correlation * _sigma(self.first) / _sigma(self.second)


def _internal(estimate: ParameterEstimate, values: np.ndarray) -> np.ndarray:
    """Distance of values from the estimate, in the coordinate of the fit."""
    spec = estimate.spec
    return np.vectorize(spec.to_internal)(values) - spec.to_internal(estimate.value)


def _sigma(estimate: ParameterEstimate) -> float:
    """Standard error in the coordinate of the fit."""
    return (estimate.stderr or 0.0) / estimate.spec.slope(estimate.value)
