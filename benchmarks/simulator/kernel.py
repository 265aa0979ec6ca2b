"""The equations of motion and the stepping through them, compiled by numba.

Everything that a rig does stands in `rates`: to add physics, give it a place in the parameter vector (`PARAMETERS`), and in the state
vector (`Z` and after) if it has a memory of its own, and extend `rates`; nothing else integrates. A parameter that is 0 leaves its effect
out. If the effect is sudden or quick, see that `steps_in_sample` notices.

All of it is one file because numba's cache on disk notices changes in the file of a function only.
"""

import math

import numpy as np

try:
    from numba import njit
except ModuleNotFoundError as error:
    raise ModuleNotFoundError("the simulator needs numba, which vibrojax itself does not: pip install numba") from error

NOMINAL = ("m", "c", "k", "k_i", "n", "lambda_i", "gap", "base_amplitude", "omega_exc", "base_phase")
"""What the nominal model knows; SI. Base motion y = A0 sin(omega_exc t + base_phase)."""
PARAMETERS = (
    *NOMINAL,
    *("friction_force", "friction_speed", "drag", "cubic", "constant_force"),
    *("hysteresis_force", "hysteresis_a", "hysteresis_b", "hysteresis_g"),
    *("stop_mass", "stop_stiffness", "stop_damping", "adhesion_force", "adhesion_reach", "back_gap"),
    *("second_harmonic", "second_phase", "third_harmonic", "third_phase", "frequency_rate"),
    *("cart_mass", "cart_stiffness", "cart_damping", "gap_rate", "gap_jump", "jump_time"),
    *("mode_mass", "mode_stiffness", "mode_damping"),
    *("foreign_force", "foreign_omega", "foreign_phase", "warming_rate", "position_damping"),
    *("parametric_share", "parametric_phase", "wear_impulse", "magnet_force", "magnet_reach"),
    *("knock_force", "knock_width", "knock_start", "knock_period"),
    *("deep_stiffness", "deep_depth", "deep_damping", "damping_difference"),
    *("saturation_force", "saturation_threshold"),
    *("quintic", "power_loss", "power_exponent", "power_speed"),
)
"""Order of the parameter vector; SI. What each means stands in `effects/`."""
M, C, K, K_I, N, LAMBDA_I, GAP, A0, OMEGA, PHASE = range(len(NOMINAL))
FRICTION, FRICTION_SPEED, DRAG, CUBIC, CONSTANT = range(10, 15)
BW_FORCE, BW_A, BW_B, BW_G = range(15, 19)
STOP_MASS, STOP_STIFFNESS, STOP_DAMPING, ADHESION, ADHESION_REACH, BACK_GAP = range(19, 25)
SECOND, SECOND_PHASE, THIRD, THIRD_PHASE, FREQUENCY_RATE = range(25, 30)
CART_MASS, CART_STIFFNESS, CART_DAMPING, GAP_RATE, GAP_JUMP, JUMP_TIME = range(30, 36)
MODE_MASS, MODE_STIFFNESS, MODE_DAMPING = range(36, 39)
FOREIGN, FOREIGN_OMEGA, FOREIGN_PHASE, WARMING, POSITION_DAMPING = range(39, 44)
PARAMETRIC, PARAMETRIC_PHASE, WEAR, MAGNET, MAGNET_REACH = range(44, 49)
KNOCK, KNOCK_WIDTH, KNOCK_START, KNOCK_PERIOD = range(49, 53)
DEEP_STIFFNESS, DEEP_DEPTH, DEEP_DAMPING, DAMPING_DIFFERENCE = range(53, 57)
SATURATION, SATURATION_THRESHOLD = range(57, 59)
QUINTIC, POWER_LOSS, POWER_EXPONENT, POWER_SPEED = range(59, 63)
FORCE_START, FORCE_STEP, FORCE = range(63, 66)
"""Behind the named parameters, where there is a random force: its start and step, s, and its values from then on, N."""

PLAIN = 2
"""States of a rig whose effects have no memory: hammer position x and velocity x', absolute."""
STATES = 10
"""All states: x, x', hysteresis z, stop q, q' and cart r, r' from where they should be, second mode x2, x2', impulse since t = 0."""
X, V, Z, Q, QD, R, RD, X2, X2D, IMPULSE = range(STATES)

