"""Options of the compiler: for programs that run briefly, a short compilation; for programs that run long, wide vectors."""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import equinox as eqx
import jax

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")

_VERSION = jax.__version_info__[:2]
"""Of JAX; one that does not know an option refuses it. Tried: 0.10.2, 0.11.2 and 0.12.0."""
_SOON = {"xla_cpu_use_fusion_emitters": False} if _VERSION == (0, 10) else {}
"""Every fused loop costs the newer emitters of XLA a pipeline of MLIR; the older one compiles sooner, and what it makes runs slower."""
LONG = {"xla_cpu_prefer_vector_width": 512} if (0, 10) <= _VERSION <= (0, 12) else {}
"""XLA takes 256 bits by default; processors that have no 512 run two halves."""


def soon_compiled(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Decorator like `equinox.filter_jit`, for programs of which compiling takes as long as running them."""
    return cast(Any, eqx.filter_jit)(function, compiler_options=_SOON)  # its types do not list what it hands on to `jax.jit`


def compiled_for_long_runs(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Decorator like `equinox.filter_jit`, for programs that loop over the same short arrays for seconds."""
    return cast(Any, eqx.filter_jit)(function, compiler_options=LONG)
