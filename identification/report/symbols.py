"""The thesis's symbols as they are printed: in plain text, and in HTML."""

import re

from markupsafe import Markup, escape

_LOWERED = str.maketrans("0123456789in", "₀₁₂₃₄₅₆₇₈₉ᵢₙ")


def symbol_text(symbol: str) -> str:
    """A symbol with lowered indices.

    Example:
        >>> symbol_text("k_i"), symbol_text("n_2"), symbol_text("ζ")
        ('kᵢ', 'n₂', 'ζ')
    """
    head, mark, index = symbol.partition("_")
    return head + index.translate(_LOWERED) if mark and re.fullmatch(r"[0-9in]+", index) else symbol


def symbol_html(symbol: str) -> Markup:
    """A symbol in italics with its index below the line.

    Example:
        >>> print(symbol_html("k_i"))
        <i>k</i><sub>i</sub>
    """
    head, mark, index = symbol.partition("_")
    return Markup("<i>{}</i><sub>{}</sub>").format(head, index) if mark else Markup("<i>{}</i>").format(escape(symbol))
