"""What a further effect explains of the misfit."""

import dataclasses

import numpy as np
import pytest

from identification.diagnosis.relevance import misfit, share, weights
from identification.likelihood.fitted import Fitted
from identification.windows.prepare import windows_of
from tests.identification.diagnosis import made_fit


@pytest.mark.parametrize(
    ("model", "more", "expected"),
    [(11.0, 1.0, 1.0), (2.0, 1.0, 0.1), (1.001, 1.0, 1e-4), (2.0, 12.0, 0.0), (2.0, 2.0, 0.0), (13.0, 12.0, 1.0), (2.0, np.nan, 0.0)],
)
def test_share_of_the_misfit_that_more_than_a_model_explains(model, more, expected):
    """The nominal model leaves 11."""
    assert share(11.0, model, more) == pytest.approx(expected, rel=1e-6)


def weighed(fit: Fitted, weight: np.ndarray) -> Fitted:
    """A fit whose windows have other weights."""
    variances = dataclasses.replace(fit.variances, weight=weight)
    return dataclasses.replace(fit, point=dataclasses.replace(fit.point, variances=variances))


def test_windows_that_nothing_explains_do_not_hide_an_effect_in_the_others(motion, friction):
    """Every sixth window holds a force a hundred times as large, with and without the effect: its share of the misfit is nearly all."""
    odd = np.arange(len(motion.at.record)) % 6 == 0
    large = 100.0 * friction(0.05) * odd[:, None]
    nominal, explained = (motion.fitted(motion.shown(force=small + large)) for small in (friction(0.05), 0.0))
    more = weighed(explained, np.where(odd, 1e-6, 1.0))
    assert misfit(nominal, weighed(explained, np.ones(len(odd)))) > 50.0 * misfit(nominal, more)
    assert misfit(more, more) == pytest.approx(1.0, abs=0.05) and misfit(nominal, more) > 2.0


def test_a_weight_is_the_mean_over_the_samples_of_a_window(recovered):
    """At most 1, also where the other fit has further windows."""
    weight = np.linspace(0.2, 0.9, len(recovered.prepared.record))
    np.testing.assert_allclose(weights(recovered, weighed(recovered, weight)), weight)
    np.testing.assert_allclose(weights(recovered, weighed(recovered, 3.0 * np.ones(len(weight)))), 1.0)
    doubled = recovered.weighted_chi2(2.0 * weight)
    assert recovered.weighted_chi2(weight) == pytest.approx(doubled) and np.isnan(recovered.weighted_chi2(0.0 * weight))
    part = made_fit.with_prepared(recovered, windows_of(recovered.prepared, np.array([2, 5])))
    np.testing.assert_allclose(weights(part, weighed(recovered, weight)), weight[[2, 5]])
