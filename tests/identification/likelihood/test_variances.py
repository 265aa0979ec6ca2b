"""Restricted likelihood and mode of all windows, against the dense mixed model of the textbook and a Kalman filter."""

import dataclasses

import numpy as np
import pytest
from scipy.linalg import block_diag, expm

from identification.likelihood.linearised import Linearised
from identification.likelihood.marginal import marginal
from identification.likelihood.noise import white
from identification.likelihood.random_force import RandomForce, hats
from identification.likelihood.response import force_responses
from identification.likelihood.variances import (
    Linear,
    Variances,
    estimated,
    log_determinant,
    measured_noise,
    orderly,
    posterior,
    restricted_likelihood,
)
from identification.windows.layout import NUISANCES, Active, Estimate, Layout
from tests.identification.likelihood.made_windows import (
    CHANNELS,
    DT,
    FORCE,
    NOISE,
    PLACES,
    RECORD,
    blank,
    dense,
    force_covariance,
    made_answer,
    made_grams,
    made_windows,
)
from vibrojax.effects import OwnState
from vibrojax.parameters import Parameter

WINDOWS, RECORDS = len(RECORD), 2
PLAIN = Layout(parameters=tuple(Parameter(name=name, field=name, symbol=name, unit="1", start=1.0) for name in ("a", "b", "c")))
"""Three parameters; a window begins with two numbers."""
WITH_PRIORS = dataclasses.replace(
    PLAIN,
    zeros=((CHANNELS[0], 1.0),),
    variations=(("b", 0.1),),
    own_states=(OwnState(name="z", unit="m", scale=0.2), OwnState(name="rest", unit="m", scale=0.0)),
)
"""With a zero and a variation of each record, whose prior has standard deviation 1, and a third number of each window with one of 0.2."""
WIDE = np.array([1e-2, 1e1])
"""Variances of an initial state that is not known, m^2 and m^2/s^2."""
WEIGHT = np.array([1.2, 0.8, 1.0, 0.3, 1.5])


def linear(layout: Layout, *, finite: np.ndarray | None = None) -> Linear:
    """Made windows; the second parameter is held, and so is all of a record but zeros and variations."""
    rng = np.random.default_rng(11)
    free = np.tile(np.arange(layout.nuisance_count) >= len(NUISANCES), (RECORDS, 1))
    estimate = Estimate(
        shared=rng.normal(size=layout.shared),
        nuisances=rng.normal(size=free.shape) * free,
        states=0.3 * rng.normal(size=(WINDOWS, layout.states)),
    )
    at = made_windows(layout.size)
    return Linear(
        layout=layout,
        estimate=estimate,
        active=Active(shared=np.array([True, False, True]), nuisances=free),
        at=at if finite is None else dataclasses.replace(at, finite=finite),
    )


def variances(**given) -> Variances:
    """Noise and force as made, all windows alike, unless given."""
    whole = {"noise": NOISE, "force": FORCE, "places": PLACES, "weight": np.ones(WINDOWS), "degrees": 4.0}
    return Variances(**whole | given)


class Textbook:
    """All windows in one vector: residual r, design X of all that is estimated and covariance V; each prior is one more observation."""

    def __init__(self, of: Linear, by: Variances, answer: np.ndarray):
        layout, estimate, counted = of.layout, of.estimate, np.flatnonzero(of.at.finite & (by.weight > 0))
        self.own = layout.size - layout.states
        self.columns = layout.shared + layout.nuisance_count * RECORDS + layout.states * WINDOWS
        rows, residuals, blocks = [], [], []
        windows = dense(of.at, answer, by.noise)
        for window in counted:
            design = np.zeros((len(windows[window].residual), self.columns))
            design[:, self.places(layout, window)] = windows[window].jacobian
            rows.append(design)
            residuals.append(windows[window].residual)
            blocks.append(windows[window].covariance(force_covariance(by.force)) / by.weight[window])
        priors = [(window, layout.size - 1, 0.2) for window in counted if layout.free_own]
        first = {int(RECORD[window]): window for window in counted[::-1]}
        priors += [(window, layout.shared + k, 1.0) for window in first.values() for k in range(len(NUISANCES), layout.without_effects)]
        local = estimate.local(RECORD)
        for window, place, std in priors:
            rows.append(np.eye(1, self.columns, self.places(layout, window)[place]))
            residuals.append(local[window, place, None])
            blocks.append(np.array([[std**2]]))
        active = np.concatenate([of.active.shared, of.active.nuisances.ravel(), np.repeat(of.at.finite & (by.weight > 0), layout.states)])
        self.active = np.flatnonzero(active)
        self.residual, self.design, self.covariance = np.concatenate(residuals), np.vstack(rows)[:, self.active], block_diag(*blocks)
        self.inverse = np.linalg.inv(self.covariance)
        self.information = self.design.T @ self.inverse @ self.design

    def places(self, layout: Layout, window: int) -> np.ndarray:
        """Columns of one window's vector."""
        nuisances = layout.shared + layout.nuisance_count * RECORD[window] + np.arange(layout.nuisance_count)
        states = layout.shared + layout.nuisance_count * RECORDS + layout.states * window + np.arange(layout.states)
        return np.concatenate([np.arange(layout.shared), nuisances, states])

    @property
    def step(self) -> np.ndarray:
        """-(X' V^-1 X)^-1 X' V^-1 r, zero for what is held."""
        found = np.zeros(self.columns)
        found[self.active] = -np.linalg.solve(self.information, self.design.T @ self.inverse @ self.residual)
        return found

    @property
    def restricted_likelihood(self) -> float:
        """-1/2 (log |V| + log |X' V^-1 X| + r' P r)."""
        rest = self.residual + self.design @ self.step[self.active]
        logarithms = np.linalg.slogdet(self.covariance)[1] + np.linalg.slogdet(self.information)[1]
        return float(-0.5 * (logarithms + rest @ self.inverse @ rest))


