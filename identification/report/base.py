"""What figures and pages of both reports share: their style, pictures and the files they become, and the frame of a page.

A figure is drawn and rendered once, as PNG at twice the pixels of the page; the page holds the same bytes that lie beside it.

To add a figure: write a function that takes a `FitResult` (or a `Diagnosis`) and a `PageStyle` and yields `Picture` objects in the file of
what it shows, then list it in `FIGURES` (or `FIGURES_OF_DIAGNOSIS`) of
`identification/report/page.py`.
"""

import base64
import dataclasses
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from identification.experiment import Experiment, Record
from identification.result.result import FitResult, RecordFit
from identification.trajectory.fit import Progress
from identification.wording import ON_PAPER, ON_SCREEN
from identification.wording.names import equation_html, prose_html, symbol_html
from identification.wording.numbers import significant
from vibrojax.drawing import BLUE, COLOURS, ORANGE, PAGE_SCALE, PALE, WIDTH, envelope, footnote, new_figure, pdf, png
from vibrojax.drawing import style as drawing_style

MOST = 8
"""Records with pictures of their own."""
DASHED = (0.0, (5.0, 2.0))
DASHES = ("-", DASHED, (0.0, (1.0, 1.2)), (0.0, (6.0, 2.0, 1.0, 2.0)), (0.0, (3.0, 1.0)), "-")
"""Of several curves of one kind."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class PageStyle:
    """How a report looks: in colours, or in black and white for paper, where dashes, marks and widths distinguish curves.

    Colours are those of what was measured, of the fitted or augmented `model`, of the `nominal` one without the effects that a diagnosis
    asserts (its lines are dashed) and the band around it, of the ground behind the time in contact, and of several curves in a `series`;
    `sequential` is Matplotlib's name of a colour map. With `pdf` each figure is written as a PDF file too.
    """

    name: str
    measured: str
    model: str
    nominal: str
    band: str
    contact: str
    series: tuple[str, ...]
    sequential: str
    pdf: bool


SCREEN = PageStyle(
    name=ON_SCREEN,
    measured="#8a8a8a",
    model=ORANGE,
    nominal=BLUE,
    band="#b9d4e6",
    contact="#f3eee0",
    series=COLOURS[:6],
    sequential="Blues",
    pdf=False,
)
PRINT = PageStyle(
    name=ON_PAPER,
    measured="#9a9a9a",
    model="#000000",
    nominal="#000000",
    band="#d2d2d2",
    contact="#ececec",
    series=("#000000", "#5a5a5a", "#8c8c8c", "#000000", "#5a5a5a", "#8c8c8c"),
    sequential="Greys",
    pdf=True,
)
STYLES: dict[str, PageStyle] = {style.name: style for style in (SCREEN, PRINT)}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Picture:
    """One figure of a report: file name without suffix, section of the page, caption, the same in words for a reader who does not see it.

    `record` is the file of the one record that it shows; None where it shows all.
    """

    name: str
    section: str
    caption: str
    alt: str
    figure: Figure
    record: str | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Image:
    """A picture as page and files hold it: content of the files by suffix, and the page's pixels across where there is room."""

    picture: Picture
    width: int
    files: dict[str, bytes]

    @property
    def address(self) -> str:
        """The PNG file inside the page."""
        return f"data:image/png;base64,{base64.b64encode(self.files['png']).decode('ascii')}"


def rendered(
    drawers: Sequence[Callable[[Any, PageStyle], Iterator[Picture]]],
    found: Any,
    note: Callable[[Picture], str],
    style: PageStyle,
    progress: Progress = lambda stage: None,
) -> list[Image]:
    """Draw the pictures of what was found, write the note on each below it, and render each once."""
    images = []
    with drawing_style():
        progress("drawing the report")
        drawn = [picture for drawer in drawers for picture in drawer(found, style)]
        for number, one in enumerate(drawn, start=1):
            progress(f"drawing the report: {number} of {len(drawn)} figures")
            footnote(one.figure, note(one))
            files = {"png": png(one.figure)} | ({"pdf": pdf(one.figure)} if style.pdf else {})
            images.append(Image(picture=one, width=round(float(one.figure.get_figwidth() * one.figure.dpi) / PAGE_SCALE), files=files))
    return images


