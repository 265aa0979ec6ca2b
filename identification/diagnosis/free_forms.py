"""Free forms: what no listed effect says, as smooth functions of one coordinate of the motion.

Hats on a grid: a force of place and direction, a force of speed, a force of indentation and direction, a slow path of the stop, and the
error of a reading over its own value. With everything that acts in the model, none of them gains more than chance does.
"""

import numpy as np
from jaxtyping import Float

from identification.diagnosis.signals import on_segments
from identification.trajectory.course import Course, Signal
from identification.trajectory.fit import Fitted
from vibrojax.effects import ProbeScales

_HATS = 8
"""Hats over the range of a coordinate."""
_PATHS = 4
"""Knots of the stop's path in each record, beside its start."""


def hats(values: Float[np.ndarray, " time"], low: float, high: float, count: int) -> Float[np.ndarray, "hats time"]:
    """Piecewise linear functions that add up to one between low and high, constant beyond."""
    place = np.clip((values - low) / max(high - low, 1e-300), 0.0, 1.0) * (count - 1)
    return np.clip(1.0 - np.abs(place - np.arange(count)[:, None]), 0.0, 1.0)


def free_forms(fitted: Fitted, courses: tuple[Course, ...], scales: ProbeScales) -> dict[str, tuple[Signal, ...]]:
    """Signals of every free form by name."""
    problem, chains = fitted.problem, fitted.problem.chains
    size = problem.scales.force
    records = problem.experiment.records
    along = [(np.asarray(c.motion.u), np.asarray(c.motion.v), np.asarray(c.motion.indentation)) for c in courses]
    inside = [tuple(values[: len(r.time)] for values in one) for one, r in zip(along, records, strict=True)]
    all_u, all_v = (np.concatenate([one[k] for one in inside]) for k in (0, 1))
    (low, high), fastest = np.quantile(all_u, [0.01, 0.99]), float(np.quantile(np.abs(all_v), 0.99))

    def force(columns) -> tuple[Signal, ...]:
        """Signals of forces, from the columns of every record."""
        made = [[on_segments(chains, index, size * column) for column in columns(*one)] for index, one in enumerate(along)]
        return tuple(Signal(force=np.concatenate(parts), stop=None, readings={}) for parts in zip(*made, strict=True))

    found = {
        "force of displacement and direction": force(
            lambda u, v, _: [hat * way for hat in hats(u, low, high, _HATS) for way in (v > 0, v <= 0)]
        ),
        "force of velocity": force(lambda u, v, _: hats(v, -fastest, fastest, 2 * _HATS)),
    }
    if scales.deepest > 0:
        deep = scales.deepest
        found["force of indentation and direction"] = force(
            lambda u, v, depth: [hat * way for hat in hats(depth, -deep, deep, 5)[1:] for way in (v > 0, v <= 0)]
        )
        paths = []
        for index, record in enumerate(records):
            share = (record.time - record.time[0]) / (record.time[-1] - record.time[0])
            for hat in hats(share, 0.0, 1.0, _PATHS + 1)[1:]:
                stop = np.zeros((len(chains.left), chains.samples + 1))
                stop[chains.of_record(index)] = on_segments(chains, index, 1e-4 * hat)
                paths.append(Signal(force=None, stop=stop, readings={}))
        found["place of the stop in time"] = tuple(paths)
    for channel in chains.channels:
        values = [np.asarray(c.readings[channel]) for c in courses]
        whole = np.concatenate([one[: len(r.time)] for one, r in zip(values, records, strict=True)])
        bottom, top = np.quantile(whole, [0.005, 0.995])
        if not top > bottom:
            continue
        made = [
            [on_segments(chains, i, scales.noise[channel] * hat) for hat in hats(one, bottom, top, _HATS)] for i, one in enumerate(values)
        ]
        found[f"reading of {channel}"] = tuple(
            Signal(force=None, stop=None, readings={channel: np.concatenate(parts)}) for parts in zip(*made, strict=True)
        )
    return found