CHOICES = [
    variances(),
    variances(force=RandomForce(std=0.3, memory=0.03)),
    variances(noise={CHANNELS[0]: white(2.0), CHANNELS[1]: NOISE[CHANNELS[1]]}),
    variances(weight=WEIGHT),
]


@pytest.mark.parametrize("layout", [PLAIN, WITH_PRIORS], ids=["plain", "with priors"])
@pytest.mark.parametrize("lost", [False, True])
def test_restricted_likelihood_differs_as_the_dense_one(layout, lost):
    """Between forces, noises and weights; also where one window could not be integrated."""
    of = linear(layout, finite=np.arange(WINDOWS) != 1 if lost else None)
    answer = 0.5 * made_answer(of.at)
    found = [restricted_likelihood(of, made_grams(of.at, answer, by.noise), by) for by in CHOICES]
    expected = [Textbook(of, by, answer).restricted_likelihood for by in CHOICES]
    assert np.ptp(expected) > 50.0
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=0, atol=2e-3)


@pytest.mark.parametrize("layout", [PLAIN, WITH_PRIORS], ids=["plain", "with priors"])
def test_mode_is_that_of_generalised_least_squares(layout):
    """Every window's step, the force left over, and what is unexplained."""
    of, by = linear(layout), variances(weight=WEIGHT)
    answer = 0.5 * made_answer(of.at)
    found, textbook = posterior(of, made_grams(of.at, answer), by), Textbook(of, by, answer)
    step = np.stack([textbook.step[textbook.places(layout, window)] for window in range(WINDOWS)])
    np.testing.assert_allclose(found.step, step, rtol=0, atol=1e-5 * np.abs(step).max())
    force = force_covariance(FORCE)
    for window, one in enumerate(dense(of.at, answer)):
        inverse, rest = np.linalg.inv(one.covariance(force)), one.residual + one.jacobian @ step[window]
        np.testing.assert_allclose(found.force[window], -force @ one.answer.T @ inverse @ rest, rtol=0, atol=1e-4)
        assert found.deviation()[window] == pytest.approx(rest @ inverse @ rest, rel=1e-5)


