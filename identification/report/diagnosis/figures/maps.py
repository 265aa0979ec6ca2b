"""Where in each record the nominal model goes wrong: misfit by part of the record and phase of the excitation."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.image import AxesImage

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.figures.base import Picture
from identification.report.page_style import PageStyle
from identification.report.rows import recorded
from identification.result.result import RecordFit
from identification.wording.numbers import significant
from vibrojax.drawing import GREY, WIDTH, literal, new_figure

_MOST = 6
_COLUMNS = 3
_WIDEST = 2.2
"""Inches"""
_NOTHING = "#dddddd"
_LEAST_REACH = 3.0
"""Times the noise at the dark end of the scale, at least: noise alone stays pale."""
_FEW_TICKS, _DECADES = (1, 2, 3, 5, 10), tuple(10**k for k in range(16))
"""Of the scale, where it is short and where it is long."""
_LONG = 50.0


def maps(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture, a panel a record."""
    shown = _shown(diagnosis)
    if not shown:
        return
    columns = 2 if len(shown) in (2, 4) else min(len(shown), _COLUMNS)
    rows = -(-len(shown) // columns)
    left, right, below, above, tall, gap_x, gap_y = 0.72, 0.85, 0.48, 0.28, 1.45, 0.52, 0.68
    wide = min((WIDTH - left - right - (columns - 1) * gap_x) / columns, _WIDEST)
    width = left + right + columns * wide + (columns - 1) * gap_x
    height = below + above + rows * tall + (rows - 1) * gap_y
    figure = new_figure(height, width)
    top = max(_LEAST_REACH, *(float(np.nanmax(values)) ** 0.5 for _, values in shown))
    for number, (record, values) in enumerate(shown):
        row, column = divmod(number, columns)
        x, y = left + column * (wide + gap_x), height - above - tall - row * (tall + gap_y)
        axes = figure.add_axes((x / width, y / height, wide / width, tall / height))
        image = _panel(axes, diagnosis, record, values, top, style)
        if column == 0:
            axes.set_ylabel("time t (s)")
    bar_axes = figure.add_axes(((width - right + 0.12) / width, below / height, 0.11 / width, (height - below - above) / height))
    bar = figure.colorbar(image, cax=bar_axes)
    ticks = [float(tick) for tick in (_FEW_TICKS if top < _LONG else _DECADES) if tick <= top]
    bar.set_ticks(ticks, labels=[f"{tick:g}" for tick in ticks])
    bar.ax.minorticks_off()
    bar.set_label("rms residual / noise")
    worst = max(shown, key=lambda item: float(np.nanmax(item[1])))
    yield Picture(
        name="residual-maps",
        section="location",
        record=None,
        caption="Misfit of the nominal model by time in the record (upwards) and phase of the excitation (across): root mean square"
        f" residual over the noise; pale is noise alone, {'grey' if style.hatch is None else 'hatched'} is no sample."
        + _remarks(diagnosis, len(shown)),
        alt=f"Maps of the nominal model's misfit over time and excitation phase for {', '.join(record.file for record, _ in shown)};"
        f" the darkest cell, in {worst[0].file}, is {significant(float(np.nanmax(worst[1])) ** 0.5, 2)} times the noise.",
        figure=figure,
    )


def _shown(diagnosis: Diagnosis) -> list[tuple[RecordFit, np.ndarray]]:
    """Records with a map, those with the largest share of the misfit, in the order of the experiment."""
    where = diagnosis.location
    if where is None:
        return []
    able = [r for r in diagnosis.nominal.records if r.file in where.maps and np.isfinite(where.maps[r.file]).any()]
    largest = sorted(able, key=lambda r: -where.records.get(r.file, 0.0))[:_MOST]
    return [(record, where.maps[record.file]) for record in able if record in largest]


def _panel(axes: Axes, diagnosis: Diagnosis, record: RecordFit, values: np.ndarray, top: float, style: PageStyle) -> AxesImage:
    where, read = diagnosis.location, recorded(record, diagnosis.experiment)
    driven = read is None or read.excitation_frequency is not None
    axes.set_facecolor(_NOTHING if style.hatch is None else "white")
    axes.patch.set(hatch=style.hatch, edgecolor=GREY, linewidth=0.0)
    image = axes.imshow(
        np.sqrt(np.maximum(values, 1.0)),
        cmap=style.sequential,
        norm=LogNorm(1.0, top),
        origin="lower",
        aspect="auto",
        interpolation="nearest",
        extent=(0.0, 360.0, float(record.time[0]), float(record.time[-1])),
    )
    axes.grid(False)
    axes.locator_params(axis="y", nbins=5)
    axes.set_xticks([0, 180, 360])
    axes.set_xlabel("phase φ (°)" if driven else "time within the row")
    axes.tick_params(labelbottom=driven)
    share = where.records.get(record.file) if where is not None else None
    name = literal(record.file if len(record.file) <= 18 else "…" + record.file[-17:])
    axes.set_title(name if share is None else f"{name}: {100 * share:.0f} %", pad=4, fontsize=8)
    if where is not None and where.time is not None and where.record in (None, record.file):
        axes.axhline(where.time, color="black", linewidth=0.9, linestyle=(0, (4, 2)))
    return image


def _remarks(diagnosis: Diagnosis, shown: int) -> str:
    where = diagnosis.location
    share = " Per cent: share of the excess misfit." if where is not None and where.records else ""
    mark = " The dashed line is the instant of the change." if where is not None and where.time is not None else ""
    more = len(diagnosis.nominal.records) - shown
    return share + mark + (f" {more} more {'record is' if more == 1 else 'records are'} not drawn." if more else "")
