"""The part of the rig that every record shares: hammer, suspension and contact law, with named parameters."""

import dataclasses
from collections.abc import Mapping

import equinox as eqx
from jaxtyping import Array, Float

from vibrojax.contact import AbstractContactLaw
from vibrojax.excitation import AbstractAppliedForce, AbstractBaseMotion
from vibrojax.parameters import Parameter
from vibrojax.suspension import AbstractSuspension
from vibrojax.system import System

Value = float | Float[Array, "..."]

MASS = Parameter(name="m", field="mass", symbol="m", unit="kg", start=1.0, lower=1e-9, upper=1e9, meaning="hammer mass")


class Model(eqx.Module):
    """A hammer on its suspension with the law of its stop.

    What changes from record to record (gap, motion of the cart, applied force) is added by `system`.

    Example:
        >>> from vibrojax.contact import HuntCrossley
        >>> from vibrojax.suspension import Linear
        >>> model = Model(mass=2.0, suspension=Linear(0.02, 5.0), law=HuntCrossley(2.1e8, 1.6, 0.6))
        >>> model.replace({"n": 1.5}).values()["n"]
        1.5
    """

    mass: Value
    """kg"""
    suspension: AbstractSuspension
    law: AbstractContactLaw

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of contact law and suspension, in the order of the tables; the mass is weighed, not listed."""
        return (*self.law.parameters, *self.suspension.parameters)

    def values(self) -> dict[str, Value]:
        """Value of every listed parameter by name, SI."""
        parts = {p.name: self.law for p in self.law.parameters} | {p.name: self.suspension for p in self.suspension.parameters}
        return {p.name: getattr(parts[p.name], p.field) for p in self.parameters}

    def replace(self, values: Mapping[str, Value]) -> "Model":
        """The same model with other parameter values; `m` sets the mass. Unknown names raise `KeyError`."""
        unknown = set(values) - {p.name for p in self.parameters} - {MASS.name}
        if unknown:
            raise KeyError(f"unknown parameters {sorted(unknown)}: this model has {[p.name for p in self.parameters]}")
        return Model(mass=values.get(MASS.name, self.mass), suspension=_with(self.suspension, values), law=_with(self.law, values))

    def system(self, *, gap: Value, base: AbstractBaseMotion, applied: AbstractAppliedForce) -> System:
        """The rig in one record: gap in m, motion of the cart, force on the hammer."""
        return System(mass=self.mass, suspension=self.suspension, law=self.law, gap=gap, base=base, applied=applied)


def _with(part, values: Mapping[str, Value]):
    """The part with those of its parameters that `values` names."""
    return dataclasses.replace(part, **{p.field: values[p.name] for p in part.parameters if p.name in values})
