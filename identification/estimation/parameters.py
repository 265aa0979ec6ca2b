"""What a fitted chain says of the parameters: standard errors, identifiability, intervals, each record alone; and what is random in it."""

import dataclasses
from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import chdtrc, ndtri

from identification.result.evidence import Disagreement, Unrest, chance_of_force
from identification.result.result import AT_BOUND, FIXED, NOT_IDENTIFIABLE, OK, ParameterEstimate, Quantity, SensorError
from identification.trajectory import elimination
from identification.trajectory.fit import Fitted, settled
from identification.trajectory.innovations import whiteness
from identification.trajectory.random_force import RandomForce
from identification.trajectory.segments import OF_RECORD, VARIATION
from identification.trajectory.start import Problem, weighable
from identification.trajectory.variances import SMALLEST_FORCE, is_largest, reweighed
from vibrojax.channels import UNITS

DERIVED = {"k": "N/m", "c": "N s/m"}
"""Units of the numbers derived from mass, natural frequency and damping ratio, by name."""
FORCE_BY_CHANCE = 1e-4
"""Probability that noise alone gives the random force that a fit reports."""
_SIGMAS_95 = float(ndtri(0.975))
_NULL = 1e-11
"""Eigenvalue of the scaled information below which a direction is not identifiable."""
LARGEST_STDERR = 1.0
"""Standard error in the coordinate of the fit (a factor of e) up to which records say something of a parameter."""
_WEAK = 0.1
"""The same above which an interval follows the likelihood: a tenth, where a logarithm is no longer linear."""
_WIDE = 10.0
"""Prior standard deviation of a parameter within a single record, in the coordinate of the fit."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Standard errors of the shared parameters, in the coordinate of the fit: a logarithm, or the value over its usual size.

    Attributes:
        covariance: (parameters, parameters), 0 where not estimated.
        identifiable: (parameters,) False for free ones that the records do not identify.
        at_bound: (parameters,) at the edge of its range; the others' errors hold for it there.
    """

    covariance: np.ndarray
    identifiable: np.ndarray
    at_bound: np.ndarray

    @property
    def stderr(self) -> np.ndarray:
        """Of all shared parameters."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    @property
    def known(self) -> Bool[np.ndarray, " parameters"]:
        """Parameters with a standard error."""
        return self.identifiable & ~self.at_bound & (self.stderr > 0)

    def correlation(self, chosen: Int[np.ndarray, " chosen"]) -> np.ndarray:
        """Correlation matrix of the chosen parameters."""
        part = self.covariance[np.ix_(chosen, chosen)]
        scale = np.sqrt(np.diag(part))
        return part / np.outer(scale, scale)


def uncertainty(fitted: Fitted) -> Uncertainty:
    """Covariance at the mode: the inverse of the information of all records and of the priors; what it says nothing of is left out."""
    border, shared = fitted.problem.border, fitted.at.shared
    at_bound = border.shared & ((shared <= border.lower) | (shared >= border.upper))
    chosen = np.flatnonzero(border.shared & ~at_bound)
    whole = fitted.solution.information.sum(axis=0) + np.diag(border.shared_precision * border.shared_scale**2)
    matrix = whole[np.ix_(chosen, chosen)]
    size = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    safe = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(matrix / np.outer(safe, safe))
    loose = np.any((np.abs(vectors) > 0.05) & (values < _NULL), axis=1) | (size == 0)
    kept, covariance = chosen[~loose], np.zeros_like(whole)
    scale = safe[~loose]
    part = matrix[np.ix_(~loose, ~loose)] / np.outer(scale, scale)
    covariance[np.ix_(kept, kept)] = np.linalg.pinv(part, hermitian=True) / np.outer(scale, scale)
    identifiable = np.ones(len(shared), bool)
    identifiable[chosen[loose]] = False
    if not weighable(fitted.problem.experiment) and "m" in (names := [p.name for p in fitted.problem.parameters]):
        identifiable[names.index("m")] = False
    identifiable &= np.sqrt(np.maximum(np.diag(covariance), 0.0)) <= LARGEST_STDERR
    return Uncertainty(covariance=covariance, identifiable=identifiable, at_bound=at_bound)


def estimates(
    fitted: Fitted, spread: Uncertainty, between: Mapping[str, float], *, first: Mapping[str, float], profiled: bool = True
) -> list[ParameterEstimate]:
    """Table of the shared parameters.

    Args:
        fitted: the fit.
        spread: its errors.
        between: standard deviation between records of those that may vary, in the coordinate of the chain.
        first: guesses that the fit began with, SI.
        profiled: whether intervals of weak parameters come from profiles of the likelihood, which takes a few fits for each.
    """
    problem, values, found = fitted.problem, fitted.problem.values(fitted.at), []
    for index, spec in enumerate(problem.parameters):
        internal = float(fitted.at.shared[index] / problem.border.shared_scale[index])
        value, sigma = spec.to_physical(internal), float(spread.stderr[index])
        stderr, interval, kind, status, reason = None, None, "", OK, ""
        if not spread.identifiable[index]:
            status, reason = NOT_IDENTIFIABLE, _why_not(fitted, spec.name)
        elif not problem.border.shared[index]:
            given = spec.name in problem.experiment.parameters
            status, reason = FIXED, "held at the value given in [parameters]" if given else "held where the expected improvement is largest"
        elif spread.at_bound[index]:
            status, reason = AT_BOUND, f"stopped at {value:.4g}, the edge of its range"
        else:
            ends, kind = (internal - _SIGMAS_95 * sigma, internal + _SIGMAS_95 * sigma), "normal"
            if profiled and sigma > _WEAK:
                ends, kind = _by_profile(fitted, index, internal, sigma), "profile"
            stderr, interval = sigma * spec.slope(value), (spec.to_physical(ends[0]), spec.to_physical(ends[1]))
        varies, unit = between.get(spec.name), values[spec.name] if spec.logarithmic else 1.0
        found.append(
            ParameterEstimate(
                spec=spec,
                value=value,
                stderr=stderr,
                ci95=interval,
                interval=kind,
                initial=float(first.get(spec.name, values[spec.name])),
                status=status,
                reason=reason,
                between=None if varies is None else varies * unit,
            )
        )
    return found


def _by_profile(fitted: Fitted, index: int, internal: float, sigma: float) -> tuple[float, float]:
    """Ends of the interval in which the profile likelihood falls by no more than its 95 % limit: the secant from 1.96 standard errors."""
    ends = []
    for side in (-1.0, 1.0):
        reach = _SIGMAS_95 * sigma
        for _ in range(4):
            rise = profile_rise(fitted, {index: side * reach})
            if not np.isfinite(rise) or rise <= 0 or abs(rise / _SIGMAS_95**2 - 1.0) < 0.1:
                break
            reach *= float(np.clip(_SIGMAS_95 / np.sqrt(rise), 0.3, 2.0))
        ends.append(internal + side * reach)
    return ends[0], ends[1]


def profile_rise(fitted: Fitted, shifts: Mapping[int, float], *, steps: int = 3) -> float:
    """Twice the fall of the profile log-likelihood, with some shared parameters moved from the mode, in the coordinate of the fit.

    Everything else, the chain included, follows by Gauss-Newton steps with these held; sizes of force and reading errors stay.
    """
    problem, at = fitted.problem, fitted.at
    places = np.array(list(shifts))
    free, shared = problem.border.shared.copy(), at.shared.copy()
    shared[places] += np.array(list(shifts.values())) * problem.border.shared_scale[places]
    shared = np.clip(shared, problem.border.lower, problem.border.upper)
    free[places] = False
    by_likelihood = np.ones(len(free), bool)
    held = dataclasses.replace(problem, border=dataclasses.replace(problem.border, shared=free, strengths=by_likelihood))
    try:
        moved = settled(held, dataclasses.replace(at, shared=shared), fitted.variances, steps=steps)
    except np.linalg.LinAlgError:
        return float("inf")
    there = dataclasses.replace(problem, border=dataclasses.replace(problem.border, strengths=by_likelihood))
    return moved.solution.deviance - deviance(dataclasses.replace(fitted, problem=there), fitted.variances.force)


def deviance(fitted: Fitted, force: RandomForce) -> float:
    """-2 log restricted likelihood of a fit under another random force."""
    return elimination.deviance(fitted.problem, fitted.at, fitted.local, force)


def _why_not(fitted: Fitted, name: str) -> str:
    """Reason why a parameter has no standard error."""
    if name == "m" and not weighable(fitted.problem.experiment):
        return "no force is recorded, and a motion by itself is the same for every mass"
    in_law = name in {p.name for p in fitted.problem.model.law.parameters}
    if in_law and not any(motion is None or motion.touching.any() for motion in fitted.problem.motions):
        return "the hammer does not touch the stop in any record"
    return "its standard error is larger than a factor of e, or than 1 where it is not estimated by its logarithm"


def derived(fitted: Fitted, spread: Uncertainty) -> tuple[Quantity, ...]:
    """Stiffness k = m omega_n^2 and damping c = 2 zeta omega_n m, with errors to first order."""
    problem, values = fitted.problem, fitted.problem.values(fitted.at)
    if "f_n" not in values:
        return ()
    mass, omega = values.get("m", problem.experiment.mass), 2 * np.pi * values["f_n"]

    def row(name: str, value: float, slopes: dict[str, float]) -> Quantity:
        vector = np.zeros(len(values))
        at = {problem.unknowns.index(key): slope for key, slope in slopes.items() if key in values}
        vector[list(at)] = list(at.values())
        settled_all = all(spread.known[i] or (spread.identifiable[i] and not problem.border.shared[i]) for i in at)
        stderr = float(value * np.sqrt(vector @ spread.covariance @ vector)) if settled_all else None
        return Quantity(name=name, symbol=name, unit=DERIVED[name], value=float(value), stderr=stderr)

    return (
        row("k", mass * omega**2, {"f_n": 2.0, "m": 1.0}),
        row("c", 2 * values["zeta"] * omega * mass, {"zeta": 1.0, "f_n": 1.0, "m": 1.0}),
    )


def variations(problem: Problem) -> dict[str, int]:
    """Parameters that have a value for each record, each with the place of its deviation among a record's own numbers."""
    own = enumerate(problem.unknowns.own)
    return {name.partition(".")[2]: place for place, name in own if name.startswith(VARIATION) and problem.border.own[:, place].any()}


