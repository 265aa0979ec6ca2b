"""Variation of parameters between records: each record's own estimate, a chi-square test of homogeneity, and the mean over records."""

import dataclasses
from typing import Any

import numpy as np
from scipy.special import chdtrc

from identification.likelihood.fitted import Fitted
from identification.likelihood.random_effects import IDENTIFIED, record_estimates
from vibrojax.parameters import Parameter


@dataclasses.dataclass(frozen=True, kw_only=True)
class Disagreement:
    """Variation of one parameter between records, with a chi-square test of homogeneity.

    Attributes:
        name: of the parameter.
        chi2: weighted sum of squared deviations of the records' own estimates from their mean (Cochran's Q).
        degrees: number of records that identify it, less one.
        chance: probability that noise alone scatters them as much.
        records: by file, the record's own estimate and standard error, SI.
        modelled: whether the model has a value for each record.
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


def disagreements(fitted: Fitted) -> tuple[Disagreement, ...]:
    """Homogeneity test of every parameter that at least two records identify.

    The weighted sum of squared deviations of the records' own estimates is chi-square distributed where the parameter is the same in all.
    """
    layout, shared, files = fitted.prepared.layout, fitted.estimate.shared, [r.file for r in fitted.prepared.experiment.records]
    shift, sigma = record_estimates(fitted)
    found, varying = [], {name for name, _ in layout.variations}
    for index, p in enumerate(layout.parameters):
        known = np.flatnonzero(sigma[:, index] < IDENTIFIED)
        if len(known) < 2:
            continue
        weight, moved = sigma[known, index] ** -2.0, shift[known, index]
        chi2 = float(np.sum(weight * (moved - np.sum(weight * moved) / np.sum(weight)) ** 2))
        own = {files[k]: _estimated(p, shared[index] + shift[k, index], sigma[k, index]) for k in known}
        chance = float(chdtrc(len(known) - 1, chi2))
        of_records = Disagreement(name=p.name, chi2=chi2, degrees=len(known) - 1, chance=chance, records=own, modelled=p.name in varying)
        found.append(of_records)
    return tuple(found)


def _estimated(p: Parameter, internal: float, sigma: float) -> tuple[float, float]:
    """Value and standard error, SI, of a parameter in its internal coordinate."""
    value = p.to_physical(internal)
    return value, float(sigma) * p.slope(value)