FINE, MEDIUM, COARSE = 250, 25, 5
"""Steps in a sample of 0.25 ms: within reach of the stop or of a kink, with a ringing stop, and elsewhere."""
_FULL_PULL = 0.05
"""Adhesion is full from this share of its reach inside the stop."""
_LEAVING = 1e-4
"""Speed, m/s, at which a hammer has left: adhesion sets in up to it."""
_SILENT = 1e-4
"""A stop that rings with less than this force, N, is left to coarse steps."""


def vector(force: np.ndarray | None = None, **values: float) -> np.ndarray:
    """A parameter vector; what is not named is 0. Start, step and values of a random force, two at least, go behind the named ones."""
    unknown = set(values) - set(PARAMETERS)
    if unknown:
        raise ValueError(f"unknown parameters {sorted(unknown)}: expected names among PARAMETERS")
    return np.append([values.get(name, 0.0) for name in PARAMETERS], [] if force is None else force)


@njit(cache=True)
def base_motion(t, p):
    """Position, velocity and acceleration of the cart as it is driven; its frequency changes from t = 0 on."""
    later = max(t, 0.0)
    amplitude, omega = p[A0], p[OMEGA] * (1.0 + p[FREQUENCY_RATE] * later)
    angle = p[OMEGA] * (t + 0.5 * p[FREQUENCY_RATE] * later * later) + p[PHASE]
    s, c = math.sin(angle), math.cos(angle)
    y, y1, y2 = amplitude * s, amplitude * omega * c, -amplitude * omega * omega * s
    if p[SECOND] != 0.0 or p[THIRD] != 0.0:
        for order, share, phase in ((2.0, p[SECOND], p[SECOND_PHASE]), (3.0, p[THIRD], p[THIRD_PHASE])):
            s, c = amplitude * share * math.sin(order * angle + phase), amplitude * share * math.cos(order * angle + phase)
            y, y1, y2 = y + s, y1 + order * omega * c, y2 - (order * omega) ** 2 * s
    return y, y1, y2


@njit(cache=True)
def gap_at(t, p):
    """Clearance at rest; it drifts from t = 0 on, and may jump once."""
    gap = p[GAP] + p[GAP_RATE] * max(t, 0.0)
    return gap + p[GAP_JUMP] if t >= p[JUMP_TIME] else gap


@njit(cache=True)
def contact_force(indentation, rate, p):
    """Hunt and Crossley (1975): k_i delta^n (1 + lambda_i delta'), never negative, nothing out of contact; N.

    Where a deep stop is concealed, the same from its depth on, with its own numbers and the exponent 1.5, comes on top.
    """
    if indentation <= 0.0:
        return 0.0
    force = p[K_I] * indentation ** p[N] * max(1.0 + p[LAMBDA_I] * rate, 0.0)
    if p[DEEP_STIFFNESS] > 0.0 and indentation > p[DEEP_DEPTH]:
        force += p[DEEP_STIFFNESS] * (indentation - p[DEEP_DEPTH]) ** 1.5 * max(1.0 + p[DEEP_DAMPING] * rate, 0.0)
    return force


@njit(cache=True)
def adhesion(indentation, rate, p):
    """Pull towards the stop while the hammer leaves: full at the surface, linearly less over the reach; N.

    It sets in over a little speed: were it sudden, a hammer that sticks would chatter, and its samples show one side of that only.
    """
    reach = p[ADHESION_REACH]
    if p[ADHESION] == 0.0 or rate >= 0.0 or indentation <= -reach or indentation >= _FULL_PULL * reach:
        return 0.0
    return p[ADHESION] * min(1.0, 1.0 + indentation / reach) * min(1.0, -rate / _LEAVING)


@njit(cache=True)
def back_force(u, v, p):
    """Push of the stop behind the hammer, of the same law, towards the stop in front; N."""
    return contact_force(-u - p[BACK_GAP], -v, p) if p[BACK_GAP] > 0.0 else 0.0


