"""A study on disk: its data set and its figure."""

from pathlib import Path

import xarray as xr

from vibrojax.studies.basin_finding import document
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
        written[-1].write_text(document(data), encoding="utf-8")
    return written
