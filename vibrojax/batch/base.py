"""What every batch engine is: it takes many lanes, each a rig with a periodically driven cart, on by whole cycles of excitation.

A lane's state is known at strobes, the instants t = 0, T, 2 T, ... with T the period of its excitation. What happens in a cycle is
reduced to a few numbers on the way, so that memory does not grow with the number of cycles behind a lane.

To add one: write a file with a final subclass of `AbstractEngine` that gives `name` and implements `unfit` and `advance`, then list it in
`vibrojax/batch/__init__.py`.
"""

import abc
from typing import ClassVar, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from vibrojax.system import System

Count = int | Int[Array, " lanes"]
"""Cycles: as many of all lanes, or each lane's own."""


class Lanes(NamedTuple):
    """Rigs side by side."""

    systems: System
    """One system with a leading lane axis on every array leaf."""
    frequency_hz: Float[Array, " lanes"]
    """Of the excitation; a cycle lasts 1 / frequency, strobes are at whole cycles."""


class LaneState(NamedTuple):
    """Where every lane is at a strobe."""

    u: Float[Array, " lanes"]
    """m"""
    v: Float[Array, " lanes"]
    """m/s"""
    in_contact: Bool[Array, " lanes"]
    approach_speed: Float[Array, " lanes"]
    """Speed at the last touch, m/s."""
    since_touch: Float[Array, " lanes"]
    """Time since the last touch where in contact, s."""
    cycle: Int[Array, " lanes"]
    """Cycles behind the lane."""
    own: Float[Array, "lanes own"]
    """States of the system's effects."""


class Cycles(NamedTuple):
    """What happened in each of the recorded cycles, which are the first rows of each table, and over all of a call to `advance`."""

    u: Float[Array, "rows lanes"]
    """At the strobe that ends the cycle, m."""
    v: Float[Array, "rows lanes"]
    """m/s"""
    impacts: Int[Array, "rows lanes"]
    """Touches that began in the cycle."""
    peak_force: Float[Array, "rows lanes"]
    """Largest push of the stop in front, N; 0 without impact, and of a rigid stop. A contact at the strobe counts in both cycles, with
    its part in each."""
    impact_speed: Float[Array, "rows lanes"]
    """Largest approach speed of the touches of the cycle, m/s; 0 without impact."""
    u_max: Float[Array, " lanes"]
    """Largest displacement in the recorded cycles, m; see `Responses.u_max`."""
    result: Int[Array, " lanes"]
    """A code of `vibrojax.integrate.base`: `SUCCESS`, or why the lane stopped short."""


TABLES = ("u", "v", "impacts", "peak_force", "impact_speed")
"""Those of `Cycles` with a row a recorded cycle."""


def numbered(cycles: Count, recorded: int, lanes: int) -> Int[Array, "rows lanes"]:
    """Which of its cycles each lane is in, row by row, so that all end with the last; a lane waits while its number is negative."""
    rows = cycles if isinstance(cycles, int) else recorded
    return jnp.arange(rows)[:, None] + jnp.broadcast_to(cycles - rows, (1, lanes))


class AbstractEngine(eqx.Module):
    """A method that advances many lanes at once."""

    name: eqx.AbstractClassVar[str]
    """Name in a data set's provenance."""
    in_kernel: ClassVar[bool] = False
    """Whether a GPU can run `advance` as one kernel (`vibrojax.batch.kernel`): Pallas lowers its operations, the tables have the next power
    of two of rows, and the rigs have no effects."""

    @abc.abstractmethod
    def unfit(self, lanes: Lanes) -> str | None:
        """Why it cannot integrate these rigs; None where it can. Needs concrete values."""

    @abc.abstractmethod
    def advance(self, lanes: Lanes, state: LaneState, cycles: Count, recorded: int) -> tuple[LaneState, Cycles]:
        """Take every lane on by so many whole cycles of its own excitation.

        Arguments:
            lanes: the rigs.
            state: of every lane at a strobe.
            cycles: how many; this and the next are static numbers: a program is compiled for each pair. Or an array: how many of
                each lane, from 1 to `recorded`.
            recorded: how many of them, the last ones, are handed back; the tables may have more rows, which mean nothing.
        """
