"""Damping and frequency of free vibrations against their amplitude, as recorded and as models have them."""

from collections.abc import Iterator, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from identification.diagnosis.diagnosis import MISSING, Diagnosis
from identification.experiment import Experiment
from identification.report.base import DASHED, PageStyle, Picture, panels
from identification.result.result import FitResult
from identification.result.ring_down import RingDown, RingDowns
from identification.wording.names import label, plain_name
from identification.wording.numbers import joined
from vibrojax.drawing import few_ticks, literal

_VAGUE = 3.0
"""Standard error, over the median one, above which a point does not widen an axis."""


def ring_downs(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture, where a record of a fit has a free vibration."""
    names = joined([plain_name(name) for name in result.added.names]) if result.added is not None else ""
    yield from _picture(result.ring_downs, f"with {names}", result.experiment, style)


def ring_downs_of_both(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """The same of a diagnosis."""
    names = joined([plain_name(effect.name) for effect in diagnosis.model.effects])
    named = f"with {names}" if diagnosis.verdict == MISSING else "with the learned term"
    yield from _picture(diagnosis.ring_downs, named, diagnosis.experiment, style)


def _picture(found: RingDowns, augmented: str, experiment: Experiment, style: PageStyle) -> Iterator[Picture]:
    """Measured points with error bars, and lines of the nominal and the augmented model, of that name; damping above, frequency below."""
    if not found.measured:
        return
    lines: list[tuple] = [("nominal model", found.models.get("nominal", ()), style.nominal, DASHED)]
    if "augmented" in found.models:
        lines.append((augmented, found.models["augmented"], style.model, "-"))
    recorded = {name for record in experiment.records for name in record.channels}
    look = label("relative_displacement" if "relative_displacement" in recorded else "hammer_displacement", experiment)
    legend = 0.19 * -(-(len(lines) + 1) // 2)
    figure, ((upper,), (lower,)) = panels((1.95, 1.95), sharex=True, gap=(0.2, 0.0), edges=(0.72, 0.1, 0.45, 0.12 + legend))
    _panel(upper, found.measured, lines, ("damping", 100.0), look.factor, style)
    _panel(lower, found.measured, lines, ("frequency", 1.0), look.factor, style)
    upper.set_ylim(bottom=min(upper.get_ylim()[0], 0.0))
    upper.set_ylabel("damping ratio ζ (%)")
    lower.set_ylabel("frequency f (Hz)")
    lower.set_xlabel(f"amplitude of u ({look.unit})")
    amplitudes, errors, damping = (_joined(found.measured, name) for name in ("amplitude", "damping_stderr", "damping"))
    shown = look.factor * amplitudes[errors <= _VAGUE * np.median(errors)]
    lower.set_xscale("log")
    lower.set_xlim(0.92 * shown.min(), 1.08 * shown.max())
    lower.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0), numticks=12))
    lower.xaxis.set_minor_locator(NullLocator())
    lower.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    upper.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, borderpad=0.1, handlelength=2.6)
    pendulum = experiment.suspension.kind in ("pendulum", "pivot")
    yield Picture(
        name="damping-and-frequency",
        section="decay",
        caption="Damping ratio and frequency of the free vibrations against their amplitude: measured (dots, with one standard error from"
        " the noise), and lines: the motion of each model from the same initial states, read in the same way. Viscous damping is level;"
        " dry friction rises towards small amplitudes, drag towards large ones. A spring that hardens rises in frequency."
        f"{' That of a pendulum falls with the amplitude by itself, as the lines show.' if pendulum else ''}",
        alt=f"Damping ratio, {100 * damping.min():.3g} to {100 * damping.max():.3g} per cent, and frequency of {len(damping)} swings as"
        f" measured against amplitudes from {look.factor * amplitudes.min():.3g} to {look.factor * amplitudes.max():.3g} {look.unit},"
        f" beside {joined([named for named, *_ in lines])}.",
        figure=figure,
    )


def _joined(measured: Sequence[RingDown], name: str) -> np.ndarray:
    return np.concatenate([getattr(one, name) for one in measured])


def _panel(
    axes: Axes, measured: Sequence[RingDown], lines: Sequence[tuple], what: tuple[str, float], per_metre: float, style: PageStyle
) -> None:
    """One quantity; its name as an attribute, and the factor to the axis."""
    name, factor = what
    amplitude, value, error = (_joined(measured, key) for key in ("amplitude", name, f"{name}_stderr"))
    dots = {"fmt": ".", "color": style.measured, "elinewidth": 0.7, "markersize": 4.0, "zorder": 1.0, "label": "measured"}
    axes.errorbar(per_metre * amplitude, factor * value, factor * error, **dots)
    for named, curves, colour, dashes in lines:
        for part, one in enumerate(curves):
            looks = {"color": colour, "linewidth": 1.1, "linestyle": dashes, "marker": "" if len(one.amplitude) > 1 else "_"}
            x, y = per_metre * np.array(one.amplitude), factor * np.array(getattr(one, name))
            axes.plot(x, y, label="_" if part else literal(named), **looks)
    sure = error <= _VAGUE * np.median(error)
    low, high = float(np.min((value - error)[sure])), float(np.max((value + error)[sure]))
    drawn = np.array([v for _, curves, _, _ in lines for one in curves for v in getattr(one, name)])
    room = max(0.5 * (high - low), 1e-3 * abs(high))
    near = drawn[(drawn > low - room) & (drawn < high + room)]
    low, high = min([low, *near]), max([high, *near])
    margin = max(0.06 * (high - low), 1e-4 * abs(high))
    axes.set_ylim(factor * (low - margin), factor * (high + margin))
    few_ticks(axes, y=5)
