"""A model run for a given time: every channel that a sensor could read."""

import equinox as eqx
import jax.numpy as jnp
from jax.core import Tracer
from jaxtyping import Array, Float

from vibrojax.channels import channels
from vibrojax.errors import InputError
from vibrojax.excitation import AbstractAppliedForce, AbstractBaseMotion, Unforced, at_rest
from vibrojax.integrate import SUCCESS, AbstractIntegrator, Landing
from vibrojax.model import Model


def simulate(
    model: Model,
    ts: Float[Array, " time"],
    *,
    gap: float,
    base: AbstractBaseMotion | None = None,
    applied: AbstractAppliedForce | None = None,
    y0: Float[Array, " state"] | None = None,
    integrator: AbstractIntegrator | None = None,
) -> dict[str, Float[Array, " time"]]:
    """Readings of the model at the times `ts`, s; differentiable, and inside `jax.jit` and `jax.vmap` too.

    Args:
        model: of the rig.
        ts: increasing; the first is when the motion begins.
        gap: from the hammer at rest to the stop, m.
        base: motion of the cart; at rest if None.
        applied: force on the hammer; none if None.
        y0: displacement u in m and velocity u' in m/s with which the hammer begins, relative to the cart; at rest if None.
        integrator: `Landing`, which steps onto every touch and release, if None.

    Returns:
        By name, SI: displacements, accelerations and forces.

    Raises:
        InputError: times that do not increase, a gap that is no number, an initial state that is not two numbers.
        equinox.EquinoxRuntimeError: the integration fails.

    Example:
        >>> from vibrojax import HuntCrossley, Linear, Model
        >>> law = HuntCrossley(impact_stiffness=3e6, impact_exponent=1.5, impact_damping=0.3)
        >>> rig = Model(mass=0.4, suspension=Linear(damping_ratio=0.01, natural_frequency_hz=5.0), law=law)
        >>> drop = simulate(rig, jnp.linspace(0.0, 0.2, 2001), gap=0.0, y0=jnp.array([-0.01, 0.0]))
        >>> bool(drop["impact_force"].max() > 10.0)
        True
    """
    begin = jnp.zeros(2) if y0 is None else jnp.asarray(y0)
    _check(ts, begin, gap)
    system = model.system(gap=gap, base=at_rest() if base is None else base, applied=Unforced() if applied is None else applied)
    trajectory = (Landing() if integrator is None else integrator)(system, ts, begin)
    trajectory = eqx.error_if(
        trajectory, trajectory.result != SUCCESS, "the model cannot be integrated: ask for a shorter time or other steps"
    )
    return channels(system, trajectory)


def _check(ts: Float[Array, " time"], y0: Float[Array, "..."], gap: float) -> None:
    """Refuse what is known to be wrong before anything is traced."""
    if ts.ndim != 1 or len(ts) < 2 or not jnp.issubdtype(ts.dtype, jnp.floating):
        raise InputError(f"ts is of shape {ts.shape} and type {ts.dtype}: expected two times or more, floats, in s")
    if y0.shape != (2,):
        raise InputError(f"y0 is of shape {y0.shape}: expected displacement (m) and velocity (m/s)")
    if not isinstance(ts, Tracer) and not bool(jnp.all(jnp.diff(ts) > 0)):
        raise InputError("ts does not increase: expected increasing times, s")
    if not isinstance(gap, Tracer) and not jnp.isfinite(gap):
        raise InputError(f"the gap is {gap}: expected a number, m")
