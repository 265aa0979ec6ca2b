"""A few impacts of a record, close up: what the model does while the hammer is at the stop."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes

from identification.report.channel_labels import label
from identification.report.figures.base import BAND, MEASURED, MODEL, Picture, few_ticks, new_figure
from identification.report.figures.chosen import drawn_records
from identification.report.record_view import Impact, notable, residual
from identification.result import FitResult, RecordFit


def impact_closeups(result: FitResult) -> Iterator[Picture]:
    """One picture a record with contact: first, strongest and worst-fitted impact, one a column."""
    for number, record in drawn_records(result):
        chosen, channels = notable(record), [c for c in record.chi2_reduced if not c.startswith("cart")] or list(record.chi2_reduced)
        if not chosen or not channels:
            continue
        height = 0.75 + 1.75 * len(channels)
        figure = new_figure(height)
        grid = figure.subplots(
            2 * len(channels),
            len(chosen),
            squeeze=False,
            sharex="col",
            sharey="row",
            gridspec_kw={
                "height_ratios": [2.2, 1.0] * len(channels),
                "left": 0.125,
                "right": 0.985,
                "bottom": 0.42 / height,
                "top": 1 - 0.42 / height,
                "hspace": 0.25,
                "wspace": 0.08,
            },
        )
        for column, impact in enumerate(chosen):
            for row, channel in enumerate(channels):
                _channel(grid[2 * row, column], grid[2 * row + 1, column], record, channel, impact, result)
            grid[0, column].set_title(f"impact at {record.time[impact.first]:.4g} s", pad=4)
            grid[-1, column].set_xlabel("time since touch (ms)" if len(chosen) < 3 else "since touch (ms)")
        for row, channel in enumerate(channels):
            grid[2 * row, 0].set_ylabel(label(channel, result.experiment).axis)
            grid[2 * row + 1, 0].set_ylabel("r (σ)")
        times = ", ".join(f"{record.time[impact.first]:.4g} s" for impact in chosen)
        yield Picture(
            name=f"record-{number:02d}-impacts",
            section="records",
            record=record.file,
            caption=f"{record.file}: impacts close up (among them the first, the strongest and the worst-fitted): measured (grey dots),"
            " model (orange), contact shaded; residual in units of the noise σ below.",
            alt=f"Close-up of {len(chosen)} impacts of {record.file}, at {times}: measured and modelled channels with residuals.",
            figure=figure,
        )


def _channel(upper: Axes, lower: Axes, record: RecordFit, channel: str, impact: Impact, result: FitResult) -> None:
    look, part = label(channel, result.experiment), impact.around(len(record.time))
    since = 1e3 * (record.time[part] - record.time[impact.first])
    last = 1e3 * (record.time[min(impact.end, len(record.time) - 1)] - record.time[impact.first])
    for axes in (upper, lower):
        axes.axvspan(0.0, float(last), color="#f3efe6", linewidth=0)
    upper.plot(since, look.factor * record.measured[channel][part], ".", color="#6a6a6a", markersize=3.2)
    upper.plot(since, look.factor * record.predicted[channel][part], color=MODEL, linewidth=1.1)
    lower.axhspan(-2, 2, color=BAND, linewidth=0)
    r = residual(record, channel)[part]
    lower.plot(since, r, color="black", marker=".", markersize=2, linewidth=0.5)
    reach = 1.05 * max(float(np.nanmax(np.abs(r), initial=0.0)), 4.0, abs(lower.get_ylim()[1]) if lower.lines[1:] else 0.0)
    lower.set_ylim(-reach, reach)
    few_ticks(upper, x=4)
    few_ticks(lower, x=4, y=2)
