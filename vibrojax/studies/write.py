"""A study on disk: its data set and its figure."""

from pathlib import Path

import xarray as xr

from vibrojax.studies.figures import FIGURES, save, style


def write_study(name: str, data: xr.Dataset, folder: Path) -> list[Path]:
    """Write `NAME.nc` (NetCDF 3, readable by `xarray.open_dataset`) and `NAME.png`.

    Arguments:
        name: of the command, a key of `FIGURES`.
        data: of the study.
        folder: that receives the files; it must exist.

    Returns:
        Paths of the files.
    """
    written = [folder / f"{name}.nc", folder / f"{name}.png"]
    data.to_netcdf(written[0], engine="scipy")
    with style():
        save(FIGURES[name](data), written[1])
    return written