def write_page(
    template: str,
    images: list[Image],
    style: PageStyle,
    folder: Path,
    *,
    file: str = "report.html",
    next_steps: tuple[str, ...],
    provenance: Mapping[str, Any],
    seconds: Mapping[str, float],
    **content: Any,
) -> list[Path]:
    """Write a page that loads nothing from outside itself, and the files of its images beside it; returns the paths, the page first.

    The template extends `frame.html`. What is not marked as HTML is escaped, and a misspelt name is an error. `next_steps` are sentences
    with commands between back quotes; `seconds` has wall time by stage, s, or under "total" as one.
    """
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("identification.report", ""),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters.update(symbol=symbol_html, prose=prose_html, number=significant, step=_step_html, equation=equation_html)
    html = environment.get_template(template).render(
        images=images,
        style=style,
        next_steps=next_steps,
        provenance=provenance,
        seconds=seconds.get("total", sum(seconds.values())),
        stages={} if "total" in seconds else seconds,
        **content,
    )
    written = {folder / file: html.encode()}
    for image in images:
        written |= {folder / f"{image.picture.name}.{suffix}": drawn for suffix, drawn in image.files.items()}
    for path, written_bytes in written.items():
        path.write_bytes(written_bytes)
    return list(written)


def _step_html(text: str) -> Markup:
    """A sentence with commands between back quotes."""
    return Markup(re.sub(r"`([^`]+)`", r"<code>\1</code>", str(prose_html(text))))


def recorded(record: RecordFit, experiment: Experiment) -> Record | None:
    """The record as it was read."""
    return next((read for read in experiment.records if read.file == record.file), None)


def subject(experiment: Experiment, records: Sequence[RecordFit], file: str | None) -> str:
    """The line below a figure: the rig, and the record with its gap and drive, or how many records where `file` is None."""
    if file is None:
        return f"{experiment.name}; {len(records)} {'record' if len(records) == 1 else 'records'}"
    record = next(one for one in records if one.file == file)
    read = recorded(record, experiment)
    if read is not None and read.excitation_frequency is not None:
        drive = f"drive {significant(read.excitation_frequency, 4)} Hz"
    else:
        drive = {"drop-test": "drop test", "free-decay": "free decay"}.get(record.kind, "drive as recorded")
    return "; ".join((experiment.name, file, f"gap {significant(1e3 * record.gap, 4)} mm", drive))


def drawn_records(result: FitResult) -> Iterator[tuple[int, RecordFit]]:
    """Number (from 1, in the order of the experiment) and record; beyond `MOST`, those with the largest misfit in any channel."""
    numbered = list(enumerate(result.records, start=1))
    worst = sorted(numbered, key=lambda item: -max(item[1].chi2_reduced.values(), default=0.0))[:MOST]
    yield from sorted(worst, key=lambda item: item[0])


def panels(
    heights: Sequence[float],
    columns: int = 1,
    *,
    gap: tuple[float, float] = (0.2, 0.5),
    edges: tuple[float, float, float, float] = (0.72, 0.1, 0.45, 0.25),
    width: float = WIDTH,
    **sharing: Any,
) -> tuple[Figure, Any]:
    """A figure and its axes by row and column, all placed in inches: nothing has to be measured, and labels stand in one line.

    `heights` are those of the rows, `gap` is the room between rows and between columns, `edges` that at the left, right, bottom and top;
    `sharing` is as of Matplotlib's `subplots`.
    """
    left, right, below, above = edges
    height = below + above + sum(heights) + gap[0] * (len(heights) - 1)
    wide = (width - left - right - gap[1] * (columns - 1)) / columns
    figure = new_figure(height, width)
    places = {"left": left / width, "right": 1 - right / width, "bottom": below / height, "top": 1 - above / height}
    places |= {"hspace": gap[0] * len(heights) / sum(heights), "wspace": gap[1] / wide, "height_ratios": heights}
    grid = figure.subplots(len(heights), columns, squeeze=False, gridspec_kw=places, **sharing)
    for axes in grid[:, 0]:
        axes.yaxis.set_label_coords(-0.52 / wide, 0.5)
    for axes in grid[:-1].ravel() if sharing.get("sharex") else ():
        axes.xaxis.set_visible(False)
    return figure, grid


def grid_of(count: int, height: float, columns: int, **placed: Any) -> tuple[Figure, Any, list[Axes]]:
    """A figure of so many panels of one height, its axes by row and column, and the used ones in a list; the rest is blank."""
    figure, grid = panels((height,) * -(-count // columns), columns, **placed)
    for axes in grid.ravel()[count:]:
        axes.set_axis_off()
    return figure, grid, list(grid.ravel()[:count])


def residual_panel(axes: Axes, time: np.ndarray, r: np.ndarray, reach: float, colour: str = "black") -> None:
    """A residual over its noise with a band of two standard deviations, on a symmetric axis that holds values up to `reach`."""
    limit = max(float(reach), 4.0)
    tick = float(f"{limit:.0e}")
    axes.axhspan(-2, 2, color=PALE, linewidth=0)
    axes.plot(*envelope(time, r), color=colour, linewidth=0.5)
    axes.set_ylabel("r (σ)")
    axes.set_ylim(-1.15 * limit, 1.15 * limit)
    axes.set_yticks([-tick, 0.0, tick])
