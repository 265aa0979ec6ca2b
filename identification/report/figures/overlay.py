"""Every channel of a record from beginning to end: measured, model, and the residual in standard deviations."""

from collections.abc import Iterator

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from identification.report.figures.base import Picture, drawn_records, residual_panel, signal_rows
from identification.report.figures.zoom import Curve, Panel, tracks
from identification.report.page_style import PageStyle
from identification.result.result import FitResult, RecordFit, largest, residual
from identification.wording.names import label
from identification.wording.numbers import significant, unit_text
from vibrojax.drawing import few_ticks


def overlay(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture a record."""
    for number, record in drawn_records(result):
        channels = list(record.chi2_reduced)
        if not channels:
            continue
        figure, rows = signal_rows(0.3, len(channels))
        panels = [
            panel for (pair,), channel in zip(rows, channels, strict=True) for panel in _channel(*pair, record, channel, result, style)
        ]
        (first, _), (_, last) = rows[0][0], rows[-1][0]
        first.legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, borderpad=0.1, handlelength=1.6)
        last.set_xlabel("time t (s)")
        last.set_xlim(record.time[0], record.time[-1])
        misfits = [f"{label(c, result.experiment).words}: misfit {significant(record.chi2_reduced[c] ** 0.5, 2)} σ" for c in channels]
        yield Picture(
            name=f"record-{number:02d}-overlay",
            section="records",
            record=record.file,
            caption=f"{record.file}: measured ({style.measured.word}) and model ({style.model.word}); below each"
            " channel the residual in units of the noise σ, with a band of ±2 σ.",
            alt=f"Measured and modelled channels of {record.file} against time, residuals below. " + "; ".join(misfits) + ".",
            figure=figure,
            panels=tuple(panels),
        )


def _channel(signal: Axes, lower: Axes, record: RecordFit, channel: str, result: FitResult, style: PageStyle) -> tuple[Panel, Panel]:
    """Measured and model above, the residual below."""
    look, r = label(channel, result.experiment), residual(record, channel)
    measured, model = look.factor * record.measured[channel], look.factor * record.predicted[channel]
    noise = look.factor * record.noise[channel]
    time, (measured_track, model_track) = tracks(record.time, (measured, model), noise)
    curves = (
        Curve(name="measured", track=measured_track, colour=style.measured.colour, width=1.8),
        Curve(name="model", track=model_track, colour=style.model.colour, width=0.7),
    )
    left = Curve(name="residual", track=measured_track, minus=model_track, noise=noise, colour="#000000", width=0.5)
    for curve, values in zip(curves, (measured, model), strict=True):
        curve.draw(signal, record.time, values)
    signal.set_title(look.words, loc="left", pad=3)
    signal.set_ylabel(look.axis)
    few_ticks(signal)
    residual_panel(lower, largest(r))
    left.draw(lower, record.time, r)
    lower.xaxis.set_major_locator(MaxNLocator(6))
    return (
        Panel(axes=signal, time=time, curves=curves, words=look.words, unit=unit_text(look.unit)),
        Panel(axes=lower, time=time, curves=(left,), words="r", unit="σ", fixed=True),
    )
