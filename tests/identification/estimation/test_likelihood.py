"""Profiles of the likelihood, and the sample of the posterior, as parts of a whole fit."""

import dataclasses

import numpy as np
import pytest
from scipy.special import chdtri

from identification.estimation.estimate import fit_experiment
from identification.estimation.likelihood import log_posterior
from identification.estimation.parameters import profile_rise, uncertainty
from identification.experiment import ParameterOption
from identification.report import tables
from identification.report.base import STYLES
from identification.report.estimates import likelihood_profiles, posterior
from identification.result.files import StoredFit, fit_dataset, fit_json, provenance, stored_fit
from identification.result.posterior import SHAPE_LIMIT, arviz, weighted, write_posterior
from identification.result.store import read_stored, write_dataset
from identification.trajectory.fit import fit as chain_fit
from identification.trajectory.start import problem_of
from tests.identification.conftest import TRUTH, cropped


def fit(example, **options):
    """A short drop test and a short cart record; the damping ratio is held."""
    held = {"zeta": ParameterOption(start=TRUTH["zeta"], fixed=True)}
    experiment = dataclasses.replace(cropped(example, 1200, (0, 1)), parameters=held)
    return fit_experiment(experiment, **options)


@pytest.fixture(scope="module")
def fitted(example):
    """With profiles and as many draws as agree with the standard errors."""
    return fit(example, draws=150, with_profiles=True)


def test_profiles_are_the_parabola_of_the_standard_errors_on_quiet_records(fitted):
    estimates = {p.spec.name: p for p in fitted.parameters}
    assert [curve.name for curve in fitted.profiles.single] == ["k_i", "n", "lambda_i", "f_n"]
    for curve in fitted.profiles.single:
        spec, one = estimates[curve.name].spec, estimates[curve.name]
        sigma = one.stderr / spec.slope(one.value)
        sigmas = (np.array([spec.to_internal(value) for value in curve.values]) - spec.to_internal(one.value)) / sigma
        np.testing.assert_allclose(curve.rise, sigmas**2, atol=0.25)
        low, high = np.interp(one.ci95, curve.values, curve.rise)
        assert low == pytest.approx(chdtri(1, 0.05), rel=0.15) and high == pytest.approx(chdtri(1, 0.05), rel=0.15)


def test_the_map_of_stiffness_and_exponent_rises_with_the_distance_in_their_ellipse(fitted):
    pair = fitted.profiles.pair
    assert pair.names == ("k_i", "n")
    axis = np.linspace(-3.2, 3.2, 9)
    np.testing.assert_allclose(pair.rise, axis[:, None] ** 2 + axis[None] ** 2, atol=0.6)


def test_the_posterior_agrees_with_the_standard_errors_on_quiet_records(fitted):
    """Mean, standard deviation and 95 % interval, within what so many independent draws leave open."""
    sample = fitted.posterior
    assert sample.names == ("k_i", "n", "lambda_i", "f_n")
    assert sample.effective > 75 and sample.tail < SHAPE_LIMIT and not sample.warnings()
    for name in sample.names:
        one = next(p for p in fitted.parameters if p.spec.name == name)
        mean, std = sample.moments(name)
        assert mean == pytest.approx(one.value, abs=0.4 * one.stderr)
        assert std == pytest.approx(one.stderr, rel=0.25)
        np.testing.assert_allclose(sample.interval(name), one.ci95, atol=0.8 * one.stderr)
    assert [row[0] for row in tables.posterior(fitted).rows] == ["k_i", "n", "λ_i", "f_n"]


def test_the_density_is_that_of_the_profile_where_all_but_one_parameter_are_held(example):
    """Of one free parameter, density and profile likelihood are the same but for the chain's determinant, which hardly changes."""
    held = {name: ParameterOption(start=TRUTH[name], fixed=True) for name in ("k_i", "n", "lambda_i", "zeta")}
    chain = chain_fit(problem_of(dataclasses.replace(cropped(example, 1200, (0, 1)), parameters=held)))
    index = chain.problem.unknowns.index("f_n")
    mode, sigma = chain.at.shared / chain.problem.border.shared_scale, uncertainty(chain).stderr[index]
    for side in (-2.0, 1.0):
        there = mode.copy()
        there[index] += side * sigma
        fall = 2.0 * (log_posterior(chain, mode) - log_posterior(chain, there))
        assert fall == pytest.approx(profile_rise(chain, {index: side * sigma}), abs=0.05)


def test_weights_turn_draws_of_another_distribution_into_the_posterior():
    """A normal density from draws of one that is shifted by half its width, and wider."""
    rng = np.random.default_rng(4)
    z = 0.5 + 1.5 * rng.standard_normal(4000)
    sample = weighted(("a",), ("1",), draws=z[:, None], log_density=-0.5 * z**2, log_proposal=-0.5 * ((z - 0.5) / 1.5) ** 2)
    assert sample.moments("a") == (pytest.approx(0.0, abs=0.06), pytest.approx(1.0, abs=0.06))
    np.testing.assert_allclose(sample.interval("a"), (-1.96, 1.96), atol=0.15)
    assert np.std(sample.pooled) == pytest.approx(1.0, abs=0.06)


def test_arviz_reads_the_file(fitted, tmp_path):
    write_posterior(fitted.posterior, tmp_path / "posterior.nc", {"experiment": "a rig"})
    data = arviz().from_netcdf(tmp_path / "posterior.nc")
    assert set(data.groups()) == {"posterior"}
    np.testing.assert_array_equal(data.posterior["k_i"].values[0], fitted.posterior.pooled[:, 0])
    assert data.posterior["k_i"].attrs["units"] == "N/m^n"


def test_both_are_kept_with_the_result(fitted, tmp_path):
    write_dataset(fit_dataset(StoredFit(result=fitted, reference=None, provenance=provenance(fitted))), tmp_path / "result.nc")
    again = read_stored(tmp_path / "result.nc", {"fit": stored_fit}).result
    assert again.profiles == fitted.profiles
    for field in dataclasses.fields(fitted.posterior):
        np.testing.assert_array_equal(getattr(again.posterior, field.name), getattr(fitted.posterior, field.name))
    document = fit_json(fitted)
    assert document["posterior"]["parameters"]["n"]["ci95"] == list(fitted.posterior.interval("n"))
    assert document["profiles"]["pair"]["names"] == ["k_i", "n"]


@pytest.mark.parametrize("style", STYLES.values(), ids=STYLES)
def test_they_are_drawn(fitted, style):
    pictures = [*likelihood_profiles(fitted, style), *posterior(fitted, style)]
    assert [picture.name for picture in pictures] == ["profiles", "profile-contour", "posterior"]
    panels = [axes for axes in pictures[0].figure.axes if axes.axison]
    assert len(panels) == 4
    assert len(pictures[2].figure.axes) == 16
    for picture in pictures:
        assert picture.caption and picture.alt


def test_a_fit_without_them_has_no_such_pictures(fitted):
    plain = dataclasses.replace(fitted, posterior=None, profiles=None)
    assert not [*likelihood_profiles(plain, STYLES["screen"]), *posterior(plain, STYLES["screen"])]


def test_a_sample_that_does_not_represent_the_posterior_is_a_warning(fitted):
    (warning,) = dataclasses.replace(fitted.posterior, tail=0.9).warnings()
    assert "tail 0.90, reliable up to 0.7" in warning and "--draws" in warning
