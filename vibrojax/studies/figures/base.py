"""What the figures of the studies take from a data set: names of axes in the thesis's symbols, settings, the second axes."""

import json
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from vibrojax.figure_style import RATIO, SYMBOLS


def label(data: xr.Dataset, name: str, scale: str = "") -> str:
    """Name of an axis: what it is, its symbol, and the unit in brackets."""
    part = data[name]
    unit = scale or part.attrs["units"]
    return (SYMBOLS.get(name) or str(part.attrs["long_name"])) + ("" if unit == "1" else f" ({unit})")


def setting(data: xr.Dataset, name: str) -> Any:
    """One of the study's settings."""
    return json.loads(data.attrs["settings"])[name]


def natural_frequency(data: xr.Dataset) -> float | None:
    """f_n of the study's model, Hz; None where its suspension has none."""
    return json.loads(data.attrs.get("model", "{}")).get("suspension", {}).get("natural_frequency_hz")


def add_ratio_axis(axes: Axes, data: xr.Dataset, name: str) -> None:
    """Omega/omega along the top of a panel whose abscissa is the excitation frequency in Hz."""
    f_n = natural_frequency(data)
    if f_n and name == "frequency_hz":
        axes.secondary_xaxis("top", functions=(lambda f: np.asarray(f) / f_n, lambda r: np.asarray(r) * f_n)).set_xlabel(RATIO)
