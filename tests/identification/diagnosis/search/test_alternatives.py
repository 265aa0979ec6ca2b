"""Which candidates are refitted, and which of them to convergence."""

import numpy as np
import pytest

from identification.diagnosis.score.scored import Scored
from identification.diagnosis.search import alternatives as module
from identification.diagnosis.search.alternatives import Alternative
from identification.likelihood.fitted import Fitted
from tests.effects.scales import SCALES
from tests.identification.diagnosis import made_fit
from tests.identification.diagnosis.search.made_objects import made


def alternative(name="coulomb_friction", *, gain=0.0, expected=0.0, **known):
    """One that was fitted, as much of it as the choice looks at."""
    found = made(
        Fitted, **{"chi2_reduced": 5.0, "criterion": -gain, "to_go": 0.0, "title": name, "continued": name, "variances": None} | known
    )
    return Alternative(candidate=made_fit.candidate(name, expected), fitted=found, gain=gain)


@pytest.mark.parametrize(
    ("alternatives", "name", "expected", "hopeless"),
    [
        ([], "quadratic_drag", 1.0, False),
        ([alternative(gain=1000.0, expected=900.0)], "quadratic_drag", 50.0, True),
        ([alternative(gain=1000.0, expected=900.0)], "quadratic_drag", 150.0, False),
        ([alternative(gain=-1e5, expected=900.0)], "quadratic_drag", 1.0, False),
        ([alternative(gain=200.0, expected=900.0)], "quadratic_drag", 50.0, False),
        ([alternative(gain=1000.0, expected=900.0, chi2_reduced=1.01)], "quadratic_drag", 150.0, True),
        ([alternative(gain=1000.0, expected=900.0)], "deep_stop", 0.0, False),
        ([alternative(gain=1000.0, expected=900.0)], "back_stop", 0.0, False),
    ],
)
def test_what_is_worth_a_fit(monkeypatch, alternatives, name, expected, hopeless):
    """By what was gained, no matter what had been expected of it; what no derivative shows always is."""
    monkeypatch.setattr(module, "residual_share", lambda found, beside: (found.chi2_reduced - 1.0) / (beside.chi2_reduced - 1.0))
    scored = made(Scored, scales=SCALES, fitted=made(Fitted, chi2_reduced=10.0))
    assert module._is_hopeless(made_fit.candidate(name, expected), scored, alternatives, 900.0) is hopeless


def test_what_can_still_come_near_the_best_is_fitted_to_the_end(monkeypatch):
    """Their criteria with what another step would bring, against that of the best, 100 after its fit, and the model without, 180."""
    rough = [
        alternative("coulomb_friction", criterion=110.0, to_go=10.0),
        alternative("quadratic_drag", criterion=130.0, to_go=10.0),
        alternative("hysteresis", criterion=130.0, to_go=1.0),
        alternative("cubic_stiffness", criterion=300.0, to_go=100.0),
    ]
    ends = {"coulomb_friction": 100.0, "quadratic_drag": 105.0, "cubic_stiffness": None}

    def attempt(start, variances, *, rounds):
        if ends[start] is None:
            return None
        return made(Fitted, criterion=ends[start], log_likelihood=-0.5 * ends[start], converged=True, lightened=lambda self: self)

    monkeypatch.setattr(module, "attempt", attempt)
    beside = made(Fitted, criterion=180.0, log_likelihood=-90.0)
    found = module._finished(rough, beside, np.inf, lambda stage: None)
    assert [(one.name, one.fitted.criterion) for one in found] == [
        ("coulomb_friction", 100.0),
        ("quadratic_drag", 105.0),
        ("hysteresis", 130.0),
        ("cubic_stiffness", 300.0),
    ]
    assert [one.gain for one in found[:2]] == [80.0, 75.0]
    late = module._finished(rough, beside, -np.inf, lambda stage: None)
    assert [one.fitted.criterion for one in late] == [100.0, 130.0, 130.0, 300.0]


def test_after_the_deadline_one_candidate_is_fitted_and_no_more(monkeypatch):
    names = ["coulomb_friction", "quadratic_drag"]
    beside = made(Fitted, criterion=180.0, log_likelihood=-90.0, title="", variances=None)
    monkeypatch.setattr(module, "_queue", lambda scored: [(made_fit.candidate(name, 50.0), name) for name in names])
    monkeypatch.setattr(module, "_tried", lambda candidate, prepared, beside: [alternative(prepared, gain=40.0)])
    monkeypatch.setattr(module, "_compiled", lambda prepared, beside: None)
    monkeypatch.setattr(module, "_finished", lambda found, *rest: found)
    scored = made(Scored, fitted=beside, largest_gain=50.0, scales=SCALES)
    late, in_time = (module.fitted_in_full(scored, None, deadline, lambda stage: None) for deadline in (-np.inf, np.inf))
    assert ([one.name for one in late[0]], late[1]) == (names[:1], True)
    assert ([one.name for one in in_time[0]], in_time[1]) == (names, False)
