"""One rig for the tests of all effects: as the package simulates it, and as SciPy's DOP853 does from equations written out once more.

The equations here are in absolute coordinates and in NumPy, so that a wrong sign in the package cannot hide behind itself.
"""

import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

from vibrojax.channels import channels
from vibrojax.contact import HuntCrossley
from vibrojax.excitation import Harmonic, Unforced
from vibrojax.integrate import Landing
from vibrojax.model import Model
from vibrojax.suspension import Linear

M, ZETA, F_N, GAP = 0.5, 0.02, 5.0, 1e-3
K, C = M * (2 * np.pi * F_N) ** 2, 2 * ZETA * M * 2 * np.pi * F_N
K_I, N_I, LAMBDA = 2e7, 1.5, 0.3
A0, PHASE, FREQUENCY = 2e-3, 0.4, 8.0
OMEGA = 2 * np.pi * FREQUENCY
START = (-2e-3, 0.05)
"""u, u'"""
TS = np.arange(0.0, 0.3, 5e-4)

SUSPENSION = Linear(damping_ratio=ZETA, natural_frequency_hz=F_N)
LAW = HuntCrossley(impact_stiffness=K_I, impact_exponent=N_I, impact_damping=LAMBDA)
SINE = Harmonic(base_amplitude=A0, base_phase=PHASE, frequency_hz=FREQUENCY)
FINE = Landing(contact_steps=400.0, flight_step=1e-4, most_steps=50_000)


def system(*effects, law=LAW, base=SINE, gap=GAP):
    """The rig with effects."""
    return Model(mass=M, suspension=SUSPENSION, law=law, effects=effects).system(gap=gap, base=base, applied=Unforced())


def simulate(*effects, law=LAW, base=SINE, ts=TS, start=START, integrator=FINE):
    """Channels and trajectory of the rig with effects, by the package."""
    rig = system(*effects, law=law, base=base)
    trajectory = integrator(rig, jnp.asarray(ts), jnp.asarray(start))
    assert int(trajectory.result) == 0
    return channels(rig, trajectory), trajectory


def sine(t):
    """Displacement, velocity and acceleration of the cart."""
    return A0 * np.sin(OMEGA * t + PHASE), A0 * OMEGA * np.cos(OMEGA * t + PHASE), -A0 * OMEGA**2 * np.sin(OMEGA * t + PHASE)


def push(delta, rate):
    """Force of the stop in contact, N."""
    return K_I * max(delta, 0.0) ** N_I * max(1 + LAMBDA * rate, 0.0)


class Reference:
    """The rig with one thing more, integrated from touch to release to touch.

    Its hooks are functions of t, the absolute displacement x and velocity v of the hammer, and further states z.
    """

    def __init__(self, *, extra=None, own_rates=None, own=(), gap=None, cart=None, back_gap=None):
        """extra(t, u, u', z): force on the hammer; own_rates(t, x, v, z, F, x''); gap(t, z) and cart(t, z): value and rate."""
        self.extra = extra or (lambda t, u, v, z: 0.0)
        self.own_rates = own_rates or (lambda t, x, v, z, pushed, a: [])
        self.own = list(own)
        self.gap = gap or (lambda t, z: (GAP, 0.0))
        self.cart = cart or (lambda t, z: sine(t)[:2])
        self.back_gap = back_gap

    def stops(self, t, state):
        """Indentation and its rate, in front and, where there is one, behind."""
        x, v, *z = state
        (y, yv), (gap, gap_rate) = self.cart(t, z), self.gap(t, z)
        behind = [] if self.back_gap is None else [(y - x - self.back_gap, yv - v)]
        return [(x - y - gap, v - yv - gap_rate), *behind]

    def rates(self, t, state, touching):
        """x', x'' and the rates of further states."""
        x, v, *z = state
        y, yv = self.cart(t, z)
        pushes = [push(*stop) if touches else 0.0 for stop, touches in zip(self.stops(t, state), touching, strict=True)]
        a = (-K * (x - y) - C * (v - yv) + self.extra(t, x - y, v - yv, z) - pushes[0] + sum(pushes[1:])) / M
        return [v, a, *self.own_rates(t, x, v, z, pushes[0], a)]

    def __call__(self, ts=TS):
        """u, force of the stop in front, further states and x'' at `ts`."""
        y, yv = self.cart(ts[0], self.own)
        state, t = np.array([START[0] + y, START[1] + yv, *self.own]), ts[0]
        touching = [stop[0] > 0 for stop in self.stops(t, state)]
        states, pushes, a = np.empty((len(ts), len(state))), np.empty(len(ts)), np.empty(len(ts))
        self.touches = 0
        while True:
            piece = self._until_boundary(t, ts[-1], state, touching)
            for i in np.flatnonzero((ts >= t) & (ts <= piece.t[-1])):
                states[i] = piece.sol(ts[i])
                pushes[i] = push(*self.stops(ts[i], states[i])[0]) if touching[0] else 0.0
                a[i] = self.rates(ts[i], states[i], touching)[1]
            t, state = piece.t[-1], piece.y[:, -1]
            if piece.status != 1:
                break
            changed = next(i for i, found in enumerate(piece.t_events) if len(found))
            touching[changed] = not touching[changed]
            self.touches += touching[changed]
        cart = np.array([self.cart(t, z)[0] for t, z in zip(ts, states[:, 2:], strict=True)])
        return states[:, 0] - cart, pushes, states[:, 2:], a

    def _until_boundary(self, t, t_end, state, touching):
        def boundary(i):
            def event(t, state):
                return self.stops(t, state)[i][0]

            event.terminal, event.direction = True, -1 if touching[i] else 1
            return event

        events = [boundary(i) for i in range(len(touching))]
        atol = [1e-14, 1e-12] + [1e-14] * len(self.own)
        return solve_ivp(
            lambda t, state: self.rates(t, state, touching),
            (t, t_end),
            state,
            method="DOP853",
            rtol=1e-11,
            atol=atol,
            events=events,
            dense_output=True,
            max_step=5e-4,
        )


def assert_same(readings, reference, *, within=1e-5, touches=2):
    """The package's channels agree with the reference's, relative to the largest, over at least so many touches."""
    u, force, _, a = reference()
    assert reference.touches >= touches
    for name, expected in (("relative_displacement", u), ("impact_force", force), ("hammer_acceleration", a)):
        np.testing.assert_allclose(readings[name], expected, atol=within * np.abs(expected).max(), rtol=0, err_msg=name)
