"""Variances of a chain: size and memory of the random force by restricted maximum likelihood, reading errors by expectation.

Reading errors are estimated from samples of the posterior, or, where they compete with the force, together with it by the gradient of the
likelihood; the size of effects' own states at the beginning of a record by expectation.

Source: D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320-338 (restricted likelihood); G. C. G. Wei, M. A. Tanner, J. Am. Stat. Assoc. 85
(1990) 699-704 (expectation by samples); T. A. Louis, J. R. Stat. Soc. B 44 (1982) 226-233 (gradient by expected products).
"""

import dataclasses

import numpy as np
from scipy.optimize import minimize

from identification.trajectory.chain_equations import Weighed, residuals_after, weighed, whitenings
from identification.trajectory.elimination import Solution, deviance, solved
from identification.trajectory.motion import Estimate, Linearised
from identification.trajectory.posterior import expected_products, knots_covariance
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import HIGHEST_ORDER, ReadingError, estimated
from identification.trajectory.start import Problem

LARGEST_FORCE = 0.3
"""Largest random force, over the force of the suspension: with a larger one any motion is explained."""
SMALLEST_FORCE = 1e-5
"""Smallest one: the chain is then one deterministic trajectory to within the sensors' resolution."""
_INDEFINITE = 1e12
"""Deviance of variances that the equations cannot be solved with."""
OF_TWO_NUMBERS = 4.0
"""Akaike's price of size and memory of a random force, in -2 log likelihood."""
_LONGEST_ERROR = 1.0 / 3.0
"""Correlation time of a reading error, over the time in which the motion changes by its own size, at most."""
_LONGEST_MEMORY = 30.0
"""Of a random force, over the time in which the motion changes by its own size, rms u / rms u'."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Variances:
    """Random force and reading errors by channel."""

    force: RandomForce
    readings: tuple[ReadingError, ...]


def vanishes(problem: Problem, force: RandomForce) -> bool:
    """Whether nothing is left of the random force."""
    return bool(force.std <= 1.01 * SMALLEST_FORCE * problem.scales.force)


def is_largest(problem: Problem, force: RandomForce) -> bool:
    """Whether a random force is as large as it may be: then its likeliest size lies beyond."""
    return bool(force.std >= 0.99 * LARGEST_FORCE * problem.scales.force)


def is_no_mode(problem: Problem, force: RandomForce) -> bool:
    """Whether a random force is at one of its limits, so that the parameters beside it are hardly determined.

    One that is as large as it may be explains any motion. A white one, of the shortest memory, has no finite acceleration: where that is
    read, it takes the place of an error of the reading, whatever that is, and moves the hammer with it.
    """
    white = bool(np.log(force.memory) <= _force_range(problem)[0][1] + 0.01) and not vanishes(problem, force)
    return is_largest(problem, force) or (white and "hammer_acceleration" in problem.chains.channels)


def reweighed(problem: Problem, at: Estimate, linear: Linearised, readings: tuple[ReadingError, ...]) -> Weighed:
    """Local systems of a linearisation under other reading errors."""
    return weighed(problem.chains, problem.unknowns, problem.border, linear, at, whitenings(problem.chains, linear, readings))


def coloured(
    problem: Problem, at: Estimate, linear: Linearised, local: Weighed, force: RandomForce, rng: np.random.Generator, *, draws: int
) -> tuple[ReadingError, ...]:
    """Reading errors from samples of the posterior under the present variances; with few samples of readings, from more of them."""
    chains, border = problem.chains, problem.border
    solution = solved(problem, at, local, force)
    counted = (chains.weight > 0) & linear.done[:, None, None]
    several = max(draws, int(np.ceil(20_000 / max(int(counted.sum()), 1))))
    drawn = [residuals_after(chains, border, linear, *solution.draw(rng)) for _ in range(min(several, 40))]
    return tuple(
        estimated(
            [one[..., c] for one in drawn],
            counted[..., c],
            chains.first,
            largest_pole=largest_pole(problem),
            highest=min(HIGHEST_ORDER, chains.samples),
        )
        for c in range(len(chains.channels))
    )


def with_initial_size(problem: Problem, at: Estimate, solution: Solution) -> Problem:
    """The problem with the likelier size of the effects' own states at the beginning of a record, by expectation over all records.

    What is at rest there, as before a single impact, and what swings there, as in steady motion, are models as likely as their states are.
    """
    own = slice(2, len(problem.unknowns.states))
    if own.start == own.stop:
        return problem
    begins, scales = [knots.start for knots in problem.chains.knots], problem.scales
    try:
        covariance = knots_covariance(solution)[begins]
    except np.linalg.LinAlgError:  # rounding has spoilt it: the size stays
        return problem
    variance = np.minimum(np.diagonal(covariance, axis1=1, axis2=2)[:, own], scales.own_initial**2)
    size = np.sqrt(np.mean(at.states[begins][:, own] ** 2 + variance, axis=0))
    return dataclasses.replace(problem, scales=dataclasses.replace(scales, own_initial=np.maximum(size, scales.floor[own])))


def largest_pole(problem: Problem) -> float:
    """Largest modulus of a pole of a reading error.

    One that is correlated for much longer than a part of the time in which the motion changes by its own size, rms u over rms u', is no
    matter of the sensor: it moves as the rig does, and would take the place of what the model leaves out.
    """
    spacing = float(np.median(problem.chains.duration)) / problem.chains.samples
    return float(np.exp(-spacing * problem.scales.velocity / (_LONGEST_ERROR * problem.scales.displacement)))


def annealed(problem: Problem, at: Estimate, local: Weighed, force: RandomForce, *, evaluations: int) -> RandomForce:
    """Random force of greatest restricted likelihood, but no further below the present one than annealing allows."""
    low, high = _force_range(problem)

    def bounded(logs: np.ndarray) -> float:
        inside = np.clip(logs, low, high)
        std, memory = np.exp(inside)
        tried = RandomForce(std=float(std), memory=float(memory))
        try:
            found = deviance(problem, at, local, tried)
        except np.linalg.LinAlgError:
            return _INDEFINITE
        return found + 10.0 * float(np.sum((logs - inside) ** 2))

    begin = np.log([force.std, force.memory])
    spread = (3.0, 1.8) if evaluations < 40 else (2.0, 2.0)
    simplex = np.array([begin, begin - [np.log(spread[0]), 0.0], begin + [0.0, np.log(spread[1])]])
    found = minimize(
        bounded, begin, method="Nelder-Mead", options={"maxfev": evaluations, "xatol": 0.02, "fatol": 0.2, "initial_simplex": simplex}
    )
    std, memory = np.exp(np.clip(found.x, low, high))
    return RandomForce(std=float(max(std, force.std / 30.0)), memory=float(memory))  # falls by no more in one round


def force_if_it_pays(problem: Problem, at: Estimate, local: Weighed, force: RandomForce) -> tuple[RandomForce, Solution]:
    """The random force, or none where it gains less than its two numbers cost; with the solution."""
    none, some = RandomForce(std=SMALLEST_FORCE * problem.scales.force, memory=force.memory), solved(problem, at, local, force)
    if not vanishes(problem, force):
        try:
            without = solved(problem, at, local, none)
        except np.linalg.LinAlgError:  # the records cannot be explained without one
            return force, some
        if without.deviance < some.deviance + OF_TWO_NUMBERS:
            return none, without
    return force, some


def likeliest(problem: Problem, at: Estimate, linear: Linearised, begin: Variances, *, iterations: int = 40) -> tuple[RandomForce, tuple]:
    """Random force and reading errors, their orders given, of greatest restricted likelihood: all at once, since they compete.

    Sequential quadratic programming in log force, log memory, log innovations and the inverse hyperbolic tangents of partial
    autocorrelations, each over about its standard error: readings are many, and say far less of the force. The gradient by a reading error
    is that of its likelihood with expected products (Fisher's identity); by the force, a difference quotient.
    """
    chains, unknowns, border = problem.chains, problem.unknowns, problem.border
    limit, (low, high) = largest_pole(problem), _force_range(problem)
    free = [one.free(limit) for one in begin.readings]
    ends = np.cumsum([2, *(len(one) for one in free)])
    highest = max((one.order for one in begin.readings), default=0)

    def at_point(x: np.ndarray) -> tuple[RandomForce, tuple[ReadingError, ...]]:
        force = RandomForce(std=float(np.exp(x[0])), memory=float(np.exp(x[1])))
        return force, tuple(ReadingError.of(x[a:b], limit) for a, b in zip(ends[:-1], ends[1:], strict=True))

    def bounded(x: np.ndarray) -> tuple[float, np.ndarray]:
        try:
            return with_slope(x)
        except np.linalg.LinAlgError:  # so far off that rounding makes the equations indefinite: the search turns back
            return _INDEFINITE, np.zeros_like(x)

    def with_slope(x: np.ndarray) -> tuple[float, np.ndarray]:
        force, readings = at_point(x)
        local = reweighed(problem, at, linear, readings)
        solution = solved(problem, at, local, force)
        slope = np.zeros_like(x)
        for place in range(2):
            step = np.where(np.arange(len(x)) == place, 1e-3 if x[place] < high[place] - 1e-3 else -1e-3, 0.0)
            other = deviance(problem, at, local, at_point(x + step)[0])
            slope[place] = (other - solution.deviance) / step[place]
        products = expected_products(chains, unknowns, border, linear, solution, highest)
        for a, b, (sums, counts) in zip(ends[:-1], ends[1:], products, strict=True):
            for place in range(a, b):
                step = np.where(np.arange(a, b) == place, 1e-4, 0.0)
                up, down = (ReadingError.of(x[a:b] + sign * step, limit).deviance(sums, counts) for sign in (1.0, -1.0))
                slope[place] = (up - down) / 2e-4
        return solution.deviance, slope

    start = np.concatenate([np.clip(np.log([begin.force.std, begin.force.memory]), low, high), *free])
    least, most = np.full(len(start), -4.0), np.full(len(start), 4.0)  # partial autocorrelations within 1e-3 of one
    least[ends[:-1]], most[ends[:-1]] = np.log(0.01), np.log(1e5)  # innovations: no sensor is better; beyond, it says nothing
    least[:2], most[:2] = low, high
    counts = np.maximum(chains.readings, 1)
    force_unit = np.full(2, 0.1)  # about the standard error of the logarithms of a random force
    unit = np.concatenate([force_unit, *(np.full(len(one), n**-0.5) for one, n in zip(free, counts, strict=True))])

    def in_units(z: np.ndarray) -> tuple[float, np.ndarray]:
        value, slope = bounded(z * unit)
        return value, slope * unit

    bounds, begun = list(zip(least / unit, most / unit, strict=True)), np.clip(start, least, most) / unit
    found = minimize(in_units, begun, jac=True, method="SLSQP", bounds=bounds, options={"maxiter": iterations, "ftol": 0.05})  # of -2 log L
    return at_point(found.x * unit)


def _force_range(problem: Problem) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest logarithm of size and memory of the random force."""
    smallest, largest = np.log(np.array([SMALLEST_FORCE, LARGEST_FORCE]) * problem.scales.force)
    shortest = 0.3 * float(np.median(problem.chains.duration))
    longest = max(_LONGEST_MEMORY * problem.scales.displacement / problem.scales.velocity, 2.0 * shortest)
    return np.array([smallest, np.log(shortest)]), np.array([largest, np.log(longest)])
