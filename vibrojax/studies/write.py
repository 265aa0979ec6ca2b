"""A study on disk: its data set, its figure, and the caption with what it shows, what was found, and the rig behind it, as Markdown."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from vibrojax.drawing import write_figure
from vibrojax.figure_style import SCREEN, FigureStyle, rig_words, written
from vibrojax.studies.basin_manifolds import manifold_table
from vibrojax.studies.figures import FIGURES, UNCERTAIN
from vibrojax.studies.finding import document, finding

_SHOWS = {
    "response": "Largest impact force F_i, and F_i / (m g), of the motion reached from rest against the excitation frequency Omega. "
    "Lines join neighbours of one motion z = p/q (p impacts in q cycles); points of aperiodic motion stand alone.",
    "bifurcation": "Displacement u of the hammer relative to the cart at the strobes, and largest impact force F_i of each cycle, "
    "along a parameter that is swept up (pale) and down (dark). Broken lines: jumps.",
    "peterka": "Left: motion reached from rest, z = p/q (p impacts in q cycles of excitation), over frequency ratio and gap over "
    "amplitude. Right: F_i / (m g) on z = 1/1, wherever that exists.",
    "section": "Poincaré section, phase plane and histories: displacement u relative to the cart, impact force F_i and absolute "
    "acceleration of the hammer. Broken line: the stop.",
    "basins": "Basins of attraction in the plane of the initial displacement and velocity relative to the cart, one colour a motion.",
    "basins_along": "Share of the initial states that settle in each motion, matched along a parameter, and the basin entropy.",
    "lyapunov": "Both Lyapunov exponents of the stroboscopic map per cycle of excitation, over the bifurcation diagram: displacement u at "
    "the strobes. Shaded: chaos.",
    "design": "Largest impact force F_i, and F_i / (m g), against the hammer's mass over that of the model; spring, damper and stop stay.",
}
_BESIDE = {
    "response": " Open marks: motions that coexist with it.",
    "bifurcation": " Open marks: motions that coexist with those of both sweeps.",
    "peterka": " Dotted, or rings: cells at which another motion exists, too.",
    "section": " Open marks: section points of motions that coexist with it.",
}
_MANIFOLDS = " Crosses: saddles; thick and thin lines: their stable and unstable manifolds."
_OVER_DRAWS = " Median, middle 50 % and 95 % over the draws of a fit."


def caption(name: str, data: xr.Dataset, found: str) -> str:
    """Title, what is shown, what was found, and model, gap, A0 and drive.

    Arguments:
        name: of the command.
        data: its data set.
        found: the sentence of `finding`.
    """
    settings = json.loads(data.attrs["settings"])
    shown = _SHOWS[name] + (_OVER_DRAWS if "quantile" in data.dims else "") + (_MANIFOLDS if "manifolds" in data.attrs else "")
    shown += _BESIDE.get(name, "") if "coexistence" in data.attrs else ""
    rows = {
        "model": rig_words(json.loads(data.attrs["model"])),
        "gap": _gap(data, settings),
        "A0": f"{1e3 * settings['base_amplitude']:.4g} mm" if "base_amplitude" in settings else "varies",
        "drive": f"y = A0 sin(Omega t), {_drive(data)}",
    }
    rows |= {key: f"{value:g}" for key, value in settings.items() if key not in _SAID and isinstance(value, float)}
    rows["made with"] = f"vibrojax {data.attrs['vibrojax']}, engine {data.attrs['engine']}"
    return written(data.attrs["title"], shown, found, rows)


_SAID = ("gap", "base_amplitude", "frequency_hz", "parameter")


def _gap(data: xr.Dataset, settings: Mapping[str, Any]) -> str:
    if "gap" in data.coords:
        return f"{_values(1e3 * np.atleast_1d(data['gap'].values))} mm"
    if "clearance" in data.coords:
        return f"{_values(data['clearance'].values)} A0"
    return f"{1e3 * settings['gap']:.4g} mm" if "gap" in settings else "none"


def _drive(data: xr.Dataset) -> str:
    settings = json.loads(data.attrs["settings"])
    if "frequency_hz" in data.coords:
        return f"Omega {_values(np.atleast_1d(data['frequency_hz'].values))} Hz"
    if "ratio" in data.coords:
        return f"Omega/omega {_values(data['ratio'].values)}"
    return f"Omega {settings['frequency_hz']:.4g} Hz" if "frequency_hz" in settings else "Omega varies"


def _values(values: np.ndarray) -> str:
    """Few values one by one, many by their ends and number."""
    if values.size <= 6:
        return ", ".join(f"{value:.4g}" for value in values)
    return f"{values.min():.4g} to {values.max():.4g} ({values.size} values)"


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
    data.to_netcdf(folder / f"{stem}.nc", engine="scipy")
    draw = UNCERTAIN[name] if "quantile" in data.dims else FIGURES[name]
    figures = write_figure(lambda: draw(data), folder / stem, look)
    texts = {f"{stem}.md": caption(name, data, finding(name, data))}
    if "attractors" in data.attrs:
        texts[f"{stem}.json"] = document(data)
    if "manifolds" in data.attrs:
        texts[f"manifolds{stem.removeprefix('basins')}.csv"] = manifold_table(data)
    for file, text in texts.items():
        (folder / file).write_text(text, encoding="utf-8")
    return [folder / f"{stem}.nc", *figures, *(folder / file for file in texts)]
