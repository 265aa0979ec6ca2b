"""Separate exponents: the common case, and the lost energy in the limit of little damping."""

import numpy as np
import pytest
from scipy.special import beta

from tests.contact.single_impact import hunt_crossley_restitution, single_impact
from vibrojax.contact import HuntCrossleySeparate

MASS, SPEED, STIFFNESS = 0.4, 0.3, 1e6


def law(exponent, damping, damping_exponent):
    return HuntCrossleySeparate(
        impact_stiffness=STIFFNESS, impact_exponent=exponent, impact_damping=damping, damping_exponent=damping_exponent
    )


def test_equal_exponents_give_hunt_crossley():
    assert single_impact(law(1.5, 2.0, 1.5), MASS, SPEED).restitution == pytest.approx(hunt_crossley_restitution(0.6), rel=1e-9)


def closed_form_loss(n, damping, n_2):
    deepest = (0.5 * (n + 1) * MASS * SPEED**2 / STIFFNESS) ** (1 / (n + 1))
    return 2 * STIFFNESS * damping * SPEED * deepest ** (n_2 + 1) * beta((n_2 + 1) / (n + 1), 1.5) / (n + 1)


@pytest.mark.parametrize(("n", "n_2"), [(1.5, 1.0), (1.5, 2.0), (1.0, 1.5), (2.0, 0.5)])
def test_little_damping_loses_what_the_closed_form_says(n, n_2):
    unit = 0.5 * MASS * SPEED**2 / closed_form_loss(n, 1.0, n_2)  # damping that would lose all of the energy to first order
    fractions = np.array([1e-2, 1e-3])
    errors = []
    for fraction in fractions:
        impact = single_impact(law(n, fraction * unit, n_2), MASS, SPEED)
        errors.append(abs(impact.loop_area / closed_form_loss(n, fraction * unit, n_2) - 1))
    assert errors[1] < 2e-3
    assert np.log10(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.15)


def test_restitution_depends_on_the_speed_through_depth_too():
    fast, slow = (single_impact(law(1.5, 0.02, 1.0), MASS, v) for v in (0.4, 0.2))
    assert fast.restitution != pytest.approx(slow.restitution, abs=1e-3)


@pytest.mark.parametrize("n_2", [0.5, 3.0])
def test_never_pulls(n_2):
    assert single_impact(law(1.5, 0.3 * 1e-3 ** (1.5 - n_2), n_2), MASS, SPEED).smallest_force >= 0.0
