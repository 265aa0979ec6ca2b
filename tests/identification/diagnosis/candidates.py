"""Candidates of one effect beside a model."""

from identification.diagnosis.look import Candidate, Look, _of_kind
from vibrojax.effects import EFFECTS


def probed(seen: Look, name: str) -> Candidate:
    """The middle one of its grid."""
    found = _of_kind(EFFECTS[name], seen.scales, seen.courses, seen.fitted.problem.chains)
    return found[len(found) // 2]
