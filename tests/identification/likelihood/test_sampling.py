"""Density and sampler of the posterior: against the normal approximation, differences, and a density in closed form."""

import dataclasses
import importlib.util

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from identification.estimation.nominal import nominal_fit
from identification.experiment import ParameterOption, Prior
from identification.least_squares.fit import free_unknowns
from identification.least_squares.residual import weighted_residual
from identification.least_squares.uncertainty import uncertainty
from identification.likelihood.fitted import Fitted
from identification.likelihood.marginal import estimated_force
from identification.likelihood.sampling import nuts
from identification.likelihood.sampling.density import density
from identification.likelihood.sampling.nuts import Nuts, check_extra
from identification.likelihood.sampling.window_terms import principal_axes
from identification.likelihood.variances import posterior
from identification.windows.prepare import prepare
from tests.identification.conftest import cropped
from vibrojax.errors import InputError, NoConvergenceError

PRIOR = Prior(mean=3.2e6, std=2e4)


@pytest.fixture(scope="module")
def fitted(example):
    """A short drop test and a short cart record, with a prior on the stiffness."""
    experiment = dataclasses.replace(cropped(example, 2000, (0, 1)), parameters={"k_i": ParameterOption(prior=PRIOR)})
    prepared = prepare(experiment)
    return nominal_fit(prepared, starts=1).fitted


@pytest.fixture(scope="module")
def about(fitted):
    """Its density, and that compiled."""
    shared = fitted.prepared.layout.shared
    spread = uncertainty(fitted.posterior.equations, fitted.estimate, free_unknowns(fitted.prepared))
    found = density(fitted, np.ones(shared, bool), spread.covariance[:shared, :shared])
    return found, eqx.filter_jit(lambda z: found.terms(z))


@pytest.mark.thorough
def test_near_the_mode_it_is_the_normal_density_of_the_standard_errors(about):
    found, evaluate = about
    at_mode, room, slope = evaluate(jnp.zeros(5))
    np.testing.assert_allclose(slope, 0.0, atol=0.01)
    for direction in np.eye(5):
        for distance in (-1.0, 1.0):
            value, volume, gradient = evaluate(jnp.asarray(distance * direction))
            assert float(value - at_mode) == pytest.approx(-0.5, abs=0.02)
            assert float(volume - room) == pytest.approx(0.0, abs=0.02)
            np.testing.assert_allclose(gradient, -distance * direction, atol=0.03)


def test_its_gradient_is_that_of_the_value(about):
    found, evaluate = about
    here, step = jnp.asarray([1.0, -0.5, 0.8, 0.3, -1.2]), 1e-2
    *_, gradient = evaluate(here)
    central = [(evaluate(here + step * e)[0] - evaluate(here - step * e)[0]) / (2 * step) for e in jnp.eye(5)]
    np.testing.assert_allclose(gradient, central, atol=0.01)
    np.testing.assert_allclose(eqx.filter_jit(jax.grad(lambda z: found(z)))(here), gradient, rtol=1e-9)


def test_the_random_force_follows_its_optimum(fitted, about):
    """Away from the mode the force that is integrated is the one that the fit would estimate there, to first order."""
    found, _ = about
    part = jax.tree.map(lambda leaf: leaf[0], found.groups[0])
    lanes, size = part.mode.shape
    step = 1e-3 * jax.random.normal(jax.random.key(0), (lanes, size))
    order = np.argsort(fitted.prepared.groups[0].lengths, kind="stable")[:lanes]
    steps = np.zeros((len(fitted.prepared.record), size))
    steps[order] = step
    expected, _ = estimated_force(fitted.point.inner, fitted.point.marginal, steps)
    at_mode, _ = estimated_force(fitted.point.inner, fitted.point.marginal, np.zeros_like(steps))
    moved = part.force_at(part.mode + step) - part.force_at(part.mode)
    assert float(jnp.abs(moved).max()) > 0
    np.testing.assert_allclose(moved, (expected - at_mode)[order], rtol=1e-6, atol=1e-9 * float(jnp.abs(moved).max()))


def test_what_a_force_adds_to_the_residual_is_taken_off_again(fitted):
    """To first order, products do not depend on the force under which a window is integrated."""
    point, variances = fitted.point, fitted.variances
    restless = dataclasses.replace(variances, force=dataclasses.replace(variances.force, std=1e-4))
    at = Fitted(point=point.under(restless), posterior=posterior(point.linear, point.inner, restless), to_go=0.0)
    found = density(at, np.ones(5, bool), np.eye(5))
    part = jax.tree.map(lambda leaf: leaf[0], found.groups[0])
    local = part.mode
    force = part.force + 1e-3 * jax.random.normal(jax.random.key(1), part.force.shape)

    def residual(values):
        windows = eqx.tree_at(lambda one: one.disturbance.values, part.windows, values)
        return weighted_residual(found.model, found.layout, found.integrator, windows, local)[0][:, None]

    before, moved = residual(part.force), residual(force)
    at_mode, taken_off, left_in = (part.gram(*one)[:, 0, 0] for one in ((before, part.force), (moved, force), (moved, part.force)))
    counted = np.asarray(part.counted)
    assert counted.any()
    assert np.all(np.abs(taken_off - at_mode)[counted] < 0.02 * np.abs(left_in - at_mode)[counted])


