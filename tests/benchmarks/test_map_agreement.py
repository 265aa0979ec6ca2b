"""What counts as agreement between two maps."""

import numpy as np
import xarray as xr

from benchmarks.maps.agreement import compare
from vibrojax.studies.classify import APERIODIC, NO_IMPACT, PERIODIC


def made(kind: np.ndarray, impacts: np.ndarray) -> xr.Dataset:
    dims = ("clearance", "ratio")
    parts = {"kind": kind, "impacts": impacts, "period": np.ones_like(kind)}
    side = {dim: np.arange(float(size)) for dim, size in zip(dims, kind.shape, strict=True)}
    return xr.Dataset({name: (dims, values) for name, values in parts.items()}, side)


def test_cells_beside_chaos_do_not_count_and_others_do():
    kind, impacts = np.full((6, 6), PERIODIC), np.ones((6, 6), dtype=int)
    theirs_kind, theirs = kind.copy(), impacts.copy()
    theirs_kind[0, 0] = APERIODIC
    theirs[1, 1], theirs[4, 4], theirs[5, 0] = 2, 2, 1
    kind[5, 5] = theirs_kind[5, 5] = NO_IMPACT
    impacts[5, 5] = 3
    found = compare(made(kind, impacts), made(theirs_kind, theirs))
    assert found["cells"] == 36 and found["away_from_chaos"] == 32
    assert found["same"] == 31 and found["share"] == 31 / 32
    assert found["disagreements"] == [{"clearance": 4.0, "ratio": 4.0, "fast": "1/1", "switch": "2/1"}]
    assert found["aperiodic_in_one"] == 1 and found["aperiodic_in_both"] == 0