@njit(cache=True)
def extra_force(t, u, v, p):
    """Forces without memory that the nominal model leaves out, out of contact, on the hammer towards the stop; N."""
    force = p[CONSTANT] - p[DRAG] * v * abs(v) - p[CUBIC] * u * u * u - p[POSITION_DAMPING] * abs(u) * v
    if p[FRICTION] != 0.0:
        force -= p[FRICTION] * math.tanh(v / p[FRICTION_SPEED])
    if p[DAMPING_DIFFERENCE] != 0.0:
        force -= 0.5 * p[DAMPING_DIFFERENCE] * abs(v)
    if p[SATURATION] != 0.0:
        force -= p[SATURATION] * min(max(u / p[SATURATION_THRESHOLD], -1.0), 1.0)
    if p[QUINTIC] != 0.0:
        force -= p[QUINTIC] * u**5
    if p[POWER_LOSS] != 0.0:
        force -= p[POWER_LOSS] * v * math.hypot(v, p[POWER_SPEED]) ** (p[POWER_EXPONENT] - 1.0)
    if p[WARMING] != 0.0:
        force -= p[K] * p[WARMING] * max(t, 0.0) * u
    if p[PARAMETRIC] != 0.0 and p[OMEGA] > 0.0:
        force -= p[K] * p[PARAMETRIC] * math.cos(p[OMEGA] * t + p[PARAMETRIC_PHASE]) * u
    if p[FOREIGN] != 0.0:
        force += p[FOREIGN] * math.sin(p[FOREIGN_OMEGA] * t + p[FOREIGN_PHASE])
    if p[MAGNET] != 0.0:
        distance = 1.0 + max(gap_at(t, p) - u, 0.0) / p[MAGNET_REACH]
        force += p[MAGNET] / (distance * distance)
    if p[KNOCK] != 0.0 and t >= p[KNOCK_START]:
        since = (t - p[KNOCK_START]) % p[KNOCK_PERIOD]
        if since < p[KNOCK_WIDTH]:
            force += p[KNOCK] * math.sin(math.pi * since / p[KNOCK_WIDTH])
    return force + random_force(t, p) if p.size > FORCE else force


@njit(cache=True)
def random_force(t, p):
    """A force known at equal steps, linear between them and constant beyond; N."""
    last = p.size - FORCE - 1
    place = min(max((t - p[FORCE_START]) / p[FORCE_STEP], 0.0), float(last))
    i = min(int(place), last - 1) + FORCE
    return p[i] + (place + FORCE - i) * (p[i + 1] - p[i])


@njit(cache=True)
def rates(t, state, p, out):
    """Write d(state)/dt into `out` and return what the load cell feels, N: m x'' = -c (x' - y') - k (x - y) - F + what is left out."""
    y, y1, _ = base_motion(t, p)
    remembers = state.size > PLAIN
    stop, stop_rate = 0.0, 0.0
    if remembers:
        y, y1, stop, stop_rate = y + state[R], y1 + state[RD], state[Q], state[QD]
    u, v = state[X] - y, state[V] - y1
    indentation, rate = u - gap_at(t, p) - stop, v - stop_rate
    force = contact_force(indentation, rate, p)
    if remembers and p[WEAR] > 0.0:
        force *= math.exp(-state[IMPULSE] / p[WEAR])
    force -= adhesion(indentation, rate, p)
    extra = extra_force(t, u, v, p) + back_force(u, v, p)
    felt = force
    if remembers:
        extra += memories(t, state, v, force, p, out)
        if p[STOP_MASS] > 0.0:
            felt = p[STOP_STIFFNESS] * stop + p[STOP_DAMPING] * stop_rate
    out[X] = state[V]
    out[V] = (-p[C] * v - p[K] * u - force + extra) / p[M]
    return felt


