"""What the figures of the studies take from a data set: names of axes, and settings."""

import json
from typing import Any

import xarray as xr


def label(data: xr.Dataset, name: str, scale: str = "") -> str:
    """Name of an axis: what it is, and the unit in brackets."""
    part = data[name]
    unit = scale or part.attrs["units"]
    return part.attrs["long_name"] + ("" if unit == "1" else f" ({unit})")


def setting(data: xr.Dataset, name: str) -> Any:
    """One of the study's settings."""
    return json.loads(data.attrs["settings"])[name]
