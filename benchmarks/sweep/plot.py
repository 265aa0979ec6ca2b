"""Error against time."""

from pathlib import Path

import numpy as np

from vibrojax.drawing import BLUE, GREEN, GREY, ORANGE, PINK, new_figure, save, style

_LOOK = {
    "ours": (ORANGE, "o", "vibrojax, exact flight"),
    "numba": (BLUE, "s", "numba DOPRI5, all cores"),
    "diffrax_vmap": (GREEN, "^", "vmap of diffeqsolve"),
    "scipy_lsoda": (PINK, "D", "SciPy LSODA"),
    "scipy_dop853": (GREY, "v", "SciPy DOP853"),
}


def work_precision(problems: dict[str, dict], stated: float, path: Path) -> None:
    """One panel a problem: seconds against median error of the section points of periodic lanes."""
    with style():
        figure = new_figure(3.8, 4.6 * len(problems), layout="constrained")
        panels = np.atleast_1d(figure.subplots(1, len(problems), sharey=True))
        for axes, (name, found) in zip(panels, problems.items(), strict=True):
            for engine, (colour, marker, label) in _LOOK.items():
                runs = sorted((run for run in found["runs"] if run["engine"] == engine), key=lambda run: run["miss"]["median"])
                axes.loglog(
                    [run["miss"]["median"] for run in runs], [run["seconds"] for run in runs], marker + "-", color=colour, ms=4, label=label
                )
            axes.axvline(stated, color="#b0b0b0", lw=1, zorder=0)
            problem = found["problem"]
            axes.set(xlabel="error of section points / A0, median of periodic lanes")
            axes.set_title(f"{name}: $k_i$ = {problem['k_i']:g}, n = {problem['n']}, {problem['lanes']} × {problem['cycles']} cycles")
        panels[0].set_ylabel("seconds")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(_LOOK))
        save(figure, path)
