"""Statistical evidence: limits of chi-square, p-values of a gain, and what varies beyond the noise of the sensors."""

import dataclasses
from typing import Any

import numpy as np
from scipy.special import chdtrc, chdtri

from identification.wording.numbers import percent, significant

BY_NOISE = 1e-3
"""Probability that noise exceeds the limit."""
OVERALL, ONE_CHANNEL = 0.05, 0.1
"""Relative excess of chi-square allowed for an imperfect noise figure: of all records together, of a single channel."""


def chi2_limit(degrees: int, allowance: float) -> float:
    """Reduced chi-square that pure noise exceeds with probability `BY_NOISE`, times 1 + `allowance` for an imperfect noise figure.

    Example:
        >>> round(chi2_limit(100_000, 0.0), 4)
        1.0139
    """
    return float(chdtri(max(degrees, 1), BY_NOISE)) / max(degrees, 1) * (1.0 + allowance)


def chance(gain: float, degrees: int, trials: int) -> float:
    """P-value of a gain in twice the log-likelihood, as the best of `trials` candidates (Bonferroni: an upper bound).

    Example:
        >>> chance(0.0, 1, 10)
        1.0
        >>> round(chance(30.0, 1, 10), 9)
        4.32e-07
    """
    return float(min(1.0, trials * chdtrc(max(degrees, 1), max(gain, 0.0))))


def chance_of_force(gain: float) -> float:
    """P-value of a gain in twice the log-likelihood due to a random force.

    Under noise alone its size lies at the edge of its range; the gain is then distributed half as chi-square with no degree of freedom,
    half with one.

    Source: S. G. Self, K.-Y. Liang, JASA 82 (1987) 605-610.

    Example:
        >>> round(chance_of_force(2.706), 3)
        0.05
    """
    return 0.5 * float(chdtrc(1, max(gain, 0.0))) if gain > 0 else 1.0


@dataclasses.dataclass(frozen=True, kw_only=True)
class Disagreement:
    """Variation of one parameter between records, with a chi-square test of homogeneity.

    `chi2` is the weighted sum of squared deviations of the records' own estimates from their mean (Cochran's Q), `degrees` the number of
    records that identify the parameter less one, `chance` the probability that noise alone scatters them as much. `records` holds each
    record's own estimate and standard error, SI, by file; `modelled` says whether the model has a value for each record.
    """

    name: str
    chi2: float
    degrees: int
    chance: float
    records: dict[str, tuple[float, float]]
    modelled: bool = False

    @property
    def scatter(self) -> float:
        """Standard deviation of the values beyond their errors, SI, by the method of moments (DerSimonian and Laird 1986).

        0 where only one record identifies the parameter.
        """
        value, weight = np.array([(value, stderr**-2.0) for value, stderr in self.records.values()]).T
        chi2 = float(weight @ (value - weight @ value / weight.sum()) ** 2)
        of_others = float(weight.sum() - weight @ weight / weight.sum())
        return float(np.sqrt(max(chi2 - len(value) + 1, 0.0) / of_others)) if of_others > 0 else 0.0

    @property
    def pooled(self) -> tuple[float, float]:
        """Mean over records and its standard error, SI, each record weighted by the inverse of its variance plus that between records.

        The error holds for a further record of the same kind of rig; it exceeds that of the joint fit where records scatter.

        Source: R. DerSimonian, N. Laird, Controlled Clinical Trials 7 (1986) 177-188 (random effects).
        """
        value, error = np.array(list(self.records.values())).T
        weight = 1.0 / (error**2 + self.scatter**2)
        return float(weight @ value / weight.sum()), float(weight.sum() ** -0.5)

    def document(self) -> dict[str, Any]:
        """As plain data for `fit.json` and `diagnosis.json`."""
        value, stderr = self.pooled
        return {
            "chi2": self.chi2,
            "degrees": self.degrees,
            "chance": self.chance,
            "scatter": self.scatter,
            "modelled": self.modelled,
            "pooled": {"value": value, "stderr": stderr},
            "records": {file: {"value": value, "stderr": stderr} for file, (value, stderr) in self.records.items()},
        }


@dataclasses.dataclass(frozen=True, kw_only=True)
class Unrest:
    """Random force on the hammer with exponential autocorrelation.

    Attributes:
        force_rms: size, N, and its standard error; None where the likelihood is flat.
        memory: correlation time, s, and its standard error.
        share: of the reference force.
        reference: that force: the spring's at the amplitude of the drive, k A0; without spring or drive, the rms inertia in flight.
        gain: twice the restricted log-likelihood gain over no force; infinite where the records cannot be explained without one.
        at_limit: whether it is as large as a fit allows: it then explains any motion, and hardly determines the parameters beside it.
    """

    force_rms: tuple[float, float | None]
    memory: tuple[float, float | None]
    share: float
    reference: str
    gain: float
    at_limit: bool = False

    def document(self) -> dict[str, Any]:
        """The random force as plain data: `unrest` in `fit.json` and `diagnosis.json`."""
        (force, of_force), (memory, of_memory) = self.force_rms, self.memory
        return {
            "force_rms": {"value": force, "stderr": of_force, "unit": "N"},
            "memory": {"value": memory, "stderr": of_memory, "unit": "s"},
            "share": self.share,
            "share_of": self.reference,
        }

    @property
    def size(self) -> str:
        """Its size in words."""
        return f"{significant(self.force_rms[0], 2)} N rms ({percent(self.share, 1.0)} of {self.reference})"

    def sentence(self) -> str:
        """Sentence on the random force for a report."""
        limit = ", as large as a fit allows," if self.at_limit else ""
        return f"The random force on the hammer is {self.size}{limit} with a correlation time of {significant(1e3 * self.memory[0], 2)} ms."
