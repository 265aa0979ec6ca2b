"""The rig under a harmonic cart, as a function of named numbers, and its stroboscopic map: the state some cycles of the cart later."""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax
from jaxtyping import Array, Bool, Float, Int

from vibrojax.contact import NOWHERE, NoContact
from vibrojax.effects.base import AbstractEffect
from vibrojax.errors import InputError
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate.base import NOT_FINITE, STEP_LIMIT, SUCCESS
from vibrojax.integrate.impacts import Push, peak_of_step, push_of
from vibrojax.integrate.landing import Landing, LandingState
from vibrojax.model import MASS, Model
from vibrojax.parameters import Parameter
from vibrojax.shapes import Number
from vibrojax.steps import cubic_top
from vibrojax.system import System

SETTINGS = {"frequency": "frequency_hz", "gap": "gap", "amplitude": "base_amplitude"}
"""What is set on the rig, by name: field of `ForcedRig`."""
UNITS = {"frequency": "Hz", "gap": "m", "amplitude": "m", MASS.name: MASS.unit}
_SYMBOLS = {"frequency": "f", "gap": "gap", "amplitude": "A0", MASS.name: MASS.symbol}
_PHASES = 24
_SAME = 1e-9


class ForcedRig(eqx.Module):
    """A model in front of a stop, its cart driven by y = A0 sin(2 pi f t): all that an orbit depends on.

    Differentiable in every number. Effects must repeat with the cart; `check_settings` refuses those that drift. Faults of a recorder, and
    what acted in one record alone, are left out.

    Arguments:
        model: hammer, suspension, contact law, effects.
        gap: distance of the stop from the hammer at rest, m.
        base_amplitude: A0 > 0, m.
        frequency_hz: f > 0, Hz.

    Example:
        >>> from vibrojax.contact import Hertz
        >>> from vibrojax.suspension import Linear
        >>> rig = ForcedRig(Model(1.0, Linear(0.02, 5.0), Hertz(1e6, 1.5)), gap=1e-3, base_amplitude=1e-3, frequency_hz=8.0)
        >>> float(rig.replace("zeta", 0.05).value("zeta"))
        0.05
    """

    model: Model = eqx.field(converter=lambda model: model.rig)
    gap: Number
    base_amplitude: Number
    frequency_hz: Number

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers that can be varied: settings of the rig, mass, parameters of the model."""
        return (*SETTINGS, MASS.name, *self.model.values())

    @property
    def size(self) -> int:
        """Count of states: u, u' and those of the effects."""
        return 2 + sum(len(effect.own_states) for effect in self.model.effects)

    def value(self, name: str) -> Number:
        """The number of that name, SI (frequency in Hz)."""
        self._check(name)
        if name in SETTINGS:
            return getattr(self, SETTINGS[name])
        return self.model.mass if name == MASS.name else self.model.values()[name]

    def replace(self, name: str, value: Number) -> "ForcedRig":
        """The same rig with another value of one number."""
        self._check(name)
        if name in SETTINGS:
            return dataclasses.replace(self, **{SETTINGS[name]: value})
        return dataclasses.replace(self, model=self.model.replace({name: value}))

    def label(self, name: str) -> str:
        """Symbol and unit of a number, for tables and axes."""
        symbol = _SYMBOLS[name] if name in _SYMBOLS else self._parameter(name).symbol
        return f"{symbol} ({self.unit(name)})"

    def unit(self, name: str) -> str:
        """Unit of a number."""
        return UNITS[name] if name in UNITS else self._parameter(name).unit

    def system(self) -> System:
        """The rig in its equation of motion; time zero is where the cart passes its middle, moving forward."""
        base = Harmonic(base_amplitude=self.base_amplitude, base_phase=jnp.zeros(()), frequency_hz=self.frequency_hz)
        gap = jnp.asarray(NOWHERE) if isinstance(self.model.law, NoContact) else self.gap
        return self.model.system(gap=gap, base=base, applied=Unforced())

    def _parameter(self, name: str) -> Parameter:
        self._check(name)
        return next(p for p in self.model.parameters if p.name == name)

    def _check(self, name: str) -> None:
        if name not in self.names:
            raise InputError(f"unknown parameter {name!r}: expected one of {', '.join(self.names)}")


