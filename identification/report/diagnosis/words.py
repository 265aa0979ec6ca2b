"""How a diagnosis is put: the verdict in a headline, effects and coordinates in words, chances in figures."""

import dataclasses
import math

from identification.diagnosis.diagnosis import ADEQUATE, MISSING, RESTLESS, Asserted, Considered, Diagnosis
from identification.report.next_steps import RUN_MODEL
from identification.wording.names import spoken
from identification.wording.numbers import joined, significant
from vibrojax.effects import EFFECTS

_ALMOST = 0.999


@dataclasses.dataclass(frozen=True, kw_only=True)
class Axis:
    """A coordinate as it is drawn and named: values in SI times `factor` are in `unit`."""

    words: str
    symbol: str
    factor: float
    unit: str

    @property
    def label(self) -> str:
        """Text of an axis."""
        unit = f" ({self.unit})" if self.unit else ""
        return f"{self.words} {self.symbol}".strip() + unit


_SYMBOLS = {
    "time": "t",
    "excitation phase": "φ",
    "displacement": "u",
    "velocity": "u̇",
    "indentation": "δ",
    "impact speed": "v⁻",
    "time since impact": "t − tⱼ",
}


def axis(coordinate: str, unit: str) -> Axis:
    """A coordinate with a readable unit: metres in mm, short times in ms, angles in degrees.

    Example:
        >>> axis("displacement", "m").label
        'displacement u (mm)'
    """
    symbol = _SYMBOLS.get(coordinate, "")
    if unit == "m":
        return Axis(words=coordinate, symbol=symbol, factor=1e3, unit="mm")
    if unit == "s" and coordinate != "time":
        return Axis(words=coordinate, symbol=symbol, factor=1e3, unit="ms")
    if unit == "rad":
        return Axis(words=coordinate, symbol=symbol, factor=180.0 / math.pi, unit="°")
    return Axis(words=coordinate, symbol=symbol, factor=1.0, unit="" if unit == "1" else unit)


def quantity(name: str) -> str:
    """What a profile shows: the missing force, or the residual of a channel."""
    return "missing force" if name == "force" else f"residual of {spoken(name)}"


def quantity_unit(name: str) -> str:
    """Unit of that: newtons, or the noise of the channel."""
    return "N" if name == "force" else "σ"


def effect_words(name: str) -> str:
    """What an effect is, by its name.

    Example:
        >>> effect_words("coulomb_friction"), effect_words("sticky_tape")
        ('dry friction in the suspension', 'sticky tape')
    """
    return EFFECTS[name].summary if name in EFFECTS else plain_name(name)


def plain_name(name: str) -> str:
    """A name without its underscores."""
    return name.replace("_", " ")


def headline(diagnosis: Diagnosis) -> str:
    """The verdict in a few words."""
    if not diagnosis.is_finished:
        return "Not finished: " + ("the budget ended the search" if any("budget" in one for one in diagnosis.warnings) else "a fit failed")
    varying = [p.symbol for p in diagnosis.augmented.parameters if p.name in diagnosis.augmented.varying]
    varies = f"{joined(varying)} {'varies' if len(varying) == 1 else 'vary'} between records" if varying else ""
    if diagnosis.verdict == ADEQUATE:
        return f"No listed effect is missing, but {varies}" if varies else "Nothing is missing beyond the noise"
    if diagnosis.verdict == RESTLESS:
        return "Nothing is missing, but a random force acts on the hammer" + (f", and {varies}" if varies else "")
    if diagnosis.verdict == MISSING:
        return f"Missing: {joined([one.effect.summary + (f' ({where(one)})' if where(one) else '') for one in diagnosis.effects])}"
    return f"Something is missing that no {candidates(diagnosis)} explains"


def candidates(diagnosis: Diagnosis) -> str:
    """What the search could name: any listed effect, or one of those that were looked for."""
    return "effect that was looked for" if diagnosis.is_limited else "listed effect"


def next_steps(diagnosis: Diagnosis) -> tuple[str, ...]:
    """What an experimenter can do after a diagnosis, the most urgent first."""
    steps = [] if diagnosis.is_finished else ["Allow more time with `--budget-minutes`: the search was not finished."]
    if diagnosis.next_experiment:
        steps.append(diagnosis.next_experiment)
    if diagnosis.is_complete:
        own = [f"[parameters.{name}]" for name in diagnosis.augmented.varying]
        setting = f", with `varies = true` in {joined(own)}," if own else ""
        steps.append(f"`fit-parameters` with the same experiment{setting} gives the parameters with intervals and correlations.")
    held = "the augmented model, nominal.json the nominal one" if diagnosis.is_augmented else "the nominal model"
    return (*steps, RUN_MODEL.format(which=held))


def where(effect: Asserted) -> str:
    """Record and channel of an effect that does not act everywhere: "impact force, in cart1.csv"; or nothing."""
    channel = spoken(effect.effect.channel) if effect.effect.channel else ""
    record = f"in {effect.effect.record}" if effect.effect.record else ""
    return ", ".join(part for part in (channel, record) if part)


def beside(candidate: Considered) -> str:
    """The model to which a candidate was added."""
    return joined([plain_name(name) for name in candidate.beside]) if candidate.beside else "nominal"


def probability_text(probability: float) -> str:
    """A probability in per cent, never rounded to certainty.

    Example:
        >>> probability_text(0.99999), probability_text(0.62), probability_text(1e-5)
        ('> 99.9 %', '62 %', '< 0.1 %')
    """
    if not math.isfinite(probability):
        return "–"
    if probability > _ALMOST:
        return "> 99.9 %"
    if probability < 1.0 - _ALMOST:
        return "< 0.1 %"
    return f"{significant(100.0 * probability, 3 if 0.1 > min(probability, 1 - probability) else 2)} %"
