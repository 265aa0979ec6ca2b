"""The thesis's symbols as they are printed: in plain text, and in HTML."""

import re

from markupsafe import Markup, escape

from vibrojax.contact import LAWS
from vibrojax.effects import EFFECTS
from vibrojax.suspension import SUSPENSIONS

_PARAMETERS = [p for owner in (*LAWS.values(), *EFFECTS.values(), *SUSPENSIONS.values()) for p in owner.parameters]
_LISTED = {re.escape(symbol) for p in _PARAMETERS for symbol in (p.symbol, p.from_gap) if "_" in symbol}
_IN_PROSE = re.compile(rf"(?<![\w./\\-])({'|'.join(sorted(_LISTED))})(?![\w/\\-]|\.\w)")
"""A parameter's symbol among words; a part of a file's or an effect's name is none."""
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


def prose_html(text: str) -> Markup:
    """A sentence with the indices of its symbols below the line.

    Example:
        >>> print(prose_html("F_c = 0.2 N in a_1.csv"))
        <i>F</i><sub>c</sub> = 0.2 N in a_1.csv
    """
    return Markup(_IN_PROSE.sub(lambda found: str(symbol_html(found[0])), str(escape(text))))
