"""The term that was learned where no listed effect explains the records: what it adds along the motion."""

from collections.abc import Iterator

import numpy as np

from identification.diagnosis.diagnosis import UNLISTED, Diagnosis
from identification.report.diagnosis.learned_term import learned_term
from identification.report.diagnosis.words import axis
from identification.report.figures.base import MANY, Picture
from identification.report.page_style import PageStyle
from identification.wording.names import label
from vibrojax.drawing import few_ticks, new_figure

_POINTS = 2500
_SECOND = 0.05
"""Share of the term that a second coordinate must decide to be shown."""


def learned(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture, where the verdict is that nothing listed explains the records: the term against the two coordinates that decide most."""
    term = learned_term(diagnosis) if diagnosis.verdict == UNLISTED else None
    if term is None:
        return
    look = label(term.channel, diagnosis.experiment) if term.channel is not None else None
    factor, unit = (look.factor, look.unit) if look is not None else (1.0, "N")
    what = "Force of the learned term on the hammer" if look is None else f"What the learned term adds to the {look.words}"
    shown = list(term.coordinates)[: 1 + (term.decided[1] >= _SECOND)]
    figure = new_figure(2.7)
    places = {"left": 0.115, "right": 0.985, "bottom": 0.17, "top": 0.96, "wspace": 0.08}
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False, gridspec_kw=places)[0]
    some = slice(None, None, max(len(term.value) // _POINTS, 1))
    for axes, (name, si) in zip(panels, shown, strict=True):
        across = axis(name, si)
        x, y = across.factor * term.coordinates[name, si][some], factor * term.value[some]
        axes.plot(x, y, ".", color=style.augmented.colour, markersize=1.8, rasterized=len(y) > MANY)
        axes.axhline(0.0, color="black", linewidth=0.6)
        axes.set_xlabel(across.label)
        few_ticks(axes, x=6, y=6)
    panels[0].set_ylabel(f"{'force' if look is None else look.symbol} of the learned term ({unit})")
    yield Picture(
        name="learned-term",
        section="effect",
        record=None,
        caption=f"{what} along the recorded motion{', above zero towards the stop' if look is None else ''}. Where the points lie on one"
        " line, that coordinate alone decides it.",
        alt=f"{what} against {' and against '.join(name for name, _ in shown)}, between {factor * np.min(term.value):.3g} and"
        f" {factor * np.max(term.value):.3g} {unit}.",
        figure=figure,
    )
