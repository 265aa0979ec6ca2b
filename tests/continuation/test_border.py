"""Borders in two parameters: the closed form of the rigid stop, two folds on one border, refusals."""

import dataclasses

import numpy as np
import pytest

from tests.continuation.rigs import FINE, RIGID, STEPS
from vibrojax.continuation import Branch, End, Kind, SpecialPoint, border
from vibrojax.continuation.border import border_table, borders
from vibrojax.continuation.job import borders_finding
from vibrojax.errors import InputError

GAPS = (2.5e-3, 3.5e-3)


def place(branch: Branch, kind: Kind, nth: int = 0) -> SpecialPoint:
    return [one for one in branch.special if one.kind is kind][nth]


@pytest.mark.parametrize(
    ("kind", "closed_form", "error_hz"),
    [
        (Kind.FOLD, lambda oscillator, f: oscillator.fold(f - 0.01, f + 0.01, 1), 1e-7),
        (Kind.PERIOD_DOUBLING, lambda oscillator, f: oscillator.period_doubling(f - 0.01, f + 0.01, 1), 1e-7),
        (Kind.GRAZING, lambda oscillator, f: oscillator.graze(f - 0.01, f + 0.01), 1e-4),
    ],
)
def test_borders_of_the_rigid_stop_are_those_of_shaw_and_holmes(rigid, kind, closed_form, error_hz):
    found = border(place(rigid, kind), ("frequency", "gap"), ((3.0, 12.0), GAPS), landing=FINE)
    assert found.ends == (End.BOUND, End.BOUND) and sorted(found.second[[0, -1]]) == pytest.approx(GAPS)
    for frequency, gap in zip(found.first[::5], found.second[::5], strict=True):
        exact = closed_form(dataclasses.replace(RIGID, gap=float(gap)), float(frequency))
        assert frequency == pytest.approx(exact, abs=error_hz)


def test_two_folds_that_meet_in_a_cusp_lie_on_one_border(soft):
    found, lost = borders(soft, "gap", ((4.0, 9.0), (1e-3, 4e-3)), landing=STEPS)
    assert not lost and [one.kind for one in found] == [Kind.GRAZING, Kind.FOLD, Kind.GRAZING]
    folds = found[1]
    for one in (place(soft, Kind.FOLD), place(soft, Kind.FOLD, 1)):
        assert folds.holds(one.parameter, 3e-3, (1e-3, 1e-6))
    assert not folds.holds(7.0, 3e-3, (1e-3, 1e-6))
    tip = int(np.argmin(folds.second))
    assert 0 < tip < len(folds.second) - 1 and 1e-3 < folds.second[tip] < 1.5e-3
    rows = border_table(found).splitlines()
    assert rows[0].startswith("border,kind,cycles,touches,frequency,gap") and len(rows) == 1 + sum(len(one.first) for one in found)
    assert "fold of z = 1/1 at frequency" in borders_finding(found) and "grazing of the motion without impact" in borders_finding(found)


@pytest.mark.parametrize(
    ("names", "bounds", "said"),
    [
        (("frequency", "frequency"), ((4.0, 9.0), (4.0, 9.0)), "both parameters of a border are frequency"),
        (("frequency", "gap"), ((4.0, 9.0), (4e-3, 5e-3)), "gap runs from 0.004 to 0.005, the border begins at 0.003"),
        (("frequency", "k"), ((4.0, 9.0), (0.0, 1.0)), "unknown parameter 'k'"),
    ],
)
def test_a_plane_without_the_start_is_refused(soft, names, bounds, said):
    with pytest.raises(InputError, match=said):
        border(place(soft, Kind.FOLD), names, bounds)


def test_a_branch_point_is_no_border_that_is_followed(soft):
    here = dataclasses.replace(place(soft, Kind.FOLD), kind=Kind.BRANCH_POINT)
    with pytest.raises(InputError, match="a branch point is no border that is followed: expected one of fold, "):
        border(here, ("frequency", "gap"), ((4.0, 9.0), GAPS))
