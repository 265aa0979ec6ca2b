"""A few impacts of a record, close up: what the model does while the hammer is at the stop."""

from collections.abc import Iterator

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from identification.report.figures.base import Picture, drawn_records, residual_panel, signal_rows
from identification.report.page_style import PageStyle
from identification.result.result import FitResult, Impact, RecordFit, largest, notable, residual
from identification.wording.names import label
from vibrojax.drawing import few_ticks


def impact_closeups(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture a record with contact: the strongest and the worst-fitted impact side by side."""
    for number, record in drawn_records(result):
        chosen = notable(record)
        channels = [c for c in record.chi2_reduced if not c.startswith("cart")] or list(record.chi2_reduced)
        if not chosen or not channels:
            continue
        figure, rows = signal_rows(0.3, len(channels), len(chosen))
        for row, channel in zip(rows, channels, strict=True):
            shown = [impact.around(len(record.time)) for impact in chosen]
            r = [residual(record, channel)[part] for part in shown]
            for _, lower in row:
                residual_panel(lower, max(largest(one) for one in r))
            row[0][0].set_ylabel(label(channel, result.experiment).axis)
            for _, lower in row[1:]:
                lower.set_ylabel("")
            for (upper, lower), impact in zip(row, chosen, strict=True):
                _channel(upper, lower, record, channel, impact, result, style)
        for (upper, _), (_, lower), impact in zip(rows[0], rows[-1], chosen, strict=True):
            upper.set_title(f"impact at {record.time[impact.first]:.4g} s", pad=4)
            lower.set_xlabel("time since touch (ms)")
        times = ", ".join(f"{record.time[impact.first]:.4g} s" for impact in chosen)
        yield Picture(
            name=f"record-{number:02d}-impacts",
            section="records",
            record=record.file,
            caption=f"{record.file}: impacts close up, the strongest and the worst-fitted among them: measured"
            f" ({style.dots.word} dots), model ({style.model.word}), contact shaded; residual in units of the noise σ below.",
            alt=f"Close-up of {len(chosen)} impacts of {record.file}, at {times}: measured and modelled channels with residuals.",
            figure=figure,
        )


def _channel(upper: Axes, lower: Axes, record: RecordFit, channel: str, impact: Impact, result: FitResult, style: PageStyle) -> None:
    look, part = label(channel, result.experiment), impact.around(len(record.time))
    since = 1e3 * (record.time[part] - record.time[impact.first])
    last = 1e3 * (record.time[min(impact.end, len(record.time) - 1)] - record.time[impact.first])
    for axes in (upper, lower):
        axes.axvspan(0.0, float(last), color=style.contact, linewidth=0)
    upper.plot(since, look.factor * record.measured[channel][part], ".", color=style.dots.colour, markersize=3.5)
    upper.plot(since, look.factor * record.predicted[channel][part], color=style.model.colour, linewidth=1.1)
    lower.plot(since, residual(record, channel)[part], color="black", marker=".", markersize=2, linewidth=0.5)
    few_ticks(upper)
    lower.xaxis.set_major_locator(MaxNLocator(6))
