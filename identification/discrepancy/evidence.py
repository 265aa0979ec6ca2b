"""When a gain is evidence: what noise alone would give, over everything that was tried."""

from scipy.special import chdtrc

from identification.discrepancy.score import Candidate

FALSE_ALARM = 1e-4
"""Chance of noise passing, for each kind of effect; two dozen kinds are tried."""


def chance(gain: float, degrees: int, trials: int) -> float:
    """Probability that noise lowers chi-square by as much in the best of so many trials (an upper bound).

    Example:
        >>> chance(0.0, 1, 10)
        1.0
        >>> round(chance(30.0, 1, 10), 9)
        4.32e-07
    """
    return float(min(1.0, trials * chdtrc(max(degrees, 1), max(gain, 0.0))))


def best_of_each(found: list[Candidate]) -> dict[str, Candidate]:
    """The candidate of every kind of effect, and of every channel, that promises most; best first."""
    best: dict[str, Candidate] = {}
    for candidate in sorted(found, key=lambda one: -one.gain):
        best.setdefault(f"{candidate.name} {candidate.members[0].channel or ''}".strip(), candidate)
    return best


def trials(found: list[Candidate], name: str) -> int:
    """How many candidates of one kind were tried, each weighed with what it had looked at before it was proposed."""
    return sum(max(1, one.members[0].looked_at) for one in found if one.name == name)


def significant(found: list[Candidate]) -> dict[str, Candidate]:
    """The best of each kind, where noise alone would hardly do as much."""
    best = best_of_each(found)
    return {name: one for name, one in best.items() if chance(one.gain, one.degrees, trials(found, one.name)) < FALSE_ALARM}
