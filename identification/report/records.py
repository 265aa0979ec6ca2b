"""Records over time, measured and model: whole, a few impacts close up; and whether what is left over is noise."""

from collections.abc import Iterator

import numpy as np
from matplotlib.ticker import NullLocator
from scipy.special import ndtr

from identification.report.base import DASHES, PageStyle, Picture, drawn_records, panels, residual_panel
from identification.result.result import FitResult, largest, notable, residual
from identification.trajectory.innovations import autocorrelation
from identification.wording.names import label, spoken
from identification.wording.numbers import joined, significant
from vibrojax.drawing import envelope, few_ticks


def overlay(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """Every channel of a record from beginning to end, the residual in standard deviations below; one picture a record."""
    for number, record in drawn_records(result):
        channels = list(record.chi2_reduced)
        if not channels:
            continue
        figure, grid = panels((1.0, 0.42) * len(channels), sharex=True, gap=(0.16, 0.0))
        for upper, lower, channel in zip(grid[::2, 0], grid[1::2, 0], channels, strict=True):
            look, r = label(channel, result.experiment), residual(record, channel)
            sides = ((record.measured, style.measured, 1.8, "measured"), (record.predicted, style.model, 0.7, "model"))
            for side, colour, width, name in sides:
                upper.plot(*envelope(record.time, look.factor * side[channel]), color=colour, linewidth=width, label=name)
            upper.set_title(look.words, loc="left", pad=2)
            upper.set_ylabel(look.axis)
            few_ticks(upper)
            residual_panel(lower, record.time, r, largest(r))
        grid[0, 0].legend(loc="lower right", bbox_to_anchor=(1.0, 0.97), ncols=2, borderpad=0.1, handlelength=1.6)
        grid[-1, 0].set_xlabel("time t (s)")
        grid[-1, 0].set_xlim(record.time[0], record.time[-1])
        misfits = [f"{label(c, result.experiment).words}: misfit {significant(record.chi2_reduced[c] ** 0.5, 2)} σ" for c in channels]
        yield Picture(
            name=f"record-{number:02d}-overlay",
            section="records",
            record=record.file,
            caption=f"{record.file}: measured and model; below each channel the residual over the noise σ, with a band of ±2 σ.",
            alt=f"Measured and modelled channels of {record.file} against time, residuals below. " + "; ".join(misfits) + ".",
            figure=figure,
        )


def impact_closeups(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """The strongest and the worst-fitted impact side by side; one picture a record with contact."""
    for number, record in drawn_records(result):
        chosen, samples = notable(record), len(record.time)
        channels = [c for c in record.chi2_reduced if not c.startswith("cart")] or list(record.chi2_reduced)
        if not chosen or not channels:
            continue
        figure, grid = panels((1.0, 0.42) * len(channels), len(chosen), sharex="col", sharey="row", gap=(0.12, 0.12))
        for column, impact in enumerate(chosen):
            part, touch = impact.around(samples), record.time[impact.first]
            since, last = 1e3 * (record.time[part] - touch), 1e3 * float(record.time[min(impact.end, samples - 1)] - touch)
            for axes in grid[:, column]:
                axes.axvspan(0.0, last, color=style.contact, linewidth=0)
            for upper, lower, channel in zip(grid[::2, column], grid[1::2, column], channels, strict=True):
                look = label(channel, result.experiment)
                upper.plot(since, look.factor * record.measured[channel][part], ".", color=style.measured, markersize=3.5, label="measured")
                upper.plot(since, look.factor * record.predicted[channel][part], color=style.model, linewidth=1.1, label="model")
                upper.set_ylabel("" if column else look.axis)
                reach = max(largest(residual(record, channel)[one.around(samples)]) for one in chosen)
                residual_panel(lower, since, residual(record, channel)[part], reach)
                lower.set_ylabel("" if column else "r (σ)")
                few_ticks(upper)
            grid[0, column].set_title(f"impact at {touch:.4g} s", pad=4)
            grid[-1, column].set_xlabel("time since touch (ms)")
        grid[0, 0].legend(loc="best")
        times = joined([f"{record.time[impact.first]:.4g} s" for impact in chosen])
        yield Picture(
            name=f"record-{number:02d}-impacts",
            section="records",
            record=record.file,
            caption=f"{record.file}: impacts close up, the strongest and the worst-fitted among them, contact shaded; below, the residual"
            " over the noise σ.",
            alt=f"Close-up of {len(chosen)} impacts of {record.file}, at {times}: measured and modelled channels with residuals.",
            figure=figure,
        )


def residuals(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """Share of residuals beyond so many standard deviations against the normal law, and their autocorrelation; one picture."""
    by_channel: dict[str, list[np.ndarray]] = {}
    for record in result.records:
        for channel in record.chi2_reduced:
            by_channel.setdefault(channel, []).append(residual(record, channel))
    if not by_channel:
        return
    figure, ((left, right),) = panels((2.0,), 2, gap=(0.0, 0.8), edges=(0.72, 0.1, 0.45, 0.6))
    across, lags = np.linspace(0.0, 6.0, 121), 40
    left.plot(across, 2 * ndtr(-across), color="#c4c4c4", linewidth=5, label="noise alone")
    samples = 1
    for (channel, series), colour, dashes in zip(by_channel.items(), style.series * 2, DASHES * 2, strict=False):
        pooled = np.sort(np.abs(np.concatenate(series)))
        pooled = pooled[np.isfinite(pooled)]
        samples = max(samples, len(pooled))
        beyond = 1.0 - np.searchsorted(pooled, across, side="right") / max(len(pooled), 1)
        left.plot(across, np.where(beyond > 0, beyond, np.nan), color=colour, linestyle=dashes, linewidth=1.3, label=spoken(channel))
        right.plot(np.arange(1, lags + 1), autocorrelation(series, lags)[1:], color=colour, linestyle=dashes, linewidth=1.3)
    left.set_yscale("log")
    left.yaxis.set_minor_locator(NullLocator())
    left.set_ylim(max(0.3 / samples, 1e-7), 1.5)
    left.set_xlim(0, across[-1])
    left.set_xlabel("|r| (σ)")
    left.set_ylabel("share of residuals beyond")
    right.axhspan(-1.96 / samples**0.5, 1.96 / samples**0.5, color="#c4c4c4", linewidth=0)
    reach = max(0.1, *(abs(limit) for limit in right.get_ylim()))
    right.set_ylim(-reach, reach)
    right.set_xlabel("lag (samples)")
    right.set_ylabel("autocorrelation of r")
    few_ticks(right, x=6)
    figure.legend(loc="upper center", ncols=3, handlelength=2.6)
    yield Picture(
        name="residuals",
        section="residuals",
        caption="Residuals of all records by channel. Left: share of them that is larger than so many σ, with that of noise alone in grey."
        " Right: autocorrelation, with the 95 % band of white noise in grey. A model that leaves nothing out follows the grey in both.",
        alt=f"Distribution and autocorrelation of the residuals of {joined([spoken(c) for c in by_channel])}.",
        figure=figure,
    )
