"""What a verdict without a cause states on the losses in the contacts."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from identification.diagnosis.diagnosis import UNLISTED
from identification.diagnosis.locate.restitution import lost_in_contacts, restitution
from identification.diagnosis.sentences import sentences
from tests.identification.diagnosis.made_diagnosis import made_diagnosis
from tests.identification.made_result import made_result
from tests.identification.report.made_rebounds import CONTACT, FREE, LAW, ON_A_SPRING, collision
from vibrojax.contact import Newton
from vibrojax.contact.restitution import restitution as of_law

SPEEDS = np.geomspace(0.1, 1.2, 12)


@pytest.fixture(scope="module")
def unlisted():
    return made_diagnosis(made_result(samples=300), UNLISTED)


def powered(v):
    """1 - e = 0.35 v^0.4."""
    return 1.0 - 0.35 * v**0.4


def straight(v):
    """That of the fitted motions on a spring."""
    return 1.0 - 0.25 * v


def by_law(v):
    """That of the fitted law, of a free hammer."""
    return np.asarray(of_law(LAW, FREE.mass, jnp.atleast_1d(v)))


@pytest.fixture
def side(unlisted):
    """A model beside one collision a record, whose restitution is a function of the speed."""

    def made(of_speed, speeds=SPEEDS, *, model=FREE, contact=CONTACT, **changed):
        pairs = [collision(v, of_speed(v), straight(v), model=model, seed=i, contact=contact) for i, v in enumerate(speeds)]
        records = tuple(dataclasses.replace(record, **changed) for record in pairs)
        return dataclasses.replace(unlisted.nominal, model=model, records=records)

    return made


def test_both_ends_and_the_power_of_the_speed_are_stated(side):
    found = restitution(side(powered))
    assert found is not None and found.exponent is not None
    for end, speeds in ((found.slow, SPEEDS[:2]), (found.fast, SPEEDS[-2:])):
        assert end.approach_speed == pytest.approx(speeds.mean(), rel=0.01)
        assert end.measured == pytest.approx(powered(speeds).mean(), abs=0.003)
        assert end.fitted == pytest.approx(by_law(speeds).mean(), abs=1e-3)
    power, stderr = found.exponent
    assert power == pytest.approx(0.4, abs=0.01) and stderr < 0.01


@pytest.mark.parametrize("changed", [{"model": ON_A_SPRING}, {"kind": "cart-excitation"}], ids=["spring", "drive"])
def test_no_power_is_stated_where_a_spring_or_the_cart_has_its_part(side, changed):
    found = restitution(side(powered, **changed))
    assert found is not None and found.exponent is None
    assert found.fast.measured == pytest.approx(powered(SPEEDS[-2:]).mean(), abs=0.003)
    assert found.fast.fitted == pytest.approx(straight(SPEEDS[-2:]).mean())


@pytest.mark.parametrize(
    "of_speed", [lambda v: 1.05 - 0.1 * v, lambda v: powered(v) - 0.3 * (np.sin(1e3 * v) > 0)], ids=["leaves faster", "scatters"]
)
def test_no_power_is_stated_where_losses_are_insignificant_or_follow_none(side, of_speed):
    found = restitution(side(of_speed))
    assert found is not None and found.exponent is None


@pytest.mark.parametrize("off", [0.0, 0.015], ids=["the same", "a trifle off"])
def test_losses_that_the_model_has_as_well_are_not_stated(side, off):
    assert restitution(side(lambda v: straight(v) + off, model=ON_A_SPRING)) is None
    assert restitution(side(lambda v: float(by_law(v)[0]) + off)) is None


@pytest.mark.parametrize("speeds", [SPEEDS[:5], np.geomspace(0.5, 0.6, 12)], ids=["few", "alike"])
def test_too_few_or_equal_speeds_give_no_trend(side, speeds):
    assert restitution(side(powered, speeds)) is None


@pytest.mark.parametrize(("phase", "stated"), [("contact", True), ("all", False), ("free flight", False)])
def test_losses_are_stated_for_a_misfit_in_the_contacts_alone(unlisted, side, phase, stated):
    location = dataclasses.replace(unlisted.location, phase=phase)
    assert (lost_in_contacts(location, side(powered)) is not None) == stated
    assert lost_in_contacts(None, side(powered)) is None


@pytest.mark.parametrize(("phase", "stated"), [("contact", True), ("all", True), ("after impact", True), ("free flight", False)])
def test_losses_at_a_rigid_stop_are_stated_unless_the_misfit_lies_in_free_flight(unlisted, side, phase, stated):
    location, law = dataclasses.replace(unlisted.location, phase=phase), Newton(restitution=0.8)
    of_free, of_bound = (side(powered, model=model, contact=0) for model in (FREE, ON_A_SPRING))
    free, bound = (dataclasses.replace(one, model=dataclasses.replace(one.model, law=law)) for one in (of_free, of_bound))
    found = lost_in_contacts(location, free)
    assert (found is not None) == stated
    assert found is None or found.exponent is None, "its rebounds are placed by the fit, which moves them by more than their errors"
    assert (lost_in_contacts(location, bound) is not None) == (phase == "contact")


def test_an_end_is_never_a_single_contact(side):
    found = restitution(side(powered, SPEEDS[::2]))
    assert found is not None
    for end, speeds in ((found.slow, SPEEDS[:4:2]), (found.fast, SPEEDS[-4::2])):
        assert end.approach_speed == pytest.approx(speeds.mean(), rel=0.01)


def test_what_the_model_has_change_along_an_end_is_no_scatter(side):
    def always_less(v):
        return by_law(v) - 0.05

    found = restitution(side(always_less, SPEEDS[::2]))
    assert found is not None
    for end, speeds in ((found.slow, SPEEDS[:4:2]), (found.fast, SPEEDS[-4::2])):
        assert np.ptp(always_less(speeds)) > 0.01
        assert end.stderr < 0.003


def test_the_sentence_gives_both_ends_beside_the_model(unlisted, side):
    given = (UNLISTED, (), (), unlisted.location, unlisted.nominal, unlisted.nominal, "")
    said = " ".join(sentences(*given, restitution=restitution(side(powered))))
    assert (
        "Restitution, read off the flight on either side of each contact, goes from 0.85 at 0.11 m/s to 0.64 at 1.1 m/s (1 − e"
        " with the speed to the power 0.39"
    ) in said
    assert "), in the nominal model from 0.96 to 0.73." in said
    assert "the power" not in " ".join(sentences(*given, restitution=restitution(side(powered, model=ON_A_SPRING))))
    assert "Restitution" not in " ".join(sentences(*given))