def between_records(fitted: Fitted) -> tuple[Disagreement, ...]:
    """Test of homogeneity of every parameter that at least two records identify.

    Each record's own estimate is one Gauss-Newton step on what it alone says, with all its other unknowns free in it. The weighted sum of
    squared deviations is chi-square distributed where the parameter is the same in all.
    """
    shift, sigma = record_estimates(fitted)
    problem, files = fitted.problem, fitted.problem.chains.files
    modelled = set(variations(problem))
    found = []
    for index, p in enumerate(problem.parameters):
        known = np.flatnonzero(sigma[:, index] < LARGEST_STDERR)
        if len(known) < 2 or not problem.border.shared[index]:
            continue
        weight, moved = sigma[known, index] ** -2.0, shift[known, index]
        chi2 = float(np.sum(weight * (moved - np.sum(weight * moved) / np.sum(weight)) ** 2))
        internal = fitted.at.shared[index] / problem.border.shared_scale[index]
        values = {k: p.to_physical(internal + shift[k, index]) for k in known}
        own = {files[k]: (value, float(sigma[k, index]) * p.slope(value)) for k, value in values.items()}
        degrees = len(known) - 1
        chance = float(chdtrc(degrees, chi2))
        found.append(Disagreement(name=p.name, chi2=chi2, degrees=degrees, chance=chance, records=own, modelled=p.name in modelled))
    return tuple(found)


