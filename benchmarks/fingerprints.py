"""The mark that each listed effect leaves in a record, drawn over the coordinate in which it shows best.

    python -m benchmarks.fingerprints --out docs/images/effects

One rig is integrated with an effect and once more without any. White noise of the usual sensors is added to what the recorder shows, and
the nominal model, at its true parameters and along the same motion, is taken away: what is left belongs to the effect.
"""

import argparse
import dataclasses
import functools
import io
from collections.abc import Callable
from pathlib import Path

import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure
from PIL import Image

from vibrojax.channels import UNITS, channels
from vibrojax.cli.environment import prepare_jax
from vibrojax.contact import AbstractContactLaw, HuntCrossley, NoContact
from vibrojax.effects import EFFECTS, AbstractEffect
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import SUCCESS, Landing
from vibrojax.model import Model
from vibrojax.suspension import Linear

MASS, GAP = 0.5, 1e-3
SUSPENSION = Linear(damping_ratio=0.02, natural_frequency_hz=5.0)
LAW = HuntCrossley(impact_stiffness=2e6, impact_exponent=1.5, impact_damping=0.3)
BASE = Harmonic(base_amplitude=2e-3, base_phase=0.4, frequency_hz=8.0)
START = (-2e-3, 0.05)
"""u, m; u', m/s."""
NOISE = {"m": 1e-5, "m/s^2": 0.05, "N": 0.15}
"""Standard deviation of a sensor by the unit of its channel."""
_SEED = 7
_MM = 1e3


@dataclasses.dataclass(frozen=True, kw_only=True)
class Run:
    """One record of the rig, SI, each array of shape (samples,)."""

    time: np.ndarray
    u: np.ndarray
    v: np.ndarray
    indentation: np.ndarray
    """Into the stop as the nominal model has it."""
    in_contact: np.ndarray
    recorded: dict[str, np.ndarray]
    nominal: dict[str, np.ndarray]
    """The same channels as the nominal model gives them along this motion."""

    def misfit(self, channel: str) -> np.ndarray:
        """Recorded less nominal, in the channel's unit."""
        return self.recorded[channel] - self.nominal[channel]

    @property
    def missing_force(self) -> np.ndarray:
        """Force on the hammer that the nominal model lacks, N."""
        return MASS * self.misfit("hammer_acceleration")

    @property
    def flight(self) -> np.ndarray:
        """Samples away from the stop in front."""
        return ~self.in_contact & (self.indentation < 0)

    @property
    def touches(self) -> np.ndarray:
        """First sample of each contact."""
        return 1 + np.flatnonzero(~self.in_contact[:-1] & self.in_contact[1:])


Points = tuple[np.ndarray, np.ndarray]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Fingerprint:
    """One picture."""

    effect: dict[str, float | str]
    """Fields of the effect."""
    along: str
    """Label of the abscissa."""
    over: str
    """Label of the ordinate."""
    points: Callable[[Run], Points]
    shows: str
    """What to look for, in a sentence."""
    duration: float = 3.0
    sampling: float = 2.5e-4
    law: AbstractContactLaw = LAW
    lines: bool = False
    """Whether to join the points."""


def over_velocity(run: Run) -> Points:
    """Missing force over u'."""
    return run.v[run.flight], run.missing_force[run.flight]


def over_displacement(run: Run) -> Points:
    """Missing force over u, where the load cell in front is not touched."""
    free = run.indentation < 0
    return _MM * run.u[free], run.missing_force[free]


def over_time(run: Run) -> Points:
    """Missing force in flight over time."""
    return run.time[run.flight], run.missing_force[run.flight]


def after_impacts(channel: str, *, scale: float, window: tuple[float, float]) -> Callable[[Run], Points]:
    """Misfit of a channel over the time since each touch, ms."""

    def points(run: Run) -> Points:
        since, misfit = _since(run, window), scale * run.misfit(channel)
        return 1e3 * since[np.isfinite(since)], misfit[np.isfinite(since)]

    return points


