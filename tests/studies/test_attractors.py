"""Which motions share an attractor, and the measures of basins, on data whose answer is known."""

import numpy as np
import pytest

from vibrojax.studies.attractors import SAME, Sections, attractors, share
from vibrojax.studies.base import APERIODIC, FAILED, NO_IMPACT, PERIODIC
from vibrojax.studies.basins import boundary, entropy, integrity
from vibrojax.studies.basins_along import _together

STROBES = 16


def lanes(*rows: tuple[np.ndarray, int, int, int, float]) -> Sections:
    """Sections from (points, kind, p, q, exponent) of each lane."""
    points, *rest = zip(*rows, strict=True)
    return Sections(np.array(points), *(np.array(part) for part in rest))


def cycle(*points: tuple[float, float], shift: int = 0) -> np.ndarray:
    """An orbit that repeats, begun at one of its points."""
    return np.array([points[(i + shift) % len(points)] for i in range(STROBES)])


def henon(seed: int) -> np.ndarray:
    """Points of a chaotic attractor."""
    x, y = np.random.default_rng(seed).uniform(0.0, 0.1, 2)
    found = []
    for number in range(100 + STROBES):
        x, y = 1.0 - 1.4 * x * x + y, 0.3 * x
        if number >= 100:
            found.append((x, y))
    return np.array(found)


def test_orbits_of_one_z_are_told_apart_by_their_section_and_not_by_where_they_begin():
    here, there = ((0.0, 1.0), (2.0, 3.0)), ((0.0, 1.0), (2.0, 3.0 + 3 * SAME))
    periodic = (PERIODIC, 1, 2, np.nan)
    label, found = attractors(
        lanes((cycle(*here), *periodic), (cycle(*here, shift=1) + 0.3 * SAME, *periodic), (cycle(*there, shift=1), *periodic))
    )
    assert label.tolist() == [0, 0, 1]
    assert [one.name for one in found] == ["z = 1/2 a", "z = 1/2 b"] and [one.motion for one in found] == ["z = 1/2"] * 2
    np.testing.assert_allclose(found[1].points, np.roll(np.array(there), 1, axis=0))


def test_z_no_impact_and_failure_are_kept_apart_where_sections_are_the_same():
    point = cycle((0.5, 0.5))
    label, found = attractors(
        lanes(
            (point, NO_IMPACT, 0, 1, np.nan),
            (point, PERIODIC, 1, 1, np.nan),
            (point, PERIODIC, 2, 1, np.nan),
            (point, FAILED, 0, 0, np.nan),
        )
    )
    assert sorted(label.tolist()) == [-1, 0, 1, 2]
    assert sorted(one.name for one in found) == ["no impact", "z = 1/1", "z = 2/1"]


def test_two_chaotic_attractors_are_two_and_what_is_no_chaos_is_a_class_of_its_own():
    far = np.array([5.0, 0.0])
    rows = [(henon(seed), APERIODIC, 0, 0, 0.4) for seed in range(12)]
    rows += [(henon(seed) + far, APERIODIC, 0, 0, 0.4) for seed in range(20, 26)]
    rows += [(henon(30), APERIODIC, 0, 0, -0.1)]
    label, found = attractors(lanes(*rows))
    assert [one.lanes for one in found] == [12, 6, 1]
    assert [one.motion for one in found] == ["chaotic", "chaotic", "not settled, or q > 8"]
    assert label.tolist() == [0] * 12 + [1] * 6 + [2]
    assert found[0].lyapunov == pytest.approx(0.4)


def test_the_interval_of_a_share_covers_it_as_often_as_it_says():
    truth, total = 0.07, 400
    drawn = np.random.default_rng(1).binomial(total, truth, 2000)
    inside = [low <= truth <= high for _, low, high in (share(int(count), total) for count in drawn)]
    assert 0.93 < np.mean(inside) < 0.97
    assert share(0, 50)[1:] == (0.0, pytest.approx(0.0713, abs=1e-3)) and share(50, 50)[2] == 1.0


def test_basin_entropy_of_made_pictures():
    """A boundary through the middle of a box has the entropy of its parts; equal parts of three colours at random come near ln 3."""
    halves = np.zeros((25, 25), int)
    halves[:, 12:] = 1
    part = np.array([2 / 5, 3 / 5])
    one = float(-np.sum(part * np.log(part)))
    assert entropy(halves) == pytest.approx((one / 5, one))
    mixed = entropy(np.random.default_rng(0).integers(0, 3, (250, 250)))
    bias = 2 / (2 * 25)  # of an entropy from 25 draws of three colours
    assert mixed.basin == mixed.boundary == pytest.approx(np.log(3.0) - bias, abs=5e-3)


def cantor(depth: int) -> np.ndarray:
    """Stripes whose borders are a Cantor set: the middle thirds of depth 1, 2, ... in turn of one colour and the other."""
    side = 3**depth
    colour, place = np.full(side, -1), np.arange(side)
    for level in range(1, depth + 1):
        colour = np.where((colour < 0) & ((place // 3 ** (depth - level)) % 3 == 1), level % 2, colour)
    return np.broadcast_to(np.where(colour < 0, depth % 2, colour), (side, side))


def test_dimension_of_smooth_and_of_fractal_boundaries():
    circle = np.hypot(*np.meshgrid(np.linspace(-1, 1, 401), np.linspace(-1, 1, 401))) < 0.7
    smooth = boundary(circle.astype(int))
    assert smooth.dimension == pytest.approx(1.0, abs=0.02) and abs(smooth.dimension - 1.0) < 3 * smooth.stderr
    rough, known = boundary(cantor(6)), 1.0 + np.log(2) / np.log(3)
    assert abs(rough.dimension - known) < 0.1 and rough.exponent == pytest.approx(2.0 - rough.dimension)
    assert np.isnan(boundary(np.zeros((50, 50), int)).dimension)


def test_integrity_is_the_room_in_units_of_a_displacement():
    """A basin right of u = 1 mm, whose attractor lies at u = 4 mm: 3 mm; velocities count by what they displace in 1 / Omega."""
    omega = 50.0
    u0, v0 = np.linspace(-5e-3, 10e-3, 301), omega * np.linspace(-8e-3, 8e-3, 321)
    colours = np.broadcast_to((u0 > 1e-3).astype(int), (v0.size, u0.size))
    places = [np.array([[-4.5e-3, 0.0]]), np.array([[4e-3, 0.0], [8e-3, 0.1]])]
    left, right = integrity(colours, u0, v0, places, omega)
    assert left.local == pytest.approx(0.5e-3) and left.bounded
    assert right.local == pytest.approx(2e-3) and right.bounded  # the second point is 2 mm from the edge
    assert right.largest == pytest.approx(4.5e-3, abs=1e-4)
    alone = integrity(colours, u0, v0, [places[0], np.array([[4e-3, 0.0]])], omega)[1]
    assert alone.local == pytest.approx(3e-3, abs=alone.resolution) and not alone.bounded
    assert np.isnan(integrity(colours, u0, v0, [np.array([[0.1, 0.0]]), places[1]], omega)[0].local)


def test_seeds_without_any_other_motion_are_still_told_apart():
    """At a value of the parameter at which nothing on the grid could be integrated."""
    one = np.ones(1, int)
    seeds = Sections(np.zeros((1, 16, 2)), one, one, one, np.zeros(1))
    together = _together([], seeds)
    assert together.period.dtype.kind == "i"
    assert [found.name for found in attractors(together)[1]] == ["z = 1/1"]
