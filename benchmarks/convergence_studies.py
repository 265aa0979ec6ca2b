"""What `benchmarks.convergence` computes."""

from collections.abc import Callable, Iterable, Mapping
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from vibrojax.contact import AbstractContactLaw, HuntCrossley, KelvinVoigt, LankaraniNikravesh
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import SUCCESS, Smoothed, Switch
from vibrojax.suspension import Linear
from vibrojax.system import System

Track = Callable[[Iterable, str], Iterable]
_TRAJECTORY_RANGE, _GRADIENT_RANGE = (5e-10, 2e-5), (3e-7, 2e-2)
"""Relative errors between these are taken to be in the range of convergence: above those of the time steps, and small. Error control does
not see derivatives, so that their floor is higher."""


class Curve(NamedTuple):
    """Error against smoothing width, and the power law through its lower end."""

    label: str
    widths: np.ndarray
    """m"""
    errors: np.ndarray
    """Relative."""
    slope: float
    factor: float
    """error = factor * width ** slope"""
    fit_widths: tuple[float, float] | None


class Size(NamedTuple):
    """Size of the bifurcation diagram."""

    frequencies: int
    transient: int
    """Blocks of `block` cycles left out."""
    kept: int
    """Blocks kept."""
    block: int
    widths: tuple[float, ...]
    """m"""


FULL = Size(frequencies=120, transient=10, kept=2, block=20, widths=(1e-3, 3e-4, 1e-4, 3e-5, 1e-5))
QUICK = Size(frequencies=8, transient=0, kept=1, block=9, widths=(1e-3, 1e-5))


class Diagram(NamedTuple):
    """Stroboscopic velocities of the attractor that is reached from rest, mm/s, against excitation frequency, Hz."""

    frequencies: np.ndarray
    reference: np.ndarray
    smoothed: dict[float, np.ndarray]

    def summary(self) -> dict:
        """Numbers that the diagram boils down to."""
        rows, period = [], _periods(self.reference)
        for width, points in self.smoothed.items():
            same = _periods(points)
            both_simple = (same == 1) & (period == 1)
            error = np.abs(points[:, -1] - self.reference[:, -1])[both_simple] / np.ptp(self.reference)
            median = float(np.median(error)) if error.size else float("nan")
            rows.append(dict(smoothing=width, wrong_period=int((same != period).sum()), of=len(period), median_error=median))
        return {"widths": rows}


def rig(law: AbstractContactLaw, *, gap=1e-3, damping_ratio=0.02, f_n=4.0, base_amplitude=2e-3, frequency_hz=6.0) -> System:
    """Hammer of 0.5 kg on beam springs, harmonic cart."""
    return System(
        mass=0.5,
        suspension=Linear(damping_ratio=damping_ratio, natural_frequency_hz=f_n),
        law=law,
        gap=gap,
        base=Harmonic(base_amplitude=base_amplitude, base_phase=0.3, frequency_hz=frequency_hz),
        applied=Unforced(),
    )


LAWS: dict[str, AbstractContactLaw] = {
    "Hunt–Crossley, n = 1.5": HuntCrossley(1e6, 1.5, 0.3),
    "Hunt–Crossley, n = 2.5": HuntCrossley(1e10, 2.5, 0.3),
    "Lankarani–Nikravesh, e = 0.8": LankaraniNikravesh(1e6, 1.5, 0.8),
    "Kelvin–Voigt, force jumps": KelvinVoigt(2e5, 3e-4),
}


def trajectories(laws: Mapping[str, AbstractContactLaw], widths: np.ndarray, track: Track) -> list[Curve]:
    """Largest error of u over one second (six impacts) against smoothing width, relative to its range."""
    ts, state = jnp.linspace(0.0, 1.0, 401), jnp.zeros(2)
    switch = jax.jit(lambda system: Switch()(system, ts, state).u)
    smoothed = jax.jit(lambda system, width: Smoothed(width, rtol=1e-11, atol=1e-14)(system, ts, state).u)
    curves = []
    for label, law in track(list(laws.items()), "trajectories"):
        truth = switch(rig(law))
        errors = [float(jnp.abs(smoothed(rig(law), width) - truth).max() / jnp.ptp(truth)) for width in widths]
        curves.append(_curve(label, widths, np.array(errors), _TRAJECTORY_RANGE))
    return curves


