"""Figures of a diagnosis: what is missing as free forms, where in each record, and the prediction before and after.

Nominal is dashed, augmented not, measured a wide grey line, throughout; in colours, nominal is blue and augmented orange.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.ticker import LogFormatter

from identification.diagnosis.diagnosis import Diagnosis, Profile
from identification.experiment import Experiment
from identification.report.base import DASHED, MOST, PageStyle, Picture, grid_of, panels, recorded, residual_panel
from identification.result.result import RecordFit, impacts, largest, residual
from identification.wording.names import Label, coordinate_label, label, spoken
from identification.wording.numbers import significant
from vibrojax.compiling import soon_compiled
from vibrojax.drawing import envelope, few_ticks, literal
from vibrojax.excitation import Unforced, at_rest
from vibrojax.model import Model


def missing(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """What is missing against its best coordinate, with the force of the augmented model's effects; one picture."""
    where = diagnosis.location
    if where is None or not where.profiles:
        return
    best = where.profiles[0]
    figure, ((axes,),) = panels((2.7,), edges=(0.72, 0.1, 0.45, 0.12))
    factor = _coordinate(best, diagnosis.experiment).factor
    if where.interval is not None and best.coordinate == where.coordinate:
        low, high = factor * np.clip(where.interval, best.center.min(), best.center.max())
        axes.axvspan(low, high, color=style.contact, linewidth=0, label="where most of it is")
    _profile(axes, best, diagnosis.experiment, style, marker="o", markersize=3.0, label="missing from the nominal model")
    model = _added_force(diagnosis, best)
    if model is not None:
        axes.plot(factor * best.center, model, color=style.model, linewidth=1.4, label="effects of the augmented model")
    of, per_unit, unit = _quantity(best)
    axes.set_ylabel(f"{of} ({unit})")
    few_ticks(axes, x=8, y=6)
    axes.legend(loc="best")
    sign = " Above zero it pushes the hammer towards the stop." if best.quantity == "force" else ""
    sign = " Root mean square over all records, with the spectrum of the random force." if best.coordinate == "frequency" else sign
    sign += " Drawn is the force while u' > 0; while u' < 0 it acts the other way." if best.turns else ""
    others = " No other free form raises the likelihood as much." if len(where.profiles) > 1 else ""
    yield Picture(
        name="missing",
        section="missing",
        caption=f"What the nominal model leaves out, as a free form over {_over(best)}, estimated beside all parameters and variances,"
        f" with a band of ±2 standard errors.{others}{sign}",
        alt=f"{of.capitalize()} over {_over(best)}, from {per_unit * best.mean.min():.3g} to {per_unit * best.mean.max():.3g} {unit}.",
        figure=figure,
    )


