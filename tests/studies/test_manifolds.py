"""Manifolds of maps whose curves are known in closed form, and of an oscillator beside SciPy."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from vibrojax.contact import Newton, NoContact
from vibrojax.continuation.rig import ForcedRig
from vibrojax.effects import CubicStiffness
from vibrojax.model import Model
from vibrojax.studies.manifolds import stable_branch, unstable_branch
from vibrojax.studies.saddles import AbstractPlaneMap, StrobeMap, jacobian, saddles
from vibrojax.suspension import Linear

ROOM = dict(low=np.array([-40.0, -40.0]), high=np.array([40.0, 40.0]))
GROWS, SHRINKS, BENT = 3.0, 0.5, 0.1


class Saddle(AbstractPlaneMap):
    """x -> 3 x, y -> y / 2, in coordinates bent so that the stable manifold is x = 0.1 y^2 and the unstable one y = 0."""

    def image(self, points):
        x, y = points.T
        return np.stack([GROWS * (x - BENT * y**2) + BENT * (SHRINKS * y) ** 2, SHRINKS * y], axis=-1)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_stable_manifold_of_a_bent_saddle_is_a_parabola(sign):
    path, lost = stable_branch(Saddle(), np.zeros(2), np.array([0.0, sign]), longest=25.0, **ROOM)
    assert not lost
    np.testing.assert_allclose(path[:, 0], BENT * path[:, 1] ** 2, atol=0.02)
    assert (np.diff(sign * path[:, 1]) > 0).all()
    assert 25.0 <= np.linalg.norm(np.diff(path, axis=0), axis=1).sum() < 30.0


def test_the_unstable_manifold_of_a_bent_saddle_is_a_line():
    path = unstable_branch(Saddle(), np.zeros(2), np.array([1.0, 0.0]), GROWS, longest=20.0, **ROOM)
    np.testing.assert_allclose(path[:, 1], 0.0, atol=1e-12)
    assert path[-1, 0] == pytest.approx(20.0, abs=4.0)
    assert (np.diff(path[:, 0]) > 0).all()


def test_curves_end_at_the_border_of_the_region():
    near = dict(low=np.array([-1.0, -1.0]), high=np.array([1.0, 1.0]))
    path, lost = stable_branch(Saddle(), np.zeros(2), np.array([0.0, 1.0]), longest=100.0, **near)
    assert not lost and 1.0 < path[-1, 1] < 6.0
    path = unstable_branch(Saddle(), np.zeros(2), np.array([1.0, 0.0]), GROWS, longest=100.0, **near)
    assert path[-1, 0] <= 1.0


def test_the_derivative_is_that_of_the_map():
    np.testing.assert_allclose(jacobian(Saddle(), np.array([[0.0, 0.0]]))[0], [[GROWS, 0.0], [0.0, SHRINKS]], atol=1e-9)


D, BETA, F, OMEGA = 0.2, 1.0, 27.0, 2.2
"""Of x'' + d x' + beta x + x^3 = f sin(omega t), as in `benchmarks.basins`."""
COUNT = 41
LOW, HIGH = np.array([-5.0, -10.0]), np.array([5.0, 10.0])
CELL = (HIGH - LOW) / (COUNT - 1)


def settled(state: np.ndarray) -> np.ndarray:
    """Section point on which a motion of the oscillator settles, by SciPy."""

    def rates(t, y):
        return [y[1], F * math.sin(OMEGA * t) - D * y[1] - BETA * y[0] - y[0] ** 3]

    span = (0.0, 2 * np.pi / OMEGA * 60)
    return solve_ivp(rates, span, state, method="DOP853", rtol=1e-9, atol=1e-9).y[:, -1]


@pytest.fixture(scope="module")
def duffing() -> StrobeMap:
    omega_n = math.sqrt(BETA)
    model = Model(1.0, Linear(D / (2 * omega_n), omega_n / (2 * math.pi)), NoContact(), effects=(CubicStiffness(1.0),))
    rig = ForcedRig(model, gap=1e3, base_amplitude=F / OMEGA**2, frequency_hz=OMEGA / (2 * math.pi))
    return StrobeMap(rig, 1, LOW, CELL)


def test_states_on_the_two_sides_of_a_stable_manifold_settle_on_two_motions(duffing):
    """A tenth of a cell to the left of the curve all states go to one motion, to the right all to the other, by SciPy's DOP853."""
    found = saddles(duffing, 1, (COUNT, COUNT), np.zeros((0, 2)))
    assert len(found) == 1
    outside, inside = found[0].multipliers
    period = 2 * np.pi / OMEGA
    assert outside * inside == pytest.approx(math.exp(-D * period), rel=1e-6)  # Liouville
    values, vectors = np.linalg.eig(found[0].orbits[0].monodromy * CELL / CELL[:, None])
    room = dict(low=np.array([-20.0, -20.0]), high=np.array([60.0, 60.0]), longest=60.0)
    left, right = [], []
    for sign in (1.0, -1.0):
        path, lost = stable_branch(duffing, found[0].points[0], sign * vectors[:, np.argmin(np.abs(values))], **room)
        assert not lost
        where = np.linspace(1, len(path) - 2, 6).astype(int)
        along = path[where + 1] - path[where]
        normal = sign * np.stack([-along[:, 1], along[:, 0]], axis=-1) / np.linalg.norm(along, axis=1, keepdims=True)
        middle = 0.5 * (path[where] + path[where + 1])
        left += [settled(state) for state in duffing.states(middle + 0.1 * normal)]
        right += [settled(state) for state in duffing.states(middle - 0.1 * normal)]
    assert np.ptp(left, axis=0).max() < 0.05 and np.ptp(right, axis=0).max() < 0.05
    assert np.abs(left[0] - right[0]).max() > 1.0


@pytest.fixture(scope="module")
def rigid() -> StrobeMap:
    model = Model(0.5, Linear(0.03, 5.0), Newton(0.7))
    rig = ForcedRig(model, gap=4e-3, base_amplitude=1.5e-3, frequency_hz=8.0)
    return StrobeMap(rig, 1, np.array([-8e-3, -0.5]), np.array([1e-4, 1e-2]))


@pytest.mark.parametrize("speed", [0.3, -0.3])
def test_the_map_passes_through_an_impact_on_a_rigid_stop_without_a_break(rigid, speed):
    """States a hair before the stop and a hair behind it, where they stand for those on the other side of the rebound."""
    at = (np.array([4e-3, speed]) - rigid.origin) / rigid.cell
    assert rigid.edge == pytest.approx(at[0])
    before, behind = rigid.image(np.stack([at - [1e-6, 0.0], at + [1e-6, 0.0]]))
    np.testing.assert_allclose(before, behind, atol=1e-4)
    folded = rigid.states(rigid.fold((at + [1.0, 0.0])[None]))[0]
    assert folded[0] == pytest.approx(4e-3 - 1e-4) and folded[1] == pytest.approx(-0.7 * speed if speed > 0 else -speed / 0.7)
