"""Fit of the chains: from a large random force to the one that the likelihood asks for, reading errors estimated with it.

Gauss-Newton steps of states, force, parameters and each record's own numbers alternate with the variances: size and memory of the random
force by restricted maximum likelihood, the readings' autoregressions by expectation and maximisation.

Source: H. Abarbanel and others, precision annealing: Phys. Rev. E 92 (2015) 052901; Y. Tremolet, weak-constraint 4D-Var, Q. J. R.
Meteorol. Soc. 132 (2006) 2483-2504.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.trajectory.chain_equations import Weighed
from identification.trajectory.elimination import Solution, solved
from identification.trajectory.motion import Estimate, Linearised, linearise, unrolled
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError
from identification.trajectory.start import Problem
from identification.trajectory.step import NO_STEP, Stride, change, moved
from identification.trajectory.variances import (
    LARGEST_FORCE,
    OF_TWO_NUMBERS,
    SMALLEST_FORCE,
    Variances,
    annealed,
    coloured,
    force_if_it_pays,
    is_largest,
    is_no_mode,
    likeliest,
    reweighed,
    vanishes,
    with_initial_size,
)
from identification.wording.numbers import significant
from vibrojax.contact import AbstractInstantaneousLaw, NoContact
from vibrojax.errors import NoConvergenceError

Progress = Callable[[str], None]
_COLOURED_FROM = 6
"""Round from which reading errors are autocorrelated: before, they would explain a contact that is still wrong."""
_SMALL_STEP = 0.3
"""Step of a parameter over its standard error below which the iteration has converged."""
_HELD_ROUNDS = 4
"""Rounds without a random force from the other end."""
_BACK, _NEAR = 0.5, 3.0
"""The other end is at the place of the first with more than this part of its random force, and parameters within so many of its errors."""
_FURTHER_STEPS = 5
"""Under the same variances, at most."""
_ROUNDS = 24
"""Of steps with variances that move on a little, at most."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Fitted:
    """A problem at the mode of its likelihood.

    Attributes:
        problem: that was fitted.
        at: estimate, about which everything is linearised.
        variances: of random force and readings.
        linear, local, solution: there; the solution's step is the last one that was not taken.
        rounds: of the annealing.
        converged: whether the last step was small against the standard errors.
        of_readings: whether the end without a force was the likelier one: then reading errors explain what they can.
    """

    problem: Problem
    at: Estimate
    variances: Variances
    linear: Linearised
    local: Weighed
    solution: Solution
    rounds: int
    converged: bool
    of_readings: bool = False

    @property
    def deviance(self) -> float:
        """-2 log marginal likelihood by which models compare.

        Usable readings that are not compared, because their channel is late or their segment could not be integrated, are charged with the
        mean squared residual and log variance of their channel; what they would have said of the random force is not. Infinite where a
        channel has no reading left.
        """
        compared, parts = self.local.of_channels.T
        if np.any((compared == 0) & (self.problem.chains.readings > 0)):
            return np.inf
        return self.solution.deviance + float(np.sum((self.problem.chains.readings - compared) * parts / np.maximum(compared, 1)))

    @property
    def stderr(self) -> np.ndarray:
        """Of the shared unknowns, in their coordinate; 0 where held."""
        return np.sqrt(np.diag(self.solution.covariance)) * self.problem.border.shared_scale


class _AddsNothing(Exception):
    """The other end of a fit leads nowhere beside the first one."""


