"""Profiles of the likelihood, and the sample of the posterior, as parts of a whole fit."""

import dataclasses

import numpy as np
import pytest
from identification.likelihood.sampling.nuts import Nuts
from scipy.special import chdtri

from identification.estimation.estimate import fit_experiment
from identification.experiment import ParameterOption
from identification.report import tables
from identification.report.base import STYLES
from identification.report.estimates import likelihood_profiles, posterior
from identification.result.files import StoredFit, fit_json, provenance, stored_fit, write_result
from identification.result.posterior import arviz, write_posterior
from identification.result.store import read_stored
from tests.identification.conftest import TRUTH, cropped


def fit(example, **options):
    """A short drop test and a short cart record; the damping ratio is held."""
    held = {"zeta": ParameterOption(start=TRUTH["zeta"], fixed=True)}
    experiment = dataclasses.replace(cropped(example, 1200, (0, 1)), parameters=held)
    return fit_experiment(experiment, **options)


@pytest.fixture(scope="module")
def fitted(example):
    """With profiles and a sample that is too small to say anything."""
    return fit(example, posterior_by=Nuts(warm_up=5, draws=10), with_profiles=True)


@pytest.fixture(scope="module")
def sampled(example):
    """With as many draws as agree with the standard errors."""
    return fit(example, posterior_by=Nuts(warm_up=40, draws=120))


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


@pytest.mark.thorough
def test_the_posterior_agrees_with_the_standard_errors_on_quiet_records(sampled):
    """Mean, standard deviation and 95 % interval, within what so many independent draws leave open."""
    sample = sampled.posterior
    assert sample.names == ("k_i", "n", "lambda_i", "f_n")
    assert max(sample.rhat) < 1.03 and min(sample.ess_bulk) > 150
    for index, name in enumerate(sample.names):
        one = next(p for p in sampled.parameters if p.spec.name == name)
        values = sample.pooled[:, index]
        assert values.mean() == pytest.approx(one.value, abs=0.25 * one.stderr)
        assert values.std() == pytest.approx(one.stderr, rel=0.2)
        np.testing.assert_allclose(sample.interval(name), one.ci95, atol=0.6 * one.stderr)
    assert [row[0] for row in tables.posterior(sampled).rows] == ["k_i", "n", "λ_i", "f_n"]


def test_arviz_reads_the_file(fitted, tmp_path):
    write_posterior(fitted.posterior, tmp_path / "posterior.nc", {"experiment": "a rig"})
    data = arviz().from_netcdf(tmp_path / "posterior.nc")
    assert set(data.groups()) == {"posterior", "sample_stats"}
    np.testing.assert_array_equal(data.posterior["k_i"].values, fitted.posterior.draws[..., 0])
    assert data.posterior["k_i"].attrs["units"] == "N/m^n"
    assert data.sample_stats["diverging"].dtype == bool
    assert float(arviz().rhat(data)["n"]) == pytest.approx(fitted.posterior.rhat[1], rel=1e-9)


def test_both_are_kept_with_the_result(fitted, tmp_path):
    write_result(StoredFit(result=fitted, reference=None, provenance=provenance(fitted)), tmp_path / "result.nc")
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


def test_chains_that_have_not_met_are_a_warning(fitted):
    apart = dataclasses.replace(fitted.posterior, rhat=(1.0, 1.2, 1.0, 1.0), divergent=np.ones_like(fitted.posterior.divergent))
    first, second = apart.warnings()
    assert "R-hat of n is 1.200; ask for more draws with --draws" in first
    assert "40 of 40 trajectories" in second
    assert not dataclasses.replace(fitted.posterior, rhat=(1.0,) * 4).warnings()