def record_estimates(fitted: Fitted) -> tuple[Float[np.ndarray, "records parameters"], Float[np.ndarray, "records parameters"]]:
    """Each record's own estimate of every shared parameter, as shift from the common one, and its standard error, in the fit's coordinate.

    A deviation that the model has for the record is part of the shift, and is not estimated beside it.
    """
    problem, unknowns = fitted.problem, fitted.problem.unknowns
    varying = [place for place, name in enumerate(unknowns.own) if name.startswith(VARIATION)]
    solution, already = fitted.solution, np.zeros((len(problem.chains.files), len(unknowns.shared)))
    if varying:
        free = problem.border.own.copy()
        free[:, varying] = False
        fixed = dataclasses.replace(problem, border=dataclasses.replace(problem.border, own=free))
        local = reweighed(fixed, fitted.at, fitted.linear, fitted.variances.readings)
        solution = elimination.solved(fixed, fitted.at, local, fitted.variances.force)
        for place in varying:
            index = unknowns.index(unknowns.own[place].partition(".")[2])
            already[:, index] = fitted.at.own[:, place] / problem.border.shared_scale[index]
    chosen = np.flatnonzero(problem.border.shared)
    shift, sigma = already.copy(), np.full(already.shape, np.inf)
    for record, (information, gradient) in enumerate(zip(solution.information, solution.gradient, strict=True)):
        known, directions = np.linalg.eigh(information[np.ix_(chosen, chosen)])  # rounding may make it indefinite
        inverse = (directions / (np.maximum(known, 0.0) + _WIDE**-2.0)) @ directions.T
        shift[record, chosen] -= inverse @ gradient[chosen]
        sigma[record, chosen] = np.sqrt(np.diag(inverse))
    return shift, sigma


