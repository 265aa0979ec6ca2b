"""Branches over a bifurcation diagram: sweeps side by side, and only from a table of a branch along the swept parameter."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from vibrojax.cli.options import Over
from vibrojax.contact import HuntCrossley
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies import bifurcation
from vibrojax.studies.continuation_lines import pieces, with_branches
from vibrojax.studies.figures.lines import draw_bifurcation
from vibrojax.studies.write import write_study
from vibrojax.suspension import Linear

RIG = Model(1.0, Linear(0.05, 5.0), HuntCrossley(1e6, 1.5, 0.3))
TABLE = """\
frequency,u_m,v_m_per_s,stable,touches,peak_force_N
4.0,0.001,0.0,1,0,0.0
4.5,0.002,0.0,1,1,10.0
4.4,0.003,0.0,0,1,20.0
4.6,0.004,0.0,1,1,30.0
"""
RIGID = "\n".join(line.rpartition(",")[0] for line in TABLE.splitlines()) + "\n"


@pytest.fixture(scope="module")
def swept():
    return bifurcation(RIG, parameter="frequency_hz", values=[4.0, 4.3, 4.6], gap=1e-3, base_amplitude=1e-3)


def test_both_sweeps_lie_side_by_side_under_the_branches(swept, tmp_path):
    (tmp_path / "branch.csv").write_text(TABLE)
    (tmp_path / "rigid.csv").write_text(RIGID)
    data = with_branches(swept, [tmp_path / "branch.csv", tmp_path / "rigid.csv"])
    first, second = json.loads(data.attrs["branches"])
    assert first["value"] == [4.0, 4.5, 4.4, 4.6] and first["stable"] == [1, 1, 0, 1]
    assert first["force"] == [0.0, 10.0, 20.0, 30.0] and second["force"] == []
    assert len(draw_bifurcation(swept).axes) == 2
    panels = draw_bifurcation(data).axes
    assert len(panels) == 4 and panels[0].get_ylim() == panels[1].get_ylim() and panels[0].get_xlim() == (4.0, 4.6)
    broken = [line for line in panels[1].lines if line.get_linestyle() == "--" and len(line.get_xdata()) == 4]
    np.testing.assert_allclose(broken[0].get_ydata(), [np.nan, 2.0, 3.0, 4.0])
    assert write_study("bifurcation", data, tmp_path)[1].stat().st_size > 5000


def test_an_unstable_piece_reaches_the_stable_ones_and_not_the_reverse():
    values, stable = np.arange(5.0), np.array([0, 1, 1, 0, 0])
    np.testing.assert_allclose(pieces(values, stable, 1), [np.nan, 1.0, 2.0, np.nan, np.nan])
    np.testing.assert_allclose(pieces(values, stable, 0), [0.0, 1.0, 2.0, 3.0, 4.0])


@pytest.mark.parametrize(
    "text",
    ["", TABLE.splitlines()[0], TABLE.replace("frequency", "gap"), TABLE.replace("stable", "firm"), TABLE.replace("4.4", "x"), "\0"],
)
def test_any_other_table_is_refused(swept, tmp_path, text):
    (tmp_path / "other.csv").write_text(text)
    with pytest.raises(InputError, match="is no table of a branch along frequency: expected a branch.csv"):
        with_branches(swept, [tmp_path / "other.csv"])
    job = SimpleNamespace(settings={"parameter": "frequency_hz"})
    with pytest.raises(InputError, match="is no table of a branch along frequency"):  # before anything is computed
        Over(branches=(tmp_path / "other.csv",)).check([job])
