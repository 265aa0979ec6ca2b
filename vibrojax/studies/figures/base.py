"""What the figures of the studies share: look, colours that the colour-blind can tell apart, and the way to a file."""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import xarray as xr
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#606060")
"""Okabe and Ito's."""
_STYLE: Any = {
    "font.size": 9.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.5,
    "legend.frameon": False,
    "legend.fontsize": 8.0,
    "lines.linewidth": 1.0,
}


@contextmanager
def style() -> Iterator[None]:
    """Context in which figures are made and saved; outside it Matplotlib is as the user left it."""
    with rc_context(_STYLE):
        yield


def new_figure(height: float, width: float = 6.2) -> Figure:
    """An empty figure without any window; sizes in inches."""
    figure = Figure(figsize=(width, height), dpi=150, layout="constrained", facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def label(data: xr.Dataset, name: str, scale: str = "") -> str:
    """Name of an axis: what it is, and the unit in brackets."""
    part = data[name]
    unit = scale or part.attrs["units"]
    return part.attrs["long_name"] + ("" if unit == "1" else f" ({unit})")


def setting(data: xr.Dataset, name: str) -> Any:
    """One of the study's settings."""
    return json.loads(data.attrs["settings"])[name]


def save(figure: Figure, path: Path) -> None:
    """Write a PNG file."""
    figure.savefig(path)
