"""Baseline: a stochastic grey-box model in the manner of CTSM, fitted to the free flights alone.

    u'' = -2 zeta omega u' - omega^2 u - y'' + (f + g(u, u', t)) / m,      df = -f / tau dt + sigma sqrt(2 / tau) dW

with y the cart's sine, f a force with diffusion, and g the terms of effects in flight. omega, zeta, sigma, tau, the sensors' noise and the
terms' coefficients are those of greatest likelihood by an extended Kalman filter, which is exact but for friction, drag and a cubic spring;
effects are added as long as the Bayesian information criterion falls. Contacts and what acts in them are beyond it: a touch between two
samples is no small step of a filter.

Source: N. R. Kristensen, H. Madsen, S. B. Jorgensen, Automatica 40 (2004) 225-237 and Comput. Chem. Eng. 28 (2004) 1431-1449.
"""

import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from benchmarks.concealed.flights import Flights, flights
from benchmarks.concealed.kalman import FORCES, log_density
from identification.experiment import load_experiment

NAME = "grey_box"
TERMS = {"coulomb_friction": (0,), "quadratic_drag": (1,), "cubic_stiffness": (2,), "constant_force": (3,), "base_harmonics": (4, 5, 6, 7)}
"""Coefficients of g that each effect has."""
_DECISIVE = 10.0
"""A smaller drop of the criterion is no evidence (Kass and Raftery 1995)."""
_POSITIVE = 6
"""How many of the estimates are positive: omega, zeta, sigma, tau and the two noises."""


@dataclasses.dataclass(frozen=True)
class Fit:
    """Estimates of greatest likelihood.

    Attributes:
        values: omega, zeta, sigma, tau, the noise of displacement and acceleration, and the coefficients of g; SI.
        log_likelihood: there.
        criterion: BIC.
    """

    values: Float[np.ndarray, " estimates"]
    log_likelihood: float
    criterion: float


def name_effect(folder: Path) -> list[str]:
    """The chosen effects, the first chosen first; empty where no term is needed."""
    return forward_selection(flights(load_experiment(folder)))


def forward_selection(data: Flights) -> list[str]:
    """Effects one after the other, each fitted from the model before."""
    chosen: list[str] = []
    best = fit(data, (), first_guess(data))
    while len(chosen) < len(TERMS):
        tried = {name: fit(data, (*chosen, name), best.values) for name in TERMS if name not in chosen}
        name = min(tried, key=lambda each: tried[each].criterion)
        if tried[name].criterion > best.criterion - _DECISIVE:
            break
        best = tried[name]
        chosen.append(name)
    return chosen


def first_guess(data: Flights) -> Float[np.ndarray, " estimates"]:
    """Of a model without terms: a damping ratio of 1 %, a force of a thousandth of the spring's with a memory of a quarter of a turn."""
    omega = 2.0 * np.pi * data.f_n
    return np.array([omega, 0.01, 1e-3 * _spring_force(data, omega), 0.25 / data.f_n, *data.noise, *np.zeros(FORCES)])


def fit(data: Flights, names: tuple[str, ...], start: Float[np.ndarray, " estimates"]) -> Fit:
    """Greatest likelihood with the terms of these effects, from these values on."""
    free = np.array([place for name in names for place in TERMS[name]], int)
    amplitude, omega = float(np.abs(data.x).max()), start[0]
    sizes = np.array([1.0, (omega * amplitude) ** 2, amplitude**3, 1.0, 1.0, 1.0, 1.0, 1.0])
    scale = 1e-2 * _spring_force(data, omega) / sizes

    def values(point: np.ndarray) -> np.ndarray:
        found = start.copy()
        found[:_POSITIVE] *= np.exp(np.clip(point[:_POSITIVE], -7.0, 7.0))
        found[3] = min(found[3], 1.0 / data.f_n)  # a force that is the same for longer is not random but a term of g
        found[_POSITIVE + free] += point[_POSITIVE:] * scale[free]
        return found

    def cost(point: np.ndarray) -> float:
        found = -log_likelihood(data, values(point))
        return found if np.isfinite(found) else 1e12

    found = minimize(cost, np.zeros(_POSITIVE + len(free)), method="BFGS", options={"gtol": 1.0, "maxiter": 60, "eps": 1e-5})
    if found.fun >= 1e12:
        raise ArithmeticError("no likelihood at the first guess: every record needs the same sensors, their noise stated")
    return Fit(values(found.x), -float(found.fun), 2.0 * float(found.fun) + (_POSITIVE + len(free)) * float(np.log(data.count)))


def log_likelihood(data: Flights, values: Float[np.ndarray, " estimates"]) -> float:
    """Of the readings, by the filter; `values` as in `Fit`."""
    return float(log_density(data.first, data.t, data.x, data.a, data.v, data.cart, data.mass, np.asarray(values, float)))


def _spring_force(data: Flights, omega: float) -> float:
    """Largest force of the spring, N."""
    return data.mass * omega**2 * float(np.abs(data.x).max())
