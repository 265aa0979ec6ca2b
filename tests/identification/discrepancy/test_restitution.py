"""What a verdict without a cause tells of the losses in the contacts."""

import dataclasses

import numpy as np
import pytest

from identification.discrepancy.diagnosis import UNLISTED
from identification.discrepancy.restitution import lost_in_contacts, restitution
from identification.discrepancy.verdict import sentences
from identification.report.rebounds import by_law
from tests.identification.discrepancy.made_diagnosis import made_diagnosis
from tests.identification.made_result import made_result
from tests.identification.report.made_rebounds import ON_A_SPRING, collision


@pytest.fixture(scope="module")
def good():
    return made_result(samples=300)


SPEEDS = np.geomspace(0.1, 1.2, 12)


def records(of_speed, speeds=SPEEDS, **options):
    """One collision a record; its restitution is a function of the speed."""
    fitted = by_law(ON_A_SPRING, speeds)
    return tuple(collision(v, of_speed(v), float(e), seed=i, **options) for i, (v, e) in enumerate(zip(speeds, fitted, strict=True)))


def powered(v):
    """1 - e = 0.35 v^0.4."""
    return 1.0 - 0.35 * v**0.4


def test_both_ends_and_the_power_of_the_speed_are_told():
    found = restitution(records(powered), ON_A_SPRING)
    assert found is not None and found.exponent is not None
    for end, speeds in ((found.slow, SPEEDS[:2]), (found.fast, SPEEDS[-2:])):
        assert end.approach_speed == pytest.approx(speeds.mean(), rel=0.01)
        assert end.measured == pytest.approx(powered(speeds).mean(), abs=0.003)
        assert end.by_law == pytest.approx(by_law(ON_A_SPRING, speeds).mean(), abs=0.003)
    power, stderr = found.exponent
    assert power == pytest.approx(0.4, abs=0.01) and stderr < 0.01


def test_what_the_law_gives_as_well_is_not_told():
    assert restitution(records(lambda v: float(by_law(ON_A_SPRING, np.array([v]))[0])), ON_A_SPRING) is None


@pytest.mark.parametrize("speeds", [SPEEDS[:5], np.geomspace(0.5, 0.6, 12)], ids=["few", "alike"])
def test_too_few_speeds_or_all_alike_tell_no_course(speeds):
    assert restitution(records(powered, speeds), ON_A_SPRING) is None


def test_no_power_is_told_where_some_hammer_leaves_faster_than_it_came():
    found = restitution(records(lambda v: 1.05 - 0.3 * v), ON_A_SPRING)
    assert found is not None and found.exponent is None


@pytest.mark.parametrize(("phase", "told"), [("contact", True), ("all", False), ("free flight", False)])
def test_is_told_of_a_misfit_in_the_contacts_alone(good, phase, told):
    made = made_diagnosis(good, UNLISTED)
    side = dataclasses.replace(made.nominal, model=ON_A_SPRING, records=records(powered))
    assert (lost_in_contacts(dataclasses.replace(made.location, phase=phase), side) is not None) == told
    assert lost_in_contacts(None, side) is None


def test_the_sentence_gives_both_ends_beside_the_law(good):
    made = made_diagnosis(good, UNLISTED)
    found = restitution(records(powered), ON_A_SPRING)
    said = sentences(UNLISTED, (), (), made.location, made.nominal, made.nominal, "", restitution=found)
    assert (
        "Restitution, read off the flight on either side of each contact, goes from 0.85 at 0.11 m/s to 0.64 at 1.1 m/s,"
        " that of the fitted law from 0.96 to 0.73; 1 − e goes with the speed to the power 0.39"
    ) in " ".join(said)
    without = sentences(UNLISTED, (), (), made.location, made.nominal, made.nominal, "")
    assert "Restitution" not in " ".join(without)