def fit(
    problem: Problem,
    *,
    seed: int = 0,
    at: Estimate | None = None,
    begin: Variances | None = None,
    both: bool = True,
    progress: Progress = lambda line: None,
) -> Fitted:
    """Fit a problem from both ends: from a large random force, and from none with autocorrelated reading errors; the likelier counts.

    What the model leaves out may be taken by the force or by the readings' errors. Iterations that begin with one of them tend to keep it,
    and where the model is complete they agree.

    An end that has not converged counts for nothing beside one that has, nor one whose force is no mode of the likelihood (`is_no_mode`)
    beside one that has come to a mode. The second end is dropped where it meets the first one's parameters, or, where that has converged to
    a mode, arrives at the largest force.

    Args:
        problem: of an experiment.
        seed: of the samples by which expectations are taken.
        at: estimate from which the first end goes; by default the problem's own start, which prescribed motion and the least squares of a
            rigid stop always begin at.
        begin: variances of the first end; by default a large force and white reading errors. Where there is no force among them, reading
            errors are estimated from the beginning.
        both: whether to begin without a force too, where the first end has left one or has not converged.
        progress: called with a line in each round.

    Raises:
        NoConvergenceError: the equations became singular on the way of the first end.
    """
    rng, short, first = np.random.default_rng(seed), 2.0 * float(np.median(problem.chains.duration)), begin or first_variances(problem)
    small = dataclasses.replace(first_variances(problem), force=RandomForce(std=SMALLEST_FORCE * problem.scales.force, memory=short))
    if all(group.prescribed is not None for group in problem.chains.groups):  # nothing moves freely: all that differs is read
        return _converged(problem, problem.start, small, rng, progress, coloured_from=_HELD_ROUNDS, held=_ROUNDS)
    other = None
    if isinstance(problem.model.law, AbstractInstantaneousLaw):
        try:
            other = _of_one_trajectory(problem, small, rng, progress)
        except np.linalg.LinAlgError:  # errors that grow with each impact have become too large for the equations
            other = None
        if other is not None and other.converged and vanishes(problem, other.variances.force):
            return other
        if other is not None:  # its residuals ask for a random force, beside which the trajectory moves
            other = _converged_or_none(problem, other.at, other.variances, rng, progress, coloured_from=0)
    coloured_from, held = (0, _HELD_ROUNDS) if vanishes(problem, first.force) else (_COLOURED_FROM, 1)
    least = (held if begin else max(coloured_from, held)) + 2  # reading errors of another fit are not white: they are not waited for
    try:
        found = _converged(problem, at or problem.start, first, rng, progress, coloured_from=coloured_from, held=held, least=least)
    except np.linalg.LinAlgError as error:
        name = problem.experiment.name
        raise NoConvergenceError(f"the fit of {name!r} diverged: its equations became singular ({error}); check units and gaps") from error
    if other is None:
        gone = vanishes(problem, found.variances.force)
        if not both or (gone and found.converged):
            return found
        none = dataclasses.replace(found.at, force=np.zeros_like(found.at.force))
        begun = None if gone else found
        other = _converged_or_none(problem, none, small, rng, progress, coloured_from=0, held=_HELD_ROUNDS, first=begun)
    if other is not None and _rank(other) < _rank(found):
        return dataclasses.replace(other, of_readings=True)
    return found


def first_variances(problem: Problem) -> Variances:
    """Those from which a fit begins: a random force as large as it may be, and the noise that is declared."""
    scales, white = problem.scales, tuple(ReadingError() for _ in problem.chains.channels)
    return Variances(force=RandomForce(std=LARGEST_FORCE * scales.force, memory=scales.displacement / scales.velocity), readings=white)


def _is_at_a_mode(fitted: Fitted) -> bool:
    """Whether an end has converged, to a mode of the likelihood."""
    return fitted.converged and not is_no_mode(fitted.problem, fitted.variances.force)


def _rank(fitted: Fitted) -> tuple[bool, bool, float]:
    """Of an end among others, the lower the better: a converged one first, then a mode of the likelihood, then the likelier one."""
    return not fitted.converged, is_no_mode(fitted.problem, fitted.variances.force), fitted.deviance


def _converged_or_none(*args, **options) -> Fitted | None:
    """`_converged`; None where physics is missing and the way from no force leads nowhere, or to where the first end is."""
    try:
        return _converged(*args, **options)
    except (np.linalg.LinAlgError, _AddsNothing):
        return None


