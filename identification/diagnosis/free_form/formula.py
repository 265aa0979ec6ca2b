"""A learned free-form term as a formula, with standard errors in brackets."""

import math
from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from vibrojax.effects.free_form import FreeForm, factors, unit_over


def bracketed(value: float, stderr: float | None) -> str:
    """A value with its standard error, to two digits, in units of the last digit.

    Example:
        >>> bracketed(0.14062, 0.00123), bracketed(-31234.0, 210.0), bracketed(39.4, None)
        ('0.1406(12)', '-3.123(21)e+04', '39.4')
    """
    if stderr is None or not math.isfinite(stderr) or stderr <= 0 or value == 0:
        return f"{value:.4g}"
    size = math.floor(math.log10(abs(value)))
    power = size if not -3 <= size <= 3 else 0
    scaled, error = value / 10.0**power, stderr / 10.0**power
    digits = max(1 - math.floor(math.log10(error)), 0)
    error = round(error * 10**digits)
    return f"{scaled:.{digits}f}({error})" + (f"e{power:+03d}" if power else "")


def formula(effect: FreeForm, stderr: Mapping[str, float | None], phases: Mapping[str, tuple[float, float]]) -> str:
    """Equation of a free-form term, with standard errors in units of the last digit.

    Args:
        effect: learned.
        stderr: by parameter name, SI.
        phases: value and standard error by name, of those common to all records; the formula states that the others differ by record.

    Example:
        >>> formula(FreeForm(terms=("u^3",), c1=-3.1e5), {"c1": 2e4}, {})
        'force = -3.10(20)e+05 N/m^3 u^3'
    """
    own, text = [], ""
    for k, term in enumerate(effect.terms, start=1):
        value, words = float(getattr(effect, f"c{k}")), []
        bases = dict(factors(term))
        line = next((base.removeprefix("sine_") for base in bases if base.startswith("sine_")), "")
        if line and value < 0 and f"p{line}" not in phases:
            value = -value
        for base, power in factors(term):
            words.append(_factor(effect, base, power, stderr, phases))
        own += [f"p{line}"] if line and f"p{line}" not in phases else []
        number = f"{bracketed(abs(value), stderr.get(f'c{k}'))} {unit_over(effect.unit, term)}"
        sign = ("-" if value < 0 else "") if not text else (" - " if value < 0 else " + ")
        text += sign + " ".join([number, *(word for word in words if word != "1")])
    left = "force" if not effect.of_channel else f"{effect.of_channel} - motion"
    ends = f", {' and '.join(own)} another in each record" if own else ""
    return f"{left} = {text}{ends}"


def _factor(effect: FreeForm, base: str, power: int, stderr: Mapping[str, float | None], phases: Mapping[str, tuple[float, float]]) -> str:
    if base == "near":
        text = f"1/(1 + (gap - u)/({bracketed(float(effect.d), stderr.get('d'))} m))^2"
    elif base == "settled":
        text = f"(1 - exp(-t/({bracketed(float(effect.tau), stderr.get('tau'))} s)))"
    elif base.startswith("sine_"):
        line = base.removeprefix("sine_")
        frequency = bracketed(float(getattr(effect, f"f{line}_hz")), stderr.get(f"f{line}_hz"))
        phase = bracketed(*phases[f"p{line}"]) if f"p{line}" in phases else f"p{line}"
        text = f"sin(2 pi {frequency} Hz t + {phase})"
    else:
        text = base
    return text if power == 1 else f"{text}^{power}"


def common_phase(phases: Float[np.ndarray, " records"], stderr: Float[np.ndarray, " records"]) -> tuple[float, float] | None:
    """Weighted mean phase of all records, in 0 to 2 pi, and its standard error; None where phases differ by more than their errors."""
    known = np.isfinite(stderr) & (stderr > 0) & (stderr < 1.0)
    if not known.any():
        return None
    weight = stderr[known] ** -2.0
    mean = float(np.angle(np.sum(weight * np.exp(1j * phases[known]))))
    off = np.angle(np.exp(1j * (phases[known] - mean)))
    if np.any(np.abs(off) > 4.0 * stderr[known] + 0.02):
        return None
    return mean % (2.0 * math.pi), float(weight.sum() ** -0.5)
