"""The term that was learned where no listed effect explains the records: its force along the motion."""

from collections.abc import Iterator

import numpy as np

from identification.discrepancy.diagnosis import UNLISTED, Diagnosis
from identification.discrepancy.report.figures.base import AFTER, Picture
from identification.discrepancy.report.model_force import model_force
from identification.report.figures.base import few_ticks, new_figure

_POINTS = 2000


def learned(diagnosis: Diagnosis) -> Iterator[Picture]:
    """One picture, where the verdict is that nothing listed explains the records and the term is a force in flight."""
    if diagnosis.verdict != UNLISTED:
        return
    force = model_force(diagnosis)
    if force is None:
        return
    figure = new_figure(2.7)
    left, right = figure.subplots(
        1, 2, sharey=True, gridspec_kw={"left": 0.115, "right": 0.985, "bottom": 0.17, "top": 0.96, "wspace": 0.08}
    )
    some = slice(None, None, max(len(force.t) // _POINTS, 1))
    left.plot(1e3 * force.u[some], force.effects[some], ".", color=AFTER, markersize=1.6)
    right.plot(force.v[some], force.effects[some], ".", color=AFTER, markersize=1.6)
    for axes in (left, right):
        axes.axhline(0.0, color="black", linewidth=0.6)
        few_ticks(axes, x=6, y=6)
    left.set_xlabel("displacement u (mm)")
    right.set_xlabel("velocity u̇ (m/s)")
    left.set_ylabel("force of the learned term (N)")
    yield Picture(
        name="learned-term",
        section="effect",
        record=None,
        caption="Force of the learned term on the hammer along the recorded motion in free flight, above zero towards the stop. Where the"
        " points lie on one line, that coordinate alone decides it.",
        alt="Force of the learned term against displacement and against velocity, between"
        f" {np.min(force.effects):.3g} and {np.max(force.effects):.3g} newtons.",
        figure=figure,
    )
