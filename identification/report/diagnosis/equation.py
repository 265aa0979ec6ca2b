"""Equations of effects, which are written in plain text, as HTML."""

import re

from markupsafe import Markup, escape

_GREEK = {"Omega": "Ω", "delta": "δ", "lambda": "λ", "omega": "ω", "zeta": "ζ", "tau": "τ", "pi": "π", "phi": "φ"}
_SHORT_WORDS = ("if", "in", "or")
_SIGNS = (("->", "→"), ("<=", "≤"), (">=", "≥"), ("-", "−"), ("''", "″"), ("'", "′"), (" * ", " · "))
_UNIT = r"(?:N|m|s|kg|Hz|rad)(?:\^\d+)?"
_NUMBER = (
    rf"(?P<number>\d+(?:\.\d*(?:\(\d+\))?|\(\d+\)|(?=e[-+])))(?:e(?P<ten>[-+]?\d+))?(?P<unit>(?: {_UNIT}\b)+(?:/(?:{_UNIT}|\([^)]*\)))?)?"
)
_SYMBOL = re.compile(rf"{_NUMBER}|(?P<letters>[^\W\d_]+)(?P<digits>\d*)(?:_(?P<index>\w+|\([^)]*\)))?|\^(?P<power>\w+|\([^)]*\))")


def equation_html(text: str) -> Markup:
    """An equation with lowered indices, raised powers, Greek letters and italic symbols.

    Words of three letters or more stand upright, and so do units.

    Example:
        >>> print(equation_html("force = -k_3 u^3"))
        force = −<i>k</i><sub>3</sub> <i>u</i><sup>3</sup>
        >>> print(equation_html("-3.10(20)e+05 N/m^3 u"))
        −3.10(20) × 10<sup>5</sup> N/m<sup>3</sup> <i>u</i>
    """
    pieces, begin = [], 0
    for found in _SYMBOL.finditer(text):
        pieces += [_signs(text[begin : found.start()]), _symbol(found)]
        begin = found.end()
    return Markup("".join((*pieces, _signs(text[begin:]))))


def _symbol(found: re.Match[str]) -> str:
    if found["number"]:
        ten = f" × 10<sup>{_signs(str(int(found['ten'])))}</sup>" if found["ten"] else ""
        return found["number"] + ten + re.sub(r"\^(\d+)", r"<sup>\1</sup>", found["unit"] or "")
    if found["power"]:
        return f"<sup>{_signs(found['power'].strip('()'))}</sup>"
    letters = _GREEK.get(found["letters"], found["letters"])
    upright = len(letters) > 2 or letters in _SHORT_WORDS
    below = (found["index"] or found["digits"]).strip("()")
    return (letters if upright else f"<i>{letters}</i>") + (f"<sub>{_signs(below)}</sub>" if below else "")


def _signs(text: str) -> str:
    """What stands between symbols, with proper signs."""
    for plain, proper in _SIGNS:
        text = text.replace(plain, proper)
    return str(escape(text))
