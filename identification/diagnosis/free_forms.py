"""Free forms: what no listed effect says, as smooth functions of one coordinate of the motion, or as a vibration of its own.

Hats on a grid: a force of place and direction, a force of speed, a force of indentation and direction, a slow path of the stop, the error
of a reading over its own value, and its gain over time; and a force at one frequency, with another size and phase in every record. With
everything that acts in the model, none of them gains more than chance does.
"""

import dataclasses
from collections.abc import Iterator

import numpy as np

from identification.diagnosis.scales import lines_of_force
from identification.diagnosis.signals import on_segments
from identification.trajectory.course import Course, Signal
from identification.trajectory.fit import Fitted
from vibrojax.channel_units import UNITS
from vibrojax.effects import ProbeScales
from vibrojax.effects.free_form import TonalForce, hats

_HATS = 8
"""Hats over the range of a coordinate."""
_PATHS = 4
"""Knots of the stop's path in each record, and of a gain over time, beside its start."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Form:
    """One free form.

    Attributes:
        coordinate: "displacement", "velocity", "indentation", "time", "frequency" or "reading".
        quantity: "force", "stop" or a channel.
        unit: of the coordinate.
        knots: where its hats stand; (knots,).
        columns: knot, and direction of u' (1, -1, or 0 for both) or record, of each column; (columns, 2).
        size: value that a column's strength of one stands for, SI; of a gain, in 1.
        signals: of the columns.
        members: effects whose strengths are those of the columns, for every record in turn; none where `FreeForm` holds it.
        tried: places among which it was the best.
    """

    coordinate: str
    quantity: str
    unit: str
    knots: np.ndarray
    columns: np.ndarray
    size: float
    signals: tuple[Signal, ...]
    members: tuple[TonalForce, ...] = ()
    tried: int = 1

    @property
    def name(self) -> str:
        """For tables."""
        if self.members:
            return self.members[0].name
        channel = self.quantity.replace("_", " ")
        named = {"force": "force", "stop": "place of the stop"}
        quantity = named.get(self.quantity, f"gain of {channel}" if self.coordinate == "time" else channel)
        return f"any {quantity} over {self.coordinate}"


def free_forms(fitted: Fitted, courses: tuple[Course, ...], scales: ProbeScales) -> Iterator[Form]:
    """Every free form that the records can show."""
    problem, chains = fitted.problem, fitted.problem.chains
    records = problem.experiment.records
    lengths = [len(record.time) for record in records]
    u, v = (np.concatenate([np.asarray(getattr(c.motion, x))[:n] for c, n in zip(courses, lengths, strict=True)]) for x in ("u", "v"))
    force = problem.scales.force
    both, ways = np.array([0]), np.array([1, -1])

    def of_force(coordinate: str, unit: str, knots: np.ndarray, series, directions: np.ndarray) -> Form:
        columns = [(k, way) for k in range(len(knots)) for way in directions]
        made = []
        for index, course in enumerate(courses):
            value = hats(np.asarray(series(course)), knots, vanishing_below=coordinate == "indentation")
            speed = np.asarray(course.motion.v)
            acts = {0: 1.0, 1: speed > 0, -1: speed <= 0}
            made.append([on_segments(chains, index, force * value[k] * acts[int(way)]) for k, way in columns])
        signals = tuple(Signal(force=np.concatenate(parts), stop=None, readings={}) for parts in zip(*made, strict=True))
        return Form(
            coordinate=coordinate,
            quantity="force",
            unit=unit,
            knots=knots,
            columns=np.array(columns),
            size=force,
            signals=signals,
        )

    back, front = np.quantile(u, [0.01, 0.99])
    yield of_force("displacement", "m", np.linspace(back, front, _HATS), lambda c: c.motion.u, ways)
    fastest = float(np.quantile(np.abs(v), 0.99))
    yield of_force("velocity", "m/s", np.linspace(-fastest, fastest, 2 * _HATS), lambda c: c.motion.v, both)
    if scales.deepest > 0:
        deep = scales.deepest * np.array([-0.5, 0.0, 0.5, 1.0])
        yield of_force("indentation", "m", deep, lambda c: c.motion.indentation, ways)
        yield _paths(fitted)
    lines, searched = lines_of_force(fitted, scales, range(len(records)))
    if lines:
        yield _vibration(fitted, lines[0], searched)
    begin, end = (float(pick([record.time[at] for record in records])) for pick, at in ((min, 0), (max, -1)))
    times = np.linspace(begin, end, _PATHS + 1)
    for channel in chains.channels:
        values = [np.asarray(course.readings[channel]) for course in courses]
        whole = np.concatenate([one[:n] for one, n in zip(values, lengths, strict=True)])
        low, high = np.quantile(whole, [0.005, 0.995])
        if not high > low:
            continue
        knots, noise, mean = np.linspace(low, high, _HATS), scales.noise[channel], float(np.mean(whole))
        made = [("reading", UNITS[channel], knots, noise, [hats(one, knots, vanishing_below=False) for one in values])]
        if scales.tied:  # else a gain is the size of the motion
            clocks = [np.asarray(course.motion.t) for course in courses]
            moved = [(x - mean) * hats(t, times, vanishing_below=False) for x, t in zip(values, clocks, strict=True)]
            made.append(("time", "s", times, noise / float(np.std(whole)), moved))
        for coordinate, unit, places, size, of_records in made:
            parts = [[on_segments(chains, i, size * column) for column in one] for i, one in enumerate(of_records)]
            yield Form(
                coordinate=coordinate,
                quantity=channel,
                unit=unit,
                knots=places,
                columns=np.stack([np.arange(len(places)), np.zeros(len(places), int)], axis=1),
                size=size,
                signals=tuple(Signal(force=None, stop=None, readings={channel: np.concatenate(one)}) for one in zip(*parts, strict=True)),
            )


def _vibration(fitted: Fitted, hz: float, searched: int) -> Form:
    """A force at one frequency: cosine in every record, and sine in every record."""
    chains, records = fitted.problem.chains, fitted.problem.experiment.records
    size, signals, columns = fitted.problem.scales.force, [], []
    for wave in (np.cos, np.sin):
        for index, record in enumerate(records):
            force = np.zeros((len(chains.left), chains.samples + 1))
            force[chains.of_record(index)] = on_segments(chains, index, size * wave(2.0 * np.pi * hz * record.time))
            signals.append(Signal(force=force, stop=None, readings={}, record=index))
            columns.append((0, index))
    return Form(
        coordinate="frequency",
        quantity="force",
        unit="Hz",
        knots=np.array([hz]),
        columns=np.array(columns),
        size=size,
        signals=tuple(signals),
        members=(TonalForce(hz, 0.0, size), TonalForce(hz, size, 0.0)),
        tried=searched,
    )


def _paths(fitted: Fitted) -> Form:
    """The stop's place over time, another path in every record."""
    chains, records = fitted.problem.chains, fitted.problem.experiment.records
    size, signals, columns = 1e-4, [], []
    share = np.linspace(0.0, 1.0, _PATHS + 1)
    for index, record in enumerate(records):
        time = (record.time - record.time[0]) / (record.time[-1] - record.time[0])
        for k, hat in enumerate(hats(time, tuple(share.tolist()), vanishing_below=False)[1:], start=1):
            stop = np.zeros((len(chains.left), chains.samples + 1))
            stop[chains.of_record(index)] = on_segments(chains, index, size * hat)
            signals.append(Signal(force=None, stop=stop, readings={}, record=index))
            columns.append((k, index))
    longest = max(float(record.time[-1] - record.time[0]) for record in records)
    return Form(
        coordinate="time",
        quantity="stop",
        unit="s",
        knots=share * longest,
        columns=np.array(columns),
        size=size,
        signals=tuple(signals),
    )