def gradients(widths: np.ndarray, track: Track) -> list[Curve]:
    """Relative error of the derivative of u with respect to each logarithmic parameter, over three impacts, in flight only."""
    names = ("k_i", "n", "λ_i", "ζ", "ω_n")
    ts, state = jnp.linspace(0.0, 0.5, 201), jnp.zeros(2)

    def u(scale, integrator):
        law = HuntCrossley(1e6 * scale[0], 1.5 * scale[1], 0.3 * scale[2])
        return integrator(rig(law, damping_ratio=0.02 * scale[3], f_n=4.0 * scale[4]), ts, state).u

    def value_and_jacobian(integrator):
        return jax.jacfwd(lambda scale: (u(scale, integrator),) * 2, has_aux=True)(jnp.ones(len(names)))

    truth, motion = jax.jit(lambda: value_and_jacobian(Switch(rtol=1e-13, atol=1e-16)))()
    solve = jax.jit(lambda width: value_and_jacobian(Smoothed(width, rtol=1e-13, atol=1e-16))[0])
    in_flight = np.asarray(motion) < 0.0  # further from the stop than any width
    truth = np.asarray(truth)[in_flight]
    errors = [
        np.abs(np.asarray(solve(width))[in_flight] - truth).max(axis=0) / np.abs(truth).max(axis=0) for width in track(widths, "gradients")
    ]
    return [_curve(name, widths, column, _GRADIENT_RANGE) for name, column in zip(names, np.array(errors).T, strict=True)]


def bifurcations(size: Size, track: Track) -> Diagram:
    """Attractors reached from rest across a grazing, stop of 1e9 N/m^1.5 (largest indentation near 0.014 mm)."""
    frequencies = jnp.linspace(3.3, 3.7, size.frequencies)
    law = HuntCrossley(1e9, 1.5, 0.3)

    def at(frequency):
        system = rig(law, damping_ratio=0.05, f_n=5.0, base_amplitude=1e-3, frequency_hz=frequency)
        return jax.tree.map(jnp.asarray, system)

    systems = jax.vmap(at)(frequencies)
    cycles = jnp.arange(size.block + 1.0)[None, :] / frequencies[:, None]

    @jax.jit
    def switch(_, states):
        return jax.vmap(Switch(rtol=1e-9, atol=1e-12))(systems, cycles, states)

    @jax.jit
    def smoothed(width, states):
        return jax.vmap(Smoothed(width, rtol=1e-8, atol=1e-11))(systems, cycles, states)

    runs = [(switch, 0.0), *((smoothed, width) for width in size.widths)]
    points = [_attractor(method, width, size) for method, width in track(runs, "bifurcation diagram")]
    return Diagram(np.asarray(frequencies), points[0], dict(zip(size.widths, points[1:], strict=True)))


def _attractor(block: Callable, width: float, size: Size) -> np.ndarray:
    """Velocity once a cycle after the transient, mm/s: one row a frequency."""
    states, kept = jnp.zeros((size.frequencies, 2)), []
    for number in range(size.transient + size.kept):
        run = block(width, states)
        if (run.result != SUCCESS).any():
            raise RuntimeError(f"{int((run.result != SUCCESS).sum())} of {size.frequencies} frequencies were not integrated to the end")
        states = jnp.stack([run.u[:, -1], run.v[:, -1]], axis=1)
        if number >= size.transient:
            kept.append(1e3 * run.v[:, 1:])
    return np.concatenate(kept, axis=1)


def _periods(points: np.ndarray, longest: int = 8) -> np.ndarray:
    """Smallest number of cycles after which the motion repeats within 1 % of the diagram's range; 0 where none up to `longest` does."""
    tolerance = 1e-2 * np.ptp(points)
    period = np.zeros(len(points), int)
    for candidate in range(longest, 0, -1):
        repeats = np.abs(points[:, candidate:] - points[:, :-candidate]).max(axis=1) < tolerance
        period[repeats] = candidate
    return period


def _curve(label: str, widths: np.ndarray, errors: np.ndarray, between: tuple[float, float]) -> Curve:
    """Power law through the errors in the range of convergence, cut where they first leave it at either end."""
    above_floor = np.logical_and.accumulate((errors > between[0])[::-1])[::-1]
    below_ceiling = np.logical_and.accumulate(errors < between[1])
    inside = above_floor & below_ceiling
    if inside.sum() < 2:
        return Curve(label, widths, errors, float("nan"), float("nan"), None)
    slope, offset = np.polyfit(np.log(widths[inside]), np.log(errors[inside]), 1)
    return Curve(label, widths, errors, float(slope), float(np.exp(offset)), (float(widths[inside][0]), float(widths[inside][-1])))
