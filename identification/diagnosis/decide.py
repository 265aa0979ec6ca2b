"""Whether an effect is asserted: by likelihood, identifiability, prediction, and by what it leaves. Nothing else decides.

Levels, each set once:

- `LEVEL`: chance by which noise alone passes for an effect. Null maxima of the gain were 8 to 14 on nine complete rigs, and free forms of
  sixteen columns gained up to 28; at this level one column of some two hundred candidates needs 26, sixteen of one of eight forms 52.
- `IDENTIFIED`: a strength is further from nothing, or a loss from taking energy, than so many of its standard errors.
- `LEFT_OVER`: what a free form may gain over the effect, as a share of what the effect gains. True causes left up to 0.09, wrong ones
  at least 1.8; the geometric middle.
- `BEYOND_NOISE`: a reading error of so many times the noise declared is not the sensor's. Stated noise is good to some ten per cent.
"""

import dataclasses
import math

from identification.result.evidence import chance

LEVEL = 1e-4
IDENTIFIED = 3.0
LEFT_OVER = 0.4
BEYOND_NOISE = 1.5


@dataclasses.dataclass(frozen=True, kw_only=True)
class Evidence:
    """Evidence for an effect; by default its strength is beyond doubt, and no free form gains.

    Attributes:
        gain: of twice the log marginal likelihood, all variances estimated anew in both models, everything refitted; that of the predictive
            density of the records held back included.
        degrees: strengths that the effect adds.
        tried: candidates and places among which it was the best.
        held_out: gain of twice the log predictive density of what was left out; None where nothing can be left out.
        errors: rms error on that, before and after; None where nothing can be left out.
        strength: of its strongest part, over the standard error.
        drives: the part of it that would drive the motion, of an effect that can only brake it, over the standard error.
        left: largest gain of a free form over the model with the effect, of the same likelihoods, with its columns and the number of forms.
    """

    gain: float
    degrees: int
    tried: int
    held_out: float | None
    errors: tuple[float, float] | None
    strength: float = math.inf
    drives: float = 0.0
    left: float = 0.0
    left_degrees: int = 1
    forms: int = 1


def decide(evidence: Evidence) -> str:
    """Reason why an effect is not asserted; empty where it is."""
    if chance(evidence.gain, evidence.degrees, evidence.tried) > LEVEL:
        return "its gain of likelihood is no more than chance gives"
    if not evidence.strength > IDENTIFIED:
        return "these records do not identify its strength"
    if evidence.drives > IDENTIFIED:
        return "it would have to drive the motion that it can only brake"
    if evidence.held_out is not None and not evidence.held_out > 0.0:
        return "it does not predict better what was left out"
    if evidence.errors is not None and not evidence.errors[1] <= evidence.errors[0]:
        return "the error on what was left out rises with it"
    if evidence.left > LEFT_OVER * evidence.gain and chance(evidence.left, evidence.left_degrees, evidence.forms) < LEVEL:
        return "it leaves much that a free form explains"
    return ""
