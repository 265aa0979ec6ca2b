"""Regions of a map: a lightness of its own for each, so that they differ in grey too, and their names inside."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Bool
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_rgb
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from scipy.ndimage import distance_transform_edt, label

from vibrojax.drawing import GREY

NO_IMPACT, OTHER, UNSETTLED, NOT_INTEGRATED, CHAOS = "#ffffff", "#dfe9f4", "#2f2f2f", "#661a86", "#000000"
_USUAL = {(1, 1): "#0058b0", (1, 2): "#efd139", (1, 3): "#ec7bb4", (2, 2): "#6bc3ef", (1, 4): "#1d9f5e", (2, 1): "#bd4804"}
"""Colour of z = p/q in every map, so that maps compare; in lightness from 38 to 84, some 9 apart."""
_LEAST = 0.05
"""Of the shorter side of a map: a region whose inscribed circle has this radius has room for its name."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Region:
    """One region: its name, colour, cells, and what is written inside; empty for nothing."""

    name: str
    colour: str
    cells: Bool[np.ndarray, "y x"]
    inside: str = ""


def colours_of(motions: list[tuple[int, int]]) -> list[str]:
    """A colour for each z = p/q, at most six; one that is usual has its own, others take what is free.

    Example:
        >>> colours_of([(3, 2), (1, 1)])
        ['#efd139', '#0058b0']
    """
    free = [colour for motion, colour in _USUAL.items() if motion not in motions]
    return [_USUAL[motion] if motion in _USUAL else free.pop(0) for motion in motions]


def draw_regions(axes: Axes, x: np.ndarray, y: np.ndarray, regions: list[Region]) -> list[Patch]:
    """Paint a map's regions, write names where there is room, and return the patches of its legend."""
    picture = np.zeros(regions[0].cells.shape, dtype=int)
    for number, region in enumerate(regions):
        picture[region.cells] = number
    colours = ListedColormap([region.colour for region in regions])
    axes.pcolormesh(x, y, picture, cmap=colours, vmin=-0.5, vmax=len(regions) - 0.5, shading="nearest", rasterized=True)
    for region in regions:
        if region.inside and (place := _middle(region.cells)):
            pale = lightness(region.colour) > 60
            text = axes.text(x[place[1]], y[place[0]], region.inside, ha="center", va="center", color="black" if pale else "white")
            text.set_path_effects([withStroke(linewidth=1.5, foreground=region.colour)])
    return [Patch(facecolor=region.colour, edgecolor=GREY, lw=0.5, label=region.name) for region in regions]


def lightness(colour: str) -> float:
    """CIE L* of a colour, 0 black to 100 white: what is left of it in grey.

    Example:
        >>> lightness("#ffffff"), lightness("#000000")
        (100.0, 0.0)
    """
    linear = np.array([c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)])
    luminance = float(linear @ [0.2126, 0.7152, 0.0722])
    return round(116.0 * float(np.cbrt(luminance)) - 16.0 if luminance > 0.008856 else 903.3 * luminance, 1)


def _middle(cells: np.ndarray) -> tuple[int, int] | None:
    """The cell of the largest connected part that lies farthest from its border; None where a name has no room."""
    found: Any = label(cells)
    parts, count = found
    if count == 0:
        return None
    largest = parts == 1 + int(np.argmax(np.bincount(parts.ravel())[1:]))
    depth = np.asarray(distance_transform_edt(np.pad(largest, 1)))[1:-1, 1:-1]
    if depth.max() < _LEAST * min(cells.shape):
        return None
    row, column = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return int(row), int(column)