def as_arrays(rig: ForcedRig) -> ForcedRig:
    """The rig with every number as an array, so that one compiled program serves all values."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=float), rig)


def check_settings(rig: ForcedRig) -> None:
    """Refuse settings that are not possible, and effects that do not repeat with the cart.

    Raises:
        InputError: amplitude, frequency or mass not above zero, a parameter or gap that is not possible, or an effect that drifts from
            cycle to cycle.
    """
    for name in ("amplitude", "frequency"):
        value = float(rig.value(name))
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} is {value:g} {UNITS[name]}: expected a finite number above 0; correct it")
    for p in (MASS, *rig.model.parameters):
        expected = "a number above 0" if p is MASS and float(rig.value(p.name)) <= 0 else p.refusal(float(rig.value(p.name)))
        if expected:
            raise InputError(f"{p.name} is {float(rig.value(p.name)):g}: expected {expected}; correct it")
    if not np.isfinite(float(rig.gap)):
        raise InputError(f"gap is {float(rig.gap)} m: expected a finite number; correct it")
    drifting = [effect.name for effect in rig.model.effects if not _repeats(rig, effect)]
    if drifting:
        raise InputError(
            f"{', '.join(drifting)} does not repeat with the cart: a periodic orbit needs that; take the effect out of the model"
        )


def _repeats(rig: ForcedRig, effect: AbstractEffect) -> bool:
    """Whether all that acts is the same one cycle later, with this effect alone."""
    rig = as_arrays(dataclasses.replace(rig, model=dataclasses.replace(rig.model, effects=(effect,))))
    system, period = rig.system(), 1.0 / rig.frequency_hz
    phases = jnp.arange(_PHASES) / _PHASES
    scale = rig.base_amplitude * jnp.ones(_PHASES)
    own = jnp.zeros((_PHASES, rig.size - 2))
    seen = []
    for cycle in (0.0, 1.0, 7.0):
        t = (phases + cycle) * period
        near = system.approach(t, scale, scale / period, own)
        force = system.forces(t, scale, scale / period, own, jnp.zeros(_PHASES, bool), scale)
        seen.append(np.concatenate([near.indentation / scale, near.rate / scale * period, force.acceleration / scale * period**2]))
    return all(np.allclose(seen[0], later, rtol=_SAME, atol=1e3 * _SAME) for later in seen[1:])


_Scalar = Float[Array, ""]
_Number = Float[Array | np.ndarray, ""]
_SPARE = 3.0
_TOUCH_STEPS = 2000


class Passage(NamedTuple):
    """What an orbit met on its way; without derivatives."""

    touches: Int[Array | np.ndarray, ""]
    slowest_touch: _Number
    """Least approach speed, m/s; infinite without a touch."""
    fastest_touch: _Number
    """Largest approach speed, m/s; zero without a touch."""
    closest: _Number
    """Largest indentation at a turning point in flight, m: minus the clearance of the closest miss; -infinite where none turns."""
    highest: _Number
    """Largest u at the end of a step, m."""
    lowest: _Number
    """Least u at the end of a step, m."""
    peak_force: _Number
    """Largest push of the stop, N (`vibrojax.integrate.impacts`); zero for a rigid stop."""
    starts_in_contact: Bool[Array | np.ndarray, ""]
    result: Int[Array | np.ndarray, ""]
    """A code of `vibrojax.integrate`."""


def strobe(
    landing: Landing, rig: ForcedRig, cycles: Int[Array, ""], state: Float[Array, " states"]
) -> tuple[Float[Array, " states"], Passage]:
    """State after so many cycles of the cart, and what happened on the way.

    P: (u, u', ...) at t = 0 -> the same at t = cycles / f, with y = A0 sin(2 pi f t). A periodic orbit of p cycles is a fixed point of P^p.

    Differentiable (forward mode) in the state and in every number of the rig, the time of each touch included; not at a grazing touch,
    and with a jump of the derivative where an orbit begins to graze. The values are those of the discretised motion, whose error falls
    with the steps of `landing`; its derivative agrees with the derivative of the values to that error.

    Arguments:
        landing: the integrator, whose steps are taken.
        rig: with arrays as numbers (`as_arrays`).
        cycles: p > 0.
        state: (u, u') in m and m/s, and the states of the effects.

    Source: the loop is that of `Landing`, without its history.
    """
    system, t_end = rig.system(), jnp.asarray(cycles, dtype=float) / rig.frequency_hz
    system = jax.tree.map(lambda leaf: jnp.asarray(leaf, dtype=state.dtype), system)
    lane = jax.tree.map(lambda leaf: leaf[None], system)
    start: LandingState = jax.tree.map(lambda leaf: leaf[0], landing.start(lane, jnp.zeros((1, 1)), state[None]))
    limit = _most_steps(landing, lax.stop_gradient(t_end), cycles)

    def unfinished(loop):
        count, carry, *_ = loop
        return (count < limit) & (carry.t < t_end) & jnp.isfinite(carry.u)

    def advance(loop):
        count, carry, passage, push = loop
        after = landing.step(system, t_end, carry)
        felt = push_of(*lax.stop_gradient((system, after)))
        return count + 1.0, after, _seen(system, carry, after, passage, (push, felt)), felt

    nothing = Passage(
        touches=jnp.asarray(0),
        slowest_touch=jnp.asarray(jnp.inf),
        fastest_touch=jnp.asarray(0.0),
        closest=jnp.asarray(-jnp.inf),
        highest=lax.stop_gradient(state[0]),
        lowest=lax.stop_gradient(state[0]),
        peak_force=jnp.asarray(0.0),
        starts_in_contact=start.in_contact,
        result=jnp.asarray(SUCCESS),
    )
    first = push_of(*lax.stop_gradient((system, start)))
    _, last, passage, _ = lax.while_loop(unfinished, advance, (jnp.asarray(0.0), start, nothing, first))
    finite = jnp.isfinite(last.u) & jnp.isfinite(last.v)
    result = jnp.where(finite, jnp.where(last.t >= t_end, SUCCESS, STEP_LIMIT), NOT_FINITE)
    return jnp.concatenate([jnp.stack([last.u, last.v]), last.own]), passage._replace(result=result)


strobe_from = eqx.filter_jit(strobe)
"""`strobe`, compiled."""


@eqx.filter_jit
def linearised(landing: Landing, rig: ForcedRig, name: str, cycles: Int[Array, ""], state: Float[Array, " states"]):
    """End state, its Jacobian with respect to (state, the number called `name`), shape (states, states + 1), and what was met.

    By forward-mode differentiation, all columns in one run.
    """

    def end(z):
        reached, passage = strobe(landing, rig.replace(name, z[-1]), cycles, z[:-1])
        return reached, (reached, passage)

    z = jnp.concatenate([state, jnp.asarray(rig.value(name), dtype=state.dtype)[None]])
    jacobian, (reached, passage) = jax.jacfwd(end, has_aux=True)(z)
    return reached, jacobian, passage


def _most_steps(landing: Landing, t_end: _Scalar, cycles: Int[Array, ""]) -> _Scalar:
    """After how many steps the loop gives up."""
    if landing.most_steps is not None:
        return jnp.asarray(float(landing.most_steps))
    return _SPARE * t_end / landing.flight_step + _TOUCH_STEPS * jnp.asarray(cycles, dtype=float)


def _seen(system: System, before: LandingState, after: LandingState, passage: Passage, pushes: tuple[Push, Push]) -> Passage:
    """What one step adds to the passage."""
    before, after, system = lax.stop_gradient((before, after, system))
    taken = ~after.landing
    landed = before.landing & taken
    touch = landed & ~before.in_contact
    old = system.approach(before.t, before.u, before.v, before.own)
    new = system.approach(after.t, after.u, after.v, after.own)
    turns = taken & ~landed & ~before.in_contact & (old.rate > 0) & (new.rate <= 0)
    h = after.t - before.t
    top = cubic_top(old.indentation, h * old.rate, new.indentation, h * new.rate)
    speed = after.approach_speed
    return passage._replace(
        touches=passage.touches + touch.astype(int),
        slowest_touch=jnp.where(touch, jnp.minimum(passage.slowest_touch, speed), passage.slowest_touch),
        fastest_touch=jnp.where(touch, jnp.maximum(passage.fastest_touch, speed), passage.fastest_touch),
        closest=jnp.where(turns, jnp.maximum(passage.closest, top), passage.closest),
        highest=jnp.maximum(passage.highest, after.u),
        lowest=jnp.minimum(passage.lowest, after.u),
        peak_force=jnp.maximum(passage.peak_force, peak_of_step(*pushes, h)),
    )
