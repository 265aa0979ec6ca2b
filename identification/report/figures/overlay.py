"""Every channel of a record from beginning to end: measured, model, and the residual in standard deviations."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes

from identification.report.channel_labels import label
from identification.report.figures.base import BAND, MEASURED, MODEL, Picture, few_ticks, new_figure
from identification.report.figures.chosen import drawn_records
from identification.report.figures.envelope import envelope
from identification.report.numbers import significant
from identification.report.record_view import residual
from identification.result import FitResult, RecordFit


def overlay(result: FitResult) -> Iterator[Picture]:
    """One picture a record."""
    for number, record in drawn_records(result):
        channels = list(record.chi2_reduced)
        if not channels:
            continue
        height = 0.55 + 1.75 * len(channels)
        figure = new_figure(height)
        rows = figure.subplots(
            2 * len(channels),
            1,
            sharex=True,
            gridspec_kw={
                "height_ratios": [2.2, 1.0] * len(channels),
                "left": 0.125,
                "right": 0.985,
                "bottom": 0.42 / height,
                "top": 1 - 0.25 / height,
                "hspace": 0.28,
            },
        )
        for index, channel in enumerate(channels):
            _signals(rows[2 * index], record, channel, result)
            _residual(rows[2 * index + 1], record, channel)
        rows[0].legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=2, borderpad=0.1, handlelength=1.6)
        rows[-1].set_xlabel("time t (s)")
        rows[-1].set_xlim(record.time[0], record.time[-1])
        told = [f"{label(c, result.experiment).words}: misfit {significant(record.chi2_reduced[c] ** 0.5, 2)} σ" for c in channels]
        yield Picture(
            name=f"record-{number:02d}-overlay",
            section="records",
            record=record.file,
            caption=f"{record.file}: measured (grey) and model (orange); below each channel the residual in units of the noise σ, band ±2 σ.",
            alt=f"Measured and modelled channels of {record.file} against time, residuals below. " + "; ".join(told) + ".",
            figure=figure,
        )


def _signals(axes: Axes, record: RecordFit, channel: str, result: FitResult) -> None:
    look = label(channel, result.experiment)
    axes.plot(*envelope(record.time, look.factor * record.measured[channel]), color=MEASURED, linewidth=1.8, label="measured")
    axes.plot(*envelope(record.time, look.factor * record.predicted[channel]), color=MODEL, linewidth=0.7, label="model")
    axes.set_title(look.words, loc="left", pad=3)
    axes.set_ylabel(look.axis)
    axes.tick_params(labelbottom=False)
    few_ticks(axes)


def _residual(axes: Axes, record: RecordFit, channel: str) -> None:
    r = residual(record, channel)
    axes.axhspan(-2, 2, color=BAND, linewidth=0)
    axes.plot(*envelope(record.time, r), color="black", linewidth=0.5)
    axes.set_ylabel("r (σ)")
    largest = float(np.nanmax(np.abs(r), initial=0.0))
    axes.set_ylim(-1.05 * max(largest, 4.0), 1.05 * max(largest, 4.0))
    few_ticks(axes, y=2)
