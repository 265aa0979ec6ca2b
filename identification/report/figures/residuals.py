"""Are the residuals noise? Their distribution and their memory, channel by channel over all records."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from matplotlib.ticker import NullLocator
from scipy.special import ndtr

from identification.report.figures.base import Picture
from identification.report.page_style import DASHES, PageStyle
from identification.result.result import FitResult, residual
from identification.wording.names import spoken
from vibrojax.drawing import few_ticks, new_figure

_LAGS = 40
_FURTHEST = 6.0
"""σ"""


def residuals(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture: share of residuals beyond so many standard deviations against the normal law, and autocorrelation."""
    by_channel: dict[str, list[np.ndarray]] = {}
    for record in result.records:
        for channel in record.chi2_reduced:
            by_channel.setdefault(channel, []).append(residual(record, channel))
    if not by_channel:
        return
    figure = new_figure(3.1)
    left, right = figure.subplots(1, 2, gridspec_kw={"left": 0.105, "right": 0.985, "bottom": 0.15, "top": 0.8, "wspace": 0.32})
    across = np.linspace(0.0, _FURTHEST, 121)
    left.plot(across, 2 * ndtr(-across), color="#c4c4c4", linewidth=5, label="noise alone")
    samples = 1
    for (channel, series), colour, dashes in zip(by_channel.items(), style.series * 2, DASHES * 2, strict=False):
        pooled = np.sort(np.abs(np.concatenate(series)))
        pooled = pooled[np.isfinite(pooled)]
        samples = max(samples, len(pooled))
        beyond = 1.0 - np.searchsorted(pooled, across, side="right") / max(len(pooled), 1)
        left.plot(across, np.where(beyond > 0, beyond, np.nan), color=colour, linestyle=dashes, linewidth=1.3, label=spoken(channel))
        right.plot(np.arange(1, _LAGS + 1), autocorrelation(series, _LAGS)[1:], color=colour, linestyle=dashes, linewidth=1.3)
    left.set_yscale("log")
    left.yaxis.set_minor_locator(NullLocator())
    left.set_ylim(max(0.3 / samples, 1e-7), 1.5)
    left.set_xlim(0, _FURTHEST)
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
        record=None,
        caption="Residuals of all records by channel. Left: share of them that is larger than so many σ, with that of noise"
        " alone in grey. Right: autocorrelation, with the 95 % band of white noise in grey."
        " A model that leaves nothing out follows the grey in both.",
        alt="Distribution and autocorrelation of the residuals of " + ", ".join(spoken(c) for c in by_channel) + ".",
        figure=figure,
    )


def autocorrelation(series: list[np.ndarray], lags: int) -> Float[np.ndarray, " lags"]:
    """Mean product of residuals so many samples apart over their mean square; all records together, gaps left out.

    Example:
        >>> autocorrelation([np.array([1.0, -1.0, 1.0, -1.0])], 1).round(2).tolist()
        [1.0, -1.0]
    """
    products = [[one[lag:] * one[: len(one) - lag] for one in series if len(one) > lag] for lag in range(lags + 1)]
    means = np.array([np.nanmean(np.concatenate(p)) if p and np.isfinite(np.concatenate(p)).any() else np.nan for p in products])
    if not means[0] > 0.0:  # nothing is left over, or nothing was recorded
        return np.full(lags + 1, np.nan)
    return means / means[0]
