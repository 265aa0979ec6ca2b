"""How large a figure, its letters and its lines are: for the screen, for a column of a paper or thesis, for a talk.

The styles stand apart from the drawing, so that the command line lists them without loading anything else.
"""

import dataclasses

_MM = 25.4


@dataclasses.dataclass(frozen=True, kw_only=True)
class FigureStyle:
    """Sizes of a figure. Every figure is laid out in inches for the screen and brought to the sizes of a style by `vibrojax.drawing.sized`.

    Attributes:
        name: what `--style` says.
        column_mm: width of a figure of one panel across, mm.
        page_mm: width of a figure of two panels across, mm.
        text: size of letters, points; ticks and legends are one point smaller.
        strokes: width of lines and marks over that on the screen.
        tall: height over width, over that on the screen: large letters need more room between panels.
        dpi: of the PNG file, and of dense points inside a PDF or SVG file.

    Example:
        >>> round(PAPER.column, 3)
        3.307
    """

    name: str
    column_mm: float
    page_mm: float
    text: float
    strokes: float
    tall: float
    dpi: int

    @property
    def column(self) -> float:
        """Width of one panel, inches."""
        return self.column_mm / _MM

    @property
    def page(self) -> float:
        """Width of two panels, inches."""
        return self.page_mm / _MM


SCREEN = FigureStyle(name="screen", column_mm=6.2 * _MM, page_mm=9.6 * _MM, text=9.0, strokes=1.0, tall=1.0, dpi=150)
PAPER = FigureStyle(name="paper", column_mm=84.0, page_mm=174.0, text=7.0, strokes=0.8, tall=1.3, dpi=300)
TALK = FigureStyle(name="talk", column_mm=160.0, page_mm=300.0, text=14.0, strokes=2.0, tall=1.3, dpi=150)
FIGURE_STYLES: dict[str, FigureStyle] = {style.name: style for style in (SCREEN, PAPER, TALK)}
"""By name; the first is taken where none is chosen."""
