"""Rigs described twice: for the package, and for the oracle that shares no code with it."""

from collections.abc import Callable, Mapping

import numpy as np

from benchmarks import oracle
from vibrojax.contact import (
    AbstractContactLaw,
    Flores,
    Hertz,
    HuntCrossley,
    HuntCrossleySeparate,
    KelvinVoigt,
    KelvinVoigtClipped,
    LankaraniNikravesh,
    Newton,
)
from vibrojax.excitation import AbstractAppliedForce, Harmonic
from vibrojax.shapes import Scalars, Value
from vibrojax.suspension import Linear
from vibrojax.system import System


class ConstantForce(AbstractAppliedForce):
    """A force that never changes, such as a tilt's share of the weight."""

    newtons: Value

    def force(self, t: Scalars) -> Scalars:
        return self.newtons + 0.0 * t


RIG = dict(mass=0.5, zeta=0.02, f_n=4.0, gap=1e-3, base_amplitude=2e-3, base_phase=0.3, frequency_hz=6.0, applied=0.3)
STATE = dict(u0=-5e-4, v0=0.03)
DROP = RIG | dict(base_amplitude=0.0, gap=0.0, f_n=3.0, applied=0.0)
DROP_STATE = dict(u0=-5e-3, v0=0.0)

LAWS: dict[str, tuple[dict[str, float], Callable[..., AbstractContactLaw]]] = {
    "hunt-crossley": (dict(k_i=1e6, n=1.5, lambda_i=0.3), HuntCrossley),
    "hunt-crossley-separate": (dict(k_i=1e6, n=1.5, lambda_i=1e-2, n_2=1.0), HuntCrossleySeparate),
    "hertz": (dict(k_i=1e6, n=1.5), Hertz),
    "kelvin-voigt": (dict(k_i=2e5, lambda_i=3e-4), KelvinVoigt),
    "kelvin-voigt-clipped": (dict(k_i=2e5, lambda_i=3e-4), KelvinVoigtClipped),
    "lankarani-nikravesh": (dict(k_i=1e6, n=1.5, e=0.8), LankaraniNikravesh),
    "flores": (dict(k_i=1e6, n=1.5, e=0.8), Flores),
    "newton": (dict(e=0.8), Newton),
}


def system(p: Mapping[str, float], law: str) -> System:
    """The rig for the package; `p` may hold tracers."""
    fields = {parameter.field: p[parameter.name] for parameter in LAWS[law][1].parameters if parameter.name in p}
    return System(
        mass=p["mass"],
        suspension=Linear(damping_ratio=p["zeta"], natural_frequency_hz=p["f_n"]),
        law=LAWS[law][1](**fields),
        gap=p["gap"],
        base=Harmonic(base_amplitude=p["base_amplitude"], base_phase=p["base_phase"], frequency_hz=p["frequency_hz"]),
        applied=ConstantForce(p["applied"]),
    )


def _force(p: Mapping[str, float], law: str) -> Callable[[float, float, float], float] | None:
    if law == "newton":
        return None
    if law == "kelvin-voigt":
        return oracle.kelvin_voigt(p["k_i"], p["k_i"] * p["lambda_i"])
    if law == "kelvin-voigt-clipped":
        return lambda delta, rate, _: p["k_i"] * max(delta + p["lambda_i"] * rate, 0.0)
    if law == "hunt-crossley-separate":
        return lambda delta, rate, _: p["k_i"] * max(max(delta, 0) ** p["n"] + p["lambda_i"] * max(delta, 0) ** p["n_2"] * rate, 0.0)
    if law == "lankarani-nikravesh":
        return lambda delta, rate, v0: oracle.hunt_crossley(p["k_i"], p["n"], 0.75 * (1 - p["e"] ** 2) / v0)(delta, rate, v0)
    if law == "flores":
        return lambda delta, rate, v0: oracle.hunt_crossley(p["k_i"], p["n"], 1.6 * (1 - p["e"]) / p["e"] / v0)(delta, rate, v0)
    return oracle.hunt_crossley(p["k_i"], p["n"], p.get("lambda_i", 0.0))


def oracle_motion(p: Mapping[str, float], law: str, ts: np.ndarray, **options) -> oracle.Motion:
    """Motion of the same rig by the oracle."""
    names = ("mass", "zeta", "f_n", "gap", "base_amplitude", "base_phase", "frequency_hz", "applied")
    rig = oracle.Rig(**{name: p[name] for name in names}, force=_force(p, law), restitution=p.get("e", 1.0))
    return oracle.motion(rig, ts, (p["u0"], p["v0"]), **options)
