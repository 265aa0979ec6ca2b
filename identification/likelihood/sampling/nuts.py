"""Chains of the No-U-Turn Sampler, as many at a time as there are cores. Needs the extra `bayes`."""

import dataclasses
import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import lax

from vibrojax.errors import InputError, NoConvergenceError

_TARGET = 0.9
"""Wanted rate of acceptance: at 0.8 chains reach too rarely into the narrow end of a curved density."""
_DOUBLINGS = 7
"""Most doublings of a trajectory; the density is scaled by its covariance, so that fewer are usual."""
_BLOCK = 5
"""Draws between two looks at whether to stop."""
_SPREAD = 2.0
"""Standard deviation of the first points, in standard errors: wider than the density, so that R-hat can show chains that do not meet."""
_ATTEMPTS = 20
_WIDTH, _EVERY = 20, 5.0
"""Characters of the bar, and s between two reports."""


_PACKAGES = ("blackjax", "arviz")
INSTALL = 'pip install "vibrojax[bayes]"'


def check_extra() -> None:
    """Raise `InputError`, with what to install, where the packages of the extra `bayes` are missing."""
    if missing := [name for name in _PACKAGES if find_spec(name) is None]:
        them = "package" if len(missing) == 1 else "packages"
        raise InputError(f"a posterior needs the {them} {' and '.join(missing)}, not installed: run {INSTALL}, or leave the posterior out")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Chains:
    """Draws of all chains after their warm-up; the first axes are the chain and the draw.

    Attributes:
        draws: (chains, draws, parameters), in the coordinates of the density.
        log_density: up to a constant.
        divergent: whether the energy error of the trajectory was large.
        acceptance: rate of acceptance along the trajectory.
        steps: gradients that the draw took.
    """

    draws: np.ndarray
    log_density: np.ndarray
    divergent: np.ndarray
    acceptance: np.ndarray
    steps: np.ndarray


