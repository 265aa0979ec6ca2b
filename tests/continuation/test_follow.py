"""Branches: folds where sweeps jump, special points of the rigid stop where the closed form has them, ends for the right reason."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest

from tests.continuation.rigs import RIGID, STEPS, rig, settled, without_impact
from vibrojax.contact import Hertz, KelvinVoigtClipped, Newton
from vibrojax.continuation import Branch, End, Kind, find_orbit, follow
from vibrojax.continuation.rig import as_arrays, strobe_from
from vibrojax.errors import InputError


def places(branch: Branch, kind: Kind) -> list[float]:
    return [place.parameter for place in branch.special if place.kind is kind]


def sweep(forced, frequencies, state, cycles: int) -> np.ndarray:
    """Speed of the fastest impact in the last of so many cycles at each frequency, the state handed on: brute force."""
    state, speeds = jnp.asarray(state), []
    for frequency in frequencies:
        here = as_arrays(forced.replace("frequency", float(frequency)))
        state, _ = strobe_from(STEPS, here, jnp.asarray(cycles - 1), state)
        state, passage = strobe_from(STEPS, here, jnp.asarray(1), state)
        speeds.append(float(passage.fastest_touch))
    return np.array(speeds)


def test_a_branch_goes_through_its_folds_from_one_end_of_the_range_to_the_other(soft):
    assert soft.ends == (End.BOUND, End.BOUND)
    assert [place.kind for place in soft.special] == [Kind.GRAZING, Kind.FOLD, Kind.FOLD, Kind.GRAZING]
    assert soft.parameter[[0, -1]].tolist() == [4.0, 9.0]
    assert soft.touches[[0, -1]].tolist() == [0, 0]
    assert 0.1 < np.mean(soft.stable) < 0.9


def test_folds_lie_where_sweeps_jump(soft):
    upper, lower = places(soft, Kind.FOLD)
    step = 0.02
    up = np.arange(7.92, 8.05, step)
    speeds = sweep(rig(frequency=7.92), up, near(soft, 7.92), 400)
    fell = np.flatnonzero(speeds == 0.0)[0]
    assert up[fell - 1] < upper < up[fell]
    down = np.arange(6.12, 6.02, -step)
    speeds = sweep(rig(frequency=6.12), down, without_impact(rig(frequency=6.12)).state, 400)
    rose = np.flatnonzero(speeds > 0.1)[0]
    assert speeds[rose - 1] < 0.02
    assert down[rose] < lower < down[rose - 1]


def near(branch: Branch, frequency: float) -> np.ndarray:
    """State of the stable impacting orbit of the branch nearest to a frequency."""
    wanted = branch.stable & (branch.touches > 0)
    return branch.states[wanted][np.argmin(np.abs(branch.parameter[wanted] - frequency))]


def test_along_the_branch_multipliers_are_those_of_the_orbits(soft):
    for index in np.linspace(0, len(soft.parameter) - 1, 7).astype(int):
        orbit = find_orbit(rig(frequency=soft.parameter[index]), soft.states[index], landing=STEPS)
        np.testing.assert_allclose(orbit.multipliers, soft.multipliers[index], rtol=1e-6, atol=1e-8)


def test_special_points_of_the_rigid_stop_are_those_of_shaw_and_holmes(rigid):
    assert places(rigid, Kind.FOLD) == pytest.approx([RIGID.fold(7.0, 9.5, 1)], rel=1e-8)
    assert places(rigid, Kind.PERIOD_DOUBLING) == pytest.approx([RIGID.period_doubling(4.6, 6.0, 1)], rel=1e-8)
    assert places(rigid, Kind.GRAZING) == pytest.approx([RIGID.graze(4.0, 5.0)], rel=1e-8)
    assert places(rigid, Kind.GRAZING_FOLD) == pytest.approx([RIGID.graze(5.1, 8.0)], rel=1e-8)
    assert rigid.ends == (End.BOUND, End.BOUND)


def test_every_orbit_of_the_rigid_branch_is_one_of_shaw_and_holmes(rigid):
    for frequency, speed, found in zip(rigid.parameter, rigid.impact_speed, rigid.multipliers, strict=True):
        if speed == 0 or abs(frequency - rigid.parameter.max()) < 1e-3:
            continue
        orbits = [RIGID.orbit(frequency, 1, root) for root in (0, 1)]
        exact, monodromy, _ = min(orbits, key=lambda orbit: abs(orbit[0] - speed))
        assert speed == pytest.approx(exact, rel=1e-5, abs=1e-9)
        expected = np.sort_complex(np.linalg.eigvals(monodromy).astype(complex))
        if abs(expected).max() < 100:
            np.testing.assert_allclose(np.sort_complex(found), expected, rtol=1e-4, atol=1e-6)


def test_a_branch_without_a_continuation_ends_at_the_grazing():
    branch = follow(without_impact(rig(Newton(0.8), frequency=7.0)), "frequency", (5.9, 7.1), landing=STEPS)
    assert branch.ends == (End.GRAZING, End.BOUND)
    assert places(branch, Kind.GRAZING) == pytest.approx([RIGID.graze(5.1, 8.0)], rel=1e-6)


def test_a_stiff_elastic_stop_converges_to_the_rigid_one():
    limit = dataclasses.replace(RIGID, e=1.0, zeta=0.1).fold(7.0, 9.5, 1)
    errors = []
    for stiffness in (1e6, 1e8):
        forced = rig(Hertz(stiffness, 1.0), frequency=7.0, zeta=0.1)
        branch = follow(settled(forced, (-9e-3, 0.06)), "frequency", (6.9, 9.5), landing=STEPS)
        errors.append(places(branch, Kind.FOLD)[0] - limit)
    # An impact takes pi sqrt(m / k): the fold comes earlier by a part of that, to first order.
    assert errors[1] < 0
    assert errors[0] / errors[1] == pytest.approx(10.0, rel=0.1)


def test_a_jump_of_the_force_at_touch_makes_a_corner():
    branch = follow(without_impact(rig(KelvinVoigtClipped(1e6, 1e-4), frequency=7.0)), "frequency", (5.9, 7.1), landing=STEPS)
    (corner,) = places(branch, Kind.GRAZING_FOLD)
    assert corner == pytest.approx(RIGID.graze(5.1, 8.0), rel=1e-6)
    assert places(branch, Kind.FOLD) == []


def test_other_parameters_are_followed_too(soft):
    orbit = find_orbit(rig(frequency=7.0), near(soft, 7.0), landing=STEPS)
    gap = follow(orbit, "gap", (1.5e-3, 8e-3), landing=STEPS)
    assert Kind.FOLD in {place.kind for place in gap.special}
    damping = follow(orbit, "zeta", (0.04, 0.2), landing=STEPS)
    (fold,) = places(damping, Kind.FOLD)
    at_fold = next(place.orbit for place in damping.special if place.kind is Kind.FOLD)
    assert float(at_fold.rig.value("zeta")) == pytest.approx(fold)
    assert at_fold.multipliers[0] == pytest.approx(1.0, abs=1e-6)


def test_a_short_allowance_says_so(soft):
    branch = follow(settled(rig(frequency=4.0)), "frequency", (3.0, 9.0), landing=STEPS, most_points=4)
    assert branch.ends == (End.POINTS, End.POINTS)
    assert len(branch.parameter) == 7


def test_a_range_without_the_start_is_refused():
    with pytest.raises(InputError, match="frequency runs from 5 to 6, the orbit is at 4: expected a range that holds it"):
        follow(settled(rig(frequency=4.0)), "frequency", (5.0, 6.0), landing=STEPS)


def test_the_table_holds_the_branch(soft):
    header, *rows = soft.csv().splitlines()
    assert header.startswith("frequency,u_m,v_m_per_s,stable,touches,impact_speed_m_per_s,peak_force_N")
    table = np.array([[float(value) for value in row.split(",")] for row in rows])
    np.testing.assert_array_equal(table[:, 0], soft.parameter)
    np.testing.assert_array_equal(table[:, -4] + 1j * table[:, -3], soft.multipliers[:, 0])
