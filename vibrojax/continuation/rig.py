"""The rig under a harmonic cart, as a function of named numbers."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from vibrojax.contact import NoContact
from vibrojax.contact.no_contact import NOWHERE
from vibrojax.effects.base import AbstractEffect
from vibrojax.errors import InputError
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.model import MASS, Model
from vibrojax.parameters import Parameter
from vibrojax.shapes import Number
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

    def period(self, cycles: Int[Array, ""]) -> Float[Array, ""]:
        """Duration of so many cycles of the cart, s."""
        return jnp.asarray(cycles, dtype=float) / self.frequency_hz

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
    system, period = rig.system(), rig.period(jnp.asarray(1))
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
