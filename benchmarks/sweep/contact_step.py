"""What a contact step costs, against the arithmetic that it consists of."""

import time
from collections.abc import Callable
from typing import Any, cast

import jax
import jax.numpy as jnp
from jax import lax

from benchmarks.sweep.problem import Problem
from vibrojax.batch import grid
from vibrojax.batch.contact_steps import Contact, contact_step, touching
from vibrojax.batch.linear_flow import flow_of, take_off
from vibrojax.batch.points import lanes_of
from vibrojax.compiling import as_one_function, compiled_for_long_runs
from vibrojax.contact import AbstractCompliantLaw

_LANES, _STEPS, _REPEATS = 64, 9.0, 20_000
"""Lanes side by side as `integrate` takes them; steps in an impact; steps that are timed."""
_CHAINS, _LINKS = 8, 16
"""Independent chains of multiplications and additions, which keep the processor's vector units busy, and the length of each."""


def contact_cost(problem: Problem) -> dict[str, float]:
    """Of one step of one lane on one core: nanoseconds, operations, exponentials and roots, and its rate beside that of bare arithmetic.

    Operations are counted by XLA's own analysis of one step: additions, multiplications, divisions, comparisons and selections,
    those of the logarithms among them; exponentials and roots are counted apart.
    """
    frequencies = problem.frequencies[:_LANES]
    lanes, _ = lanes_of(problem.model, grid({"frequency_hz": frequencies}, base_amplitude=problem.base_amplitude, gap=problem.gap))
    flow, law, mass = flow_of(lanes.systems), cast(AbstractCompliantLaw, lanes.systems.law), jnp.asarray(lanes.systems.mass)
    nothing, speed = jnp.zeros(_LANES), jnp.linspace(0.05, 0.1, _LANES)
    flight = take_off(flow, flow.gap, speed, jnp.linspace(0.5, 2.0, _LANES))
    begin = Contact(
        u=flow.gap + nothing,
        v=speed,
        theta=flight.theta,
        drive=flow.drive_sine * flight.sine + flow.drive_cosine * flight.cosine,
        drive_quarter=flow.drive_sine * flight.cosine - flow.drive_cosine * flight.sine,
        **dict.fromkeys(("since_touch", "force", "slope", "h", "peak", "u_max"), nothing),
    )

    def one(flow: Any, touch: Any, at: Contact, moves: Any):
        return contact_step(flow, touch, at, moves, _STEPS)

    @compiled_for_long_runs
    @as_one_function
    def many(flow: Any, law: Any, mass: Any, begin: Contact):
        touch = touching(law, mass, begin.v, _STEPS)

        def onward(loop: Any):
            number, at, moves = loop
            at, left, strobes = one(flow, touch, at, moves)
            again = number % int(_STEPS) == 0  # every impact anew
            return number + 1, jax.tree.map(lambda first, now: jnp.where(again, first, now), begin, at), moves | left | strobes

        return lax.while_loop(
            lambda loop: (loop[0] < _REPEATS) & (jnp.max(loop[2].astype(int)) > 0), onward, (1, begin, jnp.ones(_LANES, dtype=bool))
        )

    touch = touching(law, mass, speed, _STEPS)
    counted = jax.jit(one).lower(flow, touch, begin, jnp.ones(_LANES, dtype=bool)).compile().cost_analysis() or {}
    seconds = _fastest(lambda: many(flow, law, mass, begin)) / _REPEATS
    operations = counted.get("flops", float("nan")) / _LANES
    return {
        "nanoseconds": 1e9 * seconds / _LANES,
        "operations": operations,
        "exponentials_and_roots": counted.get("transcendentals", float("nan")) / _LANES,
        "operations_per_second": operations * _LANES / seconds,
        "bare_operations_per_second": _bare_rate(),
    }


def _bare_rate() -> float:
    """Operations a second of multiplications and additions alone, of as many lanes."""

    @compiled_for_long_runs
    def chains(x: jax.Array):
        def onward(loop: Any):
            number, x = loop
            parts = [x + 0.1 * part for part in range(_CHAINS)]
            for _ in range(_LINKS):
                parts = [part * 0.999 + 1e-3 for part in parts]
            return number + 1, sum(parts[1:], parts[0]) / _CHAINS

        return lax.while_loop(lambda loop: loop[0] < _REPEATS, onward, (0, x))

    return 2.0 * _CHAINS * _LINKS * _LANES * _REPEATS / _fastest(lambda: chains(jnp.linspace(0.0, 1.0, _LANES)))


def _fastest(work: Callable[[], Any]) -> float:
    jax.block_until_ready(work())
    times = []
    for _ in range(3):
        begin = time.perf_counter()
        jax.block_until_ready(work())
        times.append(time.perf_counter() - begin)
    return min(times)
