"""Force against indentation: the contact law itself, measured and fitted."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from identification.report.figures.base import Picture
from identification.report.page_style import DASHES, PageStyle
from identification.result.result import FitResult, RecordFit, impacts, measured_displacement, strength
from vibrojax.drawing import few_ticks, literal, new_figure

_COUNT = 4
_MARKS = "os^D"


def loops(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """One picture: a few impacts of all records, from the weakest to the strongest."""
    forces = {record.file: force for record in result.records if (force := _force(record, result)) is not None}
    found = [(record, impact) for record in result.records if record.file in forces for impact in impacts(record)]
    found = [(record, impact) for record, impact in found if impact.end - impact.first >= 4]
    if not found:
        return
    found.sort(key=lambda item: strength(*item))
    chosen = [found[i] for i in np.unique(np.linspace(0, len(found) - 1, _COUNT).round().astype(int))]
    figure = new_figure(3.7)
    axes = figure.subplots(gridspec_kw={"left": 0.115, "right": 0.985, "bottom": 0.125, "top": 0.97})
    for (record, impact), colour, mark, dashes in zip(chosen, style.series, _MARKS, DASHES, strict=False):
        part = slice(max(impact.first - 1, 0), impact.end + 1)
        measured = measured_displacement(record)
        across = record.relative_displacement if measured is None else measured
        speed = abs(float(record.relative_velocity[impact.first]))
        axes.plot(1e6 * (across[part] - record.gap), forces[record.file][part], mark, color=colour, markersize=3.5, fillstyle="none")
        indentation, modelled = record.relative_displacement - record.gap, record.predicted["impact_force"]
        axes.plot(1e6 * indentation[part], modelled[part], color=colour, linestyle=dashes, label=literal(f"{speed:.3g} m/s, {record.file}"))
    axes.set_xlabel("indentation δ (µm)")
    axes.set_ylabel("impact force Fᵢ (N)")
    axes.legend(loc="upper left", title="touch at", title_fontsize=8, alignment="left")
    few_ticks(axes, x=8, y=6)
    source = "load cell" if any("impact_force" in record.measured for record, _ in chosen) else "mass times measured acceleration"
    yield Picture(
        name="force-indentation",
        section="contact",
        record=None,
        caption=f"Force against indentation in {len(chosen)} impacts from the weakest to the strongest: measured (marks; force: {source},"
        " indentation: measured displacement where recorded, less the fitted gap) and fitted law (lines)."
        " A loop's area is the energy lost.",
        alt=f"Loops of impact force against indentation for {len(chosen)} impacts, measured marks on the fitted law's lines.",
        figure=figure,
    )


def _force(record: RecordFit, result: FitResult) -> Float[np.ndarray, " samples"] | None:
    """Measured push of the stop, N: the load cell's, else minus mass times acceleration (the suspension's share is small in contact)."""
    if "impact_force" in record.measured:
        return record.measured["impact_force"]
    if "hammer_acceleration" in record.measured:
        return -float(result.model.mass) * record.measured["hammer_acceleration"]
    return None
