"""The contact: force against indentation, restitution against approach speed, and the phase plane with the stop."""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float
from scipy.signal import savgol_filter

from identification.diagnosis.diagnosis import Diagnosis
from identification.report.base import DASHED, DASHES, PageStyle, Picture, drawn_records, grid_of, panels
from identification.result.rebounds import Rebound, rebounds
from identification.result.result import FitResult, RecordFit, impacts, measured_displacement, strength
from identification.wording.numbers import joined
from vibrojax.drawing import few_ticks, literal

_FEWEST = 5  # contacts that make a picture of restitution


def loops(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """Force against indentation in a few impacts of all records, from the weakest to the strongest; one picture."""
    forces = {record.file: force for record in result.records if (force := _force(record, result)) is not None}
    found = [(record, impact) for record in result.records if record.file in forces for impact in impacts(record)]
    found = [(record, impact) for record, impact in found if impact.end - impact.first >= 4]
    if not found:
        return
    found.sort(key=lambda item: strength(*item))
    chosen = [found[i] for i in np.unique(np.linspace(0, len(found) - 1, 4).round().astype(int))]
    figure, ((axes,),) = panels((3.1,), edges=(0.72, 0.1, 0.45, 0.12))
    for (record, impact), colour, mark, dashes in zip(chosen, style.series, "os^D", DASHES, strict=False):
        part = slice(max(impact.first - 1, 0), impact.end + 1)
        measured, indentation = measured_displacement(record), record.relative_displacement - record.gap
        across = indentation if measured is None else measured - record.gap
        speed = abs(float(record.relative_velocity[impact.first]))
        modelled, words = record.predicted["impact_force"], literal(f"{speed:.3g} m/s, {record.file}")
        axes.plot(1e6 * across[part], forces[record.file][part], mark, color=colour, markersize=3.5, fillstyle="none")
        axes.plot(1e6 * indentation[part], modelled[part], color=colour, linestyle=dashes, label=words)
    axes.set_xlabel("indentation δ (µm)")
    axes.set_ylabel("impact force Fᵢ (N)")
    axes.legend(loc="upper left", title="touch at", title_fontsize=8, alignment="left")
    few_ticks(axes, x=8, y=6)
    source = "load cell" if any("impact_force" in record.measured for record, _ in chosen) else "mass times measured acceleration"
    yield Picture(
        name="force-indentation",
        section="contact",
        caption=f"Force against indentation in {len(chosen)} impacts from the weakest to the strongest: measured (marks; force: {source},"
        " indentation: measured displacement where recorded, less the fitted gap) and fitted law (lines). A loop encloses the energy lost.",
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


def restitution(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """Restitution of every contact, measured and fitted; one picture, where enough contacts have flight on either side."""
    found = rebounds(result.records, result.model)
    if len(found) >= _FEWEST:
        yield _restitution(found, {"model": found}, (style.model,), style)


def restitution_of_both(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """The same beside both models of a diagnosis; measured by the augmented one, or where that has few contacts by the nominal one."""
    if diagnosis.location is None:
        return
    before, after = (rebounds(side.records, side.model) for side in (diagnosis.nominal, diagnosis.augmented))
    if len(before) >= _FEWEST:
        models, better = {"nominal model": before}, diagnosis.is_augmented and len(after) >= _FEWEST
        models |= {"augmented model": after} if better else {}
        yield _restitution(after if better else before, models, (style.nominal, style.model), style)


def _restitution(measured: Sequence[Rebound], models: dict[str, list[Rebound]], colours: Sequence[str], style: PageStyle) -> Picture:
    figure, ((axes,),) = panels((2.8,), edges=(0.72, 0.1, 0.45, 0.12))
    speeds, ratios = [one.approach_speed for one in measured], [one.restitution for one in measured]
    axes.errorbar(speeds, ratios, [one.stderr for one in measured], fmt=".", color=style.measured, elinewidth=0.7, label="measured")
    for (name, contacts), colour, mark in zip(models.items(), colours, "os", strict=False):
        fitted = [one.fitted_speed for one in contacts], [one.fitted for one in contacts]
        axes.plot(*fitted, mark, color=colour, fillstyle="none", markersize=5, label=name)
    axes.set_xlabel("approach speed v⁻ (m/s)")
    axes.set_ylabel("restitution e")
    axes.legend(loc="best")
    few_ticks(axes, x=8, y=6)
    by_law = {one.by_law for contacts in models.values() for one in contacts}
    how = " or ".join(words for words, law in (("its law at the measured speeds", True), ("its fitted motion", False)) if law in by_law)
    return Picture(
        name="restitution",
        section="contact",
        caption="Restitution against approach speed, from the last sample before a contact to the first after it: dots, measured, by the"
        f" flight on either side, with one standard error; open marks: the {joined(list(models))}, by {how}.",
        alt=f"Restitution of {len(measured)} contacts against approach speeds up to {max(speeds):.3g} m/s, measured and modelled.",
        figure=figure,
    )


def phase_plane(result: FitResult, style: PageStyle) -> Iterator[Picture]:
    """Velocity against displacement of the hammer in the cart, measured and model; one picture, a panel a record."""
    records, most, window = [record for _, record in drawn_records(result)], 2500, 9  # samples shown, and of a sliding parabola
    figure, grid, drawn = grid_of(len(records), 1.75, min(len(records), 2), gap=(0.65, 0.7))
    for axes, record in zip(drawn, records, strict=True):
        shown, u, interval = slice(0, most), measured_displacement(record), float(np.median(np.diff(record.time)))
        if u is not None and len(u) > window:
            slope = np.asarray(savgol_filter(u, window, 2, deriv=1, delta=interval, mode="nearest"))[shown]
            slope[: window // 2] = np.nan  # nothing lies before the first sample
            many = len(slope) > 400  # an image inside a PDF
            axes.plot(1e3 * u[shown], slope, ".", color=style.measured, markersize=1.5, rasterized=many)
        axes.plot(1e3 * record.relative_displacement[shown], record.relative_velocity[shown], color=style.model, linewidth=0.7)
        axes.axvline(1e3 * record.gap, color="black", linewidth=0.8, linestyle=DASHED)
        axes.set_title(literal(f"{record.file} ({record.kind})"), pad=4)
        axes.set_xlabel("displacement u = x − y (mm)")
        few_ticks(axes, x=5, y=5)
    for axes in grid[:, 0]:
        axes.set_ylabel("velocity u̇ (m/s)")
    yield Picture(
        name="phase-plane",
        section="contact",
        caption="Phase plane of the hammer relative to the cart: measured displacement and its slope (dots), model (line), stop (dashed)."
        f" At most the first {most} samples of each record.",
        alt="Velocity against displacement of the hammer relative to the cart, measured and model, one panel for each of "
        f"{', '.join(record.file for record in records)}.",
        figure=figure,
    )
