"""Windows as arrays: one lane per window, stacked by kind of excitation."""

import dataclasses
from collections.abc import Sequence

import jax
import numpy as np

from identification.experiment import Record
from identification.windows import measured_input
from identification.windows.kinematics import Kinematics
from identification.windows.windows import FITTED_CHANNELS, Windows
from vibrojax.excitation import SampledForce, SampledMotion


@dataclasses.dataclass(frozen=True, kw_only=True)
class Inputs:
    """Recorded inputs that drive the model along one record; None where the input is not recorded."""

    cart: SampledMotion | None = None
    applied: SampledForce | None = None
    prescribed: SampledMotion | None = None


def inputs_of(record: Record) -> Inputs:
    """Recorded inputs of a record."""
    return Inputs(
        cart=measured_input.measured_motion(record) if record.base == "measured" else None,
        applied=measured_input.measured_force(record) if record.kind == "forced" else None,
        prescribed=measured_input.prescribed_motion(record) if record.kind == "prescribed" else None,
    )


def lane(index: int, record: Record, first: int, length: int, samples: int, inputs: Inputs) -> Windows:
    """One window of a record, padded to `samples`, with its part of the recorded inputs."""
    present = np.arange(first, first + length)
    dt = float(np.median(np.diff(record.time[max(first - 1, 0) : first + length + 1])))
    ts = record.time[present[-1]] + dt * np.arange(1 - length, samples - length + 1)
    ts[:length] = record.time[present]
    measured, weight = np.zeros((samples, len(FITTED_CHANNELS))), np.zeros((samples, len(FITTED_CHANNELS)))
    driving = measured_input.driving_channels(record)
    for column, name in enumerate(FITTED_CHANNELS):
        if name not in record.channels or name in driving:
            continue
        values = record.channels[name][present]
        usable = np.isfinite(values)
        measured[:length, column] = np.where(usable, values, 0.0)
        weight[:length, column] = usable / record.noise[name]
    driven = record.kind == "cart-excitation" and inputs.cart is None
    cart, applied, prescribed = inputs.cart, inputs.applied, inputs.prescribed
    return Windows(
        record=np.asarray(index),
        first=np.asarray(first),
        lengths=np.asarray(length),
        ts=ts,
        measured=measured,
        weight=weight,
        gap=np.asarray(record.gap),
        frequency_hz=np.asarray(record.excitation_frequency if driven else 0.0),
        motion=None if cart is None else measured_input.motion_part(cart, first, samples),
        applied=None if applied is None else SampledForce(signal=measured_input.part(applied.signal, first, samples)),
        prescribed=None if prescribed is None else measured_input.motion_part(prescribed, first, samples),
        channels=FITTED_CHANNELS,
    )


def grouped(lanes: list[Windows]) -> tuple[Windows, ...]:
    """Windows stacked by kind of excitation, without channels that none of them holds."""
    kinds: dict[tuple[bool, ...], list[Windows]] = {}
    for lane in lanes:
        kinds.setdefault(tuple(each is None for each in (lane.motion, lane.applied, lane.prescribed)), []).append(lane)
    stacked = [jax.tree.map(lambda *leaves: np.stack(leaves), *group) for group in kinds.values()]
    return tuple(_without_empty(group) for group in stacked)


def _without_empty(group: Windows) -> Windows:
    """The group without channels that have no weight."""
    used = np.flatnonzero(group.weight.any(axis=(0, 1)))
    return dataclasses.replace(
        group,
        measured=group.measured[:, :, used],
        weight=group.weight[:, :, used],
        channels=tuple(group.channels[column] for column in used),
    )


def initial_states(group: Windows, motions: Sequence[Kinematics | None]) -> np.ndarray:
    """Initial state of every window, from the smoothed record; zero where the motion is not known."""
    states = np.zeros((len(group.record), 2))
    for lane, (record, first) in enumerate(zip(group.record, group.first, strict=True)):
        motion = motions[record]
        if motion is not None:
            states[lane] = motion.u[first], motion.v[first]
    return states


def chunked(groups: Sequence[Windows], size: int) -> list[tuple[np.ndarray, Windows]]:
    """All windows in chunks of `size`, sorted by length: (their indices over all groups, the windows).

    Repetition of a window fills up the last chunk of a group; its results are then the same twice.
    """
    chunks, begin = [], 0
    for group in groups:
        order = np.argsort(group.lengths, kind="stable")
        for first in range(0, len(order), size):
            lanes = np.resize(order[first : first + size], size)
            chunks.append((begin + lanes, jax.tree.map(lambda leaf, lanes=lanes: leaf[lanes], group)))
        begin += len(order)
    return chunks