def missing_force_after_impacts(run: Run) -> Points:
    """Missing force in flight over the time since each touch, ms."""
    since = _since(run, (0.0, 0.1))
    chosen = np.isfinite(since) & run.flight
    return 1e3 * since[chosen], run.missing_force[chosen]


def while_leaving(run: Run) -> Points:
    """Missing force over the distance to the stop, mm, on the way back."""
    chosen = run.flight & (run.v < 0) & (run.indentation > -1.2e-3)
    return -_MM * run.indentation[chosen], run.missing_force[chosen]


def beyond_gap(run: Run) -> Points:
    """Missing force over u, mm, all samples."""
    return _MM * run.u, run.missing_force


def cart_over_phase(run: Run) -> Points:
    """Misfit of the cart, um, over the phase of its sine, in turns."""
    return (BASE.frequency_hz * run.time + BASE.base_phase / (2 * np.pi)) % 1.0, 1e6 * run.misfit("cart_displacement")


def cart_over_time(run: Run) -> Points:
    """Misfit of the cart, um, over time."""
    return run.time, 1e6 * run.misfit("cart_displacement")


def touch_over_time(run: Run) -> Points:
    """Where the hammer is when a contact begins, um beyond the gap as set."""
    after = run.touches
    return run.time[after], 1e6 * 0.5 * (run.indentation[after - 1] + run.indentation[after])


def force_over_force(run: Run) -> Points:
    """What the load cell shows over the force of the nominal model."""
    return run.nominal["impact_force"], run.recorded["impact_force"]


def spectrum(run: Run) -> Points:
    """Amplitude of the misfit of the hammer's displacement, um, over frequency."""
    window = np.hanning(len(run.time))
    amplitude = 2 * np.abs(np.fft.rfft(window * run.misfit("hammer_displacement"))) / window.sum()
    frequency = np.fft.rfftfreq(len(run.time), run.time[1] - run.time[0])
    shown = (frequency > 20) & (frequency < 120)
    return frequency[shown], 1e6 * amplitude[shown]


def over_reading(run: Run) -> Points:
    """Misfit of the hammer's displacement, um, over its value, mm."""
    return _MM * run.nominal["hammer_displacement"], 1e6 * run.misfit("hammer_displacement")


def over_rate(run: Run) -> Points:
    """Misfit of the hammer's displacement, um, over its rate, m/s."""
    return np.gradient(run.nominal["hammer_displacement"], run.time), 1e6 * run.misfit("hammer_displacement")


def _since(run: Run, window: tuple[float, float]) -> np.ndarray:
    """Time since the last touch, s; NaN outside the window."""
    starts = run.time[run.touches]
    index = np.searchsorted(starts, run.time, side="right") - 1
    since = np.where(index >= 0, run.time - starts[np.maximum(index, 0)], np.nan)
    return np.where((since >= window[0]) & (since <= window[1]), since, np.nan)


_U, _V, _TIME = "relative displacement u, mm", "relative velocity u', m/s", "time, s"
_MISSING, _TOUCH, _CART = "missing force, N", "place of the touch beyond the gap, µm", "misfit of the cart's motion, µm"
_SINCE, _LOAD_CELL = "time since the touch, ms", "load cell, N"
_HAMMER = "hammer_displacement"

