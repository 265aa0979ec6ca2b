"""Correlation between the estimated parameters."""

from collections.abc import Iterator

import numpy as np

from identification.report.figures.base import Picture, new_figure
from identification.report.symbols import symbol_text
from identification.result import FitResult


def correlation(result: FitResult) -> Iterator[Picture]:
    """One picture, from two estimated parameters on."""
    count = len(result.correlated)
    if count < 2:
        return
    symbols = {p.spec.name: symbol_text(p.spec.symbol) for p in result.parameters}
    names = [symbols.get(name, name) for name in result.correlated]
    side = min(0.55 * count, 4.6)
    figure = new_figure(side + 0.55)
    axes = figure.add_axes((0.14, 0.08, side / 6.2, side / (side + 0.55)))
    image = axes.imshow(result.correlation, cmap="PuOr_r", vmin=-1, vmax=1)
    axes.set_xticks(range(count), names)
    axes.set_yticks(range(count), names)
    axes.grid(False)
    axes.tick_params(length=0)
    for (row, column), value in np.ndenumerate(result.correlation):
        if np.isfinite(value) and count <= 10:
            colour = "white" if abs(value) > 0.7 else "black"
            axes.text(column, row, f"{value:.2f}".replace("-", "−"), ha="center", va="center", fontsize=8, color=colour)
    bar = figure.colorbar(image, ax=axes, fraction=0.05, pad=0.04)
    bar.set_label("correlation")
    off = np.abs(result.correlation - np.eye(count))
    first, second = np.unravel_index(int(np.nanargmax(off)), off.shape)
    largest = f"{names[int(first)]} and {names[int(second)]} at {result.correlation[first, second]:.3f}"
    yield Picture(
        name="correlation",
        section="correlation",
        record=None,
        caption="Correlation of the estimated parameters; close to ±1 the records determine a combination better than either alone.",
        alt=f"Correlation matrix of {', '.join(names)}; the largest is between {largest}.",
        figure=figure,
    )
