"""`python -m benchmarks.peak_forces`: peak forces of every study on every preset beside SciPy's DOP853.

At three frequencies of each preset, gap 0, every study that gives a force is asked for the motion reached from rest. SciPy starts from
the last strobe of the section and integrates eight cycles of equations that are written out here once more, from touch to release to
touch, at a relative tolerance of 1e-10; forces are read off 2000 instants of its dense output in each contact. Beside the peaks stand the
impulse, the contact time and the approach speed that the section lists. All numbers are relative differences from SciPy.
"""

import argparse
import math
import sys
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.integrate import solve_ivp

from vibrojax.cli.environment import prepare_jax
from vibrojax.presets.preset import NAMES, Preset, read_preset

RATIOS = (1.6, 2.0, 3.8)
"""Omega/omega of the operating points: two of z = 1/1 and one of z = 1/2 at gap 0."""
LARGEST = 1e-3
"""Relative difference that is allowed."""
_CYCLES, _RTOL, _INSTANTS = 8, 1e-10, 2000


class Strike(NamedTuple):
    """One impact as SciPy has it, SI."""

    approach_speed: float
    peak_force: float
    impulse: float
    duration: float


def strikes(preset: Preset, frequency_hz: float, gap: float, state: tuple[float, float], cycles: int = _CYCLES) -> list[Strike]:
    """Every impact of so many cycles from a strobe on that ends within them, by SciPy.

    Arguments:
        preset: the rig; its numbers are taken, none of its code.
        frequency_hz: of the cart, Hz.
        gap: m.
        state: u, m, and u', m/s, at the strobe.
        cycles: of the cart.
    """
    values = {name: float(value) for name, value in preset.model().values().items()}
    mass, zeta, omega_n, amplitude = preset["mass"], values["zeta"], 2.0 * math.pi * values["f_n"], preset["base_amplitude"]
    omega, length = 2.0 * math.pi * frequency_hz, 9.81 / omega_n**2 if preset.suspension == "pendulum" else math.inf

    def force(u: Any, v: Any) -> Any:
        delta = np.maximum(u - gap, 0.0)
        if preset.law == "hunt-crossley":
            return values["k_i"] * delta ** values["n"] * np.maximum(1.0 + values["lambda_i"] * v, 0.0)
        return values["k_i"] * np.maximum(delta + values["lambda_i"] * v, 0.0)

    def rates(t: float, y: np.ndarray, touching: bool) -> list[float]:
        u, v = y[0], y[1]
        sine = u / length
        cosine2 = 1.0 - sine**2
        push = float(force(u, v)) if touching else 0.0
        inertia = cosine2 * amplitude * omega**2 * math.sin(omega * t)
        swing = omega_n**2 * math.sqrt(cosine2) * u + (sine * v**2 / (length * cosine2) if math.isfinite(length) else 0.0)
        return [v, inertia - 2.0 * zeta * omega_n * v - swing - push / mass, push]

    def boundary(t: float, y: np.ndarray, touching: bool) -> float:
        return y[0] - gap

    t, y, touching, end, found = 0.0, np.array([*state, 0.0]), state[0] > gap, cycles / frequency_hz, []
    fresh = False
    while t < end:
        boundary.terminal, boundary.direction = True, -1.0 if touching else 1.0  # type: ignore[attr-defined]
        step = 2e-4 if touching else 0.01 / frequency_hz
        how: Any = dict(method="DOP853", rtol=_RTOL, atol=[1e-15, 1e-13, 1e-13], events=boundary, dense_output=True, max_step=step)
        piece = solve_ivp(rates, (t, end), y, args=(touching,), **how)
        if touching and fresh and piece.status == 1:
            u, v, _ = piece.sol(np.linspace(t, piece.t[-1], _INSTANTS))
            found.append(Strike(float(y[1]), float(force(u, v).max()), float(piece.y[2, -1]), float(piece.t[-1] - t)))
        t, y = piece.t[-1], np.array([gap, piece.y[1, -1], 0.0])
        touching, fresh = (not touching, not touching) if piece.status == 1 else (touching, False)
    return found


class Row(NamedTuple):
    """One operating point: SciPy's largest force, N, and relative differences by study and by what is compared."""

    preset: str
    frequency_hz: float
    peak_force: float
    off: dict[str, float]


def compared(name: str, ratio: float) -> Row:
    """All studies at one operating point.

    Arguments:
        name: of the preset.
        ratio: Omega/omega.
    """
    from vibrojax.continuation import find_orbit
    from vibrojax.studies import bifurcation, frequency_response, hammer_design, peterka, section
    from vibrojax.suspension import Linear

    preset = read_preset(name)
    model, frequency, amplitude = preset.model(), ratio * preset["natural_frequency_hz"], preset["base_amplitude"]
    rig: dict[str, Any] = dict(gap=0.0, base_amplitude=amplitude)
    here = section(model, frequency_hz=frequency, strobes=16, cycles=_CYCLES, **rig)
    state = float(here["displacement"][-1]), float(here["velocity"][-1])
    truth = strikes(preset, frequency, 0.0, state)
    top = max(one.peak_force for one in truth)
    along = bifurcation(model, parameter="frequency_hz", values=frequency * np.array([0.998, 1.0, 1.002]), **rig)
    hit = {name: here[f"impact_{name}"].values.max() for name in Strike._fields}
    forces = {
        "response": frequency_response(model, frequency_hz=[frequency], gap=[0.0], base_amplitude=amplitude)["impact_force"].item(),
        "bifurcation": float(along["impact_force"].isel(frequency_hz=1, direction=0).max()),
        "peterka": peterka(model, ratio=[ratio], clearance=[0.0], base_amplitude=amplitude)["impact_force"].item(),
        "section": float(here["peak_force"].max()),
        "history": float(here["impact_force"].max()),
    }
    if isinstance(model.suspension, Linear):
        design = hammer_design(model, mass_ratio=[1.0], frequency_hz=[frequency], **rig)
        forces["design"] = design["impact_force"].item()
    cycles = max(1, round(_CYCLES / max(len(truth), 1)))
    forces["continue"] = float(find_orbit(preset.rig(gap=0.0, frequency=frequency), np.array(state), cycles=cycles).passage.peak_force)
    off = {study: value / top - 1.0 for study, value in forces.items()}
    others = ("approach_speed", "impulse", "duration")
    off |= {part: hit[part] / max(getattr(one, part) for one in truth) - 1.0 for part in others}
    return Row(name, frequency, top, off)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.peak_forces", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--presets", nargs="*", default=list(NAMES), choices=list(NAMES), help="which")
    options = parser.parse_args()
    prepare_jax()
    rows = [compared(name, ratio) for name in options.presets for ratio in RATIOS]
    columns = list(dict.fromkeys(study for row in rows for study in row.off))
    table = Table("preset", "Omega (Hz)", "SciPy F_i (N)", *columns)
    for row in rows:
        cells = (f"{row.off[column]:+.1e}" if column in row.off else "" for column in columns)
        table.add_row(row.preset, f"{row.frequency_hz:.3f}", f"{row.peak_force:.2f}", *cells)
    Console(width=200).print(table)
    worst = max(abs(value) for row in rows for value in row.off.values())
    print(f"largest difference {100 * worst:.3f} %, allowed {100 * LARGEST:g} %")
    sys.exit(int(worst > LARGEST))


if __name__ == "__main__":
    main()
