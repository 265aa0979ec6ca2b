"""What figures share: sizes for the screen, a column of a paper or thesis, and a talk; symbols at axes; and the caption file.

It stands apart from the drawing, so that the command line lists the styles without loading anything else.
"""

import dataclasses
from collections.abc import Mapping
from typing import Any

_MM = 25.4


@dataclasses.dataclass(frozen=True, kw_only=True)
class FigureStyle:
    """Sizes of a figure. Every figure is laid out in inches for the screen and brought to the sizes of a style by `vibrojax.drawing.sized`.

    Attributes:
        name: what `--style` says.
        column: width of a figure of one panel across, inches.
        page: width of a figure of two panels across, inches.
        text: size of letters, points; ticks and legends are one point smaller.
        strokes: width of lines and marks over that on the screen.
        tall: height over width, over that on the screen: large letters need more room between panels.
        dpi: of the PNG file, and of dense points inside a PDF or SVG file.

    Example:
        >>> round(PAPER.column, 3)
        3.307
    """

    name: str
    column: float
    page: float
    text: float
    strokes: float
    tall: float
    dpi: int


SCREEN = FigureStyle(name="screen", column=6.2, page=9.6, text=9.0, strokes=1.0, tall=1.0, dpi=150)
PAPER = FigureStyle(name="paper", column=84.0 / _MM, page=174.0 / _MM, text=7.0, strokes=0.8, tall=1.3, dpi=300)
TALK = FigureStyle(name="talk", column=160.0 / _MM, page=300.0 / _MM, text=14.0, strokes=2.0, tall=1.3, dpi=150)
FIGURE_STYLES: dict[str, FigureStyle] = {style.name: style for style in (SCREEN, PAPER, TALK)}
"""By name; the first is taken where none is chosen."""


SYMBOLS = {
    "frequency_hz": r"excitation frequency $\Omega$",
    "frequency": r"excitation frequency $\Omega$",
    "ratio": r"frequency ratio $\Omega/\omega$",
    "clearance": r"gap over amplitude gap$/A_0$",
    "gap": "gap",
    "base_amplitude": "amplitude of the cart $A_0$",
    "amplitude": "amplitude of the cart $A_0$",
    "mass_ratio": "mass over that of the model",
    "m": "mass of the hammer $m$",
    "f_n": r"natural frequency $\omega$",
    "zeta": r"damping ratio $\zeta$",
    "k_i": "impact stiffness $k_i$",
    "n": "impact exponent $n$",
    "lambda_i": r"impact damping $\lambda_i$",
}
"""What stands at an axis, by the name in the data set; a name that is not listed has its meaning there."""
FORCE, FORCE_OF_CYCLE, FORCE_OVER_WEIGHT = "largest $F_i$ (N)", "largest $F_i$ of a cycle (N)", r"$F_i/(m\,g)$"
AT_STROBES = "$u$ at the strobes (mm)"
RATIO = r"$\Omega/\omega$"


def short(name: str) -> str:
    """Symbol of an axis or parameter, for legends.

    Example:
        >>> short("k_i"), short("gap")
        ('$k_i$', 'gap')
    """
    return "$" + SYMBOLS[name].partition("$")[2] if "$" in SYMBOLS.get(name, "") else name


_FIELDS = {"damping_ratio": "zeta", "natural_frequency_hz": "omega", "length": "l"}


def written(title: str, shown: str, found: str, rows: Mapping[str, str]) -> str:
    """A caption as Markdown: a paragraph, the finding, a list."""
    listed = "\n".join(f"- {name}: {text}" for name, text in rows.items())
    return f"**{title[:1].upper()}{title[1:]}.** {shown}\n\nFound: {found}.\n\n{listed}\n"


def rig_words(document: Mapping[str, Any]) -> str:
    """The model in one line, from `model.json` as `model_document` makes it.

    Example:
        >>> rig = {"mass": 1.0, "suspension": {"kind": "free"}, "law": {"name": "newton", "e": 0.5}, "units": {"law": {"e": "1"}}}
        >>> rig_words(rig)
        'm = 1 kg; suspension free; contact newton (e = 0.5)'
    """
    units = document.get("units", {})
    parts = [f"m = {document['mass']:.4g} kg"]
    for part, key, word in (("suspension", "kind", "suspension"), ("law", "name", "contact")):
        numbers = [
            f"{_FIELDS.get(name, name)} = {value:.4g} {units.get(part, {}).get(name, '1')}".removesuffix(" 1")
            for name, value in document[part].items()
            if name != key and isinstance(value, int | float)
        ]
        parts.append(f"{word} {document[part][key]}" + (f" ({', '.join(numbers)})" if numbers else ""))
    if effects := [effect["name"] for effect in document.get("effects", ()) if "name" in effect]:
        parts.append(f"effects {', '.join(effects)}")
    return "; ".join(parts)
