"""Records as chains of short segments between knots, and the order of all unknowns.

A record is cut at knots t_0 < t_1 < ... into segments of `SAMPLES` samples or more. Unknown at a knot are the state of the motion and the
random force; shared by all records are the model's parameters; and each record has a few numbers of its own.
"""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property, partial
from itertools import pairwise
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jaxtyping import Bool, Float, Int

from identification.experiment import Record
from identification.guesses.motion import driving_channels, input_noise, inputs_of, parts
from vibrojax.channels import EVERY_CHANNEL
from vibrojax.contact import AbstractCompliantLaw
from vibrojax.contact.base import uses_approach_speed
from vibrojax.effects.readings import ForceClipping
from vibrojax.excitation import CubicSignal, SampledForce, SampledMotion
from vibrojax.model import Model
from vibrojax.parameters import Parameter

FEWEST_SAMPLES = 4
"""Samples of a segment, at least: whitening reaches back one segment, so that no reading error is of higher order."""
SEGMENTS_PER_PERIOD = 60.0
"""Segments in a period of the natural or excitation frequency, about: the random force is linear within each."""
FEWEST_SEGMENTS_PER_PERIOD = 8.0
"""Where samples are that few: a force that is linear within a segment follows no motion on fewer."""
MOVED_BETWEEN_KNOTS = 0.3
"""Displacement between knots by the noise of a recorded input, over the sensor's noise, at most."""
CEILING_SAMPLES, CEILING_RUN = 20, 4
"""Samples at one extreme value, in all and in a row, by which a channel counts as cut off there."""
OF_RECORD = ("base_sine", "base_cosine", "gap_error")
"""Own to each record: y = base_sine sin(Omega t) + base_cosine cos(Omega t), m, and the setting error of the gap, m."""
VARIATION = "variation."
"""Before the name of a shared parameter: its deviation in a record."""
APPROACH_SPEED = "approach_speed"
"""State: speed at the last touch, m/s."""
Lateness = Callable[[np.ndarray], np.ndarray]
"""Time by which a channel is late, s, from the time on the record's clock, s."""
Hosted = Any
"""A NumPy or JAX array."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Unknowns:
    """Names and order of the unknowns that do not belong to a knot; hashable, and free of numbers, so that a number never compiles.

    Attributes:
        shared: parameters that all records share, with whether they move by their logarithm.
        own: numbers of each record: motion of the cart, gap, zeros of sensors, deviations of shared parameters, parameters of effects.
        states: of the motion at a knot: u, u', the effects' own, and the approach speed where the contact law depends on it.
    """

    shared: tuple[tuple[str, bool], ...]
    own: tuple[str, ...]
    states: tuple[str, ...]
    logarithmic_own: tuple[bool, ...]

    @property
    def columns(self) -> int:
        """Length of the vector that a segment depends on: states, force at both ends, shared, own."""
        return len(self.states) + 2 + len(self.shared) + len(self.own)

    def index(self, name: str) -> int:
        """Place of a shared parameter."""
        return [one for one, _ in self.shared].index(name)


class Segments(eqx.Module):
    """Segments that share one kind of excitation, side by side; or, without the leading axis, one of them.

    `weight` is 1 / noise where a sample counts, and 0 where it was not recorded, is not usable or is only padding.
    """

    place: Int[Hosted, "*segments"]
    """Among all segments of the experiment."""
    record: Int[Hosted, "*segments"]
    ts: Float[Hosted, "*segments knots"]
    """Times of the samples and of the knot behind them, s."""
    measured: Float[Hosted, "*segments samples channels"]
    weight: Float[Hosted, "*segments samples channels"]
    gap: Float[Hosted, "*segments"]
    """As set, m."""
    frequency_hz: Float[Hosted, "*segments"]
    """Of the excitation as set, Hz; 0 for a cart at rest."""
    motion: SampledMotion | None
    """Measured motion of the cart; None where it is at rest or moves harmonically."""
    applied: SampledForce | None
    """Measured force on the hammer; None where there is none."""
    ahead: dict[str, Float[Hosted, "*segments samples"]] | None
    """By channel that is late, time from a sample of the motion to the reading that it is compared with, s; None where none is."""
    prescribed: SampledMotion | None
    """Measured motion relative to the cart, where a machine imposes it: nothing moves freely then, and no random force acts."""
    resting: Bool[Hosted, "*segments"]
    """Whether the body rests on a rigid stop: then only sensors of displacement count."""
    channels: tuple[str, ...] = eqx.field(static=True)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Chains:
    """All records as chains, in the order of their segments.

    Attributes:
        groups: the segments by kind of excitation.
        record: of each segment.
        duration: of each segment, s.
        input_noise: in each segment; (segments, 2). See `identification.guesses.motion.input_noise`.
        files: of the records.
        channels: compared with the model, in the order of all arrays.
        measured, weight: (segments, samples, channels).
        readings: usable ones by channel, those too that nothing is compared with because the channel is late.
    """

    groups: tuple[Segments, ...]
    record: np.ndarray
    duration: np.ndarray
    input_noise: np.ndarray
    files: tuple[str, ...]
    channels: tuple[str, ...]
    measured: np.ndarray
    weight: np.ndarray
    readings: np.ndarray

    @cached_property
    def left(self) -> np.ndarray:
        """Knot at the beginning of each segment; the one at its end is the next."""
        return np.arange(len(self.record)) + self.record

    @cached_property
    def first(self) -> np.ndarray:
        """Whether a segment is the first of its record."""
        return np.diff(self.record, prepend=-1) > 0

    @cached_property
    def knots(self) -> tuple[slice, ...]:
        """Slice of the knots of each record."""
        ends = [*self.left[self.first].tolist(), len(self.record) + len(self.files)]
        return tuple(slice(begin, end) for begin, end in pairwise(ends))

    @property
    def samples(self) -> int:
        """Of a segment."""
        return self.weight.shape[1]

    @property
    def knot_count(self) -> int:
        """Of all records."""
        return self.knots[-1].stop

    def of_record(self, index: int) -> slice:
        """Segments of a record."""
        where = np.flatnonzero(self.record == index)
        return slice(int(where[0]), int(where[-1]) + 1)

    def part(self, kept: Bool[np.ndarray, " segments"]) -> tuple["Chains", np.ndarray, np.ndarray]:
        """Chains of some segments, the first ones of each record that has any; with their knots and records among all."""
        records, owner = np.unique(self.record[kept], return_inverse=True)
        part = dataclasses.replace(
            self,
            groups=(),
            record=owner,
            duration=self.duration[kept],
            input_noise=self.input_noise[kept],
            files=tuple(self.files[index] for index in records),
            measured=self.measured[kept],
            weight=self.weight[kept],
        )
        return part, np.union1d(self.left[kept], self.left[kept] + 1), records

    def series(self, index: int, values: np.ndarray, samples: int) -> np.ndarray:
        """Values at the samples of a record in one row of time; (samples, ...)."""
        chosen = values[self.of_record(index)]
        return chosen.reshape(-1, *chosen.shape[2:])[:samples]


def unknowns_of(model: Model, parameters: Sequence[Parameter], *, zeros: Sequence[str] = (), varying: Sequence[str] = ()) -> Unknowns:
    """Unknowns of a model: `parameters` are shared, `zeros` name channels of unknown zero, `varying` parameters that deviate in records."""
    own = (*OF_RECORD, *(f"zero.{name}" for name in zeros), *(f"{VARIATION}{name}" for name in varying))
    of_effects, of_motion = model.record_parameters, ("u", "v")
    effects = tuple(f"{effect.name}.{state.name}" for effect in model.acting for state in effect.own_states)
    return Unknowns(
        shared=tuple((p.name, p.logarithmic) for p in parameters),
        own=(*own, *(p.name for p in of_effects)),
        states=(*of_motion, *effects, *((APPROACH_SPEED,) if _takes_approach_speed(model) else ())),
        logarithmic_own=(*(False for _ in own), *(p.logarithmic for p in of_effects)),
    )


def _takes_approach_speed(model: Model) -> bool:
    """Whether the contact force depends on the speed at the touch, which is then part of the state."""
    return isinstance(model.law, AbstractCompliantLaw) and uses_approach_speed(model.law)


def samples_of_a_segment(records: Sequence[Record], fastest_hz: float, *, mass: float, resolution: float) -> int:
    """Samples from one knot to the next: a part of the shortest period, and `FEWEST_SAMPLES` where a period has enough of them.

    Where noise of a recorded input moves the hammer, (q T^3 / 3)^(1/2) in a segment of length T (see `motion_covariance`), no more than
    keep that below `MOVED_BETWEEN_KNOTS`, but never fewer than `FEWEST_SAMPLES`.

    Args:
        records: of the experiment.
        fastest_hz: vibration, Hz.
        mass: of the hammer, kg.
        resolution: of the displacement sensor, m.
    """
    dt = min(float(np.median(np.diff(record.time))) for record in records)
    period = 1.0 / (fastest_hz * dt) if fastest_hz > 0 else np.inf  # samples
    wanted = period / SEGMENTS_PER_PERIOD if fastest_hz > 0 else 0.0
    noise = max(force / mass**2 + base for force, base in map(input_noise, records))
    still = np.cbrt(3.0 * (MOVED_BETWEEN_KNOTS * resolution) ** 2 / noise) / dt if noise > 0.0 else np.inf
    return max(1, round(min(max(min(wanted, still), FEWEST_SAMPLES), period / FEWEST_SEGMENTS_PER_PERIOD)))


def chains_of(
    records: Sequence[Record],
    samples: int,
    *,
    rest: Sequence[tuple[float, float]] | None = None,
    late: Mapping[str, Lateness] = {},
) -> Chains:
    """Cut the records into segments of so many samples each; the last one of a record is padded.

    `rest` are the times between which a body flies too low from a rigid stop to be seen, and from which it rests there, s, by record: in
    between no sample counts. A channel that comes late is compared with the motion as many samples earlier; `late` gives the time by
    channel, s.
    """
    lanes: dict[tuple[bool, ...], list[Segments]] = {}
    place, owner, readings = 0, [], []
    compared = {name for record in records for name in record.channels if name not in driving_channels(record)}
    channels = tuple(name for name in EVERY_CHANNEL if name in compared)
    for index, record in enumerate(records):
        one, usable = _segments(index, record, samples, channels, place, (np.inf, np.inf) if rest is None else rest[index], late)
        count = len(one.record)
        lanes.setdefault(tuple(each is None for each in (one.motion, one.applied, one.prescribed)), []).append(one)
        owner.append(np.full(count, index))
        readings.append(usable)
        place += count
    groups = tuple(jax.tree.map(lambda *leaves: np.concatenate(leaves), *group) for group in lanes.values())
    order = np.argsort(np.concatenate([group.place for group in groups]))

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(group, name) for group in groups])[order]

    ts = joined("ts")
    return Chains(
        groups=groups,
        record=np.concatenate(owner),
        duration=ts[:, -1] - ts[:, 0],
        input_noise=np.array([input_noise(record) for record in records])[np.concatenate(owner)],
        files=tuple(record.file for record in records),
        channels=channels,
        measured=joined("measured"),
        weight=joined("weight"),
        readings=np.sum(readings, axis=0),
    )


def not_shown(channel: str, values: Float[np.ndarray, " samples"]) -> np.ndarray:
    """Samples of a channel `at_ceiling`; the load cell's at its upper one count, since an effect explains them (`ForceClipping`)."""
    return at_ceiling(values, above=channel != ForceClipping.of_channel)


