"""What varies beyond the noise of sensors: parameters between records, and a random force on the hammer within them."""

import dataclasses
from typing import Any

import numpy as np
from scipy.special import chdtrc

from identification.likelihood.evidence import chance_of_force
from identification.likelihood.fitted import Fitted, inertia
from identification.likelihood.random_effects import IDENTIFIED, record_estimates
from identification.likelihood.random_force import RandomForce
from identification.likelihood.variances import orderly, restricted_likelihood
from identification.windows.layout import BASE_AMPLITUDE
from identification.wording.numbers import percent, significant
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


_NOTHING = 1e-4
"""Size that represents a zero force, over the estimated one."""
_STEP = 0.15
"""Step of the log size and log correlation time for second differences."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Unrest:
    """Random force on the hammer with exponential autocorrelation.

    Attributes:
        force_rms: size, N, and its standard error; None where the likelihood is flat.
        memory: correlation time, s, and its standard error.
        share: of the reference force.
        reference: that force: the spring's at the amplitude of the drive, k A0; without spring or drive, the rms inertia in flight.
        gain: twice the restricted log-likelihood gain over no force.
    """

    force_rms: tuple[float, float | None]
    memory: tuple[float, float | None]
    share: float
    reference: str
    gain: float

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
        return f"The random force on the hammer is {self.size} with a correlation time of {significant(1e3 * self.memory[0], 2)} ms."


def unrest(fitted: Fitted, *, alpha: float) -> Unrest | None:
    """Random force beside a fitted model; None where it is not significant at the level `alpha`."""
    gain = gain_of_force(fitted)
    if chance_of_force(gain) > alpha:
        return None
    force = fitted.variances.force
    of_force, of_memory = _errors(fitted)
    size, reference = _reference(fitted)
    return Unrest(force_rms=(force.std, of_force), memory=(force.memory, of_memory), share=force.std / size, reference=reference, gain=gain)


def gain_of_force(fitted: Fitted) -> float:
    """Twice the restricted log-likelihood gain of the random force over no force."""
    force = fitted.variances.force
    return 2.0 * (_likelihood(fitted, force) - _likelihood(fitted, dataclasses.replace(force, std=_NOTHING * force.std)))


def _likelihood(fitted: Fitted, force: RandomForce) -> float:
    at = dataclasses.replace(orderly(fitted.variances), force=force)
    return restricted_likelihood(fitted.point.linear, fitted.point.inner, at)


def _errors(fitted: Fitted) -> tuple[float | None, float | None]:
    """Standard errors of size and correlation time, from the curvature of the restricted likelihood in their logarithms."""
    force = fitted.variances.force

    def at(size: int, memory: int) -> float:
        return _likelihood(fitted, RandomForce(std=force.std * np.exp(_STEP * size), memory=force.memory * np.exp(_STEP * memory)))

    middle = at(0, 0)
    a, b = at(1, 0) + at(-1, 0) - 2 * middle, at(0, 1) + at(0, -1) - 2 * middle
    c = (at(1, 1) + at(-1, -1) - at(1, -1) - at(-1, 1)) / 4
    information = -np.array([[a, c], [c, b]]) / _STEP**2
    if not np.all(np.linalg.eigvalsh(information) > 0):
        return None, None
    size, memory = np.sqrt(np.diag(np.linalg.inv(information)))
    return float(force.std * size), float(force.memory * memory)


def _reference(fitted: Fitted) -> tuple[float, str]:
    """Reference force, N, and its name: k A0, or the rms inertia of the hammer in flight where there is no spring or no drive."""
    model, amplitudes = fitted.model, fitted.estimate.nuisances[:, BASE_AMPLITUDE]
    driven = [r.kind == "cart-excitation" and r.base == "sine" for r in fitted.prepared.experiment.records]
    f_n = float(model.values().get("f_n", 0.0))
    if f_n > 0 and any(driven):
        return float(model.mass) * (2.0 * np.pi * f_n) ** 2 * float(np.abs(amplitudes[driven]).max()), "the spring's force"
    return inertia(fitted.point), "the inertia force"
