"""Options of the compiler: for programs that run briefly, a short compilation; for programs that run long, wide vectors."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, ParamSpec, TypeVar, cast

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.experimental.xla_metadata import set_xla_metadata

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")

_VERSION = jax.__version_info__[:2]
"""Of JAX; one that does not know an option refuses it. Tried: 0.10.2, 0.11.2 and 0.12.0."""
_SOON = {"xla_cpu_use_fusion_emitters": False} if _VERSION == (0, 10) else {}
"""Every fused loop costs the newer emitters of XLA a pipeline of MLIR; the older one compiles sooner, and what it makes runs slower."""
LONG = {"xla_cpu_prefer_vector_width": 512} if (0, 10) <= _VERSION <= (0, 12) else {}
"""XLA takes 256 bits by default; processors that have no 512 run two halves."""
_ONE = {"inlineable": "false", "xla_cpu_small_call": "true"} if _VERSION == (0, 10) else {}
"""By this XLA marks small loops that it compiles as one function. Tried: 0.10.2."""
_IN_KERNEL = ContextVar("in_kernel", default=False)


def as_one_function(function: Callable[..., _Result]) -> Callable[..., _Result]:
    """Decorator for a loop within a compiled program: on a CPU it becomes one function of machine code.

    Else XLA calls a function for every fused operation, which takes as long as its arithmetic on some hundred numbers. What the loop
    closes over has to be an argument, too: arrays of real numbers, booleans, or integers below 2^53 (2^24 in single precision), since all
    go in as one array of floats. XLA aborts over an argument that a loop has no use for.
    """

    def called(*given: Any) -> _Result:
        if not _ONE or _IN_KERNEL.get() or jax.default_backend() != "cpu":
            return function(*given)
        leaves, form = jax.tree.flatten(given)
        leaves = [jnp.asarray(leaf) for leaf in leaves]
        ends = np.cumsum([leaf.size for leaf in leaves])

        @jax.jit
        def inside(together: jax.Array) -> _Result:
            with set_xla_metadata(**dict.fromkeys(_ONE)):  # of the call alone
                parts = [together[end - leaf.size : end] for leaf, end in zip(leaves, ends, strict=True)]
                shaped = [part.reshape(leaf.shape).astype(leaf.dtype) for leaf, part in zip(leaves, parts, strict=True)]
                return function(*jax.tree.unflatten(form, shaped))

        together = jnp.concatenate([leaf.ravel().astype(float) for leaf in leaves])
        with set_xla_metadata(**_ONE):
            return inside(together)

    return called


@contextmanager
def in_kernel() -> Iterator[None]:
    """Where Pallas lowers what is traced, loops stay as they are."""
    before = _IN_KERNEL.set(True)
    try:
        yield
    finally:
        _IN_KERNEL.reset(before)


def soon_compiled(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Decorator like `equinox.filter_jit`, for programs that take as long to compile as to run."""
    return cast(Any, eqx.filter_jit)(function, compiler_options=_SOON)  # its types do not list what it hands on to `jax.jit`


def compiled_for_long_runs(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Decorator like `equinox.filter_jit`, for programs that loop over the same short arrays for seconds."""
    return cast(Any, eqx.filter_jit)(function, compiler_options=LONG)
