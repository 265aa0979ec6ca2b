"""Bands of motion with one impact in n cycles, and whether impact and no impact coexist, for a preset."""

import dataclasses
import functools
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from vibrojax.continuation import find_orbit, follow
from vibrojax.continuation.branch import Branch
from vibrojax.continuation.follow import Steps
from vibrojax.continuation.rig import ForcedRig, as_arrays
from vibrojax.continuation.stroboscope import strobe
from vibrojax.integrate import Landing
from vibrojax.presets.preset import Preset, read_preset
from vibrojax.presets.single_impact import SingleImpact

_BELOW, _ABOVE = 0.95, 1.4
_FLIGHT, _CONTACT_STEPS = 0.03, 30.0
"""Longest step in flight over 1 / omega_n, and steps in an impact: places of bands to 1e-3."""
_SETTLING, _WATCHED, _SIDE = 1500, 8, 6
_AT_TOP, _UNDER_END = 0.98, 0.97


@dataclasses.dataclass(frozen=True, kw_only=True)
class Band:
    """The stable stretch of a branch z = 1/n around its start.

    Attributes:
        largest: frequency at which the peak force is largest, Hz.
        end: upper end of stability, Hz.
        force: the largest peak force, N.
    """

    largest: float
    end: float
    force: float


@functools.cache
def band(name: str, gap: float, cycles: int) -> Band:
    """Band z = 1/n of a preset, by continuation of the compliant rig from the rigid stop's closed form.

    Arguments:
        name: of the preset.
        gap: m.
        cycles: n.

    Raises:
        NoConvergenceError: no such motion is found.
    """
    preset = read_preset(name)
    ideal = _ideal(preset, gap / preset["base_amplitude"], cycles)
    ratio = _AT_TOP * 2.0 * cycles if gap == 0 else _UNDER_END * ideal.band_end()
    frequency, landing = ratio * preset["natural_frequency_hz"], _landing(preset)
    orbit = find_orbit(preset.rig(gap=gap, frequency=frequency), _scaled(preset, ideal, ratio), cycles=cycles, landing=landing)
    limits = (_BELOW * frequency, _ABOVE * frequency)
    branch = follow(orbit, "frequency", limits, landing=landing, steps=Steps(largest=0.1))
    return _stable_stretch(branch, frequency)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Coexisting:
    """Which motions were found at one place.

    Attributes:
        stays_off: whether the orbit without impacts clears the stop.
        starts: how many initial states were run.
        early: how many of them strike the stop after 1500 cycles.
        late: and after 3000; fewer than `early` means that motion with impacts dies out, however slowly, and is no attractor for them.
    """

    stays_off: bool
    starts: int
    early: int
    late: int


def coexisting(preset: Preset, ratio: float, gap_ratio: float) -> Coexisting:
    """Motions at (Omega/omega, gap/A0) by brute force.

    Starts fill u from -4 to 1 gaps and u' within 4 gap Omega; one more is the rigid stop's z = 1/1, or rest where there is none. Each is
    watched for 8 cycles after 1500 and after 3000.
    """
    amplitude = preset["base_amplitude"]
    gap, frequency = gap_ratio * amplitude, ratio * preset["natural_frequency_hz"]
    rig = preset.rig(gap=gap, frequency=frequency)
    free = find_orbit(rig.replace("gap", 1e3 * amplitude), np.zeros(2), landing=_landing(preset))
    stays_off = float(free.passage.closest) + 1e3 * amplitude < gap
    reach = 4.0 * gap * 2.0 * np.pi * frequency
    u, v = np.meshgrid(np.linspace(-4.0, 1.0, _SIDE) * gap, np.linspace(-reach, reach, _SIDE))
    states = np.stack([u.ravel(), v.ravel()], axis=1)
    ideal = _ideal(preset, gap_ratio, 1)
    one_more = _scaled(preset, ideal, ratio) if np.isfinite(ideal.speed(ratio)) else np.zeros(2)
    states = np.concatenate([states, one_more[None]])
    early, late = (int(np.sum(strikes)) for strikes in _strikes(_landing(preset), as_arrays(rig), jnp.asarray(states)))
    return Coexisting(stays_off=stays_off, starts=len(states), early=early, late=late)


@eqx.filter_jit
def _strikes(landing: Landing, rig: ForcedRig, states: Float[Array, "starts 2"]) -> Any:
    """Whether the motion from each start touches the stop after one and after two times of settling."""

    def one(state):
        struck = []
        for _ in range(2):
            state, _ = strobe(landing, rig, jnp.asarray(_SETTLING), state)
            state, passage = strobe(landing, rig, jnp.asarray(_WATCHED), state)
            struck.append(passage.touches > 0)
        return struck

    return jax.vmap(one)(states)


def _landing(preset: Preset) -> Landing:
    """The integrator, its step an array so that all presets share one compiled program."""
    return Landing(contact_steps=_CONTACT_STEPS, flight_step=jnp.asarray(_FLIGHT / preset.omega_n))


def _ideal(preset: Preset, gap_ratio: float, cycles: int) -> SingleImpact:
    return SingleImpact(damping_ratio=preset["damping_ratio"], restitution=preset["restitution"], gap=gap_ratio, cycles=cycles)


def _scaled(preset: Preset, ideal: SingleImpact, ratio: float) -> np.ndarray:
    """State of the closed form in SI."""
    return ideal.state(ratio) * preset["base_amplitude"] * np.array([1.0, preset.omega_n])


def _stable_stretch(branch: Branch, frequency: float) -> Band:
    """The stable points joined to the start without a break."""
    start = int(np.argmin(np.abs(branch.parameter - frequency) + np.where(branch.stable, 0.0, np.inf)))
    unstable = np.flatnonzero(~branch.stable)
    first = unstable[unstable < start].max(initial=-1) + 1
    last = unstable[unstable > start].min(initial=len(branch.parameter))
    frequencies, forces = branch.parameter[first:last], branch.peak_force[first:last]
    top, beyond = int(np.argmax(forces)), branch.parameter[last : last + 1]
    found = [p.parameter for p in branch.special if beyond.size and frequencies[-1] <= p.parameter <= max(beyond[0], frequencies[-1])]
    return Band(largest=float(frequencies[top]), end=max([float(frequencies.max()), *found]), force=float(forces[top]))
