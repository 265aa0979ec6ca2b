"""A telling stretch of each record: measured, nominal and augmented, and what is left before and after."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.diagnosis.figures.base import AFTER, BEFORE, DASHED, Picture
from identification.report.diagnosis.figures.stretch import Stretch, stretches
from identification.report.figures.base import MEASURED, residual_panel
from identification.report.figures.envelope import envelope
from identification.result.record_view import largest, residual
from identification.result.result import RecordFit
from identification.wording.channel_labels import label
from identification.wording.numbers import significant
from vibrojax.drawing import WIDTH, few_ticks, new_figure

_MOST = 6
_WORTH = 1.1
"""Chi-square before over that after, from which on a record is worth a picture."""
_LEFT, _RIGHT, _ABOVE, _BELOW, _TALL, _SHORT, _BETWEEN = 0.72, 0.98, 0.3, 0.45, 1.35, 0.5, 0.13
_EDGE = 4
"""Samples on either side of a contact that count as contact."""


def before_after(diagnosis: Diagnosis) -> Iterator[Picture]:
    """One picture for each record that gains, the largest gains if there are many; where nothing is missing there is only a before."""
    found = stretches(diagnosis)
    adequate = diagnosis.is_complete
    worth = [one for one in found if adequate or _chi2(one.before, one.channel) > _WORTH * _chi2(one.after, one.channel)]
    chosen = sorted(worth or found[:1], key=lambda one: -_gain(one, adequate))[:_MOST]
    for one in sorted(chosen, key=lambda one: one.number):
        yield _nominal_only(diagnosis, one) if adequate else _both(diagnosis, one)


def _gain(one: Stretch, adequate: bool) -> float:
    before, after = (_chi2(record, one.channel) * len(record.time) for record in (one.before, one.after))
    return before if adequate else before - after


def _chi2(record: RecordFit, channel: str) -> float:
    return record.chi2_reduced.get(channel, 0.0)


def _both(diagnosis: Diagnosis, one: Stretch) -> Picture:
    signal, (first, second) = _panels(2)
    cut = _signal(signal, diagnosis, one, nominal=True)
    reach = largest(residual(one.before, one.channel)[one.part])
    before = _strip(first, one.before, one, reach, BEFORE, "before")
    after = _strip(second, one.after, one, max(reach, largest(residual(one.after, one.channel)[one.part])), AFTER, "after")
    words = label(one.channel, diagnosis.experiment).words
    return Picture(
        name=f"record-{one.number:02d}-before-after",
        section="before-after",
        record=one.before.file,
        caption=f"{one.before.file}: {words} in the most telling stretch{', impacts cut off' if cut else ''}."
        " Measured (grey), nominal (blue, dashed), augmented (orange); below, the residuals of either in units of the noise σ on the same"
        " scale, with a band of ±2 σ.",
        alt=f"{words.capitalize()} of {one.before.file} from {one.before.time[one.part][0]:.4g} to {one.before.time[one.part][-1]:.4g} s:"
        f" measured, nominal and augmented model; residual {before} σ before and {after} σ after.",
        figure=signal.figure,  # type: ignore[arg-type]
    )


def _nominal_only(diagnosis: Diagnosis, one: Stretch) -> Picture:
    signal, (strip,) = _panels(1)
    _signal(signal, diagnosis, one, nominal=False)
    left = _strip(strip, one.before, one, largest(residual(one.before, one.channel)[one.part]), "black", "residual")
    words = label(one.channel, diagnosis.experiment).words
    return Picture(
        name=f"record-{one.number:02d}-nominal",
        section="before-after",
        record=one.before.file,
        caption=f"{one.before.file}: {words} in the stretch that fits worst. Measured (grey) and nominal model (orange);"
        " below, the residual in units of the noise σ, with a band of ±2 σ.",
        alt=f"{words.capitalize()} of {one.before.file} in its worst stretch, measured and nominal model; residual {left} σ.",
        figure=signal.figure,  # type: ignore[arg-type]
    )


def _panels(strips: int) -> tuple[Axes, list[Axes]]:
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


def _signal(axes: Axes, diagnosis: Diagnosis, one: Stretch, *, nominal: bool) -> bool:
    """Measured and modelled; whether impacts are cut off, to show the flight between them."""
    look, time = label(one.channel, diagnosis.experiment), one.before.time[one.part]
    axes.plot(*envelope(time, look.factor * one.before.measured[one.channel][one.part]), color=MEASURED, linewidth=2.4, label="measured")
    if nominal:
        series = look.factor * one.before.predicted[one.channel][one.part]
        axes.plot(*envelope(time, series), color=BEFORE, linewidth=1.1, linestyle=DASHED, label="nominal")
    series = look.factor * one.after.predicted[one.channel][one.part]
    axes.plot(*envelope(time, series), color=AFTER, linewidth=0.9, label="augmented" if nominal else "nominal")
    axes.set_title(f"{one.before.file}: {look.words}", loc="left", pad=3)
    axes.set_ylabel(look.axis)
    axes.set_xlim(time[0], time[-1])
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), borderpad=0.1, handlelength=1.3, handletextpad=0.4)
    few_ticks(axes)
    limits = _limits(one) if diagnosis.location is not None and diagnosis.location.phase == "free flight" else None
    if limits is not None:
        axes.set_ylim(look.factor * limits[0], look.factor * limits[1])
    return limits is not None


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


def _strip(axes: Axes, record: RecordFit, one: Stretch, reach: float, colour: str, name: str) -> str:
    """A residual with its root mean square, which is returned."""
    r = residual(record, one.channel)[one.part]
    usable = r[np.isfinite(r)]
    told = significant(float(np.sqrt(np.mean(usable**2))) if len(usable) else None, 2)
    residual_panel(axes, reach)
    limit = max(reach, 4.0)
    power = 10.0 ** np.floor(np.log10(limit))
    axes.set_yticks([-power * (limit // power), 0.0, power * (limit // power)])
    axes.set_ylim(-1.15 * limit, 1.15 * limit)
    axes.plot(*envelope(record.time[one.part], r), color=colour, linewidth=0.6)
    axes.text(1.012, 0.5, f"{name}\nrms {told} σ", transform=axes.transAxes, ha="left", va="center", fontsize=8)
    axes.xaxis.set_major_locator(MaxNLocator(6))
    return told
