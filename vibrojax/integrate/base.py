"""What every integrator is, and what it returns.

To add one: write a file with a final subclass of `AbstractIntegrator` that implements `__call__`, then list it in
`vibrojax/integrate/__init__.py`.
"""

import abc

import equinox as eqx
from jaxtyping import Array, Bool, Float, Int

from vibrojax.system import System

SUCCESS, STEP_LIMIT, NOT_FINITE, CHATTER = 0, 1, 2, 3
RESULT_MESSAGES = {
    SUCCESS: "success",
    STEP_LIMIT: "the step limit was reached (chatter, or steps too short for the record)",
    NOT_FINITE: "the solution is not finite",
    CHATTER: "impacts on the rigid stop accumulate (chatter)",
}


class Trajectory(eqx.Module):
    """Motion of the hammer relative to the cart at the asked-for times."""

    ts: Float[Array, "*batch time"]
    u: Float[Array, "*batch time"]
    """Relative displacement, m."""
    v: Float[Array, "*batch time"]
    """Relative velocity, m/s."""
    in_contact: Bool[Array, "*batch time"]
    approach_speed: Float[Array, "*batch time"]
    """Speed at the last touch before each time, m/s."""
    result: Int[Array, "*batch"]
    """`SUCCESS` or why the solution stops short; later samples are then meaningless."""
    steps: Int[Array, ""]
    """Steps taken."""
    own: Float[Array, "*batch time own"]
    """States of the system's effects; the last axis is empty where they have none."""


class AbstractIntegrator(eqx.Module):
    """A method that takes a system from an initial state along given times."""

    @abc.abstractmethod
    def __call__(self, system: System, ts: Float[Array, " time"], state: Float[Array, " states"]) -> Trajectory:
        """Integrate one trajectory.

        Arguments:
            system: the rig.
            ts: strictly increasing times, s; the first is that of the initial state.
            state: (u, u') at `ts[0]`, in m and m/s, and behind them the states of the system's effects, which start at zero where left out.
        """


def without_effects(system: System, method: str) -> None:
    """Refuse a system with effects where the method does not know them."""
    if system.effects:
        names = ", ".join(effect.name for effect in system.effects)
        raise TypeError(f"{method} does not integrate effects ({names}): use the landing integrator, or a model without them")
