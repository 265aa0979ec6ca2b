"""What vibrojax continue wrote, over a study: branches of periodic orbits on a bifurcation diagram, borders on a Peterka map."""

import csv
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrojax.continuation.rig import SETTINGS
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies.base import natural_frequency


def with_branches(data: xr.Dataset, paths: Sequence[Path]) -> xr.Dataset:
    """The sweeps with the attribute `branches`, a list as JSON: of every branch `value`, `u` (m), `force` (N) and `stable` (1, 0).

    `force` is empty for a rigid stop, whose branches have none. Of an orbit of several cycles the table holds one section point.

    Arguments:
        data: a bifurcation diagram.
        paths: `branch.csv` of the same rig along the same parameter, and those born by period doubling.

    Raises:
        InputError: a file is no such table.
    """
    return data.assign_attrs(branches=json.dumps(read_branches(paths, json.loads(data.attrs["settings"])["parameter"])))


def read_branches(paths: Sequence[Path], parameter: str) -> list[dict[str, Any]]:
    """The tables along a parameter of `bifurcation`, as `with_branches` keeps them; `InputError` for any other file."""
    named = {field: name for name, field in SETTINGS.items()}.get(parameter, parameter)
    return [_branch(path, named) for path in paths]


def pieces(values: np.ndarray, stable: np.ndarray, chosen: int) -> np.ndarray:
    """The values on the stable (1) or unstable (0) stretches of a branch, NaN elsewhere; an unstable one reaches the stable ones beside it.

    Example:
        >>> pieces(np.array([1.0, 2.0, 3.0, 4.0]), np.array([1, 1, 0, 1]), 0).tolist()
        [nan, 2.0, 3.0, 4.0]
    """
    inside = stable == chosen
    if chosen == 0:
        before, after = np.append(inside[1:], False), np.insert(inside[:-1], 0, False)
        inside = inside | before | after
    return np.where(inside, values, np.nan)


def _branch(path: Path, parameter: str) -> dict[str, Any]:
    expected = f"a branch along {parameter}: expected a branch.csv that vibrojax continue --sweep {parameter}=A:B wrote, with the columns "
    with _rows(path, f"{expected}{parameter}, u_m and stable") as rows:
        columns = {"value": parameter, "u": "u_m", "force": "peak_force_N", "stable": "stable"}
        known = {name for name, column in columns.items() if name != "force" or (rows and column in rows[0])}
        found = {name: [float(row[column]) for row in rows] if name in known else [] for name, column in columns.items()}
        if not rows or not np.isfinite(np.concatenate(list(found.values()))).all():
            raise ValueError
    return found


@contextmanager
def _rows(path: Path, expected: str) -> Iterator[list[dict[str, Any]]]:
    """Rows of a table; what goes wrong in reading it, or in what is made of its rows, is an `InputError`."""
    try:
        with path.open(encoding="utf-8", newline="") as file:
            yield list(csv.DictReader(file))
    except (OSError, UnicodeDecodeError, KeyError, TypeError, ValueError, ZeroDivisionError, csv.Error):
        raise InputError(f"{path} is no table of {expected}") from None


def with_borders(data: xr.Dataset, model: Model, path: Path) -> xr.Dataset:
    """The map with the attribute `borders`: kind, and points on the axes `ratio` and `clearance`, of every border, as JSON.

    Arguments:
        data: a Peterka map.
        model: that of the map.
        path: `borders.csv` of the same model.

    Raises:
        InputError: the file is no such table.
    """
    f_n, found = natural_frequency(model, "a Peterka map"), dict[str, dict[str, Any]]()
    needed = "border, kind, frequency, gap, amplitude"
    with _rows(path, f"borders: expected a borders.csv that vibrojax continue --along wrote; it has {needed}") as rows:
        for row in rows:
            line = found.setdefault(row["border"], {"kind": row["kind"], "ratio": [], "clearance": []})
            line["ratio"].append(float(row["frequency"]) / f_n)
            line["clearance"].append(float(row["gap"]) / float(row["amplitude"]))
    return data.assign_attrs(borders=json.dumps(list(found.values())))