@njit(cache=True)
def memories(t, state, v, force, p, out):
    """Write the rates of all states but the hammer's, and return the force on the hammer that comes of them, N."""
    extra = 0.0
    for i in range(PLAIN, state.size):
        out[i] = 0.0
    if p[BW_FORCE] != 0.0:  # Bouc-Wen
        out[Z] = p[BW_A] * v - p[BW_B] * abs(v) * state[Z] - p[BW_G] * v * abs(state[Z])
        extra -= p[BW_FORCE] * state[Z]
    if p[STOP_MASS] > 0.0:
        out[Q], out[QD] = state[QD], (force - p[STOP_STIFFNESS] * state[Q] - p[STOP_DAMPING] * state[QD]) / p[STOP_MASS]
    if p[CART_MASS] > 0.0:
        out[R], out[RD] = state[RD], (force - p[CART_STIFFNESS] * state[R] - p[CART_DAMPING] * state[RD]) / p[CART_MASS]
    if p[MODE_MASS] > 0.0:
        pull = p[MODE_STIFFNESS] * (state[X] - state[X2]) + p[MODE_DAMPING] * (state[V] - state[X2D])
        out[X2], out[X2D] = state[X2D], pull / p[MODE_MASS]
        extra -= pull
    out[IMPULSE] = max(force, 0.0) if t >= 0.0 else 0.0
    return extra


@njit(cache=True)
def step(t, state, h, p, k, trial):
    """One step of the classical Runge-Kutta method in place; `k` (4, states) and `trial` (states,) are scratch."""
    rates(t, state, p, k[0])
    for i in range(state.size):
        trial[i] = state[i] + 0.5 * h * k[0, i]
    rates(t + 0.5 * h, trial, p, k[1])
    for i in range(state.size):
        trial[i] = state[i] + 0.5 * h * k[1, i]
    rates(t + 0.5 * h, trial, p, k[2])
    for i in range(state.size):
        trial[i] = state[i] + h * k[2, i]
    rates(t + h, trial, p, k[3])
    for i in range(state.size):
        state[i] += h / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])


@njit(cache=True)
def steps_in_sample(t, state, dt, p):
    """Fine steps if the hammer is in contact or could, generously, get to a stop or a kink within `dt`."""
    y, y1, y2 = base_motion(t, p)
    ringing = 0.0
    if state.size > PLAIN:
        y, y1 = y + state[R], y1 + state[RD]
        if p[STOP_MASS] > 0.0:
            ringing = math.sqrt(state[Q] ** 2 + state[QD] ** 2 * p[STOP_MASS] / p[STOP_STIFFNESS])
        if p[CART_MASS] > 0.0:
            y2 = abs(y2) + (abs(p[CART_STIFFNESS] * state[R]) + abs(p[CART_DAMPING] * state[RD])) / p[CART_MASS]
    u, v = state[X] - y, state[V] - y1
    pushed = abs(p[C] * v) + abs(p[K] * u) + abs(extra_force(t, u, v, p))
    if state.size > PLAIN and p[MODE_MASS] > 0.0:
        pushed += p[MODE_STIFFNESS] * abs(state[X] - state[X2]) + p[MODE_DAMPING] * abs(state[V] - state[X2D])
    push = abs(y2) + pushed / p[M]
    moved = 2.0 * (abs(v) * dt + push * dt * dt)
    gap = min(gap_at(t, p), gap_at(t + dt, p))
    near = u - gap + moved + ringing + p[ADHESION_REACH] > 0.0
    near = near or (p[BACK_GAP] > 0.0 and -u - p[BACK_GAP] + moved > 0.0)
    if p[FRICTION] != 0.0 or p[BW_FORCE] != 0.0 or (p[POWER_LOSS] != 0.0 and p[POWER_EXPONENT] < 1.0):
        near = near or abs(v) < 2.0 * push * dt + 10.0 * max(p[FRICTION_SPEED], p[POWER_SPEED])
    if near:
        return FINE
    return MEDIUM if ringing * p[STOP_STIFFNESS] > _SILENT else COARSE


@njit(cache=True)
def sampled(t0, dt, count, initial, p, refinement=1):
    """States, their rates, and what the load cell feels at t0, t0 + dt, ..., `count` of them; `refinement` divides all steps."""
    states, slopes, forces = np.empty((count, initial.size)), np.empty((count, initial.size)), np.empty(count)
    state, k, trial = initial.copy(), np.empty((4, initial.size)), np.empty(initial.size)
    for sample in range(count):
        t = t0 + sample * dt
        states[sample] = state
        forces[sample] = rates(t, state, p, slopes[sample])
        steps = refinement * steps_in_sample(t, state, dt, p)
        for i in range(steps):
            step(t + i * dt / steps, state, dt / steps, p, k, trial)
    return states, slopes, forces
