"""A study on disk: its data set and its figure."""

import json
from pathlib import Path
from typing import Any

import xarray as xr

from vibrojax.studies.figures import FIGURES, UNCERTAIN, save, style


def write_study(name: str, data: xr.Dataset, folder: Path) -> list[Path]:
    """Write `NAME.nc` (NetCDF 3, readable by `xarray.open_dataset`) and `NAME.png`.

    Arguments:
        name: of the command, a key of `FIGURES`.
        data: of the study, or of its quantiles over draws; of basins, the attractors and their measures become `NAME.json` as well.
        folder: that receives the files; it must exist.

    Returns:
        Paths of the files.
    """
    written = [folder / f"{name}.nc", folder / f"{name}.png"]
    data.to_netcdf(written[0], engine="scipy")
    with style():
        draw = UNCERTAIN[name] if "quantile" in data.dims else FIGURES[name]
        save(draw(data), written[1])
    if "attractors" in data.attrs:
        written.append(folder / f"{name}.json")
        written[-1].write_text(json.dumps(_measures(data), indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return written


def _measures(data: xr.Dataset) -> dict[str, Any]:
    """What a study of basins found, without its picture."""
    numbers = {name: None if value != value else value for name, value in data.attrs.items() if isinstance(value, float)}
    numbers.pop("seconds", None)
    return {
        "finding": data.attrs.get("finding", ""),
        "settings": json.loads(data.attrs["settings"]),
        **numbers,
        "attractors": json.loads(data.attrs["attractors"]),
    }
