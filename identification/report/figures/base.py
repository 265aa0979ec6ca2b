"""What every figure of the report is: drawn without any window or global state, legible on paper, described in words as well.

Colours are those of a `PageStyle`; measured and model also differ in width and lightness, so that a grey print keeps them apart.
Long series are drawn as their envelope.

To add a figure: write a file with a function that takes a `FitResult` and a `PageStyle` and yields `Picture` objects, then list it in
`identification/report/figures/__init__.py`.
"""

import dataclasses
from collections.abc import Callable, Iterator

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.report.figures.zoom import Panel
from identification.report.page_style import SCREEN, PageStyle
from identification.result.result import FitResult, RecordFit
from vibrojax.drawing import PALE, WIDTH, new_figure

MEASURED, MODEL, ACCENT, SERIES = SCREEN.measured.colour, SCREEN.model.colour, SCREEN.accent.colour, SCREEN.series
"""For figures elsewhere that are to look alike."""
BAND, LINK = PALE, "#c8c8c8"
"""Ground of two standard deviations, and lines from one mark to another."""
MOST = 8
"""Records with pictures of their own."""
MANY = 400
"""Marks of one kind from which on they are an image inside a vector figure."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Picture:
    """One image of the report.

    Attributes:
        name: of the file, without suffix; unique within a report.
        section: of the page it belongs to: "records", "contact", "decay", "residuals", "correlation", "posterior" or "starts".
        record: file of the record it shows; None where it shows all.
        caption: printed below it.
        alt: what it shows, for a reader who does not see it.
        figure: drawn.
        panels: that can be zoomed in the page.
    """

    name: str
    section: str
    record: str | None
    caption: str
    alt: str
    figure: Figure
    panels: tuple[Panel, ...] = ()


Drawer = Callable[[FitResult, PageStyle], Iterator[Picture]]


def drawn_records(result: FitResult) -> Iterator[tuple[int, RecordFit]]:
    """Number (from 1, in the order of the experiment) and record; beyond `MOST`, those with the largest misfit in any channel."""
    numbered = list(enumerate(result.records, start=1))
    worst = sorted(numbered, key=lambda item: -max(item[1].chi2_reduced.values(), default=0.0))[:MOST]
    yield from sorted(worst, key=lambda item: item[0])


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
