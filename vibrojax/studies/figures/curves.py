"""How a figure's curves differ, in colour and without it, however many there are, and what says which is which."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize

from vibrojax.drawing import COLOURS
from vibrojax.figure_style import short
from vibrojax.studies.classify import APERIODIC, FAILED, NO_IMPACT
from vibrojax.studies.figures.base import label

_DARK = LinearSegmentedColormap.from_list("dark cividis", matplotlib.colormaps["cividis"](np.linspace(0.0, 0.85, 64)))
"""Even in lightness, so that the colour-blind can read it too; its pale end is left out, which is lost on white."""
_DASHES = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (6, 1.5, 1, 1.5)), (0, (3, 1)), (0, (4, 1, 1, 1, 1, 1)), (0, (8, 2)))
_MARKS = ("o", "s", "^", "D", "v", "P", "X")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Curves:
    """One curve for each value of a quantity: few have colour, dashes and marks of their own and a legend, many a colour map and its bar.

    Attributes:
        values: one a curve, in the unit of `text`.
        text: what the bar of many is called, such as "gap (mm)".
        name: of a curve in the legend of few, such as "gap {:g} mm".
    """

    values: tuple[float, ...]
    text: str
    name: str

    @property
    def few(self) -> bool:
        """Whether every curve has a colour of its own."""
        return len(self.values) <= len(COLOURS)

    @property
    def colours(self) -> list[Any]:
        """Of the curves in their order."""
        return list(COLOURS[: len(self.values)]) if self.few else [_DARK(self._norm()(value)) for value in self.values]

    @property
    def dashes(self) -> list[Any]:
        """Of the curves in their order; many differ in lightness alone."""
        return list(_DASHES[: len(self.values)]) if self.few else ["-"] * len(self.values)

    @property
    def marks(self) -> list[str]:
        """Of points that no line joins."""
        return list(_MARKS[: len(self.values)]) if self.few else ["o"] * len(self.values)

    @property
    def names(self) -> list[str]:
        """For the legend; empty where a bar takes its place."""
        return [self.name.format(value) if self.few else "" for value in self.values]

    def draw(self, axes: Axes, number: int, x: np.ndarray, y: np.ndarray, joined: np.ndarray) -> None:
        """Draw one curve: a line where neighbours have the same motion, a mark for each point that stands alone.

        Arguments:
            axes: the panel.
            number: of the curve.
            x: along the panel.
            y: values, NaN where there is none.
            joined: whether each point is joined to the next, one fewer than points.
        """
        colour, name = self.colours[number], self.names[number]
        breaks = 1 + np.flatnonzero(~joined)
        alone = np.isfinite(y) & ~np.append(joined, False) & ~np.append(False, joined)
        if joined.any():
            line = np.insert(np.where(alone, np.nan, y), breaks, np.nan)
            axes.plot(np.insert(x, breaks, np.nan), line, color=colour, ls=self.dashes[number], label=name or None)
        if alone.any():
            named = None if joined.any() else name or None
            axes.plot(x[alone], y[alone], self.marks[number], color=colour, ms=1.8, mew=0, label=named)

    def explain(self, first: Axes, panels: Sequence[Axes]) -> None:
        """Legend above the first panel, or a bar beside all of them."""
        if not self.few:
            bar = ScalarMappable(self._norm(), _DARK)
            first.figure.colorbar(bar, ax=list(panels), label=f"{self.text}, {len(self.values)} curves")
        elif first.get_legend_handles_labels()[0]:
            first.legend(handlelength=2.6)

    def _norm(self) -> Normalize:
        return Normalize(min(self.values), max(self.values))


def curves_along(data: xr.Dataset, name: str) -> Curves:
    """A curve for each value of an axis of a study."""
    scale, unit = (1e3, "mm") if name == "gap" else (1.0, data[name].attrs["units"])
    words = {"gap": "gap", "frequency_hz": r"$\Omega$ ="}.get(name, f"{short(name)} =")
    tail = "" if unit == "1" else f" {unit}"
    return Curves(
        values=tuple((scale * data[name].values).tolist()), text=label(data, name, unit), name=f"{words.replace('{', '{{')} {{:g}}{tail}"
    )


def same_motion(part: xr.Dataset) -> np.ndarray:
    """Whether neighbours along the only axis of a study settle on the same z = p/q, so that a line may join them; never in chaos."""
    kind = part["kind"].values
    steady = (kind != APERIODIC) & (kind != FAILED)
    alike = kind[1:] == kind[:-1]
    for name in ("impacts", "period"):
        alike &= (part[name].values[1:] == part[name].values[:-1]) | (kind[1:] == NO_IMPACT)
    return alike & steady[1:] & steady[:-1]