FINGERPRINTS: dict[str, Fingerprint] = {
    "coulomb_friction": Fingerprint(
        effect={"friction_force": 0.15}, along=_V, over=_MISSING, points=over_velocity, shows="A step where the velocity changes sign."
    ),
    "quadratic_drag": Fingerprint(
        effect={"drag_coefficient": 3.0},
        along=_V,
        over=_MISSING,
        points=over_velocity,
        shows="Half a parabola either way, against the motion.",
    ),
    "cubic_stiffness": Fingerprint(
        effect={"cubic_stiffness": 3e6}, along=_U, over=_MISSING, points=over_displacement, shows="A cubic through the place of rest."
    ),
    "constant_force": Fingerprint(
        effect={"constant_force": 0.2},
        along=_TIME,
        over=_MISSING,
        points=over_time,
        shows="A level other than zero, whatever the motion does.",
    ),
    "hysteresis": Fingerprint(
        effect={"hysteresis_force": 0.3, "yield_displacement": 1.5e-3},
        along=_U,
        over=_MISSING,
        points=over_displacement,
        shows="Loops: another branch on the way out than on the way back, whatever the speed.",
    ),
    "stop_compliance": Fingerprint(
        effect={"stop_stiffness": 1e6, "stop_frequency_hz": 400.0, "stop_damping_ratio": 0.05},
        along=_SINCE,
        over="misfit of the load cell, N",
        points=after_impacts("impact_force", scale=1.0, window=(-1e-3, 0.04)),
        sampling=1e-4,
        shows="The load cell rings on after the hammer has left, below zero too.",
    ),
    "contact_adhesion": Fingerprint(
        effect={"adhesion_force": 0.6, "adhesion_reach": 5e-4},
        along="distance to the stop while leaving, mm",
        over=_MISSING,
        points=while_leaving,
        sampling=1e-4,
        shows="A pull that begins at the surface and has ended at the reach, on the way back only.",
    ),
    "back_stop": Fingerprint(
        effect={"distance": 4e-3}, along=_U, over=_MISSING, points=over_displacement, shows="A large push beyond one displacement behind."
    ),
    "base_harmonics": Fingerprint(
        effect={"second_sine": 0.02, "second_cosine": 0.01, "third_sine": 0.015, "third_cosine": 0.0},
        along="phase of the drive, turns",
        over=_CART,
        points=cart_over_phase,
        shows="The same curve in every cycle of the drive.",
    ),
    "cart_recoil": Fingerprint(
        effect={"cart_mass": 5.0, "cart_frequency_hz": 15.0, "cart_damping_ratio": 0.1},
        along=_TIME,
        over=_CART,
        points=lambda run: _until(cart_over_time(run), 1.0),
        shows="A kick at every impact, and a decaying oscillation after it.",
        lines=True,
    ),
    "frequency_drift": Fingerprint(
        effect={"drift_rate": 1e-3},
        along=_TIME,
        over=_CART,
        points=cart_over_time,
        shows="An oscillation at the drive's frequency that grows with the square of time.",
        lines=True,
    ),
    "gap_drift": Fingerprint(
        effect={"gap_rate": 1e-4}, along=_TIME, over=_TOUCH, points=touch_over_time, shows="The touch moves steadily from impact to impact."
    ),
    "gap_step": Fingerprint(
        effect={"gap_jump": 2e-4, "instant": 1.6},
        along=_TIME,
        over=_TOUCH,
        points=touch_over_time,
        shows="The touch jumps at one instant and stays.",
    ),
    "second_mode": Fingerprint(
        effect={"mode_mass": 0.03, "mode_frequency_hz": 30.0, "mode_damping_ratio": 0.03},
        along=_SINCE,
        over=_MISSING,
        points=missing_force_after_impacts,
        shows="An oscillation at a frequency of its own, struck at every impact.",
    ),
    "force_lag": Fingerprint(
        effect={"lag": 8e-4},
        along="force of the model, N",
        over=_LOAD_CELL,
        points=force_over_force,
        sampling=1e-4,
        shows="A loop in place of a straight line: too low while the force rises, too high while it falls.",
        lines=True,
    ),
    "force_clipping": Fingerprint(
        effect={"ceiling": 60.0},
        along="force of the model, N",
        over=_LOAD_CELL,
        points=force_over_force,
        sampling=1e-4,
        shows="A straight line up to the ceiling, and none above.",
    ),
    "mains_hum": Fingerprint(
        effect={"frequency_hz": 50.0, "sine": 1e-5, "cosine": 0.0, "of_channel": _HAMMER},
        along="frequency, Hz",
        over="misfit of the displacement, µm",
        points=spectrum,
        lines=True,
        shows="One line in the spectrum of one channel, at no multiple of the drive.",
    ),
    "missing_stop": Fingerprint(
        effect={"impact_stiffness": 2e6, "impact_exponent": 1.5, "impact_damping": 0.3, "gap_offset": 0.0},
        along=_U,
        over=_MISSING,
        points=beyond_gap,
        law=NoContact(),
        shows="A large push beyond the gap, none before it.",
    ),
    "gain_error": Fingerprint(
        effect={"factor": 1.02, "of_channel": _HAMMER},
        along="displacement of the model, mm",
        over="misfit of the displacement, µm",
        points=over_reading,
        shows="A straight line through the origin, over the channel's own value.",
    ),
    "time_offset": Fingerprint(
        effect={"delay": 3e-4, "of_channel": _HAMMER},
        along="velocity of the model, m/s",
        over="misfit of the displacement, µm",
        points=over_rate,
        shows="A straight line through the origin, over the channel's rate of change.",
    ),
}
"""One for each listed effect."""


