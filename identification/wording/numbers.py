"""How numbers are printed: no more digits than the error warrants, units with raised exponents; and lists in a sentence."""

import dataclasses
import math
import re
from collections.abc import Iterable, Sequence

NONE = "–"
_RAISED = str.maketrans("0123456789-+n", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺ⁿ")
_LOWERED = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Rounded:
    """A value and its error, rounded alike; both count in units of ten to the `exponent`."""

    value: str
    error: str
    exponent: int
    decimals: int

    @property
    def times(self) -> str:
        """The common power of ten: " × 10⁶", or nothing."""
        return f" × 10{str(self.exponent).translate(_RAISED)}" if self.exponent else ""

    @property
    def text(self) -> str:
        """Value and error in one: "(1.2345 ± 0.0012) × 10⁶"."""
        if not self.error:
            return self.value + self.times
        both = f"{self.value} ± {self.error}"
        return f"({both}){self.times}" if self.exponent else both

    def alike(self, number: float) -> str:
        """Another number, such as the end of an interval, rounded as the value is and without the power of ten."""
        return _fixed(number / 10.0**self.exponent, self.decimals) if math.isfinite(number) else NONE


def rounded(value: float, error: float | None = None) -> Rounded:
    """Round a value to the second digit of its error; without one to five digits.

    Example:
        >>> rounded(1234567.0, 1234.0).text
        '(1.2346 ± 0.0012) × 10⁶'
        >>> rounded(12.3456, 0.0996).text
        '12.35 ± 0.10'
        >>> rounded(0.5).text
        '0.5'
    """
    if not math.isfinite(value):
        return Rounded(value=NONE, error="", exponent=0, decimals=0)
    known = error is not None and math.isfinite(error) and error > 0
    exponent = _exponent(max(abs(value), float(error) if known and error is not None else 0.0))
    if not known or error is None:
        digits = f"{value / 10.0**exponent:.5g}"
        decimals = len(digits.partition(".")[2]) if "e" not in digits else 0
        return Rounded(value=digits.replace("-", "−"), error="", exponent=exponent, decimals=decimals)
    place = math.floor(math.log10(float(f"{error:.1e}"))) - 1
    decimals = min(exponent - place, 12)
    scale = 10.0**exponent
    return Rounded(value=_fixed(value / scale, decimals), error=_fixed(error / scale, decimals), exponent=exponent, decimals=decimals)


def percent(part: float | None, whole: float) -> str:
    """A part in per cent of the whole, to two digits.

    Example:
        >>> percent(0.00123, 1.0), percent(2.8, 2.0), percent(None, 1.0)
        ('0.12 %', '140 %', '–')
    """
    if part is None or not math.isfinite(part) or not whole:
        return NONE
    return f"{significant(100.0 * part / abs(whole), 2)} %"


def significant(number: float | None, digits: int = 3) -> str:
    """A number to so many digits: "0.0123", "1.2 × 10⁻⁷"."""
    if number is None or not math.isfinite(number):
        return NONE
    if number == 0:
        return "0"
    number = float(f"{number:.{digits - 1}e}")
    exponent = _exponent(abs(number))
    power = math.floor(math.log10(abs(number)))
    decimals = max(digits - 1 - (power - exponent), 0)
    return Rounded(value=_fixed(number / 10.0**exponent, decimals), error="", exponent=exponent, decimals=decimals).text


def chance_text(chance: float) -> str:
    """A chance that may be very small.

    Example:
        >>> chance_text(0.0), chance_text(0.25), chance_text(3.3e-7), chance_text(1.0)
        ('< 1 × 10⁻⁹⁹', '0.25', '3.3 × 10⁻⁷', '1')
    """
    return "< 1 × 10⁻⁹⁹" if chance < 1e-99 else significant(chance, 2).removesuffix(".0")


def compact(text: str) -> str:
    """The same numbers as terminals are used to them.

    Example:
        >>> compact("(1.2346 ± 0.0012) × 10⁶"), compact("1.0 × 10⁻⁷")
        ('(1.2346 ± 0.0012)e6', '1.0e-7')
    """
    return re.sub(" × 10([⁰¹²³⁴⁵⁶⁷⁸⁹⁻]+)", lambda power: "e" + power[1].translate(_LOWERED), text)


def unit_text(unit: str) -> str:
    """A unit with raised exponents; nothing for a pure number.

    Example:
        >>> unit_text("N/m^n"), unit_text("m/s^2"), unit_text("1")
        ('N/mⁿ', 'm/s²', '')
    """
    if unit == "1":
        return ""
    head, mark, power = unit.partition("^")
    return head + power.translate(_RAISED) if mark and all(c in "0123456789-n" for c in power) else unit


def with_unit(text: str, unit: str) -> str:
    """Text and unit, if there is one."""
    return f"{text} {unit_text(unit)}".strip()


def _exponent(magnitude: float) -> int:
    """Zero for numbers that read well as they are, else the power of ten."""
    if not magnitude:
        return 0
    power = math.floor(math.log10(magnitude))
    return 0 if -3 <= power < 5 else power


def _fixed(number: float, decimals: int) -> str:
    """Decimals below zero round to tens, hundreds …; a proper minus sign."""
    text = f"{round(number, decimals):.{max(decimals, 0)}f}"
    return text.replace("-", "−") if float(text) else text.replace("-", "")


def joined(words: Sequence[str], last: str = "and") -> str:
    """Words joined by commas and, before the last one, "and" or another word.

    Example:
        >>> joined(["a", "b", "c"]), joined(["a"]), joined([])
        ('a, b and c', 'a', '')
    """
    return f" {last} ".join(part for part in (", ".join(words[:-1]), *words[-1:]) if part)


def grouped(said: Iterable[tuple[str, str]]) -> list[str]:
    """Statements, each once, with all that it holds for.

    Example:
        >>> grouped([("a.csv", "too short"), ("b.csv", "one gap"), ("c.csv", "too short")])
        ['a.csv and c.csv: too short', 'b.csv: one gap']
    """
    subjects: dict[str, list[str]] = {}
    for subject, words in said:
        subjects.setdefault(words, []).append(subject)
    return [f"{joined(those)}: {words}" for words, those in subjects.items()]