def _of_one_trajectory(problem: Problem, small: Variances, rng: np.random.Generator, progress: Progress) -> Fitted:
    """Against a rigid stop: one trajectory by least squares, and about it the likeliest variances.

    Impacts in a segment come and go with the state at its beginning, so that jumps between segments cannot be smoothed out there: the fit
    without a random force does not begin at the knots of another one.
    """
    at, square = _least_squares(problem, small)
    linear, local, solution = equations(problem, at, small)
    readings = coloured(problem, at, linear, local, small.force, rng, draws=4)
    variances, count = Variances(force=small.force, readings=readings), 0
    for count in range(_HELD_ROUNDS):
        variances = _likelier(problem, at, linear, variances)
        linear, local, solution = equations(problem, at, variances)
        problem = with_initial_size(problem, moved(problem, at, solution, 1.0), solution)
        progress(_line(count, problem, at, variances.force))
        if not vanishes(problem, variances.force) or change(problem, at, solution) < _SMALL_STEP:
            break
        at, square = unrolled(problem.model_at(at), problem.unknowns, problem.chains, problem.integrator, moved(problem, at, solution, 1.0))
        linear, local, solution = equations(problem, at, variances)
    found = _ended(problem, at, variances, linear, local, solution, rounds=count + 1)
    return dataclasses.replace(found, converged=found.converged and bool(np.isfinite(square)))


def _likelier(problem: Problem, at: Estimate, linear: Linearised, begin: Variances) -> Variances:
    """The likeliest variances, with a random force only where that gains what its two numbers cost."""
    found, least = begin, np.inf
    for share in (1.0, 1e-3 / SMALLEST_FORCE):  # from nothing, and from a thousandth of the suspension's force
        tried = RandomForce(std=share * SMALLEST_FORCE * problem.scales.force, memory=begin.force.memory)
        force, readings = likeliest(problem, at, linear, Variances(force=tried, readings=begin.readings))
        deviance = solved(problem, at, reweighed(problem, at, linear, readings), force).deviance
        deviance += 0.0 if vanishes(problem, force) else OF_TWO_NUMBERS
        if deviance < least:
            found, least = Variances(force=force, readings=readings), deviance
    return found


def _least_squares(problem: Problem, small: Variances) -> tuple[Estimate, float]:
    """The better of one trajectory through the whole of each record at once, and through more and more of it.

    Raises:
        LinAlgError: neither can be followed.
    """
    found = []
    for way in (_longer_and_longer, _one_trajectory):
        try:
            found.append(way(problem, problem.start, small))
        except np.linalg.LinAlgError:  # the first part of a record may not hold its parameters, nor the whole the guesses
            continue
    if not found:
        raise np.linalg.LinAlgError("no trajectory follows the records without a random force")
    return min(found, key=lambda one: one[1] if np.isfinite(one[1]) else np.inf)


def _longer_and_longer(problem: Problem, at: Estimate, small: Variances) -> tuple[Estimate, float]:
    """One trajectory through the beginning of each record, then through more of it: what it has learnt there predicts the next impacts."""
    chains, square = problem.chains, np.inf
    begins = np.concatenate([np.cumsum(chains.duration[chains.of_record(r)]) for r in range(len(chains.files))])
    lengths = np.array([chains.duration[chains.of_record(r)].sum() for r in range(len(chains.files))])[chains.record]
    for part in (0.3, 0.4, 0.5, 0.65, 0.8, 1.0):  # of each record
        seen = (begins <= part * lengths + 1e-9)[:, None, None]
        groups = tuple(dataclasses.replace(group, weight=group.weight * seen[group.place]) for group in chains.groups)
        shorter = dataclasses.replace(problem, chains=dataclasses.replace(chains, groups=groups, weight=chains.weight * seen))
        at, square = _one_trajectory(shorter, at, small)
    return at, square


def _one_trajectory(problem: Problem, at: Estimate, small: Variances) -> tuple[Estimate, float]:
    """Least squares of whole records, by steps of the chain that are shortened until they help; with the sum of squares."""

    def unforced(one: Estimate) -> tuple[Estimate, float]:
        return unrolled(problem.model_at(one), problem.unknowns, problem.chains, problem.integrator, one)

    at, square = unforced(at)
    for _ in range(_ROUNDS):
        *_, solution = equations(problem, at, small)
        (step, share), before = Stride(problem).taken(at, solution), square
        while share > 1e-3:  # of the step
            tried, there = unforced(moved(problem, at, step, share))
            if there < square:
                at, square = tried, there
                break
            share *= 0.5
        if not square < before - 0.01 * square / problem.chains.weight.size:  # hardly less, over the mean square
            break
    return at, square