def test_log_determinant_is_that_of_scaled_matrices():
    """Of unknowns whose sizes differ by twelve orders; a direction that nothing determines counts as 1e-12 of its diagonal."""
    rng = np.random.default_rng(3)
    root, size = rng.normal(size=(4, 3, 5)), np.array([1e-6, 1.0, 1e6])
    matrices = size[:, None] * (root @ root.transpose(0, 2, 1)) * size
    expected = np.linalg.slogdet(root @ root.transpose(0, 2, 1))[1] + 2.0 * np.log(size).sum()
    np.testing.assert_allclose(log_determinant(matrices), expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(log_determinant(np.array([[[4.0, 6.0], [6.0, 9.0]]])), np.log([2e-12 * 36.0]), rtol=1e-3)


def test_windows_that_are_far_worse_than_most_do_not_count():
    kept = orderly(variances(weight=np.array([1.0, 1.1, 0.9, 0.35, 0.25])))
    np.testing.assert_array_equal(kept.weight, [1.0, 1.1, 0.9, 0.35, 0.0])


class Oscillator:
    """u'' + 2 zeta omega u' + omega^2 u = f / m with an Ornstein-Uhlenbeck force; u is read through white noise at every sample.

    One window from a known or an unknown initial state, with knots of the force at every sample.
    """

    mass, omega, zeta, memory, noise = 0.5, 2.0 * np.pi * 5.0, 0.02, 0.05, 2e-5
    samples, dt = 240, 1.0 / 800.0
    truth = 0.1
    matrix = np.array([[0.0, 1.0], [-(omega**2), -2.0 * zeta * omega]])

    def exact(self, std: float) -> tuple[np.ndarray, np.ndarray]:
        """Transition of (u, u', f) over one sample, and the covariance added.

        Source: C. F. Van Loan, IEEE Trans. Autom. Control 23 (1978) 395-404.
        """
        drift = np.zeros((3, 3))
        drift[:2, :2], drift[1, 2], drift[2, 2] = self.matrix, 1.0 / self.mass, -1.0 / self.memory
        diffusion = np.diag([0.0, 0.0, 2.0 * std**2 / self.memory])
        whole = expm(self.dt * np.block([[-drift, diffusion], [np.zeros((3, 3)), drift.T]]))
        forward = whole[3:, 3:].T
        return forward, forward @ whole[:3, 3:]

    def by_ramps(self, std: float) -> tuple[np.ndarray, np.ndarray]:
        """The same with a force that is linear from sample to sample, as the package has it."""
        ramp = np.zeros((4, 4))
        ramp[:2, :2], ramp[1, 2], ramp[2, 3] = self.matrix, 1.0 / self.mass, 1.0 / self.dt
        whole = expm(self.dt * ramp)
        forward, last = whole[:2, :2], whole[:2, 3]
        first, kept = whole[:2, 2] - last, np.exp(-self.dt / self.memory)
        added = std * np.sqrt(1.0 - kept**2) * np.array([*last, 1.0])
        return np.block([[forward, (first + kept * last)[:, None]], [np.zeros((1, 2)), kept]]), np.outer(added, added)

    def record(self, initial: np.ndarray, seed: int) -> np.ndarray:
        """u with noise, m."""
        rng = np.random.default_rng(seed)
        forward, added = self.exact(self.truth)
        root, state = np.linalg.cholesky(added), np.array([*initial, self.truth * rng.standard_normal()])
        found = np.empty(self.samples)
        for k in range(self.samples):
            found[k] = state[0] + self.noise * rng.standard_normal()
            state = forward @ state + root @ rng.standard_normal(3)
        return found

    def filtered(self, record: np.ndarray, transition: tuple[np.ndarray, np.ndarray], std: float, initial: np.ndarray) -> float:
        """Log-likelihood by a Kalman filter; `initial` variances of u and u'."""
        forward, added = transition
        state, covariance, found = np.zeros(3), np.diag([*initial, std**2]), 0.0
        for reading in record:
            spread, error = covariance[0, 0] + self.noise**2, reading - state[0]
            gain = covariance[:, 0] / spread
            found -= 0.5 * (error**2 / spread + np.log(2.0 * np.pi * spread))
            state = state + gain * error
            keep = np.eye(3) - np.outer(gain, [1.0, 0.0, 0.0])
            covariance = keep @ covariance @ keep.T + self.noise**2 * np.outer(gain, gain)
            state, covariance = forward @ state, forward @ covariance @ forward.T + added
        return found

    def windows(self, *records: np.ndarray) -> Linearised:
        """Linearised at rest: all of a record is residual."""
        step, shape = expm(self.dt * self.matrix), (len(records), self.samples)
        fundamental = np.stack([np.linalg.matrix_power(step, k) for k in range(self.samples)])
        jacobian = np.zeros((len(records), len(NUISANCES) + 2, self.samples, 1))
        jacobian[:, -2:, :, 0] = -fundamental[:, 0].T / self.noise
        return blank(
            record=np.arange(len(records)),
            lengths=np.full(len(records), self.samples),
            ts=self.dt * np.broadcast_to(np.arange(self.samples), shape),
            weight=np.full((*shape, 1), 1.0 / self.noise),
            channels=("relative_displacement",),
            residual=np.stack(records)[..., None] / self.noise,
            jacobian=jacobian,
            fundamental=np.broadcast_to(fundamental, (*shape, 2, 2)),
            flow=np.broadcast_to(self.matrix, (*shape, 2, 2)),
            kick=np.broadcast_to([0.0, 1.0 / self.mass], (*shape, 2)),
            finite=np.ones(len(records), bool),
        )

    def linear(self, at: Linearised) -> Linear:
        """Of which only the initial states are estimated."""
        windows, nuisances = len(at.record), np.zeros((len(at.record), len(NUISANCES)))
        estimate = Estimate(shared=np.zeros(0), nuisances=nuisances, states=np.zeros((windows, 2)))
        active = Active(shared=np.zeros(0, bool), nuisances=nuisances > 0)
        return Linear(layout=Layout(parameters=()), estimate=estimate, active=active, at=at)

    def variances(self, at: Linearised, std: float, every: int = 1) -> Variances:
        """With knots at every so many samples."""
        places = every * self.dt * np.arange((self.samples - 1) // every + 1)
        force = RandomForce(std=std, memory=self.memory)
        return variances(noise={at.channels[0]: white()}, force=force, places=places, weight=np.ones(len(at.record)))


SIZES = [0.005, 0.02, 0.1, 0.5, 2.0]
"""N; the likelihood varies by hundreds of nats over them."""
METHODS = [("by_ramps", 1e-4, 0.01), ("exact", 0.01, 0.02)]
"""Of the filter; relative and absolute tolerance, nats. The finite step makes 0.2 nats of 30 where the force is twenty times too large."""


@pytest.mark.parametrize(("method", "relative", "absolute"), METHODS)
def test_marginal_likelihood_is_that_of_a_kalman_filter(method, relative, absolute):
    """From a known initial state."""
    rig = Oscillator()
    record = rig.record(np.zeros(2), 0)
    at = rig.windows(record)
    by = [rig.variances(at, std) for std in SIZES]
    inner = made_grams(at, force_responses(at, rig.mass, hats(at, by[0].places)), by[0].noise)
    integrated = [marginal(inner, one.root) for one in by]
    found = [-0.5 * float(one.deviation[0] + one.log_determinant[0]) for one in integrated]
    expected = [rig.filtered(record, getattr(rig, method)(std), std, np.zeros(2)) for std in SIZES]
    assert int(np.argmax(expected)) == SIZES.index(rig.truth)
    assert np.all(np.abs(np.diff(expected)) > 10.0)
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=relative, atol=absolute)


@pytest.mark.parametrize(("method", "relative", "absolute"), METHODS)
def test_restricted_likelihood_is_that_of_a_kalman_filter_that_knows_no_initial_state(method, relative, absolute):
    """Of two windows, each begun anew with a variance far beyond all that is seen."""
    rig = Oscillator()
    records = [rig.record(np.array([5e-4, -0.01]), 1), rig.record(np.array([-2e-4, 0.02]), 2)]
    at = rig.windows(*records)
    by = [rig.variances(at, std) for std in SIZES]
    inner = made_grams(at, force_responses(at, rig.mass, hats(at, by[0].places)), by[0].noise)
    found = [restricted_likelihood(rig.linear(at), inner, one) for one in by]
    expected = [sum(rig.filtered(record, getattr(rig, method)(std), std, WIDE) for record in records) for std in SIZES]
    np.testing.assert_allclose(np.diff(found), np.diff(expected), rtol=relative, atol=absolute)


def test_size_and_correlation_time_of_the_force_are_recovered():
    """From thirty windows, from a start that is far off; the windows are Gaussian, and count alike."""
    rig = Oscillator()
    at = rig.windows(*(rig.record(np.array([5e-4, -0.01]), seed) for seed in range(30)))
    start = rig.variances(at, 1.0, every=6)
    start = dataclasses.replace(start, force=RandomForce(std=1.0, memory=0.01))
    inner = made_grams(at, force_responses(at, rig.mass, hats(at, start.places)), start.noise)
    found, _ = estimated(rig.linear(at), inner, start)
    assert found.force.std == pytest.approx(rig.truth, rel=0.1)
    assert found.force.memory == pytest.approx(rig.memory, rel=0.25)
    np.testing.assert_allclose(found.weight, 1.0, atol=0.3)


@pytest.mark.parametrize("declared", [False, True])
def test_noise_is_measured_in_flight_and_below_what_was_declared(declared):
    """Twice as large as supposed; contacts, a lost window and what is masked are off by a hundred."""
    rng = np.random.default_rng(5)
    windows, samples = 6, 1200
    residual = 2.0 * rng.standard_normal((windows, samples, 1))
    contact = np.zeros((windows, samples), bool)
    contact[:, 500:520] = True
    residual[:, 480:540] += 100.0
    residual[3] = 100.0
    weight = np.ones_like(residual)
    weight[0, 900:] = 0.0
    residual[0, 900:] = 100.0
    at = blank(
        lengths=np.full(windows, samples),
        ts=DT * np.broadcast_to(np.arange(samples), (windows, samples)),
        weight=weight,
        channels=(CHANNELS[0],),
        residual=residual,
        jacobian=np.zeros((windows, 1, samples, 1)),
        in_contact=contact,
        finite=np.arange(windows) != 3,
    )
    noise = measured_noise(at, 40 * DT, 1.0 / (400 * DT), frozenset(CHANNELS[:1]) if declared else frozenset())
    assert list(noise) == [CHANNELS[0]]
    assert noise[CHANNELS[0]].std == pytest.approx(1.5 if declared else 2.0, rel=1e-9 if declared else 0.03)


def test_noise_is_white_as_stated_where_flights_are_too_short():
    noise = measured_noise(made_windows(1, samples=23), 5e-3, 1.0)
    assert list(noise) == list(CHANNELS)
    for one in noise.values():
        assert one.order == 0 and one.std == 1.0
