"""Borders over a Peterka map: on the axes of the map, and only from a table of borders."""

import json

import numpy as np
import pytest

from vibrojax.contact import HuntCrossley
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies import peterka
from vibrojax.studies.continuation_lines import with_borders
from vibrojax.studies.write import write_study
from vibrojax.suspension import Linear

RIG = Model(1.0, Linear(0.05, 5.0), HuntCrossley(1e6, 1.5, 0.3))
TABLE = """\
border,kind,cycles,touches,frequency,gap,amplitude,u_m,v_m_per_s
1,grazing,1,0,4.0,0.002,0.001,0,0
1,grazing,1,0,4.5,0.003,0.001,0,0
2,fold,1,1,6.0,0.003,0.001,0,0
2,fold,1,1,7.0,0.002,0.001,0,0
"""


@pytest.fixture(scope="module")
def rough():
    return peterka(RIG, ratio=[0.8, 1.2, 1.6], clearance=[1.0, 2.0, 3.0], base_amplitude=1e-3)


def test_borders_are_on_the_axes_of_the_map(rough, tmp_path):
    (tmp_path / "borders.csv").write_text(TABLE)
    data = with_borders(rough, RIG, tmp_path / "borders.csv")
    first, second = json.loads(data.attrs["borders"])
    assert (first["kind"], second["kind"]) == ("grazing", "fold")
    np.testing.assert_allclose([first["ratio"], first["clearance"]], [[0.8, 0.9], [2.0, 3.0]])
    np.testing.assert_allclose([second["ratio"], second["clearance"]], [[1.2, 1.4], [3.0, 2.0]])
    with_lines, without = (
        next(path for path in write_study("peterka", one, tmp_path, stem=stem) if path.suffix == ".png").read_bytes()
        for stem, one in (("with", data), ("without", rough))
    )
    assert with_lines != without


@pytest.mark.parametrize(
    "text",
    ["frequency,stable\n4.0,1\n", TABLE.replace("amplitude", "size"), TABLE.replace("0.002,0.001", "0.002,0"), TABLE.replace("4.5", "x")],
)
def test_any_other_table_is_refused(rough, tmp_path, text):
    (tmp_path / "other.csv").write_text(text)
    with pytest.raises(InputError, match="is no table of borders: expected a borders.csv"):
        with_borders(rough, RIG, tmp_path / "other.csv")
