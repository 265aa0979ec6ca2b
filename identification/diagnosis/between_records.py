"""Variation of parameters between records: each record's own estimate, and a chi-square test of homogeneity."""

import numpy as np
from scipy.special import chdtrc

from identification.diagnosis.diagnosis import Disagreement
from identification.likelihood.fitted import Fitted
from identification.likelihood.random_effects import IDENTIFIED, record_estimates
from vibrojax.parameters import Parameter


def disagreements(fitted: Fitted) -> tuple[Disagreement, ...]:
    """Homogeneity test of every parameter that at least two records identify.

    The weighted sum of squared deviations of the records' own estimates is chi-square distributed where the parameter is the same in all.
    """
    layout, shared, files = fitted.prepared.layout, fitted.estimate.shared, [r.file for r in fitted.prepared.experiment.records]
    shift, sigma = record_estimates(fitted)
    found = []
    for index, p in enumerate(layout.parameters):
        known = np.flatnonzero(sigma[:, index] < IDENTIFIED)
        if len(known) < 2:
            continue
        weight, moved = sigma[known, index] ** -2.0, shift[known, index]
        chi2 = float(np.sum(weight * (moved - np.sum(weight * moved) / np.sum(weight)) ** 2))
        own = {files[k]: _estimated(p, shared[index] + shift[k, index], sigma[k, index]) for k in known}
        chance = float(chdtrc(len(known) - 1, chi2))
        found.append(Disagreement(name=p.name, chi2=chi2, degrees=len(known) - 1, chance=chance, records=own))
    return tuple(found)


def _estimated(p: Parameter, internal: float, sigma: float) -> tuple[float, float]:
    """Value and standard error, SI, of a parameter in its internal coordinate."""
    value = p.to_physical(internal)
    return value, float(sigma) * p.slope(value)
