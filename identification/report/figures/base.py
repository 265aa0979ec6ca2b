"""What every figure of the report is: drawn without any window or global state, legible on paper, told in words as well.

Colours are those of Okabe and Ito, which the colour-blind can tell apart; measured and model also differ in width and lightness, so
that a grey print keeps them apart. Long series are drawn as their envelope.

To add a figure: write a file with a function that takes a `FitResult` and yields `Picture` objects, then list it in
`identification/report/figures/__init__.py`.
"""

import dataclasses
import gc
import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from PIL import Image

from identification.result import FitResult

MEASURED, MODEL, ACCENT = "#8a8a8a", "#d55e00", "#0072b2"
DOTS, BAND, CONTACT = "#606060", "#e4e4e4", "#f3eee0"
SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
WIDTH = 6.2
"""Inches: of a column on paper, and wide enough for a phone held upright."""
DPI = 130
SCREEN_DPI = 118
"""Pixels an inch at which a page shows a figure, if it has the room."""
_COLOURS, _ALMOST_WHITE = 64, 248
_STEPS = [1, 2, 2.5, 5, 10]
STYLE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.titley": 1.0,  # here and below, a fixed place spares Matplotlib measuring every tick
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.formatter.limits": (-4, 5),
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "lines.linewidth": 1.0,
    "path.simplify": True,
    "agg.path.chunksize": 0,
}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Picture:
    """One image of the report.

    Attributes:
        name: of the file, without suffix; unique within a report.
        section: of the page it belongs to: "records", "contact", "residuals", "correlation" or "starts".
        record: file of the record it shows; None where it shows all.
        caption: printed below it.
        alt: what it shows, for a reader who does not see it.
        figure: drawn.
    """

    name: str
    section: str
    record: str | None
    caption: str
    alt: str
    figure: Figure


Drawer = Callable[[FitResult], Iterator[Picture]]


@contextmanager
def style() -> Iterator[None]:
    """Context in which figures are made and rendered; outside it Matplotlib is as the user left it.

    Figures leave much cyclic garbage, and looking for it means walking through everything that JAX has compiled: that waits until the end.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        with rc_context(STYLE):
            yield
    finally:
        if collecting:
            gc.enable()


def new_figure(height: float, width: float = WIDTH) -> Figure:
    """An empty figure; sizes in inches."""
    return Figure(figsize=(width, height), dpi=DPI, facecolor="white")


def png(figure: Figure) -> bytes:
    """The figure as the bytes of a PNG file, in few colours: smaller and quicker, and none of these figures is a photograph."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    stream = io.BytesIO()
    few = image.quantize(_COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    palette = np.asarray(few.getpalette()).reshape(-1, 3)
    palette[(palette >= _ALMOST_WHITE).all(axis=1)] = 255  # the quantiser turns paper white into a pale grey
    few.putpalette(palette.ravel().tolist())
    few.save(stream, "png", compress_level=6, dpi=(DPI, DPI))
    return stream.getvalue()


def few_ticks(axes: Axes, x: int = 5, y: int = 4) -> None:
    """At most so many intervals between ticks: short axes stay legible and quick to draw."""
    axes.xaxis.set_major_locator(MaxNLocator(x, steps=_STEPS))
    axes.yaxis.set_major_locator(MaxNLocator(y, steps=_STEPS))


def signal_rows(height_above: float, channels: int, columns: int = 1) -> tuple[Figure, list[list[tuple[Axes, Axes]]]]:
    """A figure with a tall and a short panel a channel, one below the other; one column or several.

    Args:
        height_above: room at the top, inches.
        channels: count of pairs in a column.
        columns: side by side.

    Returns:
        The figure, and by channel and column the pair (signal, residual). Only the lowest panels have an axis of x.
    """
    tall, short, inner, outer, left, right, below, gutter = 1.0, 0.42, 0.07, 0.27, 0.72, 0.12, 0.45, 0.12
    height = height_above + below + channels * (tall + short + inner) + (channels - 1) * outer
    figure = new_figure(height)
    width = (WIDTH - left - right - (columns - 1) * gutter) / columns
    pairs = []
    for channel in range(channels):
        top, row = height - height_above - channel * (tall + short + inner + outer), []
        for column in range(columns):
            place, first = left + column * (width + gutter), pairs[0][column][0] if pairs else None
            size = (width / WIDTH, tall / height)
            beside = row[0] if row else (None, None)
            upper = figure.add_axes((place / WIDTH, (top - tall) / height, *size), sharex=first, sharey=beside[0])
            bottom, size = (top - tall - inner - short) / height, (width / WIDTH, short / height)
            lower = figure.add_axes((place / WIDTH, bottom, *size), sharex=first or upper, sharey=beside[1])
            upper.xaxis.set_visible(False)
            lower.xaxis.set_visible(channel == channels - 1)
            lower.xaxis.set_label_coords(0.5, -0.25 / short)
            for axes in (upper, lower):
                axes.yaxis.set_label_coords(-0.52 / width, 0.5)
            for axes in (upper, lower) if column else ():
                axes.tick_params(labelleft=False, left=False)
            row.append((upper, lower))
        pairs.append(row)
    return figure, pairs


def residual_panel(axes: Axes, reach: float) -> None:
    """Band of two standard deviations, and a symmetric axis that holds residuals up to `reach`."""
    axes.axhspan(-2, 2, color=BAND, linewidth=0)
    axes.set_ylabel("r (σ)")
    limit = max(float(reach), 4.0)
    axes.set_ylim(-1.15 * limit, 1.15 * limit)
    nice = float(f"{limit:.0e}")
    axes.set_yticks([-nice, 0.0, nice])
