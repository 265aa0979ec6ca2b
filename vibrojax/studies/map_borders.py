"""Borders of periodic motion on a Peterka map: from the table that `vibrojax continue --along` wrote to curves on the map's axes."""

import csv
import json
from pathlib import Path

import xarray as xr

from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.studies.base import natural_frequency

_NEEDED = ("border", "kind", "frequency", "gap", "amplitude")


def with_borders(data: xr.Dataset, model: Model, path: Path) -> xr.Dataset:
    """The map with the attribute `borders`: kind, and points on the axes `ratio` and `clearance`, of every border, as JSON.

    Arguments:
        data: a Peterka map.
        model: that of the map.
        path: `borders.csv` of the same model.

    Raises:
        InputError: the file is no such table.
    """
    f_n, found = natural_frequency(model, "a Peterka map"), dict[str, dict[str, list[float] | str]]()
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = csv.DictReader(file)
            for row in rows:
                line = found.setdefault(row["border"], {"kind": row["kind"], "ratio": [], "clearance": []})
                line["ratio"].append(float(row["frequency"]) / f_n)  # type: ignore[union-attr]
                line["clearance"].append(float(row["gap"]) / float(row["amplitude"]))  # type: ignore[union-attr]
    except (OSError, UnicodeDecodeError, KeyError, TypeError, ValueError, ZeroDivisionError, csv.Error):
        raise InputError(
            f"{path} is no table of borders: expected a borders.csv that vibrojax continue --along wrote; it has {', '.join(_NEEDED)}"
        ) from None
    return data.assign_attrs(borders=json.dumps(list(found.values())))
