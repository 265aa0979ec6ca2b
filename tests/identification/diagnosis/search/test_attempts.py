"""Refits that fail, and those that have not converged."""

import numpy as np
import pytest

from identification.diagnosis.search import attempts as module
from identification.likelihood.fitted import Fitted
from identification.likelihood.variances import Variances
from identification.windows.prepare import Prepared
from tests.identification.diagnosis.search.made_objects import made


@pytest.mark.parametrize(("criterion", "is_better"), [(90.0, True), (110.0, False), (None, False)])
def test_of_a_fit_that_has_not_converged_and_one_from_least_squares_the_better_is_kept(recovered, monkeypatch, criterion, is_better):
    """The latter starts where least squares end, without a random force."""
    began, other = [], None if criterion is None else made(Fitted, criterion=criterion)
    stuck = made(
        Fitted, title="back_stop", criterion=100.0, prepared=recovered.prepared, estimate=recovered.estimate, variances=recovered.variances
    )

    def attempt(prepared, variances, *, rounds):
        began.append(prepared.start)
        return other

    monkeypatch.setattr(module, "attempt", attempt)
    assert module.by_least_squares(stuck, lambda stage: None) is (other if is_better else stuck)
    assert not np.any(began[0].force)
    np.testing.assert_allclose(began[0].shared, recovered.estimate.shared, atol=1e-3)


@pytest.mark.parametrize("error", [np.linalg.LinAlgError("singular"), module.NoConvergenceError("lost")])
def test_a_fit_that_fails_is_none(error, monkeypatch):
    def fails(*given, **more):
        raise error

    monkeypatch.setattr(module, "point", fails)
    assert module.attempt(made(Prepared, start=None), made(Variances), rounds=1) is None
