"""How symbols, channels and coordinates are written: symbols of the thesis, words, and a unit that suits the size."""

import dataclasses
import re

from markupsafe import Markup, escape

from identification.experiment import CHANNELS, Experiment, si_unit
from identification.experiment.channels import factor_to_si
from identification.wording.numbers import unit_text
from vibrojax.contact import LAWS
from vibrojax.effects import EFFECTS
from vibrojax.suspension import SUSPENSIONS

_PARAMETERS = [p for owner in (*LAWS.values(), *EFFECTS.values(), *SUSPENSIONS.values()) for p in owner.parameters]
_LISTED = {re.escape(symbol) for p in _PARAMETERS for symbol in (p.symbol, p.from_gap) if "_" in symbol}
_IN_PROSE = re.compile(rf"(?<![\w./\\-])({'|'.join(sorted(_LISTED))})(?![\w/\\-]|\.\w)")
"""A parameter's symbol among words; a part of a file's or an effect's name is none."""
_GREEK = {"Omega": "Ω", "delta": "δ", "lambda": "λ", "omega": "ω", "zeta": "ζ", "kappa": "κ", "tau": "τ", "pi": "π", "phi": "φ"}
_SIGNS = (("->", "→"), ("<=", "≤"), (">=", "≥"), ("-", "−"), ("&#39;&#39;", "″"), ("&#39;", "′"), (" * ", " · "))
_LOWERED = str.maketrans("0123456789in", "₀₁₂₃₄₅₆₇₈₉ᵢₙ")


def symbol_text(symbol: str) -> str:
    """A symbol with lowered indices.

    Example:
        >>> symbol_text("k_i"), symbol_text("n_2"), symbol_text("ζ")
        ('kᵢ', 'n₂', 'ζ')
    """
    head, mark, index = symbol.partition("_")
    return head + index.translate(_LOWERED) if mark and re.fullmatch(r"[0-9in]+", index) else symbol


def heading(symbol: str, unit: str) -> str:
    """A symbol with its unit, as a heading or for an axis.

    Example:
        >>> heading("k_i", "N/m^n"), heading("n", "1")
        ('kᵢ (N/mⁿ)', 'n')
    """
    return symbol_text(symbol) + (f" ({unit_text(unit)})" if unit_text(unit) else "")


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


def equation_html(text: str) -> Markup:
    """An equation of an effect, written in plain text, with lowered indices, raised powers, Greek letters and proper signs.

    Example:
        >>> print(equation_html("force = -k_3 u^3"))
        force = −k<sub>3</sub> u<sup>3</sup>
        >>> print(equation_html("-3.10(20)e+05 N/m^3 u"))
        −3.10(20) × 10<sup>5</sup> N/m<sup>3</sup> u
    """
    html = str(escape(text))
    html = re.sub(r"(?<=[\d)])e([-+]?\d+)\b", lambda found: f" × 10<sup>{int(found[1])}</sup>", html)
    html = re.sub(r"\^(\w+|\([^)]*\))", lambda found: f"<sup>{found[1].strip('()')}</sup>", html)
    html = re.sub(r"(?<=[^\W\d])(?:_(\w+|\([^)]*\))|(\d+))", lambda found: f"<sub>{(found[1] or found[2]).strip('()')}</sub>", html)
    html = re.sub(rf"\b({'|'.join(_GREEK)})(?=\b|<)", lambda found: _GREEK[found[1]], html)
    for plain, proper in _SIGNS:
        html = html.replace(plain, proper)
    return Markup(html)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Label:
    """How one channel or coordinate is drawn: values in SI times `factor` are in `unit`."""

    words: str
    symbol: str
    factor: float
    unit: str

    @property
    def axis(self) -> str:
        """Text of an axis."""
        return f"{self.symbol} ({unit_text(self.unit)})"


_SYMBOLS = {
    "hammer_displacement": "x",
    "cart_displacement": "y",
    "relative_displacement": "u",
    "hammer_acceleration": "ẍ",
    "cart_acceleration": "ÿ",
    "impact_force": "Fᵢ",
    "applied_force": "F",
    "reaction_force": "R",
}


def spoken(channel: str) -> str:
    """A channel in words.

    Example:
        >>> spoken("impact_force")
        'impact force'
    """
    return channel.replace("_", " ")


def plain_name(effect: str) -> str:
    """Name of an effect in words; a term of the user that has no name is its formula, which stays what it is.

    Example:
        >>> plain_name("quadratic_drag"), plain_name("-a*u_dot")
        ('quadratic drag', '-a*u_dot')
    """
    return effect.replace("_", " ") if effect.isidentifier() else effect


def label(channel: str, experiment: Experiment) -> Label:
    """Displacements in mm, everything else in SI; angles, and volts that stand for a quantity, stay what they are."""
    words, symbol = spoken(channel), _SYMBOLS.get(channel, channel)
    sensor = experiment.sensors.get(channel)
    if sensor is not None and sensor.sensitivity is None and sensor.unit in ("V", "rad", "deg"):
        return Label(words=words, symbol=symbol, factor=1.0 / factor_to_si(sensor.unit, CHANNELS[channel], channel), unit=sensor.unit)
    unit = si_unit(channel)
    return Label(words=words, symbol=symbol, factor=1e3 if unit == "m" else 1.0, unit="mm" if unit == "m" else unit)


_COORDINATES = {
    "time": "t",
    "frequency": "f",
    "displacement": "u",
    "velocity": "u̇",
    "indentation": "δ",
}


def coordinate_label(coordinate: str, unit: str) -> Label:
    """A coordinate with a readable unit: metres in mm, metres per second in mm/s.

    Example:
        >>> coordinate_label("displacement", "m").axis
        'displacement u (mm)'
    """
    factor, shown = {"m": (1e3, "mm"), "m/s": (1e3, "mm/s")}.get(unit, (1.0, unit))
    return Label(words=coordinate, symbol=f"{coordinate} {_COORDINATES.get(coordinate, '')}".strip(), factor=factor, unit=shown)
