"""How every figure of the program looks and becomes a file: no window, no global state, colours that the colour-blind can tell apart."""

import functools
import gc
import io
import logging
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, fontManager, get_font
from matplotlib.rcsetup import cycler
from matplotlib.ticker import MaxNLocator
from PIL import Image

from vibrojax.figure_style import SCREEN, FigureStyle

BLUE, ORANGE, GREEN, PINK, AMBER, SKY = "#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"
GREY, PALE = "#606060", "#e4e4e4"
COLOURS = (BLUE, ORANGE, GREEN, PINK, AMBER, SKY, GREY)
"""For one curve after another: Okabe and Ito's, and a grey."""
WIDTH = SCREEN.column
"""Inches: wide enough for a phone held upright."""
Samples = Float[np.ndarray, " samples"]
_LOG = logging.getLogger(__name__)
PAGE_SCALE = 2
"""Pixels of a figure over those that a page shows it with: sharp on a dense screen."""
_PAGE_DPI = 118 * PAGE_SCALE
_FEW_COLOURS, _ALMOST_WHITE = 64, 248
_STEPS = [1, 2, 2.5, 5, 10]
_NOTE_SIZE, _NOTE_LINE, _NOTE_LETTER = 7.0, 0.145, 0.062
"""Of a line below a figure: points, and inches a line and a letter."""
FORMATS = ("png", "pdf", "svg")
"""Files of every figure of a study."""
DENSE_DPI = 200
"""At which series of many points become images inside a vector figure."""
_INSTALLED = frozenset(font.name for font in fontManager.ttflist)
FAMILIES = [
    "DejaVu Sans",
    *(
        family
        for family in (
            *("Noto Sans CJK JP", "Noto Sans CJK SC", "WenQuanYi Micro Hei", "WenQuanYi Zen Hei"),  # Linux
            *("Microsoft YaHei", "Yu Gothic", "Malgun Gothic", "Segoe UI Symbol", "Nirmala UI", "Arial Unicode MS"),  # Windows
            *("PingFang SC", "Hiragino Sans", "Apple SD Gothic Neo", "Apple Symbols"),  # macOS
            *("Noto Sans Arabic", "Noto Sans Devanagari", "Noto Sans Symbols2", "Noto Emoji", "Symbola", "FreeSans"),
        )
        if family in _INSTALLED
    ),
]
"""Fonts of every figure: a letter that one lacks is taken from the next. Those after the first only where they are installed."""
STYLE: Any = {
    "font.family": FAMILIES,
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.titley": 1.0,  # here and below, a fixed place spares Matplotlib measuring every tick
    "axes.labelsize": 9.0,
    "axes.linewidth": 0.6,
    "axes.prop_cycle": cycler(color=COLOURS),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.formatter.limits": (-4, 5),
    "axes.formatter.useoffset": False,
    "axes.formatter.use_mathtext": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": PALE,
    "grid.linewidth": 0.5,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "lines.linewidth": 1.0,
    "path.simplify": True,
    "agg.path.chunksize": 0,
}
"""For Matplotlib's `rcParams`."""


def settings_of(look: FigureStyle) -> dict[Any, Any]:
    """`STYLE` with the sizes of a style for studies."""
    text = dict.fromkeys(("font.size", "axes.titlesize", "axes.labelsize"), look.text)
    small = dict.fromkeys(("xtick.labelsize", "ytick.labelsize", "legend.fontsize"), look.text - 1.0)
    strokes = {name: look.strokes * STYLE[name] for name in ("axes.linewidth", "grid.linewidth")}
    files = {"pdf.fonttype": 42, "svg.fonttype": "path", "svg.hashsalt": "vibrojax", "hatch.linewidth": 0.5 * look.strokes}
    return STYLE | text | small | strokes | files