def unrest(fitted: Fitted, *, alpha: float = FORCE_BY_CHANCE) -> Unrest | None:
    """Random force beside a fitted model; None where it is not significant at the level `alpha`."""
    force = fitted.variances.force
    nothing = SMALLEST_FORCE * fitted.problem.scales.force
    if force.std <= 1.01 * nothing:
        return None
    try:
        without = deviance(fitted, dataclasses.replace(force, std=nothing))
    except np.linalg.LinAlgError:  # the records cannot be explained without one
        without = np.inf
    gain = without - deviance(fitted, force)
    if chance_of_force(gain) > alpha:
        return None
    of_force, of_memory = _force_errors(fitted)
    size, reference = _reference(fitted)
    return Unrest(
        force_rms=(force.std, of_force),
        memory=(force.memory, of_memory),
        share=force.std / size,
        reference=reference,
        gain=gain,
        at_limit=is_largest(fitted.problem, force),
    )


def _force_errors(fitted: Fitted) -> tuple[float | None, float | None]:
    """Standard errors of size and correlation time, from the curvature of the restricted likelihood in their logarithms."""
    force, step = fitted.variances.force, 0.15  # of the logarithms, in second differences

    def at(size: int, memory: int) -> float:
        return deviance(fitted, RandomForce(std=force.std * np.exp(step * size), memory=force.memory * np.exp(step * memory)))

    middle = at(0, 0)
    a, b = at(1, 0) + at(-1, 0) - 2 * middle, at(0, 1) + at(0, -1) - 2 * middle
    c = (at(1, 1) + at(-1, -1) - at(1, -1) - at(-1, 1)) / 4
    information = np.array([[a, c], [c, b]]) / (2.0 * step**2)
    if not np.all(np.linalg.eigvalsh(information) > 0):
        return None, None
    size, memory = np.sqrt(np.diag(np.linalg.inv(information)))
    return float(force.std * size), float(force.memory * memory)


def _reference(fitted: Fitted) -> tuple[float, str]:
    """Reference force, N, and its name: k A0 of the drive, or the rms force of the suspension, or of inertia without one."""
    problem, border = fitted.problem, fitted.problem.border
    f_n = problem.values(fitted.at).get("f_n", 0.0)
    sine, cosine = (OF_RECORD.index(name) for name in ("base_sine", "base_cosine"))
    driven = border.own[:, sine]
    if f_n > 0 and driven.any():
        amplitude = float(np.hypot(fitted.at.own[driven, sine], fitted.at.own[driven, cosine]).max())
        return problem.experiment.mass * (2.0 * np.pi * f_n) ** 2 * amplitude, "the spring's force"
    return problem.scales.force, "the spring's force" if f_n > 0 else "the inertia force"


def sensor_errors(fitted: Fitted) -> dict[str, SensorError]:
    """Size and order of the readings' errors by channel, and whether one-step errors are white."""
    try:
        white = whiteness(fitted)
    except np.linalg.LinAlgError:  # rounding has spoilt what earlier readings say of the next ones
        white = {}
    found = {}
    for name, error in zip(fitted.problem.chains.channels, fitted.variances.readings, strict=True):
        noise = [record.noise[name] for record in fitted.problem.experiment.records if name in record.noise]
        rms = error.std * float(np.sqrt(np.mean(np.square(noise))))
        one = white.get(name)
        found[name] = SensorError(
            rms=rms,
            unit=UNITS[name],
            order=error.order,
            over_noise=error.std,
            variance=None if one is None else one.variance,
            correlation=None if one is None else max(one.correlations, key=abs, default=None),
            samples=0 if one is None else one.samples,
        )
    return found