def effect_of(name: str) -> AbstractEffect:
    """The effect of a fingerprint, at the strength that the picture shows."""
    return EFFECTS[name](**FINGERPRINTS[name].effect)


def simulate(effects: tuple[AbstractEffect, ...], law: AbstractContactLaw, duration: float, sampling: float) -> Run:
    """A record of the rig with these effects."""
    ts = jnp.arange(0.0, duration, sampling)

    def rig(*acting: AbstractEffect):
        return Model(mass=MASS, suspension=SUSPENSION, law=law, effects=acting).system(gap=GAP, base=BASE, applied=Unforced())

    path = Landing(most_steps=200_000)(rig(*effects), ts, jnp.asarray(START))
    if int(path.result) != SUCCESS:
        raise ArithmeticError(f"the rig with {[effect.name for effect in effects]} was not integrated: result {int(path.result)}")
    plain = dataclasses.replace(path, own=jnp.zeros((len(ts), 0)))
    rng = np.random.default_rng(_SEED)
    shown = {name: np.asarray(values) for name, values in channels(rig(*effects), path).items()}
    return Run(
        time=np.asarray(ts),
        u=np.asarray(path.u),
        v=np.asarray(path.v),
        indentation=np.asarray(path.u) - GAP,
        in_contact=np.asarray(path.in_contact),
        recorded={name: values + NOISE[UNITS[name]] * rng.standard_normal(len(ts)) for name, values in shown.items()},
        nominal={name: np.asarray(values) for name, values in channels(rig(), plain).items()},
    )


@functools.cache
def complete(duration: float, sampling: float) -> Run:
    """The record of the rig without any effect."""
    return simulate((), LAW, duration, sampling)


def draw(name: str) -> Image.Image:
    """The picture of one effect: the record that has it, over the one that has none."""
    mark = FINGERPRINTS[name]
    figure = Figure(figsize=(4.6, 2.7), layout="constrained", dpi=140)
    axes = figure.subplots()
    style = {"linestyle": "-" if mark.lines else "none", "linewidth": 0.8, "marker": "." if not mark.lines else None, "markersize": 2.5}
    with_it = simulate((effect_of(name),), mark.law, mark.duration, mark.sampling)
    axes.plot(*mark.points(complete(mark.duration, mark.sampling)), color="0.7", label="nothing concealed", **style)
    axes.plot(*mark.points(with_it), color="tab:red", label="with the effect", **style)
    axes.set_xlabel(mark.along)
    axes.set_ylabel(mark.over)
    axes.grid(alpha=0.3)
    figure.legend(loc="outside upper right", ncols=2, fontsize="small", markerscale=3, frameon=False)
    picture = io.BytesIO()
    figure.savefig(picture)
    return Image.open(picture).convert("RGB").quantize(48)


def _until(points: Points, end: float) -> Points:
    chosen = points[0] < end
    return points[0][chosen], points[1][chosen]


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fingerprints", description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the pictures, one PNG an effect")
    parser.add_argument("--only", action="append", choices=list(FINGERPRINTS), metavar="NAME", help="this effect; once or more")
    options = parser.parse_args()
    prepare_jax()
    options.out.mkdir(parents=True, exist_ok=True)
    for name in options.only or FINGERPRINTS:
        draw(name).save(options.out / f"{name}.png", optimize=True)
        print(name)


if __name__ == "__main__":
    main()
