"""Multistart search of the contact parameters: gradient descent on single impacts with Optax, all starts at once."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import optax

from identification.least_squares.fit import as_arrays, bounds, integrator_for
from identification.least_squares.residual import normal_equations
from identification.windows.impacts import impact_windows
from identification.windows.prepare import Prepared
from identification.windows.windows import Windows

_IMPACTS = 6
_SPREAD = 0.6
"""Standard deviation of the random starts in internal coordinates: a factor of 1.8 for logarithmic parameters."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class StartOutcome:
    """Outcome of one start: its origin, cost (half chi-square) before and after, and parameters at its end."""

    origin: str
    initial: dict[str, float]
    initial_cost: float
    final: dict[str, float]
    final_cost: float


@dataclasses.dataclass(frozen=True, kw_only=True)
class Multistart:
    """Multistart check for a better minimum of the contact parameters.

    The first starts are those read from the records; the others are drawn around them. Every iteration solves the windows' initial states
    by Gauss-Newton and moves the contact parameters along the gradient by Adam; all starts and impacts are lanes of one integration. All
    starts use the same few impacts, so their costs are comparable.
    """

    count: int = 6
    iterations: int = 40
    learning_rate: float = 0.08

    worthwhile: float = 0.9
    """A start is proposed if its final cost is below this share of that of the best start read from the records."""

    def __call__(self, prepared: Prepared, *, seed: int) -> tuple[np.ndarray | None, tuple[StartOutcome, ...]]:
        """Shared parameters of a start with a lower cost, if there is one, and the outcome of every start, best first."""
        free = _free(prepared)
        impacts = impact_windows(prepared, _IMPACTS)
        if impacts is None or not free.any() or self.count < 2:
            return None, ()
        first = self._draw(prepared, free, seed)
        initial, final, best = self._descend(prepared, free, first, *impacts)
        order = np.argsort(final)
        origins = [*prepared.candidates, *(f"random {i}" for i in range(1, self.count + 1))][: self.count]
        outcomes = tuple(
            StartOutcome(
                origin=origins[i],
                initial=prepared.layout.physical(first[i]),
                initial_cost=float(initial[i]),
                final=prepared.layout.physical(best[i]),
                final_cost=float(final[i]),
            )
            for i in order
        )
        promising = final[order[0]] < self.worthwhile * final[: len(prepared.candidates)].min()
        return best[order[0]] if promising else None, outcomes

    def _draw(self, prepared: Prepared, free: np.ndarray, seed: int) -> np.ndarray:
        """Internal coordinates of the starts, (starts, parameters)."""
        read = np.stack(list(prepared.candidates.values()))
        scatter = _SPREAD * np.random.default_rng(seed).standard_normal((self.count, len(free))) * free
        scatter[: len(read)] = 0.0
        return np.clip(read[np.arange(self.count) % len(read)] + scatter, *bounds(prepared))

    def _descend(self, prepared: Prepared, free: np.ndarray, shared: np.ndarray, group: Windows, states: np.ndarray):
        """Cost of every start at the first and at the best iteration, and the parameters at the best."""
        evaluate = self._evaluator(prepared, group)
        lanes = len(group.record)
        optimiser = optax.adam(optax.cosine_decay_schedule(self.learning_rate, self.iterations, alpha=0.05))
        memory, states = optimiser.init(jnp.asarray(shared)), np.tile(states, (self.count, 1))
        initial, best, lowest = np.zeros(self.count), shared.copy(), np.full(self.count, np.inf)
        for iteration in range(self.iterations):
            cost, slope, step = evaluate(shared, states)
            total = cost.reshape(self.count, lanes).sum(axis=1)
            initial = total if iteration == 0 else initial
            better = total < lowest
            best[better], lowest[better] = shared[better], total[better]
            downhill = slope.reshape(self.count, lanes, -1).sum(axis=1) * free / np.maximum(total, 1.0)[:, None]
            with jax.numpy_dtype_promotion("standard"):  # Optax counts its steps in int32
                update, memory = optimiser.update(jnp.asarray(np.where(np.isfinite(downhill), downhill, 0.0)), memory)
            shared = np.clip(shared + np.asarray(update), *bounds(prepared))
            states = states + np.where(np.isfinite(step), step, 0.0)
        return initial, lowest, best

    def _evaluator(self, prepared: Prepared, group: Windows):
        """Function that returns the cost of every lane after a step of its state, the gradient in the shared parameters, and that step."""
        model, integrator = as_arrays(prepared.model), integrator_for(prepared)
        lanes, parameters = len(group.record), prepared.layout.shared
        tiled = jax.tree.map(lambda leaf: jnp.asarray(np.tile(leaf, (self.count, *[1] * (leaf.ndim - 1)))), group)
        nuisances = np.tile(prepared.start.nuisances[group.record], (self.count, 1))

        def evaluate(shared: np.ndarray, states: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
            local = jnp.asarray(np.concatenate([np.repeat(shared, lanes, axis=0), nuisances, states], axis=1))
            found = normal_equations(model, prepared.layout, integrator, tiled, local)
            hessian, gradient, cost = (np.asarray(part) for part in (found.hessian, found.gradient, found.cost))
            step = -np.linalg.solve(hessian[:, -2:, -2:] + 1e-9 * np.eye(2), gradient[:, -2:, None])[..., 0]
            slope = gradient[:, :parameters] + np.einsum("lis,ls->li", hessian[:, :parameters, -2:], step)
            return cost + 0.5 * np.einsum("ls,ls->l", gradient[:, -2:], step), slope, step

        return evaluate


def _free(prepared: Prepared) -> np.ndarray:
    """(parameters,) bool: parameters of the contact law that are not fixed."""
    names = {p.name for p in prepared.model.law.parameters} - set(prepared.fixed)
    return np.array([p.name in names for p in prepared.layout.parameters], bool)
