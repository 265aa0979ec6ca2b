"""Figures of a diagnosis: what is missing over its coordinates, where in each record, and the prediction before and after.

Nominal is dashed, augmented not, measured a wide grey line, throughout; in colours, nominal is blue and augmented orange.
"""

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.ticker import LogFormatter

from identification.diagnosis.diagnosis import Diagnosis, Profile
from identification.report.base import DASHED, MANY, MOST, PageStyle, Picture, panels, recorded, residual_panel
from identification.result.flight_force import flight_force
from identification.result.result import RecordFit, impacts, largest, residual
from identification.wording.names import coordinate_label, label, spoken
from identification.wording.numbers import joined, millimetres, significant
from vibrojax.drawing import GREY, envelope, few_ticks, literal

_SOMETHING, _LITTLE = 0.005, 0.15
"""Share of the excess misfit from which on a coordinate is worth a picture, and below which its mean explains little."""
_PERIODS, _FEWEST = 3.0, 60
"""Length of a stretch of a record: periods, and samples at least."""
_IN_FLIGHT = {"displacement": "u", "velocity": "v", "indentation": "indentation"}
"""Coordinates of a profile against which the models' forces can be set, as `FlightForce` has them."""


def missing(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """What is missing against its best coordinate, with the force that the augmented model puts in its place; one picture."""
    where = diagnosis.location
    best = where.profiles[0] if where is not None and where.profiles else None
    if where is None or best is None or (best.coordinate == "time" and where.interval is None and not best.explained >= _SOMETHING):
        return
    figure, ((axes,),) = panels((2.7,), edges=(0.72, 0.1, 0.45, 0.12))
    factor = coordinate_label(best.coordinate, best.unit).factor
    if where.interval is not None and best.coordinate == where.coordinate:
        low, high = factor * np.clip(where.interval, best.center.min(), best.center.max())
        axes.axvspan(low, high, color=style.contact, linewidth=0, label="where most of it is")
    _profile(axes, best, style, marker="o", markersize=3.0, label="missing from the nominal model")
    model = _added_force(diagnosis, best)
    if model is not None:
        axes.plot(factor * best.center, model, color=style.model, linewidth=1.4, label="what the augmented model adds")
    of = "missing force" if best.quantity == "force" else f"residual of {spoken(best.quantity)}"
    axes.set_ylabel(f"{of} ({'N' if best.quantity == 'force' else 'σ'})")
    few_ticks(axes, x=8, y=6)
    axes.legend(loc="best")
    sign = " Above zero it pushes the hammer towards the stop." if best.quantity == "force" else ""
    little = " That is little: its size, more than its mean, follows this coordinate." if best.explained < _LITTLE else ""
    usable = best.mean[np.isfinite(best.mean)]
    ends = f"{usable.min():.3g} to {usable.max():.3g}" if len(usable) else "nowhere"
    yield Picture(
        name="missing",
        section="missing",
        caption=f"What the nominal model leaves out, against {best.coordinate}: mean in each bin with a band of ±2 standard errors."
        f" {_share(best)} of the excess misfit follows this line.{sign}{little}",
        alt=f"{of.capitalize()} against {best.coordinate}, from {ends}.",
        figure=figure,
    )


def missing_over_others(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """The same against the other coordinates; one picture."""
    where = diagnosis.location
    others = [one for one in where.profiles[1:] if one.explained >= _SOMETHING][:MOST] if where is not None else []
    if not others:
        return
    columns = min(len(others), 2)
    figure, grid = panels((1.1,) * -(-len(others) // columns), columns, gap=(0.68, 0.6))
    for axes, profile in zip(grid.ravel(), others, strict=False):
        _profile(axes, profile, style)
        axes.set_title(f"explains {_share(profile)}", loc="left", pad=3, fontsize=8)
        axes.set_ylabel("F (N)" if profile.quantity == "force" else "r (σ)")
        few_ticks(axes, x=5, y=4)
    for axes in grid.ravel()[len(others) :]:
        axes.set_axis_off()
    yield Picture(
        name="missing-others",
        section="location",
        caption="The same against other coordinates, with bands of ±2 standard errors and the share of the excess misfit that follows."
        " A coordinate that does not decide what is missing shows a flat line, or the shadow of one that does.",
        alt="What is missing against " + ", ".join(f"{p.coordinate} (explains {_share(p)})" for p in others) + ".",
        figure=figure,
    )


def _profile(axes: Axes, profile: Profile, style: PageStyle, **marks: object) -> None:
    look = coordinate_label(profile.coordinate, profile.unit)
    x, reach = look.factor * profile.center, 2 * profile.stderr
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.fill_between(x, profile.mean - reach, profile.mean + reach, color=style.band, linewidth=0)
    axes.plot(x, profile.mean, color=style.nominal, linewidth=1.0, **marks)  # type: ignore[arg-type]
    axes.margins(x=0.02)
    axes.set_xlabel(look.axis)


def _share(profile: Profile) -> str:
    return f"{100 * min(max(profile.explained, 0.0), 1.0):.0f} %" if np.isfinite(profile.explained) else "an unknown share"


def _added_force(diagnosis: Diagnosis, profile: Profile) -> np.ndarray | None:
    """Mean of what the augmented model pushes with beyond the nominal one, in the profile's bins; NaN in bins with little flight."""
    phase, known = diagnosis.location.phase if diagnosis.location is not None else "", _IN_FLIGHT.get(profile.coordinate)
    shown = phase in ("free flight", "all") or (phase == "separation" and known == "indentation")
    if profile.quantity != "force" or known is None or not shown or len(profile.center) < 2:
        return None
    force = flight_force(diagnosis.augmented.records, diagnosis.model, diagnosis.nominal_model)
    if force is None:
        return None
    chosen = force.v < 0 if phase == "separation" else np.ones(len(force.v), bool)
    middles = 0.5 * (profile.center[1:] + profile.center[:-1])
    edges = np.concatenate([[2 * profile.center[0] - middles[0]], middles, [2 * profile.center[-1] - middles[-1]]])
    counts = np.histogram(getattr(force, known)[chosen], edges)[0]
    sums = np.histogram(getattr(force, known)[chosen], edges, weights=force.added[chosen])[0]
    return np.where(counts >= 5, sums / np.maximum(counts, 1), np.nan)


def loop_kink(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """Force against indentation with the contact law that has a kink and the one that has none; one picture, where there is a kink."""
    found = diagnosis.location.kink if diagnosis.location is not None else None
    if found is None:
        return
    deeper = np.isin(found.record, [found.files.index(file) for file in found.deeper])
    across = 1e3 * found.indentation
    figure, ((axes,),) = panels((3.1,), edges=(0.72, 0.1, 0.45, 0.12))
    axes.axvline(1e3 * found.depth, color="black", linewidth=0.8, linestyle=DASHED)
    for chosen, mark, colour, name in ((~deeper, ".", "#b0b0b0", "the other records"), (deeper, "o", GREY, "records that go deeper")):
        marks = {"markersize": 3.2, "fillstyle": "none", "rasterized": len(across) > MANY}
        axes.plot(across[chosen], found.force[chosen], mark, color=colour, label=name, **marks)
    for number, index in enumerate(np.unique(found.record[deeper])):
        one = found.contact == found.contact[np.argmax(np.where(found.record == index, found.indentation, -np.inf))]
        names = ("_", "_") if number else ("law without a kink", "law with a kink")
        axes.plot(across[one], found.without_kink[one], color=style.nominal, linestyle=DASHED, label=names[0])
        axes.plot(across[one], found.with_kink[one], color=style.model, label=names[1])
    axes.legend(loc="upper left")
    axes.set_xlabel("indentation δ (mm)")
    axes.set_ylabel("contact force (N)")
    few_ticks(axes, x=8, y=6)
    depth, files = millimetres(found.depth), joined(list(found.deeper))
    yield Picture(
        name="kink",
        section="location",
        caption=f"Force against indentation as the records show it, without integrating a motion: beyond {depth} (dashed line upright) it"
        f" rises faster than the law in front of that; only {files} came that deep.",
        alt=f"Loops of force against indentation; beyond {depth} those of {files} rise steeply.",
        figure=figure,
    )


def residual_maps(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """Misfit of the nominal model by part of the record and phase of the excitation; one picture, a panel a record."""
    where = diagnosis.location
    able = [r for r in diagnosis.nominal.records if where is not None and np.isfinite(where.maps.get(r.file, np.nan)).any()]
    if where is None or not able:
        return
    largest_share = sorted(able, key=lambda r: -where.records.get(r.file, 0.0))[:MOST]
    shown = [record for record in able if record in largest_share]
    columns = 2 if len(shown) in (2, 4) else min(len(shown), 3)
    figure, grid = panels((1.45,) * -(-len(shown) // columns), columns, gap=(0.68, 0.52), edges=(0.72, 0.85, 0.48, 0.28))
    worst, highest = max(((r, float(np.nanmax(where.maps[r.file])) ** 0.5) for r in shown), key=lambda item: item[1])
    looks: dict[str, Any] = {"cmap": style.sequential, "norm": LogNorm(1.0, max(3.0, highest)), "origin": "lower", "aspect": "auto"}
    for axes, record in zip(grid.ravel(), shown, strict=False):
        read, values = recorded(record, diagnosis.experiment), np.sqrt(np.maximum(where.maps[record.file], 1.0))
        axes.patch.set(hatch="////", edgecolor="#c8c8c8", linewidth=0.0)
        image = axes.imshow(values, extent=(0.0, 360.0, record.time[0], record.time[-1]), interpolation="nearest", **looks)
        axes.grid(False)
        axes.locator_params(axis="y", nbins=5)
        driven = read is None or read.excitation_frequency is not None
        axes.set_xticks([0, 180, 360])
        axes.tick_params(labelbottom=driven)
        axes.set_xlabel("phase φ (°)" if driven else "time within the row")
        name = literal(record.file if len(record.file) <= 18 else "…" + record.file[-17:])
        axes.set_title(f"{name}: {100 * where.records[record.file]:.0f} %" if record.file in where.records else name, pad=4, fontsize=8)
        if where.time is not None and where.record in (None, record.file):
            axes.axhline(where.time, color="black", linewidth=0.9, linestyle=DASHED)
    for axes in grid[:, 0]:
        axes.set_ylabel("time t (s)")
    for axes in grid.ravel()[len(shown) :]:
        axes.set_axis_off()
    box = grid[-1, -1].get_position()
    bar = figure.colorbar(image, cax=figure.add_axes((box.x1 + 0.02, box.y0, 0.018, grid[0, 0].get_position().y1 - box.y0)))
    bar.ax.yaxis.set_major_formatter(LogFormatter(minor_thresholds=(2, 0.5)))
    bar.set_label("rms residual / noise")
    more = len(diagnosis.nominal.records) - len(shown)
    remarks = " Per cent: share of the excess misfit." if where.records else ""
    remarks += " The dashed line is the instant of the change." if where.time is not None else ""
    remarks += f" {more} more {'record is' if more == 1 else 'records are'} not drawn." if more else ""
    yield Picture(
        name="residual-maps",
        section="location",
        caption="Misfit of the nominal model by time in the record (upwards) and phase of the excitation (across): root mean square"
        f" residual over the noise; pale is noise alone, hatched is no sample.{remarks}",
        alt=f"Maps of the nominal model's misfit over time and excitation phase for {', '.join(record.file for record in shown)};"
        f" the darkest cell, in {worst.file}, is {significant(highest, 2)} times the noise.",
        figure=figure,
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Stretch:
    """Part of one record, in one channel, beside both models; the record's `number` in the experiment counts from 1."""

    number: int
    before: RecordFit
    after: RecordFit
    channel: str
    part: slice

    @property
    def gain(self) -> float:
        before, after = (record.chi2_reduced.get(self.channel, 0.0) for record in (self.before, self.after))
        return len(self.before.time) * (before - after)


def stretches(diagnosis: Diagnosis) -> list[Stretch]:
    """Of each record the stretch and the channel in which the augmented model gains most on the nominal one."""
    after = {record.file: record for record in diagnosis.augmented.records}
    fitted = [(number, one) for number, one in enumerate(diagnosis.nominal.records, start=1) if one.chi2_reduced]
    return [_stretch(diagnosis, number, one, after.get(one.file, one)) for number, one in fitted]


def _stretch(diagnosis: Diagnosis, number: int, before: RecordFit, after: RecordFit) -> Stretch:
    gains = {c: residual(before, c) ** 2 - (residual(after, c) ** 2 if diagnosis.is_augmented else 0.0) for c in before.chi2_reduced}
    gains = {channel: np.where(np.isfinite(gain), gain, 0.0) for channel, gain in gains.items()}
    where, channel = diagnosis.location, max(gains, key=lambda name: float(gains[name].sum()))
    if where is not None and gains.get(where.channel, np.zeros(1)).sum() > 0.0:
        channel = where.channel
    gain, read = gains[channel], recorded(before, diagnosis.experiment)
    frequency = (read.excitation_frequency if read is not None else None) or float(diagnosis.nominal_model.values().get("f_n", 0.0))
    period = 1.0 / (frequency * float(np.median(np.diff(before.time)))) if frequency > 0 else len(before.time) / 10.0 / _PERIODS
    length = min(max(int(_PERIODS * period), _FEWEST), len(before.time))
    sums = np.concatenate([[0.0], np.cumsum(gain)])
    first = int(np.argmax(sums[length:] - sums[:-length]))
    if where is not None and where.time is not None and where.record in (None, before.file):
        first = int(np.clip(np.searchsorted(before.time, where.time) - length // 2, 0, len(before.time) - length))
    part = slice(first, first + length)
    if where is not None and where.phase in ("contact", "separation"):  # one impact, unless what it does shows more clearly after it
        around = [impact.around(len(before.time)) for impact in impacts(before)]
        best = max(around, key=lambda one: float(gain[one].sum()), default=part)
        part = best if gain[best].mean() >= 0.5 * gain[part].mean() else part
    return Stretch(number=number, before=before, after=after, channel=channel, part=part)


def before_after(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """Measured, nominal and augmented in the stretch that shows most; a picture a record that gains, or where none does the first."""
    found, both = stretches(diagnosis), diagnosis.is_augmented
    worth = [one for one in found if one.gain > 0.0] if both else sorted(found, key=lambda one: -one.before.chi2_reduced[one.channel])
    chosen = sorted(worth, key=lambda one: -one.gain)[:MOST] or found[:1]
    for one in sorted(chosen, key=lambda one: one.number):
        sides = (("nominal", one.before, style.nominal), ("augmented", one.after, style.model))[: 1 + both]
        yield _before_after(diagnosis, one, sides, style)


def _before_after(diagnosis: Diagnosis, one: Stretch, sides: tuple[tuple[str, RecordFit, str], ...], style: PageStyle) -> Picture:
    look, time, both = label(one.channel, diagnosis.experiment), one.before.time[one.part], len(sides) > 1
    figure, grid = panels((1.35, *(0.5,) * len(sides)), sharex=True, gap=(0.13, 0.0), edges=(0.72, 0.98, 0.45, 0.3))
    upper = grid[0, 0]
    measured, contact = one.before.measured[one.channel][one.part], (one.before.in_contact | one.after.in_contact)[one.part]
    upper.plot(*envelope(time, look.factor * measured), color=style.measured, linewidth=2.4, label="measured")
    residuals, rms = [residual(side, one.channel)[one.part] for _, side, _ in sides], []
    for axes, (name, side, colour), r in zip(grid[1:, 0], sides, residuals, strict=True):
        dashes = DASHED if both and side is one.before else "-"
        shown = envelope(time, look.factor * side.predicted[one.channel][one.part])
        upper.plot(*shown, color=colour, linewidth=1.0, linestyle=dashes, label=name)
        residual_panel(axes, time, r, largest(r) if side is one.before else max(map(largest, residuals)), colour)
        usable = r[np.isfinite(r)]
        rms.append(significant(float(np.sqrt(np.mean(usable**2))) if len(usable) else None, 2))
        axes.text(1.012, 0.5, f"{name}\nrms {rms[-1]} σ", transform=axes.transAxes, ha="left", va="center", fontsize=8)
    flight = measured[np.isfinite(measured) & ~(np.convolve(contact, np.ones(9), mode="same") > 0.5)]
    where = diagnosis.location
    cut = where is not None and where.phase == "free flight" and 0 < np.ptp(flight) < 0.6 * np.ptp(measured[np.isfinite(measured)])
    if cut:  # impacts reach far beyond what the figure is about
        margin = 0.15 * np.ptp(flight)
        upper.set_ylim(look.factor * (flight.min() - margin), look.factor * (flight.max() + margin))
    upper.set_title(literal(f"{one.before.file}: {look.words}"), loc="left", pad=3)
    upper.set_ylabel(look.axis)
    upper.set_xlim(time[0], time[-1])
    upper.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), borderpad=0.1, handlelength=1.3, handletextpad=0.4)
    few_ticks(upper)
    grid[-1, 0].set_xlabel("time t (s)")
    models = " and ".join(f"{name} model" for name, _, _ in sides)
    return Picture(
        name=f"record-{one.number:02d}-{'before-after' if both else 'nominal'}",
        section="before-after",
        record=one.before.file,
        caption=f"{one.before.file}: {look.words} where {'the models differ most' if both else 'it fits worst'}"
        f"{', impacts cut off' if cut else ''}: measured, {models}; below, the residual over the noise σ, band ±2 σ.",
        alt=f"{look.words.capitalize()} of {one.before.file} from {time[0]:.4g} to {time[-1]:.4g} s: measured, {models};"
        f" residual {' σ before and '.join(rms)} σ{' after' if both else ''}.",
        figure=figure,
    )
