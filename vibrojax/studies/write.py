"""A study on disk: its data set, its figure and the caption."""

from pathlib import Path

import xarray as xr

from vibrojax.drawing import FORMATS, save, sized, style
from vibrojax.figure_style import SCREEN, FigureStyle
from vibrojax.studies.basin_finding import document
from vibrojax.studies.basin_manifolds import write_manifolds
from vibrojax.studies.caption import caption
from vibrojax.studies.figures import FIGURES, UNCERTAIN
from vibrojax.studies.finding import finding


def write_study(name: str, data: xr.Dataset, folder: Path, *, look: FigureStyle = SCREEN, stem: str | None = None) -> list[Path]:
    """Write `STEM.nc` (NetCDF 3, readable by `xarray.open_dataset`), its figure as PNG, PDF and SVG, and the caption `STEM.md`.

    Arguments:
        name: of the command, a key of `FIGURES`.
        data: of the study, or of its quantiles over draws; of basins, the attractors and their measures become `STEM.json` as well, and
            manifolds `manifolds.csv`.
        folder: that receives the files; it must exist.
        look: sizes of the figure.
        stem: of the files; by default the name of the command.

    Returns:
        Paths of the files.
    """
    stem = name if stem is None else stem
    paths = {suffix: folder / f"{stem}.{suffix}" for suffix in ("nc", *FORMATS, "md")}
    data.to_netcdf(paths["nc"], engine="scipy")
    draw = UNCERTAIN[name] if "quantile" in data.dims else FIGURES[name]
    with style(look):
        figure = sized(draw(data), look)
        for suffix in FORMATS:
            save(figure, paths[suffix], look)
    paths["md"].write_text(caption(name, data, finding(name, data)), encoding="utf-8")
    if "attractors" in data.attrs:
        paths["json"] = folder / f"{stem}.json"
        paths["json"].write_text(document(data), encoding="utf-8")
    if "manifolds" in data.attrs:
        paths["csv"] = write_manifolds(data, folder, stem)
    return list(paths.values())
