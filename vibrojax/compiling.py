"""How programs are compiled that run a few times only: soon, rather than to the last percent of their speed."""

from functools import partial

import equinox as eqx
import jax

_TRIED = ((0, 10),)
"""Versions of JAX that are known to have the option; those that do not know an option refuse it."""
_OPTIONS = {"xla_cpu_use_fusion_emitters": False} if jax.__version_info__[:2] in _TRIED else {}
"""Every fused loop costs the newer emitters of XLA a pipeline of MLIR; the older one compiles in half the time and is up to half slower."""

soon_compiled = partial(eqx.filter_jit, compiler_options=_OPTIONS)
"""Decorator like `equinox.filter_jit`, for what is run a few times for each time that it is compiled."""
