"""How a report looks: in colours, or in black and white for paper, where dashes, marks and widths distinguish curves."""

import dataclasses

from identification.wording import ON_PAPER, ON_SCREEN
from vibrojax.drawing import BLUE, COLOURS, GREY, ORANGE


@dataclasses.dataclass(frozen=True, kw_only=True)
class Ink:
    """One kind of curve: its colour, and the word for it in a caption."""

    colour: str
    word: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class PageStyle:
    """Everything that differs between a report for the screen and one for paper.

    Attributes:
        name: class of the page's body.
        measured: wide lines.
        dots: measured points, alone or under a line.
        accent: measured points that matter most.
        model: fitted to the records, where there is one.
        nominal: without the effects that a diagnosis asserts; always dashed or a ring.
        augmented: with them.
        nominal_band: around the nominal line.
        contact: ground behind what the text speaks of, such as the time in contact.
        series: colours of several curves of one kind, which also differ in `DASHES` or marks.
        sequential: Matplotlib's name of a colour map from nothing to much.
        diverging: the same from -1 to 1; None where only the size is drawn.
        hatch: of a map's cells without a sample.
        pdf: whether each figure is written as a PDF file too.
    """

    name: str
    measured: Ink
    dots: Ink
    accent: Ink
    model: Ink
    nominal: Ink
    augmented: Ink
    nominal_band: str
    contact: str
    series: tuple[str, ...]
    sequential: str
    diverging: str | None
    hatch: str | None
    pdf: bool


DASHED = (0.0, (5.0, 2.0))
DASHES = ("-", DASHED, (0.0, (1.0, 1.2)), (0.0, (6.0, 2.0, 1.0, 2.0)), (0.0, (3.0, 1.0)), "-")
"""Of several curves of one kind."""

SCREEN = PageStyle(
    name=ON_SCREEN,
    measured=Ink(colour="#8a8a8a", word="grey"),
    dots=Ink(colour=GREY, word="grey"),
    accent=Ink(colour=BLUE, word="blue"),
    model=Ink(colour=ORANGE, word="orange"),
    nominal=Ink(colour=BLUE, word="blue"),
    augmented=Ink(colour=ORANGE, word="orange"),
    nominal_band="#b9d4e6",
    contact="#f3eee0",
    series=COLOURS[:6],
    sequential="Blues",
    diverging="PuOr_r",
    hatch=None,
    pdf=False,
)
PRINT = PageStyle(
    name=ON_PAPER,
    measured=Ink(colour="#acacac", word="grey"),
    dots=Ink(colour="#808080", word="grey"),
    accent=Ink(colour="#707070", word="grey"),
    model=Ink(colour="#000000", word="black"),
    nominal=Ink(colour="#000000", word="black"),
    augmented=Ink(colour="#000000", word="black"),
    nominal_band="#d2d2d2",
    contact="#ececec",
    series=("#000000", "#5a5a5a", "#8c8c8c", "#000000", "#5a5a5a", "#8c8c8c"),
    sequential="Greys",
    diverging=None,
    hatch="////",
    pdf=True,
)
STYLES: dict[str, PageStyle] = {style.name: style for style in (SCREEN, PRINT)}
