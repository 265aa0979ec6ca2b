"""Candidates of one effect beside a model."""

from identification.diagnosis.scores import Candidate, Scores, _of_kind
from vibrojax.effects import EFFECTS


def probed(scores: Scores, name: str) -> Candidate:
    """The middle one of its grid."""
    found = _of_kind(EFFECTS[name], scores.scales, scores.courses, scores.fitted.problem.chains)
    return found[len(found) // 2]