def at_ceiling(values: Float[np.ndarray, " samples"], *, above: bool = True) -> np.ndarray:
    """Samples at the largest or smallest value of a channel that is cut off there: those say no more than that the true one lies beyond.

    A channel is cut off where it has one extreme value at least `CEILING_SAMPLES` times, and `CEILING_RUN` times in a row. The largest
    value is looked at where `above`.

    Example:
        >>> wave = np.sin(np.linspace(0.0, 40.0, 400))
        >>> int(at_ceiling(wave).sum()), int(at_ceiling(np.minimum(wave, 0.9)).sum())
        (0, 63)
    """
    found = np.zeros(len(values), bool)
    for extreme in (*((np.nanmax(values, initial=-np.inf),) if above else ()), np.nanmin(values, initial=np.inf)):
        there = values == extreme
        run = np.convolve(there, np.ones(CEILING_RUN))
        if there.sum() >= CEILING_SAMPLES and run.max() >= CEILING_RUN and there.sum() < 0.5 * len(values):
            found |= there
    return found


def shown_at(time: Float[np.ndarray, " samples"], late: Lateness | None) -> tuple[np.ndarray, np.ndarray]:
    """Sample at which a channel shows the motion of each sample, to the nearest, and whether it lies within the record."""
    read = np.arange(len(time))
    if late is not None:
        read = read + np.rint(late(time) / float(np.median(np.diff(time)))).astype(int)
    return np.clip(read, 0, len(time) - 1), (read >= 0) & (read < len(time))


