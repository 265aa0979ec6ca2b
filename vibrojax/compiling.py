"""How programs are compiled that run too little to make up for a long compilation: soon, rather than to the last of their speed."""

from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar, cast

import equinox as eqx
import jax

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")

_TRIED = ((0, 10),)
"""Versions of JAX that are known to have the option; those that do not know an option refuse it."""
_OPTIONS = {"xla_cpu_use_fusion_emitters": False} if jax.__version_info__[:2] in _TRIED else {}
"""Every fused loop costs the newer emitters of XLA a pipeline of MLIR; the older one compiles sooner, and what it makes runs slower."""


def soon_compiled(function: Callable[_Arguments, _Result]) -> Callable[_Arguments, _Result]:
    """Decorator like `equinox.filter_jit`, for programs of which compiling takes as long as running them."""
    return cast(Any, eqx.filter_jit)(function, compiler_options=_OPTIONS)  # its types do not list what it hands on to `jax.jit`
