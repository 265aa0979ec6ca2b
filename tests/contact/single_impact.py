"""Oracle: one impact of a free mass on a stop, integrated by SciPy from the law's force alone."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import simpson, solve_ivp
from scipy.optimize import minimize_scalar
from scipy.special import lambertw

from vibrojax.contact import AbstractCompliantLaw, smoothed_force


class Impact(NamedTuple):
    """What one impact did; SI."""

    restitution: float
    duration: float
    deepest: float
    largest_force: float
    loop_area: float
    """Work done on the stop: area of the loop that force against indentation encloses."""
    smallest_force: float


@jax.jit
def _force(law, indentation, rate, approach_speed, smoothing):
    return smoothed_force(law, indentation, rate, approach_speed, smoothing)


@jax.jit
def _force_inside(law, indentation, rate, approach_speed):
    return law.force(jnp.maximum(indentation, 0.0), rate, approach_speed)


def single_impact(law: AbstractCompliantLaw, mass: float, approach_speed: float, smoothing: float = 0.0) -> Impact:
    """Strike the stop at a speed and follow the mass until it leaves; with `smoothing`, from where the smoothed force begins."""
    duration = float(law.contact_time(jnp.asarray(mass), jnp.asarray(approach_speed)))
    depth = duration * approach_speed  # the problem is solved in these units
    edge = -0.5 * smoothing

    def force(indentation, rate):
        if smoothing:
            return np.asarray(_force(law, indentation, rate, approach_speed, smoothing))
        return np.asarray(_force_inside(law, indentation, rate, approach_speed))

    def slope(_, y):
        return y[1], -float(force(y[0] * depth, y[1] * approach_speed)) * duration / (mass * approach_speed)

    def leaves(_, y):
        return y[0] - edge / depth

    leaves.terminal, leaves.direction = True, -1.0
    solution = solve_ivp(
        slope, (0.0, 50.0), (edge / depth, 1.0), method="DOP853", rtol=1e-11, atol=1e-13, events=leaves, dense_output=True, max_step=0.1
    )
    (end,) = solution.t_events[0]
    times = np.linspace(0.0, end, 20001)
    indentations, rates = solution.sol(times) * np.array([[depth], [approach_speed]])
    forces = force(indentations, rates)

    def refined(values, function):
        k = int(np.clip(np.argmax(values), 1, times.size - 2))
        best = minimize_scalar(lambda t: -function(*solution.sol(t)), bounds=(times[k - 1], times[k + 1]), method="bounded")
        return max(float(values.max()), -float(best.fun))

    return Impact(
        restitution=-float(solution.y_events[0][0, 1]),
        duration=end * duration,
        deepest=refined(indentations, lambda d, v: d * depth),
        largest_force=refined(forces, lambda d, v: float(force(d * depth, v * approach_speed))),
        loop_area=float(simpson(forces * rates, x=times * duration)),
        smallest_force=float(forces.min()),
    )


def hunt_crossley_restitution(a: float) -> float:
    """Solution e of a (1 + e) = ln((1 + a) / (1 - a e))."""
    return float((1.0 + lambertw(-(1.0 + a) * np.exp(-1.0 - a)).real) / a)
