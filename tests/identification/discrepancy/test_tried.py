"""Each fit is made once, unless it had been given up and more is allowed now."""

import numpy as np

from identification.discrepancy.tried import Tried
from tests.identification.discrepancy.made_search import fitted
from vibrojax.errors import NoConvergenceError


def test_a_fit_is_made_once_beside_one_model_and_again_beside_another(motion, allowed):
    one, other, result = (fitted(motion, allowed.samples * level) for level in (1.0, 2.0, 3.0))
    tried, made = Tried(), []

    def fit():
        made.append(1)
        return result

    assert not tried.has(one, "friction")
    assert all(tried.fitted(one, "friction", limit, fit) is result for limit in (10.0, 1.0, np.inf))
    assert tried.has(one, "friction") and not tried.has(other, "friction") and len(made) == 1
    assert tried.fitted(other, "friction", 10.0, fit) is result and len(made) == 2
    assert tried.fitted(one, "drag", 10.0, fit) is result and len(made) == 3


def test_what_was_given_up_is_fitted_again_where_more_is_allowed_and_what_cannot_be_integrated_is_not(motion, allowed):
    beside, result, tried = fitted(motion, allowed.samples * 1.0), fitted(motion, allowed.samples * 2.0), Tried()
    assert tried.fitted(beside, "friction", 10.0, lambda: None) is None
    assert tried.fitted(beside, "friction", 5.0, lambda: result) is None
    assert tried.fitted(beside, "friction", 11.0, lambda: result) is result

    def lost():
        raise NoConvergenceError("for the test")

    assert tried.fitted(beside, "drag", 10.0, lost) is None
    assert tried.fitted(beside, "drag", np.inf, lambda: result) is None
