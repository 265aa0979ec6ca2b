"""Restitution against approach speed: of every contact as it was measured, and of the fitted law."""

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes

from identification.report.figures.base import DOTS, MODEL, Picture
from identification.report.rebounds import Rebound, by_law, rebounds
from identification.result import FitResult
from vibrojax.drawing import few_ticks, new_figure
from vibrojax.model import Model

FEWEST = 5
"""Contacts that make a picture."""
_BEYOND = 1.05
"""Of the fastest approach, where the law's curve ends."""


def restitution(result: FitResult) -> Iterator[Picture]:
    """One picture, where enough contacts were recorded with flight on either side."""
    found = rebounds(result.records, result.model)
    if len(found) >= FEWEST:
        yield restitution_picture(found, [(result.model, {"color": MODEL, "label": "fitted law"})], "orange: the fitted contact law")


def restitution_picture(found: list[Rebound], laws: list[tuple[Model, dict]], curves: str, *, section: str = "contact") -> Picture:
    """Contacts as dots, laws as lines; `curves` says in words what the lines are."""
    figure = new_figure(3.4)
    axes = figure.subplots(gridspec_kw={"left": 0.1, "right": 0.985, "bottom": 0.14, "top": 0.97})
    speeds, ratios = [one.approach_speed for one in found], [one.restitution for one in found]
    axes.errorbar(speeds, ratios, [one.stderr for one in found], fmt=".", color=DOTS, elinewidth=0.7, label="measured")
    for model, look in laws:
        _law(axes, model, max(speeds), look)
    axes.set_xlabel("approach speed v⁻ (m/s)")
    axes.set_ylabel("restitution e")
    axes.legend(loc="best")
    few_ticks(axes, x=8, y=6)
    return Picture(
        name="restitution",
        section=section,
        record=None,
        caption="Restitution against approach speed: grey, each contact, by the measured flight on either side of it, with one standard"
        f" error; {curves}, of a free hammer.",
        alt=f"Restitution of {len(found)} contacts against approach speeds up to {max(speeds):.3g} metres per second, measured and by law.",
        figure=figure,
    )


def _law(axes: Axes, model: Model, fastest: float, look: dict) -> None:
    speeds = np.linspace(0.0, _BEYOND * fastest, 60)[1:]
    axes.plot(speeds, by_law(model, speeds), **look)
