"""The stretch of each record that shows most: measured, nominal and augmented, and the residuals before and after."""

import dataclasses
from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.diagnosis.figures.stretch import Stretch, stretches
from identification.report.figures.base import Picture, residual_panel
from identification.report.figures.zoom import Curve, Panel, Track, tracks
from identification.report.page_style import DASHED, PageStyle
from identification.result.result import RecordFit, largest, residual
from identification.wording.names import label
from identification.wording.numbers import significant, unit_text
from vibrojax.drawing import WIDTH, few_ticks, literal, new_figure

_MOST = 6
_WORTH = 1.1
"""Chi-square before over that after, from which on a record is worth a picture."""
_LEFT, _RIGHT, _ABOVE, _BELOW, _TALL, _SHORT, _BETWEEN = 0.72, 0.98, 0.3, 0.45, 1.35, 0.5, 0.13
_EDGE = 4
"""Samples on either side of a contact that count as contact."""


def before_after(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture for each record that gains, the largest gains if there are many; where nothing is missing there is only a before."""
    found = stretches(diagnosis)
    both = diagnosis.is_augmented
    worth = [one for one in found if not both or _chi2(one.before, one.channel) > _WORTH * _chi2(one.after, one.channel)]
    chosen = sorted(worth or found[:1], key=lambda one: -_gain(one, both))[:_MOST]
    for one in sorted(chosen, key=lambda one: one.number):
        yield _both(diagnosis, one, style) if both else _nominal_only(diagnosis, one, style)


def _gain(one: Stretch, both: bool) -> float:
    before, after = (_chi2(record, one.channel) * len(record.time) for record in (one.before, one.after))
    return before - after if both else before


def _chi2(record: RecordFit, channel: str) -> float:
    return record.chi2_reduced.get(channel, 0.0)


def _both(diagnosis: Diagnosis, one: Stretch, style: PageStyle) -> Picture:
    signal, (first, second) = _axes(2)
    carried = _carried(diagnosis, one)
    panel, cut = _signal(signal, diagnosis, one, carried, style)
    sides = ((first, one.before, style.nominal.colour), (second, one.after, style.augmented.colour))
    reach = [largest(residual(side, one.channel)[one.part]) for _, side, _ in sides]
    curves = [
        carried.residual(name, model, colour)
        for name, model, (_, _, colour) in zip(("before", "after"), carried.models, sides, strict=True)
    ]
    before, after = (
        _strip(axes, side, one, limit, curve) for (axes, side, _), limit, curve in zip(sides, (reach[0], max(reach)), curves, strict=True)
    )
    words = label(one.channel, diagnosis.experiment).words
    return Picture(
        name=f"record-{one.number:02d}-before-after",
        section="before-after",
        record=one.before.file,
        caption=f"{one.before.file}: {words} in the stretch in which the models differ most{', impacts cut off' if cut else ''}."
        f" Measured ({style.measured.word}), nominal ({style.nominal.word}, dashed), augmented ({style.augmented.word}); below, the"
        " residuals of either in units of the noise σ on the same scale, with a band of ±2 σ.",
        alt=f"{words.capitalize()} of {one.before.file} from {one.before.time[one.part][0]:.4g} to {one.before.time[one.part][-1]:.4g} s:"
        f" measured, nominal and augmented model; residual {before} σ before and {after} σ after.",
        figure=signal.figure,  # type: ignore[arg-type]
        panels=(panel, *(carried.strip(axes, curve) for axes, curve in zip((first, second), curves, strict=True))),
    )


def _nominal_only(diagnosis: Diagnosis, one: Stretch, style: PageStyle) -> Picture:
    signal, (strip,) = _axes(1)
    carried = _carried(diagnosis, one)
    panel, _ = _signal(signal, diagnosis, one, carried, style)
    curve = carried.residual("residual", carried.models[0], "#000000")
    left = _strip(strip, one.before, one, largest(residual(one.before, one.channel)[one.part]), curve)
    words = label(one.channel, diagnosis.experiment).words
    return Picture(
        name=f"record-{one.number:02d}-nominal",
        section="before-after",
        record=one.before.file,
        caption=f"{one.before.file}: {words} in the stretch that fits worst. Measured ({style.measured.word}) and nominal model"
        f" ({style.model.word}); below, the residual in units of the noise σ, with a band of ±2 σ.",
        alt=f"{words.capitalize()} of {one.before.file} in its worst stretch, measured and nominal model; residual {left} σ.",
        figure=signal.figure,  # type: ignore[arg-type]
        panels=(panel, carried.strip(strip, curve)),
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Carried:
    """The whole record as the page carries it, of which the figure shows a stretch."""

    time: Track
    measured: Track
    models: tuple[Track, ...]
    noise: float

    def residual(self, name: str, model: Track, colour: str) -> Curve:
        return Curve(name=name, track=self.measured, minus=model, noise=self.noise, colour=colour, width=0.6)

    def strip(self, axes: Axes, curve: Curve) -> Panel:
        return Panel(axes=axes, time=self.time, curves=(curve,), words="r", unit="σ", fixed=True)


def _carried(diagnosis: Diagnosis, one: Stretch) -> _Carried:
    """Both models, or the nominal one where nothing is missing."""
    factor, record = label(one.channel, diagnosis.experiment).factor, one.before
    predicted = [side.predicted[one.channel] for side in ((one.before, one.after) if diagnosis.is_augmented else (one.before,))]
    noise = factor * record.noise[one.channel]
    time, (measured, *models) = tracks(record.time, [factor * values for values in (record.measured[one.channel], *predicted)], noise)
    return _Carried(time=time, measured=measured, models=tuple(models), noise=noise)


def _axes(strips: int) -> tuple[Axes, list[Axes]]:
    """A tall panel and short ones below it, with one axis of time."""
    height = _ABOVE + _TALL + strips * (_SHORT + _BETWEEN) + _BELOW
    figure = new_figure(height)
    width = (WIDTH - _LEFT - _RIGHT) / WIDTH
    top = figure.add_axes((_LEFT / WIDTH, 1 - (_ABOVE + _TALL) / height, width, _TALL / height))
    lower = []
    for strip in range(strips):
        bottom = 1 - (_ABOVE + _TALL + (strip + 1) * (_SHORT + _BETWEEN)) / height
        lower.append(figure.add_axes((_LEFT / WIDTH, bottom, width, _SHORT / height), sharex=top))
    for axes in (top, *lower[:-1]):
        axes.xaxis.set_visible(False)
    for axes in (top, *lower):
        axes.yaxis.set_label_coords(-0.52 / (WIDTH - _LEFT - _RIGHT), 0.5)
    lower[-1].set_xlabel("time t (s)")
    lower[-1].xaxis.set_label_coords(0.5, -0.25 / _SHORT)
    return top, lower


def _signal(axes: Axes, diagnosis: Diagnosis, one: Stretch, carried: _Carried, style: PageStyle) -> tuple[Panel, bool]:
    """Measured and modelled; whether impacts are cut off, to show the flight between them."""
    look, time = label(one.channel, diagnosis.experiment), one.before.time[one.part]
    curves = [Curve(name="measured", track=carried.measured, colour=style.measured.colour, width=2.4)]
    if diagnosis.is_augmented:
        curves += [Curve(name="nominal", track=carried.models[0], colour=style.nominal.colour, width=1.1, dashes=DASHED)]
    last = "augmented" if diagnosis.is_augmented else "nominal"
    curves += [Curve(name=last, track=carried.models[-1], colour=style.augmented.colour, width=0.9)]
    drawn = [one.before.measured, *((one.before.predicted, one.after.predicted) if diagnosis.is_augmented else (one.before.predicted,))]
    for curve, channels in zip(curves, drawn, strict=True):
        curve.draw(axes, time, look.factor * channels[one.channel][one.part])
    axes.set_title(literal(f"{one.before.file}: {look.words}"), loc="left", pad=3)
    axes.set_ylabel(look.axis)
    axes.set_xlim(time[0], time[-1])
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), borderpad=0.1, handlelength=1.3, handletextpad=0.4)
    few_ticks(axes)
    limits = _limits(one) if diagnosis.location is not None and diagnosis.location.phase == "free flight" else None
    if limits is not None:
        axes.set_ylim(look.factor * limits[0], look.factor * limits[1])
    panel = Panel(axes=axes, time=carried.time, curves=tuple(curves), words=look.words, unit=unit_text(look.unit))
    return panel, limits is not None


def _limits(one: Stretch) -> tuple[float, float] | None:
    """Range of the channel in flight, where impacts reach far beyond it."""
    contact = (one.before.in_contact | one.after.in_contact)[one.part]
    near = np.convolve(contact, np.ones(2 * _EDGE + 1), mode="same") > 0.5
    series = [s[one.channel][one.part] for s in (one.before.measured, one.before.predicted, one.after.predicted)]
    flight, whole = (np.concatenate([s[chosen] for s in series]) for chosen in (~near, np.ones_like(near)))
    flight, whole = flight[np.isfinite(flight)], whole[np.isfinite(whole)]
    if not len(flight) or np.ptp(flight) > 0.6 * np.ptp(whole):
        return None
    margin = 0.15 * float(np.ptp(flight))
    return float(flight.min()) - margin, float(flight.max()) + margin


def _strip(axes: Axes, record: RecordFit, one: Stretch, reach: float, curve: Curve) -> str:
    """A residual with its root mean square, which is returned."""
    r = residual(record, one.channel)[one.part]
    usable = r[np.isfinite(r)]
    rms = significant(float(np.sqrt(np.mean(usable**2))) if len(usable) else None, 2)
    residual_panel(axes, reach)
    limit = max(reach, 4.0)
    power = 10.0 ** np.floor(np.log10(limit))
    axes.set_yticks([-power * (limit // power), 0.0, power * (limit // power)])
    axes.set_ylim(-1.15 * limit, 1.15 * limit)
    curve.draw(axes, record.time[one.part], r)
    axes.text(1.012, 0.5, f"{curve.name}\nrms {rms} σ", transform=axes.transAxes, ha="left", va="center", fontsize=8)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    return rms