def _converged(
    problem: Problem,
    at: Estimate,
    variances: Variances,
    rng: np.random.Generator,
    progress: Progress,
    *,
    coloured_from: int,
    held: int = 1,
    least: int | None = None,
    first: Fitted | None = None,
) -> Fitted:
    """Rounds of one Gauss-Newton step and new variances, until both stay, at least so many; the random force is held in the first `held`.

    Raises:
        _AddsNothing: with most of the random force of the fit from the other end, its parameters have come to those of that fit; or its
            random force stays as large as it may be, and that fit has converged to a mode.
    """
    force, readings, count, stride = variances.force, variances.readings, 0, Stride(problem)
    least = max(coloured_from, held % _ROUNDS) + 2 if least is None else least
    for count in range(_ROUNDS):
        linear, local, solution = equations(problem, at, Variances(force=force, readings=readings))
        (step, share), off, before = (
            stride.taken(at, solution, whole=count < held or is_largest(problem, force)),
            change(problem, at, solution),
            force,
        )
        if count >= held:
            force = annealed(problem, at, local, force, evaluations=6 if count < held + 3 else 10)
        if count >= coloured_from and not _holds_readings(problem, force):
            readings = coloured(problem, at, linear, local, force, rng, draws=1)
        at = moved(problem, at, step, share)
        problem = with_initial_size(problem, at, solution)
        progress(_line(count, problem, at, force))
        if first is not None and _leads_to(first, problem, at, before, force):
            raise _AddsNothing
        stays = abs(np.log(force.std / before.std)) < 0.05 or vanishes(problem, force)
        if count >= least and stays and off < _SMALL_STEP:
            break
    diverges = is_largest(problem, force) and off >= _SMALL_STEP
    variances = Variances(force=force, readings=readings)
    found = _with_likeliest(problem, at, variances, rng, progress, rounds=count + 1, diverges=diverges)
    if first is not None and _is_at_a_mode(first) and is_largest(problem, found.variances.force):
        raise _AddsNothing
    return found


def _with_likeliest(
    problem: Problem, at: Estimate, variances: Variances, rng: np.random.Generator, progress: Progress, *, rounds: int, diverges: bool
) -> Fitted:
    """Steps with the likeliest variances: of force and readings at once where they compete, else one after the other, or the readings held.

    Reading errors are held beside the largest force, as in the rounds before, unless a smaller force is likelier together with others.
    Parameters that diverge beside that force are not brought back by steps: there are none unless it falls.
    """
    force, readings, stride, most, ends_at_largest = variances.force, variances.readings, Stride(problem), 6, False
    linear, local, solution = equations(problem, at, variances)
    for last in range(most):
        near = last > 0 and change(problem, at, solution) < _SMALL_STEP
        together = any(one.order for one in readings) and not (vanishes(problem, force) or (ends_at_largest and is_largest(problem, force)))
        if together:
            found = likeliest(problem, at, linear, Variances(force=force, readings=readings), iterations=40 if near else 12)
            ends_at_largest = _holds_readings(problem, force) and is_largest(problem, found[0])
            force, readings = (force, readings) if ends_at_largest else found
        if not together or ends_at_largest:
            if not (last and vanishes(problem, force)):  # one that has just been found not to pay would come and go
                force = annealed(problem, at, local, force, evaluations=40)
            if not _holds_readings(problem, force):
                readings = coloured(problem, at, linear, local, force, rng, draws=4)
        local = reweighed(problem, at, linear, readings)
        force, solution = force_if_it_pays(problem, at, local, force)
        progress(_line(rounds - 1, problem, at, force))
        if last == most - 1 or (near and change(problem, at, solution) < _SMALL_STEP) or (diverges and is_largest(problem, force)):
            break
        now = Variances(force=force, readings=readings)
        try:
            at, linear, local, solution = _while_likelier(problem, at, now, solution, stride)
        except np.linalg.LinAlgError:  # without the force that was taken away the motion diverges
            return dataclasses.replace(_ended(problem, at, now, linear, local, solution, rounds=rounds), converged=False)
    return _ended(problem, at, Variances(force=force, readings=readings), linear, local, solution, rounds=rounds)


