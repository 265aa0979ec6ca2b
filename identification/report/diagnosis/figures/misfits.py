"""How far each channel of each record is from the noise, before and after."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, NullLocator

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.figures.base import LINK, Picture
from identification.report.page_style import PageStyle
from identification.wording.names import spoken
from identification.wording.numbers import significant
from vibrojax.drawing import literal, new_figure

_MOST = 16
_NICE = (0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
_NICE_CLOSE = (0.5, 0.6, 0.8, 1, 1.2, 1.5, 2, 3, 4)


def misfits(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture, a line a channel of a record; of many, those that are worst before."""
    shown = _worst(diagnosis)
    if not shown:
        return
    same = not diagnosis.is_augmented
    yield Picture(
        name="misfits",
        section="errors",
        record=None,
        caption="Root mean square residual over the noise, by record and channel"
        + ("" if same else f": nominal model ({style.nominal.word} rings), augmented model ({style.augmented.word} dots)")
        + ". The dashed line at 1 is the best there is.",
        alt="Misfit of every channel: "
        + "; ".join(
            f"{spoken(channel)} of {file} {significant(a, 2)}{'' if same else f' before, {significant(b, 2)} after'}"
            for file, channel, a, b in shown
        )
        + " times the noise.",
        figure=_drawn(shown, same, style),
    )


def _worst(diagnosis: Diagnosis) -> list[tuple[str, str, float, float]]:
    """Record, channel, misfit before and after, in the order of the records."""
    after = {record.file: record for record in diagnosis.augmented.records}
    rows = [
        (record.file, channel, chi2**0.5, after.get(record.file, record).chi2_reduced.get(channel, np.nan) ** 0.5)
        for record in diagnosis.nominal.records
        for channel, chi2 in record.chi2_reduced.items()
        if np.isfinite(chi2)
    ]
    worst = sorted(rows, key=lambda row: -row[2])[:_MOST]
    return [row for row in rows if row in worst]


def _drawn(shown: list[tuple[str, str, float, float]], same: bool, style: PageStyle) -> Figure:
    """Dots on a line each; `same` where there is no augmented model."""
    height = 0.62 + 0.2 * len(shown)
    figure = new_figure(height)
    axes = figure.add_axes((0.4, 0.42 / height, 0.58, 1 - 0.62 / height))
    places = -np.arange(len(shown), dtype=float)
    before, later = (np.array([row[k] for row in shown]) for k in (2, 3))
    axes.axvline(1.0, color="black", linewidth=0.8, linestyle=(0, (4, 3)))
    if not same:
        axes.hlines(places, later, before, color=LINK, linewidth=1.6)
    axes.plot(before, places, "o", color=style.nominal.colour, fillstyle="none", markersize=5, label="nominal")
    if not same:
        axes.plot(later, places, "o", color=style.augmented.colour, markersize=4, label="augmented")
    axes.set_xscale("log")
    everything = np.concatenate([before, later, [1.0]])
    axes.set_xlim(0.8 * np.nanmin(everything), 1.25 * max(float(np.nanmax(everything)), 1.6))
    axes.xaxis.set_major_locator(FixedLocator(_NICE if np.nanmax(everything) > 4.0 else _NICE_CLOSE))
    axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_yticks(places, [literal(f"{_short(file)}: {spoken(channel)}") for file, channel, *_ in shown])
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(places[-1] - 0.7, 0.7)
    axes.set_xlabel("rms residual / noise")
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.985), ncols=2, borderpad=0.1)
    return figure


def _short(file: str) -> str:
    return file if len(file) <= 16 else "…" + file[-15:]
