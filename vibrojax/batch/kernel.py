"""A chunk of lanes as one GPU kernel.

XLA runs a loop over all lanes as a row of kernels a step, each of which reads and writes every number of every lane, and all lanes wait for
the last. In one kernel each block of lanes runs its own loops, in registers. Pallas makes the kernel of the same `advance`.
"""

from typing import Any

import jax
import jax.numpy as jnp
from jax.experimental import pallas as pl

from vibrojax.batch.base import TABLES, AbstractEngine, Cycles, LaneState
from vibrojax.compiling import in_kernel

BLOCK = 64
"""Lanes in a block: two warps. The chunk is a multiple of it."""
MOST_LANES = 2**17
"""In one chunk on a GPU: several times what an H100 keeps in its registers at a time."""


def in_one_kernel(
    engine: AbstractEngine, form: Any, cycles: int | None, recorded: int, rigs: jax.Array, state: jax.Array, *, interpret: bool = False
) -> tuple[jax.Array, Cycles]:
    """What `engine.advance` does, block by block; effects have no states of their own here.

    Arguments:
        engine: one whose `in_kernel` says that Pallas lowers it.
        form: tree of the `Lanes` whose leaves are in `rigs`.
        cycles: see `AbstractEngine.advance`; None where they are the last row of the state.
        recorded: the same.
        rigs: one row a leaf, `(rows, lanes)`.
        state: as `vibrojax.batch.packed` lays it out, `(6, lanes)`, and one row more without `cycles`.
        interpret: run the kernel as ordinary operations, on any device, to check it.

    Returns:
        The state, laid out as it came, and what happened.

    Raises:
        NotImplementedError: when it is lowered, for operations that Pallas does not lower.
    """
    lanes, dtype = rigs.shape[1], rigs.dtype
    rows = pl.next_power_of_2(recorded)  # as the engine's tables have, since shapes in a kernel are powers of two

    def block(rigs_ref, state_ref, after_ref, u, v, impacts, peak_force, impact_speed, u_max, result):
        given = [state_ref[row, :] for row in range(state.shape[0])]
        nothing = jnp.zeros((BLOCK, 0), dtype)
        before = LaneState(given[0], given[1], given[2] > 0.5, given[3], given[4], (given[5] + 0.5).astype(int), nothing)
        lanes_here = jax.tree.unflatten(form, [rigs_ref[row, :] for row in range(rigs.shape[0])])
        with in_kernel():
            after, what = engine.advance(lanes_here, before, (given[6] + 0.5).astype(int) if cycles is None else cycles, recorded)
        for row, values in enumerate(after[:6]):
            after_ref[row, :] = values.astype(dtype)
        for into, name in zip((u, v, impacts, peak_force, impact_speed), TABLES, strict=True):
            into[...] = getattr(what, name)
        u_max[...], result[...] = what.u_max, what.result

    def laid_out(*shape: int, kind: Any = dtype) -> tuple[jax.ShapeDtypeStruct, pl.BlockSpec]:
        at = (lambda number: (0, number)) if len(shape) == 2 else (lambda number: (number,))
        return jax.ShapeDtypeStruct(shape, kind), pl.BlockSpec((*shape[:-1], BLOCK), at)

    count = jnp.asarray(0).dtype
    table, row = (rows, lanes), (lanes,)
    shapes = [laid_out(6, lanes), *(laid_out(*table, kind=kind) for kind in (dtype, dtype, count, dtype, dtype))]
    shapes += [laid_out(*row), laid_out(*row, kind=count)]
    call = pl.pallas_call(
        block,
        grid=(lanes // BLOCK,),
        in_specs=[laid_out(*rigs.shape)[1], laid_out(*state.shape)[1]],
        out_specs=[spec for _, spec in shapes],
        out_shape=[shape for shape, _ in shapes],
        interpret=interpret,
        **({} if interpret else {"compiler_params": _as_triton()}),
    )
    after, *what = call(rigs, state)
    return after, Cycles(*what)


def _as_triton() -> Any:
    """Pallas has two ways to a GPU; this is the one that takes float64."""
    from jax.experimental.pallas import triton

    return triton.CompilerParams(num_warps=BLOCK // 32, num_stages=1)