def _while_likelier(
    problem: Problem, at: Estimate, variances: Variances, solution: Solution, stride: Stride
) -> tuple[Estimate, Linearised, Weighed, Solution]:
    """A step under given variances, and a few more while -2 log likelihood falls by the price of two numbers or more in each.

    The motion may still move where the parameters do not. A further step that makes it less likely is not taken.

    Raises:
        LinAlgError: the equations are singular after the first step.
    """
    before, at = solution.deviance, moved(problem, at, *stride.taken(at, solution))
    linear, local, solution = equations(problem, at, variances)
    for _ in range(_FURTHER_STEPS):
        if before - solution.deviance < OF_TWO_NUMBERS:
            break
        further = moved(problem, at, *stride.taken(at, solution))
        try:
            tried = equations(problem, further, variances)
        except np.linalg.LinAlgError:
            break
        if tried[-1].deviance > solution.deviance or tried[0].done.sum() < linear.done.sum():  # lost segments are no gain
            break
        before, at, (linear, local, solution) = solution.deviance, further, tried
    return at, linear, local, solution


def settled(problem: Problem, at: Estimate, variances: Variances, *, steps: int = 8) -> Fitted:
    """The mode under given variances, by Gauss-Newton steps from an estimate; at most so many."""
    free, count, stride = problem.border.shared.any(), 0, Stride(problem)
    for count in range(steps):
        linear, local, solution = equations(problem, at, variances)
        if count + 1 == steps or (free and change(problem, at, solution) < NO_STEP):
            break
        at = moved(problem, at, *stride.taken(at, solution))
    return _ended(problem, at, variances, linear, local, solution, rounds=count + 1)


def _ended(
    problem: Problem, at: Estimate, variances: Variances, linear: Linearised, local: Weighed, solution: Solution, *, rounds: int
) -> Fitted:
    """A fit where its iteration has ended."""
    return Fitted(
        problem=problem,
        at=at,
        variances=variances,
        linear=linear,
        local=local,
        solution=solution,
        rounds=rounds,
        converged=change(problem, at, solution) < _SMALL_STEP,
    )


def equations(problem: Problem, at: Estimate, variances: Variances) -> tuple[Linearised, Weighed, Solution]:
    """Linearisation, local systems and solution at an estimate."""
    sizes = problem.scales.states
    linear = linearise(problem.model_at(at), problem.unknowns, problem.chains, problem.integrator, at, sizes)
    local = reweighed(problem, at, linear, variances.readings)
    solution = solved(problem, at, local, variances.force)
    return linear, local, solution


def _holds_readings(problem: Problem, force: RandomForce) -> bool:
    """Whether reading errors stay as they are: beside a stop, as long as the random force is as large as it may be.

    They would take up what the force cannot, and the contact law would diverge.
    """
    return is_largest(problem, force) and not isinstance(problem.model.law, NoContact)


def _leads_to(first: Fitted, problem: Problem, at: Estimate, before: RandomForce, force: RandomForce) -> bool:
    """Whether the other end has come to the parameters of a fit, or stays at the largest force while that fit has converged to a mode."""
    if _is_at_a_mode(first) and is_largest(problem, before) and is_largest(problem, force):
        return True
    near = np.all(np.abs(at.shared - first.at.shared) <= _NEAR * first.stderr + 1e-12)
    return bool(near and force.std > _BACK * first.variances.force.std)


def _line(count: int, problem: Problem, at: Estimate, force: RandomForce) -> str:
    size = significant(100.0 * force.std / problem.scales.force, 2)
    values = ", ".join(f"{name} = {significant(value, 4)}" for name, value in problem.values(at).items())
    return f"fitting, round {count + 1}: random force {size} % of the suspension's; {values}"
