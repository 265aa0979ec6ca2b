"""Colours of a figure's curves, however many there are, and what says which is which."""

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
from vibrojax.studies.figures.base import label

_DARK = LinearSegmentedColormap.from_list("dark cividis", matplotlib.colormaps["cividis"](np.linspace(0.0, 0.85, 64)))
"""Even in lightness, so that the colour-blind can read it too; its pale end is left out, which is lost on white."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Curves:
    """One curve for each value of a quantity: few have a colour of their own and a legend, many a colour map and its bar.

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
    def names(self) -> list[str]:
        """For the legend; empty where a bar takes its place."""
        return [self.name.format(value) if self.few else "" for value in self.values]

    def explain(self, first: Axes, panels: Sequence[Axes]) -> None:
        """Legend in the first panel, or a bar beside all of them."""
        if self.few:
            first.legend()
        else:
            bar = ScalarMappable(self._norm(), _DARK)
            first.figure.colorbar(bar, ax=list(panels), label=f"{self.text}, {len(self.values)} curves")

    def _norm(self) -> Normalize:
        return Normalize(min(self.values), max(self.values))


def gap_curves(data: xr.Dataset) -> Curves:
    """A curve for each gap of a study."""
    return Curves(values=tuple((1e3 * data["gap"].values).tolist()), text="gap (mm)", name="gap {:g} mm")


def frequency_curves(data: xr.Dataset) -> Curves:
    """A curve for each excitation frequency of a study."""
    return Curves(values=tuple(data["frequency_hz"].values.tolist()), text=label(data, "frequency_hz"), name="{:g} Hz")
