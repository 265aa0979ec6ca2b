"""The part of the rig that every record shares: hammer, known load, suspension, contact law and effects, with named parameters."""

import dataclasses
import math
from collections.abc import Callable, Mapping

import equinox as eqx
import jax
import jax.numpy as jnp
from scipy.constants import g as STANDARD_GRAVITY

from vibrojax.contact import AbstractContactLaw, NoContact
from vibrojax.effects.base import AbstractEffect, unit_in
from vibrojax.effects.filters import RecorderFilter
from vibrojax.excitation import AbstractAppliedForce, AbstractBaseMotion
from vibrojax.parameters import Parameter
from vibrojax.shapes import Number, Value
from vibrojax.suspension import AbstractSuspension
from vibrojax.system import System


class Load(eqx.Module):
    """Constant forces on the hammer that are known, not estimated; positive towards the stop, as displacements and forces are.

    F = m g sin(incline) + constant_force, with g = 9.80665 m/s^2. It enters the equation of motion of every suspension as an applied force
    does, along the displacement. What is not known of it is the effect `constant_force`.

    Arguments:
        incline: angle of the rail to the horizontal, rad; positive where the stop lies downhill.
        constant_force: N.

    Example:
        >>> round(float(Load(incline=0.1, constant_force=-0.2).force(2.0)), 4)
        1.7581
    """

    incline: Value = 0.0
    constant_force: Value = 0.0

    @property
    def acts(self) -> bool:
        """Whether there is any; needs concrete values."""
        return bool(self.incline != 0.0 or self.constant_force != 0.0)

    def force(self, mass: Value) -> Value:
        """The sum, N, on a hammer of that mass, kg."""
        sine = math.sin(self.incline) if isinstance(self.incline, float) else jnp.sin(self.incline)
        return mass * STANDARD_GRAVITY * sine + self.constant_force


MASS = Parameter(name="m", field="mass", symbol="m", unit="kg", start=1.0, lower=1e-9, upper=1e9, meaning="hammer mass")


class Model(eqx.Module):
    """A hammer on its suspension with the law of its stop, and the effects beyond them.

    What changes from record to record (gap, motion of the cart, applied force) is added by `system`. Parameters of an effect carry its
    name: `coulomb_friction.friction_force`.

    Example:
        >>> from vibrojax.contact import HuntCrossley
        >>> from vibrojax.suspension import Linear
        >>> model = Model(mass=2.0, suspension=Linear(0.02, 5.0), law=HuntCrossley(2.1e8, 1.6, 0.6))
        >>> model.replace({"n": 1.5}).values()["n"]
        1.5
    """

    mass: Number
    """kg"""
    suspension: AbstractSuspension
    law: AbstractContactLaw
    effects: tuple[AbstractEffect, ...] = ()
    load: Load = Load()
    """Known constant forces: gravity along an incline, and others."""
    recorder: tuple[RecorderFilter, ...] = ()
    """Known filters, in the order in which readings pass them."""

    @property
    def acting(self) -> tuple[AbstractEffect, ...]:
        """Effects and known filters, in the order of their own states."""
        return (*self.effects, *self.recorder)

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of contact law, suspension and effects that all records share; the mass is weighed, not listed."""
        return (*self.law.parameters, *self.suspension.parameters, *(p for p in self._of_effects() if not p.per_record))

    @property
    def record_parameters(self) -> tuple[Parameter, ...]:
        """Parameters of effects that have a value for each record."""
        return tuple(p for p in self._of_effects() if p.per_record)

    def values(self) -> dict[str, Number]:
        """Number of every parameter by name, SI."""
        return {p.name: getattr(part, p.field) for part in (self.law, self.suspension, *self.effects) for p in _named(part)}

    def replace(self, values: Mapping[str, Number]) -> "Model":
        """The same model with other parameter values; `m` sets the mass. Unknown names raise `KeyError`."""
        known = self.values()
        if unknown := set(values) - set(known) - {MASS.name}:
            raise KeyError(f"unknown parameters {sorted(unknown)}: this model has {list(known)}")
        return Model(
            mass=values.get(MASS.name, self.mass),
            suspension=_with(self.suspension, values),
            law=_with(self.law, values),
            effects=tuple(_with(effect, values) for effect in self.effects),
            load=self.load,
            recorder=self.recorder,
        )

    def as_arrays(self) -> "Model":
        """The same model with array leaves, so that compiled code does not depend on its values."""
        arrays = jax.tree.map(jnp.asarray, eqx.filter(self, eqx.is_inexact_array_like))
        return eqx.combine(arrays, self)

    @property
    def has_stop(self) -> bool:
        """Whether there is one, of the model's own law or of an effect."""
        return not isinstance(self.stop(0.0)[0], NoContact)

    def stop(self, gap: Number) -> tuple[AbstractContactLaw, Number]:
        """Contact law and gap, m, as the effects have them."""
        law = self.law
        for effect in self.effects:
            law, gap = effect.stop(law, gap)
        return law, gap

    def system(self, *, gap: Number, base: AbstractBaseMotion, applied: AbstractAppliedForce) -> System:
        """The rig in one record: gap in m, motion of the cart, force on the hammer."""
        law, gap = self.stop(gap)
        for effect in self.effects:
            base = effect.base(base)
        return System(
            mass=self.mass,
            suspension=self.suspension,
            law=law,
            gap=gap,
            base=base,
            applied=applied,
            effects=self.acting,
            load=self.load.force(self.mass),
        )

    def in_record(self, acts: Callable[[str], Number]) -> "Model":
        """The model as it is in one record: effects at home in a single one are on, 1, or off, 0, as `acts` says of its file."""
        effects = tuple(effect if effect.record is None else effect.scaled(acts(effect.record)) for effect in self.effects)
        return dataclasses.replace(self, effects=effects)

    @property
    def rig(self) -> "Model":
        """The rig by itself, as it moves in no record: without the faults of a recorder, and without what acted in one record alone."""
        effects = tuple(effect for effect in self.effects if not effect.is_fault and effect.record is None)
        return dataclasses.replace(self, effects=effects, recorder=())

    def _of_effects(self) -> tuple[Parameter, ...]:
        return tuple(p for effect in self.effects for p in _named(effect))


def _named(part: AbstractContactLaw | AbstractSuspension | AbstractEffect) -> tuple[Parameter, ...]:
    """Parameters of a part of the model under the names that they have in the whole, in the units of their channel."""
    if not isinstance(part, AbstractEffect):
        return part.parameters
    return tuple(dataclasses.replace(p, name=f"{part.name}.{p.name}", unit=unit_in(p.unit, part.channel)) for p in part.parameters)


def _with(part, values: Mapping[str, Number]):
    """The part with those of its parameters that `values` names."""
    return dataclasses.replace(part, **{p.field: values[p.name] for p in _named(part) if p.name in values})
