"""Velocity against displacement of the hammer in the cart: measured and model."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float
from scipy.signal import savgol_filter

from identification.report.figures.base import MANY, Picture, drawn_records
from identification.report.page_style import PageStyle
from identification.result.result import FitResult, RecordFit, impacts, measured_displacement
from vibrojax.drawing import few_ticks, literal, new_figure

_POINTS = 2500
_SMOOTHED = (5, 15)
"""Fewest and most samples of the sliding parabola that turns the measured displacement into a velocity: half a contact."""


def phase_plane(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture, a panel a record."""
    records = [record for _, record in drawn_records(result)]
    columns = min(len(records), 2)
    rows = -(-len(records) // columns)
    height = 0.6 + 2.35 * rows
    figure = new_figure(height)
    grid = figure.subplots(
        rows,
        columns,
        squeeze=False,
        gridspec_kw={"left": 0.125, "right": 0.985, "bottom": 0.45 / height, "top": 1 - 0.3 / height, "hspace": 0.38, "wspace": 0.28},
    )
    for axes, record in zip(grid.ravel(), records, strict=False):
        shown = slice(0, _POINTS)
        measured = _measured(record)
        if measured is not None:
            across, up = 1e3 * measured[0][shown], measured[1][shown]
            axes.plot(across, up, ".", color=style.measured.colour, markersize=1.5, rasterized=len(up) > MANY)
        axes.plot(1e3 * record.relative_displacement[shown], record.relative_velocity[shown], color=style.model.colour, linewidth=0.7)
        axes.axvline(1e3 * record.gap, color="black", linewidth=0.8, linestyle=(0, (4, 3)))
        axes.set_title(literal(f"{record.file} ({record.kind})"), pad=4)
        few_ticks(axes, x=5, y=5)
    for axes in grid[:, 0]:
        axes.set_ylabel("velocity u̇ (m/s)")
    for axes in grid.ravel()[: len(records)][-columns:]:
        axes.set_xlabel("displacement u = x − y (mm)")
    for axes in grid.ravel()[len(records) :]:
        axes.set_axis_off()
    yield Picture(
        name="phase-plane",
        section="contact",
        record=None,
        caption="Phase plane of the hammer relative to the cart: measured displacement and its slope ("
        f"{style.measured.word} dots), model ({style.model.word}); the dashed line"
        f" is the stop. At most the first {_POINTS} samples of each record.",
        alt="Velocity against displacement of the hammer relative to the cart, measured and model, one panel for each of "
        + ", ".join(record.file for record in records)
        + ".",
        figure=figure,
    )


def _measured(record: RecordFit) -> tuple[Float[np.ndarray, " samples"], Float[np.ndarray, " samples"]] | None:
    """Displacement and the slope of a sliding parabola; gaps in the record are gaps in both."""
    u = measured_displacement(record)
    lengths = [impact.end - impact.first for impact in impacts(record)]
    window = int(np.clip(np.median(lengths) / 2 if lengths else _SMOOTHED[1], *_SMOOTHED)) // 2 * 2 + 1
    if u is None or len(u) < window:
        return None
    slope = np.asarray(savgol_filter(u, window, 2, deriv=1, delta=float(np.median(np.diff(record.time))), mode="nearest"))
    slope[: window // 2] = slope[-(window // 2) :] = np.nan
    return u, slope
