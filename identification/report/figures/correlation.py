"""Correlation between the estimated parameters."""

from collections.abc import Iterator

import numpy as np

from identification.report.figures.base import Picture
from identification.report.page_style import PageStyle
from identification.result.result import FitResult
from identification.wording.names import symbol_text
from vibrojax.drawing import new_figure


def correlation(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture, from two estimated parameters on."""
    count = len(result.correlated)
    if count < 2:
        return
    symbols = {p.spec.name: symbol_text(p.spec.symbol) for p in result.parameters}
    names = [symbols.get(name, name) for name in result.correlated]
    side = min(0.52 * count, 4.6)
    width, height = side + 1.45, side + 0.45
    figure = new_figure(height, width)
    axes = figure.add_axes((0.5 / width, 0.35 / height, side / width, side / height))
    image = (
        axes.imshow(np.abs(result.correlation), cmap=style.sequential, vmin=0, vmax=1)
        if style.diverging is None
        else axes.imshow(result.correlation, cmap=style.diverging, vmin=-1, vmax=1)
    )
    axes.set_xticks(range(count), names)
    axes.set_yticks(range(count), names)
    axes.grid(False)
    axes.tick_params(length=0)
    for (row, column), value in np.ndenumerate(result.correlation):
        if np.isfinite(value) and count <= 10:
            colour = "white" if abs(value) > 0.7 else "black"
            axes.text(column, row, _short(value), ha="center", va="center", fontsize=7.5, color=colour)
    bar = figure.colorbar(
        image,
        cax=figure.add_axes(((side + 0.6) / width, 0.35 / height, 0.12 / width, side / height)),
        ticks=[0, 1] if style.diverging is None else [-1, 0, 1],
    )
    bar.set_label("size of the correlation" if style.diverging is None else "correlation")
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


def _short(value: float) -> str:
    """Two decimals; a third where two would make it look like unity."""
    text = f"{value:.3f}" if 0.995 <= abs(value) < 0.9995 else f"{value:.2f}"
    return "0" if float(text) == 0.0 else text.replace("-", "−")
