"""What every figure of the report is: drawn without any window or global state, legible on paper, told in words as well.

Colours are those of Okabe and Ito, which the colour-blind can tell apart; measured and model also differ in width and lightness, so
that a grey print keeps them apart. Long series are drawn as their envelope.

To add a figure: write a file with a function that takes a `FitResult` and yields `Picture` objects, then list it in
`identification/report/figures/__init__.py`.
"""

import dataclasses
import io
from collections.abc import Callable, Iterator, Sequence

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from identification.result import FitResult

MEASURED, MODEL, ACCENT, FOURTH, BAND = "#8a8a8a", "#d55e00", "#0072b2", "#009e73", "#e4e4e4"
SERIES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9")
WIDTH = 6.2
"""Inches: of a column on paper, and wide enough for a phone held upright."""
DPI = 130
STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.titlesize": 9.0,
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


def style():
    """Context in which figures are made and rendered; outside it Matplotlib is as the user left it."""
    return rc_context(STYLE)


def new_figure(height: float) -> Figure:
    """An empty figure of the report's width; `height` in inches."""
    return Figure(figsize=(WIDTH, height), dpi=DPI, facecolor="white")


def png(figure: Figure) -> bytes:
    """The figure as the bytes of a PNG file."""
    stream = io.BytesIO()
    FigureCanvasAgg(figure).print_png(stream, pil_kwargs={"compress_level": 6})
    return stream.getvalue()


def few_ticks(axes: Axes, x: int = 5, y: int = 4) -> None:
    """At most so many intervals between ticks: short axes stay legible and quick to draw."""
    axes.locator_params(axis="x", nbins=x)
    axes.locator_params(axis="y", nbins=y)


def share_label(axes: Sequence[Axes], text: str) -> None:
    """Label of the x axis below the last of a column; the others lose their numbers."""
    for upper in axes[:-1]:
        upper.tick_params(labelbottom=False)
    axes[-1].set_xlabel(text)
