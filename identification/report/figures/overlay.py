"""Every channel of a record from beginning to end: measured, model, and the residual in standard deviations."""

from collections.abc import Iterator

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from identification.report.figures.base import MEASURED, MODEL, Picture, residual_panel, signal_rows
from identification.report.figures.chosen import drawn_records
from identification.report.figures.envelope import envelope
from identification.result.record_view import largest, residual
from identification.result.result import FitResult, RecordFit
from identification.wording.channel_labels import label
from identification.wording.numbers import significant
from vibrojax.drawing import few_ticks


def overlay(result: FitResult) -> Iterator[Picture]:
    """One picture a record."""
    for number, record in drawn_records(result):
        channels = list(record.chi2_reduced)
        if not channels:
            continue
        figure, rows = signal_rows(0.3, len(channels))
        for (pair,), channel in zip(rows, channels, strict=True):
            _signals(pair[0], record, channel, result)
            _residual(pair[1], record, channel)
        (first, _), (_, last) = rows[0][0], rows[-1][0]
        first.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, borderpad=0.1, handlelength=1.6)
        last.set_xlabel("time t (s)")
        last.set_xlim(record.time[0], record.time[-1])
        told = [f"{label(c, result.experiment).words}: misfit {significant(record.chi2_reduced[c] ** 0.5, 2)} σ" for c in channels]
        yield Picture(
            name=f"record-{number:02d}-overlay",
            section="records",
            record=record.file,
            caption=f"{record.file}: measured (grey) and model (orange); below each channel the residual in units of the noise σ, with"
            " a band of ±2 σ.",
            alt=f"Measured and modelled channels of {record.file} against time, residuals below. " + "; ".join(told) + ".",
            figure=figure,
        )


def _signals(axes: Axes, record: RecordFit, channel: str, result: FitResult) -> None:
    look = label(channel, result.experiment)
    axes.plot(*envelope(record.time, look.factor * record.measured[channel]), color=MEASURED, linewidth=1.8, label="measured")
    axes.plot(*envelope(record.time, look.factor * record.predicted[channel]), color=MODEL, linewidth=0.7, label="model")
    axes.set_title(look.words, loc="left", pad=3)
    axes.set_ylabel(look.axis)
    few_ticks(axes)


def _residual(axes: Axes, record: RecordFit, channel: str) -> None:
    r = residual(record, channel)
    residual_panel(axes, largest(r))
    axes.plot(*envelope(record.time, r), color="black", linewidth=0.5)
    axes.xaxis.set_major_locator(MaxNLocator(6))