def _segments(
    index: int,
    record: Record,
    samples: int,
    channels: tuple[str, ...],
    place: int,
    rest: tuple[float, float],
    late: Mapping[str, Lateness],
) -> tuple[Segments, np.ndarray]:
    """The segments of one record, and its usable readings by channel."""
    time = record.time
    count = -(-len(time) // samples)
    dt = float(np.median(np.diff(time)))
    padded = np.concatenate([time, time[-1] + dt * np.arange(1, count * samples - len(time) + 2)])
    first = samples * np.arange(count)
    rows = first[:, None] + np.arange(samples + 1)
    driving = driving_channels(record)
    measured, weight = np.zeros((count * samples, len(channels))), np.zeros((count * samples, len(channels)))
    ahead = {name: np.zeros(count * samples) for name in late}
    lost = np.zeros(len(channels), int)
    for column, name in enumerate(channels):
        if name in record.channels and name not in driving:
            values = record.channels[name]
            usable = np.isfinite(values) & ~not_shown(name, values)
            read, there = shown_at(time, late.get(name))
            all_usable, usable = usable, usable[read] & there
            lost[column] = max(int(all_usable.sum()) - int(usable.sum()), 0)
            measured[: len(time), column] = np.where(usable, values[read], 0.0)
            weight[: len(time), column] = usable / record.noise[name]
            if name in late:
                ahead[name][: len(time)] = time[read] - time
    low, still = rest
    resting = padded[rows][:, 0] >= still
    weight[: len(time)][(time > low) & ~np.repeat(resting, samples)[: len(time)]] = 0.0
    displacements = np.array([name.endswith("displacement") for name in channels])
    weight = weight.reshape(count, samples, -1) * (displacements | ~resting[:, None, None])
    inputs = inputs_of(record)
    of_segments = partial(jax.tree.map, lambda one: parts(one, first, samples + 2), is_leaf=lambda one: isinstance(one, CubicSignal))
    driven = record.kind == "cart-excitation" and inputs.cart is None
    segments = Segments(
        place=place + np.arange(count),
        record=np.full(count, index),
        ts=padded[rows],
        measured=measured.reshape(count, samples, -1),
        weight=weight,
        gap=np.full(count, record.gap),
        frequency_hz=np.full(count, float(record.excitation_frequency or 0.0) if driven else 0.0),
        motion=of_segments(inputs.cart),
        applied=of_segments(inputs.applied),
        ahead={name: values.reshape(count, samples) for name, values in ahead.items()} if late else None,
        prescribed=of_segments(inputs.prescribed),
        resting=resting,
        channels=channels,
    )
    return segments, lost + (weight > 0).sum(axis=(0, 1))
