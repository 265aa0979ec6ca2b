"""Force against indentation with the contact law that has a kink and the one that has none."""

from collections.abc import Iterator

import numpy as np

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.diagnosis.words import axis
from identification.report.figures.base import MANY, Picture
from identification.report.page_style import DASHED, PageStyle
from identification.wording.numbers import joined, millimetres
from vibrojax.drawing import GREY, few_ticks, new_figure

_LIGHT = "#b0b0b0"


def loop_kink(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """One picture: all samples in contact, those of the records that go deeper dark, with both laws along the deepest of each of these."""
    found = diagnosis.location.kink if diagnosis.location is not None else None
    if found is None:
        return
    look = axis("indentation", "m")
    deeper = np.isin(found.record, [found.files.index(file) for file in found.deeper])
    across = look.factor * found.indentation
    figure = new_figure(3.7)
    axes = figure.subplots(gridspec_kw={"left": 0.115, "right": 0.985, "bottom": 0.125, "top": 0.97})
    axes.axvline(look.factor * found.depth, color="black", linewidth=0.8, linestyle=(0, (4, 3)))
    many = len(across) > MANY
    axes.plot(across[~deeper], found.force[~deeper], ".", color=_LIGHT, markersize=3, label="the other records", rasterized=many)
    marks = {"color": GREY, "markersize": 3.5, "fillstyle": "none", "rasterized": many}
    axes.plot(across[deeper], found.force[deeper], "o", label="records that go deeper", **marks)
    for index in np.unique(found.record[deeper]):
        deepest = np.argmax(np.where(found.record == index, found.indentation, -np.inf))
        one = found.contact == found.contact[deepest]
        axes.plot(across[one], found.without_kink[one], color=style.nominal.colour, linestyle=DASHED, label="law without a kink")
        axes.plot(across[one], found.with_kink[one], color=style.augmented.colour, label="law with a kink")
    handles, names = axes.get_legend_handles_labels()
    once = dict(zip(names, handles, strict=True))
    axes.legend(once.values(), once.keys(), loc="upper left")
    axes.set_xlabel(f"indentation δ ({look.unit})")
    axes.set_ylabel("contact force (N)")
    few_ticks(axes, x=8, y=6)
    depth = millimetres(found.depth)
    yield Picture(
        name="kink",
        section="location",
        record=None,
        caption=f"Force against indentation as the records show it, without integrating a motion: beyond {depth} (dashed line upright) it"
        f" rises faster than the law in front of that; only {joined(list(found.deeper))} came that deep.",
        alt=f"Loops of force against indentation; beyond {depth} those of {joined(list(found.deeper))} rise steeply.",
        figure=figure,
    )
