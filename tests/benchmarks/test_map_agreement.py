"""What counts as agreement between two maps."""

import numpy as np
import xarray as xr

from benchmarks.maps.agreement import compare
from vibrojax.studies.base import APERIODIC, FAILED, NO_IMPACT, PERIODIC


def made(kind: np.ndarray, impacts: np.ndarray) -> xr.Dataset:
    dims = ("clearance", "ratio")
    parts = {"kind": kind, "impacts": impacts, "period": np.ones_like(kind)}
    side = {dim: np.arange(float(size)) for dim, size in zip(dims, kind.shape, strict=True)}
    return xr.Dataset({name: (dims, values) for name, values in parts.items()}, side)


def test_cells_in_and_beside_chaos_do_not_count_and_others_do():
    kind, impacts = np.full((100, 100), PERIODIC), np.ones((100, 100), dtype=int)
    theirs_kind, theirs = kind.copy(), impacts.copy()
    theirs_kind[0, 0] = APERIODIC
    theirs[1, 1], theirs[40, 40] = 2, 2
    kind[50, 50] = theirs_kind[50, 50] = NO_IMPACT
    impacts[50, 50] = 3
    kind[70, 70] = theirs_kind[70, 70] = FAILED
    found = compare(made(kind, impacts), made(theirs_kind, theirs))
    assert found["cells"] == 10000 and found["away_from_chaos"] == 9996
    assert found["same"] == 9994 and found["share"] == 9994 / 9996
    assert found["disagreements"][0] == {"clearance": 40.0, "ratio": 40.0, "fast": "1/1", "switch": "2/1"}
    assert [(one["clearance"], one["fast"]) for one in found["disagreements"][1:]] == [(70.0, f"kind {FAILED}")]
    assert found["aperiodic_in_one"] == 1 and found["aperiodic_in_both"] == 0
    coarse = compare(made(kind[:6, :6], impacts[:6, :6]), made(theirs_kind[:6, :6], theirs[:6, :6]))
    assert coarse["away_from_chaos"] == 35 and coarse["same"] == 34
