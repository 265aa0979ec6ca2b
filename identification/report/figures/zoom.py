"""Figures against time that a reader can zoom: their curves are drawn, and travel in the page for `zoom.js` to draw them closer.

A series is rounded to a tenth of its sensor's noise. Its differences are zigzag-coded (2 d, or -2 d - 1 where d < 0), written as four
planes of bytes from the lowest to the highest, and compressed by zlib.
"""

import base64
import dataclasses
import json
import zlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes

COLUMNS = 600
"""Bins across a figure: about one a pixel."""
MOST = 16_384
"""Samples of a series that travel in the page; of a longer one the extremes."""
_ZOOMED = "zoomed"
"""Name of a curve in the figure that the script draws itself."""
_FINER = 10.0
_OF_INTERVAL = 64.0
_MISSING, _FURTHEST = -(2**30), 2**29
_POINTS = 72.0
Samples = Float[np.ndarray, " samples"]
Dashes = str | tuple[float, tuple[float, ...]]


@dataclasses.dataclass(frozen=True, eq=False)
class Track:
    """A series that travels in the page, counted from `origin` in units of `step`."""

    values: Samples
    step: float
    origin: float = 0.0

    def packed(self) -> bytes:
        """As `zoom.js` reads it."""
        usable = np.isfinite(self.values)
        counted = np.clip(np.round((np.where(usable, self.values, self.origin) - self.origin) / self.step), -_FURTHEST, _FURTHEST)
        rises = np.diff(np.where(usable, counted, _MISSING).astype(np.int64), prepend=0)
        folded = np.where(rises < 0, -2 * rises - 1, 2 * rises).astype("<u4")
        return folded.view(np.uint8).reshape(-1, 4).T.tobytes()


@dataclasses.dataclass(frozen=True, kw_only=True)
class Curve:
    """A track as it is drawn; with `minus`, its difference from another track over the noise."""

    name: str
    track: Track
    minus: Track | None = None
    noise: float = 1.0
    colour: str
    width: float
    dashes: Dashes = "-"

    def draw(self, axes: Axes, time: Samples, values: Samples) -> None:
        """Draw a part of it, of which every sample is given."""
        axes.plot(*envelope(time, values), color=self.colour, linewidth=self.width, linestyle=self.dashes, label=self.name, gid=_ZOOMED)

    def document(self, places: dict[int, int]) -> dict[str, Any]:
        """For the script; `places` are those of the tracks."""
        minus = {} if self.minus is None else {"minus": places[id(self.minus)], "noise": self.noise}
        dashes = {} if isinstance(self.dashes, str) else {"dashes": [self.width * part for part in self.dashes[1]]}
        return {"name": self.name, "track": places[id(self.track)], "colour": self.colour, "width": self.width} | minus | dashes


@dataclasses.dataclass(frozen=True, kw_only=True)
class Panel:
    """Axes with curves over time in s; `unit` is that of the values, and `fixed` says that their range stays."""

    axes: Axes
    time: Track
    curves: tuple[Curve, ...]
    words: str
    unit: str
    fixed: bool = False

    @property
    def tracks(self) -> list[Track]:
        """All that it needs."""
        return [self.time, *(one for curve in self.curves for one in (curve.track, curve.minus) if one is not None)]

    def document(self, places: dict[int, int]) -> dict[str, Any]:
        """For the script: the place of the axes in points from the top left corner, and the rest."""
        figure, inside = self.axes.get_figure(root=True), self.axes.get_position()
        assert figure is not None
        width, height = _POINTS * figure.get_size_inches()
        box = (inside.x0 * width, (1.0 - inside.y1) * height, inside.width * width, inside.height * height)
        return {
            "box": [round(float(one), 2) for one in box],
            "range": list(map(float, self.axes.get_ylim())),
            "time": places[id(self.time)],
            "words": self.words,
            "unit": self.unit,
            "fixed": self.fixed,
            "curves": [curve.document(places) for curve in self.curves],
        }


def tracks(time: Samples, series: Sequence[Samples], noise: float) -> tuple[Track, tuple[Track, ...]]:
    """Time and series as tracks; of long ones, the instants at which the first has its extremes.

    Args:
        time: s.
        series: in one unit.
        noise: of the sensor, in that unit.
    """
    chosen = _extremes(series[0]) if len(time) > MOST else slice(None)
    interval = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    shown = Track(time[chosen], _step(time - time[0], interval / _OF_INTERVAL), float(time[0]))
    return shown, tuple(Track(one[chosen], _step(one, noise / _FINER)) for one in series)


def _step(values: Samples, wanted: float) -> float:
    """The wanted step, or a larger one where the values would reach further than can be packed."""
    reach = float(np.nanmax(np.abs(values), initial=0.0, where=np.isfinite(values)))
    return max(wanted, reach / _FURTHEST) or 1.0


def zoom_data(panels: tuple[Panel, ...]) -> dict[str, str]:
    """What a page holds of a figure for `zoom.js`: attributes of the element around it, without `data-`."""
    needed = list({id(track): track for panel in panels for track in panel.tracks}.values())
    places = {id(track): place for place, track in enumerate(needed)}
    document = {
        "window": list(map(float, panels[0].axes.get_xlim())),
        "tracks": [{"count": len(one.values), "step": one.step, "origin": one.origin} for one in needed],
        "panels": [panel.document(places) for panel in panels],
    }
    packed = zlib.compress(b"".join(one.packed() for one in needed), 9)
    return {"zoom": json.dumps(document, ensure_ascii=False, separators=(",", ":")), "samples": base64.b64encode(packed).decode("ascii")}


def _extremes(values: Samples) -> np.ndarray:
    """Places of the smallest and the largest value in each of `MOST` / 2 parts."""
    edges = np.linspace(0, len(values), MOST // 2 + 1).astype(int)
    parts = [values[begin:end] for begin, end in zip(edges[:-1], edges[1:], strict=True)]
    lowest = [int(np.where(np.isfinite(one), one, np.inf).argmin()) for one in parts]
    highest = [int(np.where(np.isfinite(one), one, -np.inf).argmax()) for one in parts]
    return np.unique(np.concatenate([edges[:-1] + lowest, edges[:-1] + highest]))


def envelope(
    x: Float[np.ndarray, " samples"], y: Float[np.ndarray, " samples"], *, columns: int = COLUMNS
) -> tuple[Float[np.ndarray, " points"], Float[np.ndarray, " points"]]:
    """Smallest and largest value of every one of `columns` bins, in the order in which they occur; a short series unchanged.

    Values that are not finite are left out; a bin of only such values leaves a gap.

    Example:
        >>> x = np.arange(10000.0)
        >>> across, up = envelope(x, np.where(x == 1234.0, 7.0, 0.0), columns=100)
        >>> len(across), float(up.max())
        (200, 7.0)
    """
    if len(x) <= 2 * columns:
        return x, y
    length = -(-len(x) // columns)
    padding = (0, -len(x) % length)
    bins_x = np.pad(x, padding, mode="edge").reshape(-1, length)
    bins_y = np.pad(y, padding, constant_values=np.nan).reshape(-1, length)
    usable = np.isfinite(bins_y)
    rows = np.arange(len(bins_y))[:, None]
    lowest = np.where(usable, bins_y, np.inf).argmin(axis=1)
    highest = np.where(usable, bins_y, -np.inf).argmax(axis=1)
    chosen = np.sort(np.stack([lowest, highest], axis=1), axis=1)
    values = np.where(usable.any(axis=1, keepdims=True), bins_y[rows, chosen], np.nan)
    return bins_x[rows, chosen].ravel(), values.ravel()
