"""Branches that are born by period doubling: where the closed form has their birth, and what brute force settles on."""

import jax.numpy as jnp
import numpy as np
import pytest

from tests.continuation.rigs import FINE, RIGID, rig
from vibrojax.contact import Newton
from vibrojax.continuation import Branch, End, Kind, doubled, find_orbit, follow, settle
from vibrojax.continuation.job import follow_and_write
from vibrojax.continuation.rig import as_arrays, strobe_from
from vibrojax.errors import InputError

BIRTH = RIGID.period_doubling(4.9, 4.93, 1)


@pytest.fixture(scope="module")
def born(rigid) -> Branch:
    (place,) = (one for one in rigid.special if one.kind is Kind.PERIOD_DOUBLING)
    orbit = doubled(place, "frequency", 4.8, landing=FINE)
    return follow(orbit, "frequency", (4.2, 9.0), born_at=place, landing=FINE)


def test_the_branch_begins_at_the_period_doubling_with_twice_the_period(born):
    assert born.cycles == 2 and born.touches[0] == 2 and born.ends[0] is End.BORN
    assert born.parameter[0] == pytest.approx(BIRTH, abs=1e-6)
    here = rig(Newton(0.8), frequency=float(born.parameter[3]))
    with_half_the_period = find_orbit(here, born.states[3], cycles=1, landing=FINE)
    assert np.linalg.norm((with_half_the_period.state - born.states[3]) / [1e-3, 1e-3 * 2 * np.pi * 5.0]) > 1e-3


def test_where_it_is_stable_brute_force_settles_on_it(born):
    stable = np.flatnonzero(born.stable & (born.parameter < BIRTH - 0.05))
    chosen = stable[len(stable) // 2]
    here = rig(Newton(0.8), frequency=float(born.parameter[chosen]))
    state, cycles = settle(here, born.states[chosen] * 1.01, landing=FINE)
    assert cycles == 2
    found = find_orbit(here, state, cycles=2, landing=FINE)
    assert found.stable and found.touches == born.touches[chosen]
    later, _ = strobe_from(FINE, as_arrays(here), jnp.asarray(1), jnp.asarray(born.states[chosen]))
    apart = [np.abs((found.state - half) / [1e-3, 1e-3 * 2 * np.pi * 5.0]).max() for half in (born.states[chosen], np.asarray(later))]
    assert min(apart) < 1e-6 and max(apart) > 1e-2


def test_a_doubled_branch_is_written_beside_its_parent(tmp_path):
    branches = follow_and_write(
        rig(Newton(0.8), frequency=5.1), "frequency", (4.9, 5.1), tmp_path, at=5.1, start=(-9e-3, 0.06), doublings=1, landing=FINE
    )
    assert [one.cycles for one in branches] == [1, 2]
    rows = (tmp_path / "branch_doubled-1.csv").read_text().splitlines()
    assert len(rows) == 1 + len(branches[1].parameter) and (tmp_path / "special_doubled-1.json").is_file()
    assert "branches born by period doubling" in (tmp_path / "branch.md").read_text()


def test_a_fold_gives_birth_to_no_doubled_orbit(rigid):
    fold = next(one for one in rigid.special if one.kind is Kind.FOLD)
    with pytest.raises(InputError, match="no orbit of twice the period is born at a fold: expected a period doubling"):
        doubled(fold, "frequency", 4.8)