def test_it_is_nothing_outside_the_bounds(about):
    found, _ = about
    narrow = eqx.tree_at(lambda d: d.limits, found, (found.mode - 1e-9, found.mode + 1e-9))
    value = eqx.filter_jit(lambda z: narrow(z))
    assert float(value(jnp.ones(5))) == -np.inf
    assert np.isfinite(float(value(jnp.zeros(5))))


def test_components_of_the_random_force_that_do_not_matter_are_left_out():
    """Singular values of the response in two windows: as many are kept in both as matter in either."""
    rng = np.random.default_rng(0)
    responses = []
    for values in ([0.9, 0.3, 1e-4], [0.5, 1e-5, 1e-6]):
        left, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        right, _ = np.linalg.qr(rng.normal(size=(40, 3)))
        responses.append(left @ np.diag(values) @ right.T)
    axes = principal_axes(np.stack(responses))
    assert axes.shape == (2, 3, 2)
    found = axes.transpose(0, 2, 1) @ np.stack(responses)
    np.testing.assert_allclose(found.transpose(0, 2, 1) @ found, [one.T @ one for one in responses], atol=1e-7)


def test_a_random_force_without_components_is_one_of_no_size(about):
    found, _ = about
    part = jax.tree.map(lambda leaf: leaf[0], found.groups[0])
    rows = jax.random.normal(jax.random.key(0), (part.projection.shape[0], 3, *part.projection.shape[2:]))
    empty = (part.projection[:, :0], part.components[:, :0])
    none = eqx.tree_at(lambda p: (p.projection, p.components), part, empty)
    small = eqx.tree_at(lambda p: p.projection, part, jnp.zeros_like(part.projection))
    np.testing.assert_allclose(none.gram(rows, part.force), small.gram(rows, part.force))


class Normal(eqx.Module):
    """A correlated normal density of two variables, in place of a `Density`."""

    precision: jax.Array

    def __call__(self, z):
        return -0.5 * z @ self.precision @ z


COVARIANCE = np.array([[1.0, 0.6], [0.6, 1.0]])


def normal() -> Normal:
    return Normal(precision=jnp.asarray(np.linalg.inv(COVARIANCE)))


def test_chains_have_mean_and_covariance_of_the_density():
    said = []
    chains = Nuts(chains=4, warm_up=50, draws=600)(normal(), 2, seed=1, progress=said.append)
    assert chains.draws.shape == (4, 600, 2) and chains.divergent.shape == (4, 600)
    pooled = chains.draws.reshape(-1, 2)
    np.testing.assert_allclose(pooled.mean(axis=0), 0.0, atol=0.1)
    np.testing.assert_allclose(np.cov(pooled.T), COVARIANCE, atol=0.15)
    assert not chains.divergent.any()
    assert 0.6 < chains.acceptance.mean() < 0.98
    assert "of 2600 draws" in said[1]


def test_the_same_seed_gives_the_same_draws_and_another_does_not():
    method = Nuts(chains=2, warm_up=5, draws=10)
    one, same, other = (method(normal(), 2, seed=seed, progress=lambda text: None).draws for seed in (3, 3, 4))
    np.testing.assert_array_equal(one, same)
    assert not np.array_equal(one, other)


def test_an_interrupt_ends_all_chains():
    def interrupted(text):
        if "of" in text and "draws" in text:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Nuts(chains=2, warm_up=5, draws=100_000)(normal(), 2, seed=0, progress=interrupted)


def test_a_density_that_is_finite_nowhere_is_no_traceback():
    nowhere = Normal(precision=jnp.full((2, 2), jnp.nan))
    with pytest.raises(NoConvergenceError, match="the posterior cannot be sampled"):
        Nuts(chains=1)(nowhere, 2, seed=0, progress=lambda text: None)


@pytest.mark.parametrize(
    ("missing", "words"), [({"blackjax"}, "package blackjax, not"), ({"blackjax", "arviz"}, "packages blackjax and arviz")]
)
def test_a_missing_extra_says_how_to_install_it(monkeypatch, missing, words):
    real = importlib.util.find_spec
    monkeypatch.setattr(nuts, "find_spec", lambda name: None if name in missing else real(name))
    with pytest.raises(InputError, match=f'{words}.*installed: run pip install "vibrojax\\[bayes\\]", or leave the posterior out'):
        check_extra()
