"""Restitution of every contact against its approach speed, as it was measured and as the model has it."""

from collections.abc import Iterator, Sequence

from identification.report.figures.base import DOTS, MODEL, Picture
from identification.result.rebounds import Rebound, rebounds
from identification.result.result import FitResult
from vibrojax.drawing import few_ticks, new_figure

FEWEST = 5
"""Contacts that make a picture."""


def restitution(result: FitResult) -> Iterator[Picture]:
    """One picture, where enough contacts were recorded with flight on either side."""
    found = rebounds(result.records, result.model)
    if len(found) >= FEWEST:
        yield restitution_picture(found, [(found, MODEL, "model")], "orange: the model")


def restitution_picture(
    measured: Sequence[Rebound], models: Sequence[tuple[Sequence[Rebound], str, str]], in_words: str, *, section: str = "contact"
) -> Picture:
    """Measured contacts as dots, those of models (contacts, colour, name) as rings; `in_words` says which ring is which."""
    figure = new_figure(3.4)
    axes = figure.subplots(gridspec_kw={"left": 0.1, "right": 0.985, "bottom": 0.14, "top": 0.97})
    speeds, ratios = [one.approach_speed for one in measured], [one.restitution for one in measured]
    axes.errorbar(speeds, ratios, [one.stderr for one in measured], fmt=".", color=DOTS, elinewidth=0.7, label="measured")
    for contacts, colour, name in models:
        shown = [one.fitted_speed for one in contacts], [one.fitted for one in contacts]
        axes.plot(*shown, "o", color=colour, fillstyle="none", markersize=5, label=name)
    axes.set_xlabel("approach speed v⁻ (m/s)")
    axes.set_ylabel("restitution e")
    axes.legend(loc="best")
    few_ticks(axes, x=8, y=6)
    by_law = {one.by_law for contacts, _, _ in models for one in contacts}
    rings = " or ".join(words for words, law in (("its law at the measured speeds", True), ("its fitted motion", False)) if law in by_law)
    return Picture(
        name="restitution",
        section=section,
        record=None,
        caption="Restitution against approach speed, from the last sample before a contact to the first after it: grey, measured, by the"
        f" flight on either side, with one standard error; {in_words}, {rings}.",
        alt=f"Restitution of {len(measured)} contacts against approach speeds up to {max(speeds):.3g} m/s, measured and modelled.",
        figure=figure,
    )
