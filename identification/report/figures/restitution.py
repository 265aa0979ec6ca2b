"""Restitution of every contact against its approach speed, as it was measured and as the model has it."""

import dataclasses
from collections.abc import Iterator, Sequence

from identification.report.figures.base import Picture
from identification.report.page_style import Ink, PageStyle
from identification.result.rebounds import Rebound, rebounds
from identification.result.result import FitResult
from vibrojax.drawing import few_ticks, new_figure

FEWEST = 5
"""Contacts that make a picture."""
_MARKS = {"o": "rings", "s": "squares"}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Shown:
    """The contacts of one model, and how they are drawn."""

    contacts: Sequence[Rebound]
    name: str
    ink: Ink
    mark: str = "o"


def restitution(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture, where enough contacts were recorded with flight on either side."""
    found = rebounds(result.records, result.model)
    if len(found) >= FEWEST:
        yield restitution_picture(found, [Shown(contacts=found, name="model", ink=style.model)], style)


def restitution_picture(measured: Sequence[Rebound], models: Sequence[Shown], style: PageStyle, *, section: str = "contact") -> Picture:
    """Measured contacts as dots, those of models as open marks."""
    figure = new_figure(3.4)
    axes = figure.subplots(gridspec_kw={"left": 0.1, "right": 0.985, "bottom": 0.14, "top": 0.97})
    speeds, ratios = [one.approach_speed for one in measured], [one.restitution for one in measured]
    axes.errorbar(speeds, ratios, [one.stderr for one in measured], fmt=".", color=style.dots.colour, elinewidth=0.7, label="measured")
    for model in models:
        shown = [one.fitted_speed for one in model.contacts], [one.fitted for one in model.contacts]
        axes.plot(*shown, model.mark, color=model.ink.colour, fillstyle="none", markersize=5, label=model.name)
    axes.set_xlabel("approach speed v⁻ (m/s)")
    axes.set_ylabel("restitution e")
    axes.legend(loc="best")
    few_ticks(axes, x=8, y=6)
    by_law = {one.by_law for model in models for one in model.contacts}
    in_words = ", ".join(f"{model.ink.word} {_MARKS[model.mark]}: the {model.name}" for model in models)
    how = " or ".join(words for words, law in (("its law at the measured speeds", True), ("its fitted motion", False)) if law in by_law)
    return Picture(
        name="restitution",
        section=section,
        record=None,
        caption=f"Restitution against approach speed, from the last sample before a contact to the first after it: {style.dots.word}"
        f" dots, measured, by the flight on either side, with one standard error; {in_words}, {how}.",
        alt=f"Restitution of {len(measured)} contacts against approach speeds up to {max(speeds):.3g} m/s, measured and modelled.",
        figure=figure,
    )