@dataclasses.dataclass(frozen=True, kw_only=True)
class Nuts:
    """No-U-Turn Sampler with a unit metric; the warm-up adapts the step by dual averaging.

    Source: M. D. Hoffman, A. Gelman, J. Mach. Learn. Res. 15 (2014) 1593-1623; the implementation is that of BlackJAX.
    """

    chains: int = 4
    warm_up: int = 60
    draws: int = 400

    def __call__(self, density: Callable, dimensions: int, *, seed: int, progress: Callable[[str], None]) -> Chains:
        """Sample a density that is scaled by its covariance about zero.

        Args:
            density: logarithm of the density, an `eqx.Module`, so that its arrays are arguments of the compiled program.
            dimensions: number of its variables.
            seed: of every random draw.
            progress: called with a line of text now and then; what it raises ends all chains.

        Raises:
            NoConvergenceError: no finite density about the mode.
        """
        warm, draws = (-(-count // _BLOCK) for count in (self.warm_up, self.draws))
        progress("compiling the sampler of the posterior")
        with _mixed_types():
            starts = [_start(density, dimensions, key) for key in jax.random.split(jax.random.key(seed), self.chains)]
            advance = _advance.lower(density, *starts[0], jnp.asarray(True)).compile()  # once, not in every thread
        report = _Report(total=_BLOCK * self.chains * (warm + draws), say=progress)
        with ThreadPoolExecutor(min(self.chains, os.cpu_count() or 1)) as threads:
            running = [threads.submit(_chain, advance, density, start, warm, draws, report) for start in starts]
            try:
                report.until_done(running)
            finally:
                report.stopped = True
        found = [one.result() for one in running]
        return Chains(**{name: np.stack([one[name][: self.draws] for one in found]) for name in found[0]})


@dataclasses.dataclass
class _Report:
    """Draws that all chains have done; the main thread says how many."""

    total: int
    say: Callable[[str], None]
    done: int = 0
    stopped: bool = False
    began: float = dataclasses.field(default_factory=time.perf_counter)

    def until_done(self, running: list[Future]) -> None:
        """Say how far the chains are until all have ended, or one has failed."""
        said = self.began
        self.say(self._line())
        while wait(running, timeout=0.5).not_done:
            if any(one.done() and one.exception() for one in running):
                return
            if time.perf_counter() - said > _EVERY:
                said = time.perf_counter()
                self.say(self._line())

    def _line(self) -> str:
        share, seconds = self.done / self.total, time.perf_counter() - self.began
        bar = "█" * round(_WIDTH * share) + "░" * (_WIDTH - round(_WIDTH * share))
        left = f", {seconds / share - seconds:.0f} s left" if share > 0 else ""
        return f"sampling the posterior {bar} {self.done} of {self.total} draws{left}"


@contextmanager
def _mixed_types() -> Iterator[None]:
    """BlackJAX adds integers to floats, and arrays of different rank."""
    with jax.numpy_dtype_promotion("standard"), jax.numpy_rank_promotion("allow"):
        yield


def _chain(advance: Callable, density: Callable, start: tuple, warm: int, draws: int, report: _Report) -> dict[str, np.ndarray]:
    """One chain, block by block; only blocks after the warm-up are kept."""
    key, state, steps = start
    kept = []
    with _mixed_types():
        for block in range(warm + draws):
            if report.stopped:
                return {}
            key, state, steps, found = advance(density, key, state, steps, jnp.asarray(block < warm))
            found = jax.tree.map(np.asarray, found)
            report.done += _BLOCK
            kept += [found] if block >= warm else []
    return {name: np.concatenate([one[name] for one in kept]) for name in kept[0]}


def _start(density: Callable, dimensions: int, key: jax.Array) -> tuple[jax.Array, Any, Any]:
    """Key, state and step adaptation of a chain at a point about the mode where the density is finite, the nearer the more attempts."""
    from blackjax.adaptation.step_size import dual_averaging_adaptation

    key, begin = jax.random.split(key)
    spread = _SPREAD
    for attempt in jax.random.split(begin, _ATTEMPTS):
        state = _state(density, spread * jax.random.normal(attempt, (dimensions,)))
        if jnp.isfinite(state.logdensity):
            steps = dual_averaging_adaptation(_TARGET)[0](1.0)
            return key, state, jax.tree.map(lambda leaf: jnp.asarray(leaf, float), steps)
        spread *= 0.7
    raise NoConvergenceError("the posterior cannot be sampled: the records cannot be integrated about the estimate")


@eqx.filter_jit
def _state(density: Callable, z: jax.Array) -> Any:
    from blackjax.mcmc import nuts

    return nuts.init(z, density)


@eqx.filter_jit
def _advance(density: Callable, key: jax.Array, state: Any, steps: Any, adapts: jax.Array):
    """A block of draws; while `adapts` the step of the sampler is adapted after each."""
    from blackjax.adaptation.step_size import dual_averaging_adaptation
    from blackjax.mcmc import nuts

    kernel: Any = nuts.build_kernel()  # its types ask for a step that is a float
    update = dual_averaging_adaptation(_TARGET)[1]
    metric = jnp.ones_like(state.position)

    def draw(carry, key):
        state, steps = carry
        length = jnp.exp(jnp.where(adapts, steps.log_step_size, steps.log_step_size_avg))
        state, about = kernel(key, state, density, length, metric, _DOUBLINGS)
        next_steps = jax.tree.map(
            lambda new, old: jnp.where(adapts, jnp.asarray(new, old.dtype), old), update(steps, about.acceptance_rate), steps
        )
        found = {
            "draws": state.position,
            "log_density": state.logdensity,
            "divergent": about.is_divergent,
            "acceptance": about.acceptance_rate,
            "steps": about.num_integration_steps,
        }
        return (state, next_steps), found

    key, now = jax.random.split(key)
    (state, steps), found = lax.scan(draw, (state, steps), jax.random.split(now, _BLOCK))
    return key, state, steps, found