def missing_over_others(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """The other free forms that raise the likelihood; one picture."""
    where = diagnosis.location
    others = [one for one in where.profiles[1:] if one.explained > 0.0][:MOST] if where is not None else []
    if not others:
        return
    figure, _, drawn = grid_of(len(others), 1.1, min(len(others), 2), gap=(0.84, 0.6), edges=(0.72, 0.1, 0.45, 0.42))
    for axes, profile in zip(drawn, others, strict=True):
        _profile(axes, profile, diagnosis.experiment, style)
        of, _, unit = _quantity(profile)
        axes.set_title(f"{of}\ngains {_share(profile)}", loc="left", pad=3, fontsize=8)
        axes.set_ylabel(f"({unit})")
        few_ticks(axes, x=5, y=4)
    yield Picture(
        name="missing-others",
        section="location",
        caption="Other free forms, each alone in the place of the first, with bands of ±2 standard errors; per cent: gain of likelihood"
        " over that of the first. One that gains little shows a flat line, or the shadow of the first.",
        alt="Other free forms: " + ", ".join(f"{_quantity(p)[0]} over {_over(p)} (gains {_share(p)} of the first)" for p in others) + ".",
        figure=figure,
    )


def _over(profile: Profile) -> str:
    """The coordinate in words."""
    return "its own value" if profile.coordinate == "reading" else f"the {profile.coordinate}"


def _quantity(profile: Profile) -> tuple[str, float, str]:
    """What a profile shows in words; the factor to the axis, and its unit."""
    if profile.coordinate == "time" and profile.quantity != "stop":
        return f"error of the gain of {spoken(profile.quantity)}", 100.0, "%"
    named = {"force": "missing force", "stop": "shift of the stop"}
    of = named.get(profile.quantity) or f"error of {spoken(profile.quantity)}"
    return of, *{"N": (1.0, "N"), "m": (1e3, "mm")}.get(profile.size_unit, (1.0, "σ"))


def _coordinate(profile: Profile, experiment: Experiment) -> Label:
    """How the coordinate is drawn; a reading as its channel is."""
    reading = profile.coordinate == "reading"
    return label(profile.quantity, experiment) if reading else coordinate_label(profile.coordinate, profile.unit)


def _profile(axes: Axes, profile: Profile, experiment: Experiment, style: PageStyle, **marks: object) -> None:
    look, (_, per_unit, _) = _coordinate(profile, experiment), _quantity(profile)
    x, mean, reach = look.factor * profile.center, per_unit * profile.mean, 2 * per_unit * profile.stderr
    axes.axhline(0.0, color="black", linewidth=0.6)
    axes.fill_between(x, mean - reach, mean + reach, color=style.band, linewidth=0)
    axes.plot(x, mean, color=style.nominal, linewidth=1.0, **marks)  # type: ignore[arg-type]
    axes.margins(x=0.02)
    axes.set_xlabel(look.axis)


def _share(profile: Profile) -> str:
    return f"{100 * profile.explained:.0f} %"


def _added_force(diagnosis: Diagnosis, profile: Profile) -> np.ndarray | None:
    """Mean of what the effects of the augmented model push with, in the profile's bins; NaN in bins with little flight.

    Where the profile turns with the motion, that while u' > 0 and the opposite of that while u' < 0.
    """
    phase = diagnosis.location.phase if diagnosis.location is not None else ""
    along_motion = profile.quantity == "force" and profile.coordinate in ("displacement", "velocity", "indentation")
    if len(profile.center) < 2 or not along_motion or phase == "contact":
        return None
    force = flight_force(diagnosis.augmented.records, diagnosis.model)
    if force is None:
        return None
    along = force[profile.coordinate]
    middles = 0.5 * (profile.center[1:] + profile.center[:-1])
    edges = np.concatenate([[2 * profile.center[0] - middles[0]], middles, [2 * profile.center[-1] - middles[-1]]])
    counts = np.histogram(along, edges)[0]
    added = force["added"] * np.sign(force["velocity"]) if profile.turns else force["added"]
    sums = np.histogram(along, edges, weights=added)[0]
    return np.where(counts >= 5, sums / np.maximum(counts, 1), np.nan)


def flight_force(records: Sequence[RecordFit], model: Model) -> dict[str, np.ndarray] | None:
    """Displacement, velocity and indentation at samples in free flight, SI, and the push `added` there by a model's effects, N.

    None where the effects have no force in flight that time and motion alone decide: without effects, with states of their own, or with
    something of its own in each record.
    """
    if not model.effects or model.record_parameters or any(one.own_states or one.record is not None for one in model.effects):
        return None
    parts = []
    for record in records:
        u, v = record.relative_displacement, record.relative_velocity
        usable = ~record.in_contact & np.isfinite(u) & np.isfinite(v) & (u < record.gap)
        parts.append(np.stack([record.time, u, v, np.full_like(u, record.gap)])[:, usable])
    samples = np.concatenate(parts, axis=1)
    if not samples.shape[1]:
        return None
    t, u, v, gap = samples[:, np.linspace(0, samples.shape[1] - 1, 8000).round().astype(int)]  # whatever the records: compiled once
    models = tuple(one.as_arrays() for one in (model, dataclasses.replace(model, effects=())))
    whole, without = map(np.asarray, _forces(models, *map(jnp.asarray, (t, u, v, gap))))
    if np.abs(whole - without).max() == 0.0:
        return None
    return {"displacement": u, "velocity": v, "indentation": u - gap, "added": whole - without}


@soon_compiled
def _forces(models: tuple[Model, ...], *samples):
    """Mass times relative acceleration of every model at times, u, u' and gaps, under a cart at rest, out of contact."""
    nothing, apart, resting = jnp.zeros(0), jnp.asarray(False), jnp.asarray(0.0)

    def force(model: Model, t, u, v, gap):
        system = model.system(gap=gap, base=at_rest(), applied=Unforced())
        return system.mass * system.forces(t, u, v, nothing, apart, resting).acceleration

    return tuple(jax.vmap(partial(force, model))(*samples) for model in models)


def residual_maps(diagnosis: Diagnosis, style: PageStyle) -> Iterator[Picture]:
    """Misfit of the nominal model by part of the record and phase of the excitation; one picture, a panel a record."""
    where = diagnosis.location
    able = [r for r in diagnosis.nominal.records if where is not None and np.isfinite(where.maps.get(r.file, np.nan)).any()]
    if where is None or not able:
        return
    largest_share = sorted(able, key=lambda r: -where.records.get(r.file, 0.0))[:MOST]
    shown = [record for record in able if record in largest_share]
    columns = 2 if len(shown) in (2, 4) else min(len(shown), 3)
    figure, grid, drawn = grid_of(len(shown), 1.45, columns, gap=(0.68, 0.52), edges=(0.72, 0.85, 0.48, 0.28))
    worst, highest = max(((r, float(np.nanmax(where.maps[r.file])) ** 0.5) for r in shown), key=lambda item: item[1])
    looks: dict[str, Any] = {"cmap": style.sequential, "norm": LogNorm(1.0, max(3.0, highest)), "origin": "lower", "aspect": "auto"}
    for axes, record in zip(drawn, shown, strict=True):
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


class Stretch(NamedTuple):
    """Part of one record, in one channel, beside both models; the gain of chi-square in all of it; its `number` counts from 1."""

    number: int
    before: RecordFit
    after: RecordFit
    channel: str
    part: slice
    gain: float


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
    period = 1.0 / (frequency * float(np.median(np.diff(before.time)))) if frequency > 0 else len(before.time) / 10.0 / 3.0
    length = min(max(int(3.0 * period), 60), len(before.time))  # three periods, and sixty samples at least
    sums = np.concatenate([[0.0], np.cumsum(gain)])
    first = int(np.argmax(sums[length:] - sums[:-length]))
    if where is not None and where.time is not None and where.record in (None, before.file):
        first = int(np.clip(np.searchsorted(before.time, where.time) - length // 2, 0, len(before.time) - length))
    part = slice(first, first + length)
    if where is not None and where.phase == "contact":  # one impact, unless what it does shows more clearly after it
        around = [impact.around(len(before.time)) for impact in impacts(before)]
        best = max(around, key=lambda one: float(gain[one].sum()), default=part)
        part = best if gain[best].mean() >= 0.5 * gain[part].mean() else part
    chi2, chi2_after = (record.chi2_reduced.get(channel, 0.0) for record in (before, after))
    return Stretch(number, before, after, channel, part, gain=len(before.time) * (chi2 - chi2_after))


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