@contextmanager
def style(look: FigureStyle = SCREEN) -> Iterator[None]:
    """Context in which figures are made and rendered; outside it Matplotlib is as the user left it.

    Figures leave much cyclic garbage, and looking for it means walking through everything that JAX has compiled: that waits until the end.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        with rc_context(settings_of(look)):
            yield
    finally:
        if collecting:
            gc.enable()


def new_figure(height: float, width: float = WIDTH, *, layout: Literal["constrained"] | None = None) -> Figure:
    """An empty figure.

    Arguments:
        height: inches.
        width: inches.
        layout: "constrained" where Matplotlib is to make room for labels and legends; None where the caller places the panels, which
            is quicker.
    """
    return Figure(figsize=(width, height), dpi=_PAGE_DPI, facecolor="white", layout=layout)


def literal(text: str) -> str:
    """Text from the user, such as a file name, without formulas (a dollar sign stays one) and without letters that no font has."""
    return drawable(text).replace("$", r"\$")


def drawable(text: str) -> str:
    r"""Text in which each letter that no font of `FAMILIES` has is its code, such as `\u6d4b`; the log says so once.

    Example:
        >>> drawable("Prüfstand 3")
        'Prüfstand 3'
    """
    letters = [letter if _has_glyph(letter) else letter.encode("ascii", "backslashreplace").decode("ascii") for letter in text]
    if len(written := "".join(letters)) > len(text):
        _warn_of_letters()
    return written


@functools.cache
def _has_glyph(letter: str) -> bool:
    return letter.isspace() or any(get_font(findfont(family)).get_char_index(ord(letter)) for family in FAMILIES)


@functools.cache
def _warn_of_letters() -> None:
    """Once in a process."""
    _LOG.warning("no installed font has all letters of the names: figures show the codes of those that lack; Noto Sans CJK has most")


def few_ticks(axes: Axes, x: int = 5, y: int = 4) -> None:
    """At most so many intervals between ticks: short axes stay legible and quick to draw."""
    axes.xaxis.set_major_locator(MaxNLocator(x, steps=_STEPS))
    axes.yaxis.set_major_locator(MaxNLocator(y, steps=_STEPS))
    axes.yaxis.get_offset_text().set(x=-0.01, horizontalalignment="right")  # a power of ten stands clear of a title at the left


def envelope(x: Samples, y: Samples, *, columns: int = 700) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, " points"]]:
    """Smallest and largest value of every one of `columns` bins, in the order in which they occur; a short series unchanged.

    Values that are not finite are left out; a bin of only such values leaves a gap.

    Example:
        >>> x = np.arange(10000.0)
        >>> across, up = envelope(x, np.where(x == 1234.0, 7.0, 0.0), columns=100)
        >>> len(across), float(up.max())
        (200, 7.0)
    """
    if len(x) <= 2 * columns:
        return x, y
    length = -(-len(x) // columns)
    padding = (0, -len(x) % length)
    bins_x = np.pad(x, padding, mode="edge").reshape(-1, length)
    bins_y = np.pad(y, padding, constant_values=np.nan).reshape(-1, length)
    usable = np.isfinite(bins_y)
    rows = np.arange(len(bins_y))[:, None]
    lowest = np.where(usable, bins_y, np.inf).argmin(axis=1)
    highest = np.where(usable, bins_y, -np.inf).argmax(axis=1)
    chosen = np.sort(np.stack([lowest, highest], axis=1), axis=1)
    values = np.where(usable.any(axis=1, keepdims=True), bins_y[rows, chosen], np.nan)
    return bins_x[rows, chosen].ravel(), values.ravel()


def footnote(figure: Figure, text: str) -> None:
    """Write a small line below everything; the figure grows by its height, and every panel keeps its size."""
    width, height = figure.get_size_inches()
    lines = textwrap.wrap(drawable(text), int((width - 0.1) / _NOTE_LETTER))
    added = _NOTE_LINE * len(lines) + 0.06
    for axes in figure.axes:
        place = axes.get_position(original=True)
        low, tall = (place.y0 * height + added) / (height + added), place.height * height / (height + added)
        axes.set_position((place.x0, low, place.width, tall))
    figure.set_size_inches(width, height + added)
    figure.text(
        0.05 / width, 0.05 / (height + added), "\n".join(lines), fontsize=_NOTE_SIZE, color=GREY, va="bottom", ha="left", parse_math=False
    )


def png(figure: Figure) -> bytes:
    """The figure as the bytes of a PNG file in few colours, for a page: smaller and quicker, where it is no photograph and no map."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    image = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    stream = io.BytesIO()
    few = image.quantize(_FEW_COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    palette = np.asarray(few.getpalette()).reshape(-1, 3)
    palette[(palette >= _ALMOST_WHITE).all(axis=1)] = 255  # the quantiser turns paper white into a pale grey
    few.putpalette(palette.ravel().tolist())
    few.save(stream, "png", compress_level=6, dpi=(_PAGE_DPI, _PAGE_DPI))
    return stream.getvalue()


def pdf(figure: Figure) -> bytes:
    """The figure as the bytes of a PDF file with its own letters, the same whenever it is made.

    The letters are those of Type 3: whole fonts (Type 42) would take two thirds of the time that a page of pictures takes.
    """
    stream = io.BytesIO()
    with rc_context({"pdf.fonttype": 3}):
        figure.savefig(stream, format="pdf", dpi=DENSE_DPI, metadata={"CreationDate": None, "Creator": None, "Producer": None})
    return stream.getvalue()


def sized(figure: Figure, look: FigureStyle) -> Figure:
    """Bring a figure that was laid out for the screen to the widths of a style; lines and marks grow with its strokes.

    Arguments:
        figure: made within `style(look)`, with the layout "constrained", `WIDTH` wide or wider where it has two panels across.
        look: the style.
    """
    width, height = figure.get_size_inches()
    wanted = look.page if width > WIDTH else look.column
    figure.set_size_inches(wanted, height * wanted / width * look.tall)
    for line in (line for axes in figure.axes for line in axes.lines):
        line.set(linewidth=look.strokes * line.get_linewidth(), markersize=look.strokes * line.get_markersize())
    return figure


def save(figure: Figure, path: Path, look: FigureStyle = SCREEN) -> None:
    """Write the figure to a file of the kind that its suffix says, `.png`, `.pdf` or `.svg`; the same figure gives the same bytes."""
    dates = {".pdf": {"CreationDate": None, "Creator": None, "Producer": None}, ".svg": {"Date": None, "Creator": None}}
    figure.savefig(path, dpi=look.dpi, metadata=dates.get(path.suffix))


def write_figure(draw: Callable[[], Figure], path: Path, look: FigureStyle) -> list[Path]:
    """Draw a figure in a style, and write it to a file of each of `FORMATS`; `path` is without a suffix, which may have dots of its own."""
    paths = [path.with_name(f"{path.name}.{suffix}") for suffix in FORMATS]
    with style(look):
        figure = sized(draw(), look)
        for one in paths:
            save(figure, one, look)
    return paths
