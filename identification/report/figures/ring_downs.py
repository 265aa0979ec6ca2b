"""Damping and frequency of free vibrations against their amplitude, as recorded and as models have them."""

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FixedLocator, NullLocator

from identification.experiment import Experiment
from identification.report.figures.base import Picture
from identification.report.page_style import DASHED, PageStyle
from identification.result.result import FitResult
from identification.result.ring_down import RingDown, RingDowns
from identification.wording.names import Label, label
from identification.wording.numbers import joined, unit_text
from vibrojax.drawing import few_ticks, literal, new_figure

SECTION = "decay"
_NICE = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0)
_MOST_TICKS = 7
_VAGUE = 3.0
"""Standard error, over the median one, above which a point does not widen an axis."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Line:
    """The curve of one model: its ring-downs, and how they are drawn."""

    name: str
    ring_downs: tuple[RingDown, ...]
    colour: str
    width: float = 1.2
    dashes: str | tuple[float, tuple[float, ...]] = "-"


def ring_downs(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture, where a record has a free vibration."""
    found = result.ring_downs
    if found.measured:
        nominal = Line(name="nominal model", ring_downs=found.models.get("nominal", ()), colour=style.nominal.colour, dashes=DASHED)
        lines = [nominal]
        if result.added is not None and "augmented" in found.models:
            named = "with " + joined([name.replace("_", " ") for name in result.added.names])
            lines.append(Line(name=named, ring_downs=found.models["augmented"], colour=style.augmented.colour))
        yield ring_down_picture(found, lines, result.experiment, style)


def ring_down_picture(found: RingDowns, lines: Sequence[Line], experiment: Experiment, style: PageStyle) -> Picture:
    """Measured points with error bars, and a line a model; damping above, frequency below."""
    look = _look(experiment)
    height = 4.6 + 0.19 * -(-(len(lines) + 1) // 2)
    figure = new_figure(height)
    places = {"left": 0.115, "right": 0.985, "bottom": 0.46 / height, "top": (4.6 - 0.12) / height, "hspace": 0.1}
    upper, lower = figure.subplots(2, 1, sharex=True, gridspec_kw=places)
    _panel(upper, found.measured, lines, ("damping", 100.0), look, style)
    _panel(lower, found.measured, lines, ("frequency", 1.0), look, style)
    low, high = upper.get_ylim()
    upper.set_ylim(min(low, 0.0) if low > 0.0 else low, high)
    upper.set_ylabel("damping ratio ζ (%)")
    lower.set_ylabel("frequency f (Hz)")
    lower.set_xlabel(f"amplitude of {look.symbol} ({unit_text(look.unit)})")
    amplitudes = look.factor * np.concatenate([one.amplitude for one in found.measured])
    errors = np.concatenate([one.damping_stderr for one in found.measured])
    shown = amplitudes[errors <= _VAGUE * np.median(errors)]
    lower.set_xscale("log")
    lower.set_xlim(0.92 * shown.min(), 1.08 * shown.max())
    lower.xaxis.set_major_locator(FixedLocator(_ticks(*lower.get_xlim())))
    lower.xaxis.set_minor_locator(NullLocator())
    lower.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    handles, names = upper.get_legend_handles_labels()
    upper.legend(
        [handles[-1], *handles[:-1]],
        [names[-1], *names[:-1]],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=2,
        borderpad=0.1,
        handlelength=2.6,
    )
    damping = 100.0 * np.concatenate([one.damping for one in found.measured])
    return Picture(
        name="damping-and-frequency",
        section=SECTION,
        record=None,
        caption=f"Damping ratio and frequency of the free vibrations against their amplitude: measured ({style.dots.word} dots, with one"
        " standard error from the noise), and lines: the motion of each model from the same initial states, read in the same way."
        " Viscous damping is level; dry friction rises towards small amplitudes, drag towards large ones."
        f" A spring that hardens rises in frequency.{_geometry(experiment)}",
        alt=f"Damping ratio, {damping.min():.3g} to {damping.max():.3g} per cent, and frequency of {len(damping)} measured swings against"
        f" amplitudes from {amplitudes.min():.3g} to {amplitudes.max():.3g} {look.unit}, beside {joined([one.name for one in lines])}.",
        figure=figure,
    )


def left_out(found: RingDowns) -> list[str]:
    """Sentences without full stops on the records in which no decay was read."""
    reasons: dict[str, list[str]] = {}
    for file, why in found.left_out.items():
        reasons.setdefault(why, []).append(file)
    return [f"{joined(files)}: {why}" for why, files in reasons.items()]


def _panel(axes: Axes, measured: Sequence[RingDown], lines: Sequence[Line], what: tuple[str, float], look: Label, style: PageStyle) -> None:
    """One quantity; its name as an attribute, and the factor to the axis."""
    name, factor = what
    amplitude, value, error = (np.concatenate([getattr(one, key) for one in measured]) for key in ("amplitude", name, f"{name}_stderr"))
    dots = {"fmt": ".", "color": style.dots.colour, "elinewidth": 0.7, "markersize": 4.0, "label": "measured", "zorder": 1.0}
    axes.errorbar(look.factor * amplitude, factor * value, factor * error, **dots)
    for line in lines:
        for part, one in enumerate(line.ring_downs):
            axes.plot(
                look.factor * np.array(one.amplitude),
                factor * np.array(getattr(one, name)),
                color=line.colour,
                linewidth=line.width,
                linestyle=line.dashes,
                marker="" if len(one.amplitude) > 1 else "_",
                label="_" if part else literal(line.name),
            )
    sure = error <= _VAGUE * np.median(error)
    low, high = float(np.min((value - error)[sure])), float(np.max((value + error)[sure]))
    drawn = np.array([v for line in lines for one in line.ring_downs for v in getattr(one, name)])
    room = max(0.5 * (high - low), 1e-3 * abs(high))
    near = drawn[(drawn > low - room) & (drawn < high + room)]
    low, high = min([low, *near]), max([high, *near])
    margin = max(0.06 * (high - low), 1e-4 * abs(high))
    axes.set_ylim(factor * (low - margin), factor * (high + margin))
    few_ticks(axes, y=5)


def _look(experiment: Experiment) -> Label:
    """Label of the displacement as it was recorded."""
    channels = {name for record in experiment.records for name in record.channels}
    look = label("relative_displacement" if "relative_displacement" in channels else "hammer_displacement", experiment)
    return dataclasses.replace(look, symbol="u")


def _ticks(low: float, high: float) -> list[float]:
    """Round values on a logarithmic axis: as many of each decade as there is room for."""
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    for chosen in (_NICE, (1.0, 2.0, 3.0, 5.0), (1.0, 2.0, 5.0), (1.0, 3.0), (1.0,)):
        found = [float(f"{nice * 10.0**k:.3g}") for k in decades for nice in chosen if low <= nice * 10.0**k <= high]
        if len(found) <= _MOST_TICKS:
            break
    return found


def _geometry(experiment: Experiment) -> str:
    if experiment.suspension.kind not in ("pendulum", "pivot"):
        return ""
    return " That of a pendulum falls with the amplitude by itself, as the lines show."
