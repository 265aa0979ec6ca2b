"""Expected and found gain of each candidate; or, where nothing is missing, how likely chance alone gives as much."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from identification.diagnosis.calibration import ALPHA as FALSE_ALARM
from identification.diagnosis.diagnosis import Considered, Diagnosis
from identification.report.diagnosis.rows import spoken_detail, strongest
from identification.report.diagnosis.words import beside, plain_name
from identification.report.figures.base import LINK, Picture
from identification.report.page_style import PageStyle
from identification.wording.numbers import chance_text, significant
from vibrojax.drawing import literal, new_figure

_MOST = 10
_LONGEST = 38
"""Letters"""
_LIMIT = significant(FALSE_ALARM, 1).replace(" ", "\u00a0")


def candidates(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture: the strongest candidates."""
    shown = strongest(diagnosis)[:_MOST]
    if not shown:
        return
    height = 0.65 + 0.24 * len(shown)
    figure = new_figure(height)
    axes = figure.add_axes((0.4, 0.43 / height, 0.57, 1 - 0.65 / height))
    places = -np.arange(len(shown), dtype=float)
    complete = diagnosis.is_complete
    (_chances if complete else _gains)(axes, places, shown, style)
    axes.set_yticks(places, [literal(_name(one, everywhere=complete)) for one in shown])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(places[-1] - 0.7, 0.7)
    axes.xaxis.set_minor_locator(NullLocator())
    if complete:
        caption = "Probability that chance alone explains as much, for the strongest candidates. One is fitted in full only below"
        caption += f" {_LIMIT}, left of the dashed line."
        described = [f"{plain_name(one.name)} {chance_text(one.chance)}" for one in shown]
    else:
        caption = "Improvement of twice the log-likelihood that is expected of each candidate beside the model named (pale) and, where"
        caption += " everything was fitted with it, found (dark)."
        described = [f"{plain_name(one.name)} {significant(one.gain if one.drop is None else one.drop, 2)}" for one in shown]
    yield Picture(
        name="candidates",
        section="considered",
        record=None,
        caption=caption,
        alt=("Chances of noise: " if complete else "Gain: ") + "; ".join(described) + ".",
        figure=figure,
    )


def _gains(axes: Axes, places: np.ndarray, shown: tuple[Considered, ...], style: PageStyle) -> None:
    gains = np.maximum(np.nan_to_num([one.gain for one in shown]), 1.0)
    drops = np.maximum([np.nan if one.drop is None else one.drop for one in shown], 1.0)
    least = 0.5 * float(np.nanmin(np.concatenate([gains, drops])))
    axes.barh(places, gains - least, left=least, height=0.62, color=style.nominal_band, label="expected")
    axes.barh(places, drops - least, left=least, height=0.28, color=style.augmented.colour, label="found")
    axes.set_xscale("log")
    axes.set_xlim(least, 1.5 * float(np.nanmax(np.concatenate([gains, drops]))))
    axes.set_xlabel("gain of twice the log-likelihood")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.985), ncols=2, borderpad=0.1)


def _chances(axes: Axes, places: np.ndarray, shown: tuple[Considered, ...], style: PageStyle) -> None:
    chances = np.maximum([one.chance for one in shown], 1e-12)
    axes.hlines(places, chances, 1.0, color=LINK, linewidth=1.4)
    axes.plot(chances, places, "o", color=style.nominal.colour, markersize=5)
    axes.axvline(FALSE_ALARM, color="black", linewidth=0.8, linestyle=(0, (4, 3)))
    axes.set_xscale("log")
    axes.set_xlim(0.3 * min(float(chances.min()), FALSE_ALARM), 1.6)
    axes.set_xlabel("probability that chance alone explains as much")


def _name(one: Considered, *, everywhere: bool) -> str:
    """The effect, its channel or record and, where there are several, the model it was added to."""
    place = spoken_detail(one.detail).partition(",")[0]
    name = plain_name(one.name) + (f": {place}" if place and not any(mark in place for mark in "_=") else "")
    name += "" if everywhere or not one.beside else f" (beside {beside(one)})"
    return name if len(name) <= _LONGEST else name[: _LONGEST - 1] + "…"
