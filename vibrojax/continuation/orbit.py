"""One periodic orbit: found by Newton shooting, with its Floquet multipliers and the functions that vanish where its stability changes."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Bool, Complex, Float

from vibrojax.contact import AbstractCompliantLaw, AbstractContactLaw
from vibrojax.continuation.rig import ForcedRig, Passage, as_arrays, check_settings, linearised, strobe_from
from vibrojax.errors import NoConvergenceError
from vibrojax.integrate import RESULT_MESSAGES, Landing
from vibrojax.integrate.base import SUCCESS
from vibrojax.integrate.landing import landing_for

Matrix = Float[np.ndarray, "states states"]


def multipliers(monodromy: Matrix) -> Complex[np.ndarray, " states"]:
    """Eigenvalues of the monodromy matrix, largest modulus first: by what a small disturbance grows in one period, 1.

    Example:
        >>> [round(float(abs(mu)), 3) for mu in multipliers(np.array([[0.5, 0.0], [3.0, -2.0]]))]
        [2.0, 0.5]
    """
    found = np.linalg.eigvals(monodromy).astype(complex)
    return found[np.lexsort((np.imag(found), -np.abs(found)))]


def is_stable(of_orbit: Complex[np.ndarray, "*points states"]) -> Bool[np.ndarray, "*points"]:
    """Whether every disturbance dies away: all multipliers inside the unit circle."""
    return np.asarray(np.all(np.abs(of_orbit) < 1.0, axis=-1))


def fold_test(monodromy: Matrix) -> float:
    """det(M - 1): changes sign where a multiplier passes +1."""
    return float(np.linalg.det(monodromy - np.eye(len(monodromy))))


def flip_test(monodromy: Matrix) -> float:
    """det(M + 1): changes sign where a multiplier passes -1, and the period doubles."""
    return float(np.linalg.det(monodromy + np.eye(len(monodromy))))


def torus_test(monodromy: Matrix) -> float:
    """Changes sign where a complex pair crosses the unit circle, or a real pair has the product 1 (which is no bifurcation).

    Product of mu_i mu_j - 1 over all pairs. For a hammer without effects that is det M - 1 < 0 wherever energy is lost: no torus is born.
    Whether a sign change is a Neimark-Sacker bifurcation is decided by `has_unit_pair`.
    """
    found = multipliers(monodromy)
    rows, columns = np.triu_indices(len(found), 1)
    return float(np.real(np.prod(found[rows] * found[columns] - 1.0)))


def has_unit_pair(of_orbit: Complex[np.ndarray, " states"], tolerance: float) -> bool:
    """Whether a complex pair lies on the unit circle, to `tolerance`."""
    pair = np.abs(np.imag(of_orbit)) > 1e-8
    return bool(np.any(np.abs(np.abs(of_orbit[pair]) - 1.0) < tolerance))


TOLERANCE = 1e-10
"""Of the closing error of an orbit, over `state_scale`."""
_ITERATIONS = 25
_HALVINGS = 5
_CLOSED = 3e-4
_PROBE = "frequency"

State = Float[np.ndarray, " states"]


class Orbit(eqx.Module):
    """A motion that repeats after some cycles of the cart."""

    rig: ForcedRig
    cycles: int = eqx.field(static=True)
    """p: period of the orbit in periods of the cart."""
    state: State
    """(u, u') in m and m/s, and states of effects, when the cart passes its middle moving forward."""
    monodromy: Float[np.ndarray, "states states"]
    """How a small change of the state is carried through one period."""
    passage: Passage

    @property
    def multipliers(self) -> Complex[np.ndarray, " states"]:
        """Eigenvalues of the monodromy matrix, largest first."""
        return multipliers(self.monodromy)

    @property
    def stable(self) -> bool:
        """Whether all multipliers lie inside the unit circle."""
        return bool(is_stable(self.multipliers))

    @property
    def touches(self) -> int:
        """Impacts in one period."""
        return int(self.passage.touches)


def state_scale(rig: ForcedRig) -> State:
    """Sizes by which states are measured: A0, A0 2 pi f, and those that the effects name, or A0."""
    amplitude = float(rig.base_amplitude)
    own = [state.scale or amplitude for effect in rig.model.effects for state in effect.own_states]
    return np.array([amplitude, amplitude * 2.0 * np.pi * float(rig.frequency_hz), *own])


def landing_of(rig: ForcedRig) -> Landing:
    """Steps of half a millisecond, or as fine as the cart and the vibrations of effects ask for."""
    fine = landing_for(rig.model.effects, float(rig.frequency_hz))
    return Landing(flight_step=min(float(fine.flight_step), float(Landing().flight_step)))


def find_orbit(rig: ForcedRig, state: State, *, cycles: int = 1, landing: Landing | None = None) -> Orbit:
    """Periodic orbit near a state, by Newton's method on P^p(x) - x = 0; stable or not.

    The Jacobian is the monodromy matrix, by forward-mode differentiation of the map. A step that enlarges the closing error is halved.

    Arguments:
        rig: the rig.
        state: guess of (u, u', ...) at the section, m and m/s.
        cycles: p, how many cycles of the cart the orbit takes.
        landing: the integrator; `landing_of` the rig by default.

    Raises:
        InputError: impossible settings, or an effect that does not repeat with the cart.
        NoConvergenceError: the closing error does not reach `TOLERANCE`, the map itself fails, or the section lies in a contact whose force
            depends on the speed of its touch.

    Example:
        >>> from vibrojax.contact import Hertz
        >>> from vibrojax.model import Model
        >>> from vibrojax.suspension import Linear
        >>> jax.config.update("jax_enable_x64", True)
        >>> model = Model(1.0, Linear(0.02, 5.0), Hertz(1e6, 1.5))
        >>> orbit = find_orbit(ForcedRig(model, gap=0.1, base_amplitude=1e-3, frequency_hz=10.0), np.zeros(2))
        >>> orbit.stable, orbit.touches
        (True, 0)
    """
    check_settings(rig)
    landing, rig = landing_of(rig) if landing is None else landing, as_arrays(rig)
    scale, identity = state_scale(rig), np.eye(len(state))
    x = np.asarray(state, dtype=float)
    reached, jacobian, passage = map_with_jacobian(landing, rig, _PROBE, cycles, x)
    for _ in range(_ITERATIONS):
        error = float(np.max(np.abs((reached - x) / scale)))
        if error < TOLERANCE:
            return Orbit(rig, cycles, x, jacobian[:, :-1], passage)
        step = solved(jacobian[:, :-1] - identity, x - reached)
        for halving in range(_HALVINGS + 1):
            trial = x + step / 2.0**halving
            reached, jacobian, passage = map_with_jacobian(landing, rig, _PROBE, cycles, trial)
            if float(np.max(np.abs((reached - trial) / scale))) < error:
                break
        x = trial
    raise NoConvergenceError(
        f"no orbit of {cycles} cycles found at {float(rig.frequency_hz):g} Hz: closing error {error:.1e} of A0 after {_ITERATIONS} steps; "
        "start nearer to an orbit, or ask for another number of cycles"
    )


def settle(
    rig: ForcedRig, state: State, *, transient: int = 300, most_cycles: int = 8, landing: Landing | None = None
) -> tuple[State, int]:
    """Where the motion from a state settles, and after how many cycles it repeats: brute force, hence stable orbits only.

    Arguments:
        rig: the rig.
        state: (u, u', ...) at the section, m and m/s.
        transient: cycles that are left out.
        most_cycles: longest period looked for, cycles.
        landing: the integrator.

    Returns:
        A state on (or near) the orbit, and its period in cycles.

    Raises:
        InputError: as for `find_orbit`.
        NoConvergenceError: no repetition within `most_cycles` (a longer period, chaos, or a transient not over).
    """
    check_settings(rig)
    landing, rig = landing_of(rig) if landing is None else landing, as_arrays(rig)
    states = [_advance(landing, rig, transient, np.asarray(state, dtype=float))]
    for _ in range(most_cycles):
        states.append(_advance(landing, rig, 1, states[-1]))
    distance = [float(np.max(np.abs((later - states[0]) / state_scale(rig)))) for later in states[1:]]
    near = [cycles for cycles, off in enumerate(distance, 1) if off < _CLOSED]
    if not near:
        raise NoConvergenceError(
            f"the motion at {float(rig.frequency_hz):g} Hz does not repeat within {most_cycles} cycles after {transient}: nearest return "
            f"{min(distance):.1e} of A0; choose another start or frequency, or allow a longer transient"
        )
    return states[0], near[0]


def map_with_jacobian(landing: Landing, rig: ForcedRig, name: str, cycles: int, state: State):
    """`linearised` on NumPy arrays: end state, Jacobian with respect to (state, `name`), passage.

    Raises:
        NoConvergenceError: the motion is not finite, or impacts without end use up all steps.
    """
    reached, jacobian, passage = linearised(landing, rig, name, jnp.asarray(cycles), jnp.asarray(state))
    passage = _checked(rig, passage)
    return np.asarray(reached), np.asarray(jacobian), passage


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution of a linear system; `NoConvergenceError` where it has none, as at an orbit that is one of a continuous family."""
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        raise NoConvergenceError("no isolated orbit: a multiplier is 1 exactly; leave out the effect whose state nothing drives") from None


def _advance(landing: Landing, rig: ForcedRig, cycles: int, state: State) -> State:
    reached, passage = strobe_from(landing, rig, jnp.asarray(cycles), jnp.asarray(state))
    _checked(rig, passage)
    return np.asarray(reached)


def _checked(rig: ForcedRig, passage: Passage) -> Passage:
    passage = Passage(*(np.asarray(leaf) for leaf in jax.device_get(passage)))
    if passage.result != SUCCESS:
        raise NoConvergenceError(f"the motion at {float(rig.frequency_hz):g} Hz breaks off: {RESULT_MESSAGES[int(passage.result)]}")
    if passage.starts_in_contact and _depends_on_touch(rig.model.law):
        raise NoConvergenceError(
            f"the motion at {float(rig.frequency_hz):g} Hz is in contact when the cart passes its middle, and {rig.model.law.name} depends "
            "on the speed of the touch before that, which the state there does not hold; take a law without that memory"
        )
    return passage


def _depends_on_touch(law: AbstractContactLaw) -> bool:
    """Whether the force depends on the approach speed of the touch that began a contact."""
    if not isinstance(law, AbstractCompliantLaw):
        return False
    slow, fast = (law.force(jnp.asarray(1e-4), jnp.asarray(0.01), jnp.asarray(speed)) for speed in (0.1, 0.2))
    return bool(slow != fast)
