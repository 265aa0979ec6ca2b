"""The chain's normal equations, segment by segment: whitened readings, and defects between the segments.

-2 log p = sum of whitened residuals^2 + defects' Q^-1 defects + the random force's prior + other priors, linearised about an estimate.
The Hessian is block tridiagonal in the knots, with a border of each record's own unknowns and one of the shared ones; `elimination`
solves it.

Source: B. M. Bell, The iterated Kalman smoother as a Gauss-Newton method, SIAM J. Optim. 4 (1994) 626-636; L. Ljung, System
Identification, 2nd ed. (1999), section 4.3 (noise of an input as noise of the process).
"""

import dataclasses
from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from identification.trajectory.motion import Estimate, Linearised
from identification.trajectory.random_force import RandomForce
from identification.trajectory.reading_error import ReadingError, Whitening, tail, whitening
from identification.trajectory.segments import Chains, Unknowns


@dataclasses.dataclass(frozen=True, kw_only=True)
class Border:
    """Unknowns outside the chain: what is free, its scale, and what is known of it beforehand.

    Attributes:
        shared: (parameters,) whether free.
        own: (records, own) whether free.
        shared_scale, own_scale: natural size of a step; (parameters,) and (own,).
        shared_mean, shared_precision: prior, (parameters,), precision 0 where there is none.
        own_mean, own_precision: prior, (records, own).
        lower, upper: limits of the shared unknowns, (parameters,).
        proximal: information of each shared unknown that a step assumes about the present estimate, in its natural scale: what the records
            do not identify stays where it is, and does not shorten the step of the others. The estimate at the end does not depend on it.
        strengths, own_strengths: unknowns that enter by maximum likelihood rather than by the restricted one, so that models compare;
            (parameters,) and (own,).
    """

    shared: np.ndarray
    own: np.ndarray
    shared_scale: np.ndarray
    own_scale: np.ndarray
    shared_mean: np.ndarray
    shared_precision: np.ndarray
    own_mean: np.ndarray
    own_precision: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    strengths: np.ndarray
    own_strengths: np.ndarray
    proximal: float = 0.25


@dataclasses.dataclass(frozen=True, kw_only=True)
class Scales:
    """Natural sizes of the rig's motion, which set floors and the prior of the initial states.

    Attributes:
        displacement, velocity: rms of u, m, and of u', m/s.
        force: rms of the force of the suspension, or of inertia where there is none, N.
        resolution: noise of the best displacement sensor, m.
        own: of the effects' own states.
        own_initial: standard deviation of these at the beginning of a record, which a fit estimates from all of them.
    """

    displacement: float
    velocity: float
    force: float
    resolution: float
    own: np.ndarray
    own_initial: np.ndarray

    @property
    def states(self) -> np.ndarray:
        """Of u, u' and the effects' own states."""
        return np.concatenate([[self.displacement, self.velocity], self.own])

    @property
    def widest(self) -> np.ndarray:
        """Standard deviation of the states at the beginning of a record: motion of any size, states of effects near rest."""
        return np.concatenate([10.0 * self.states[:2], self.own_initial])

    @property
    def unknown(self) -> np.ndarray:
        """Standard deviation of the states behind a segment that was not integrated: motion of any size, states of effects of their own."""
        return np.maximum(self.widest, self.states)

    @property
    def floor(self) -> np.ndarray:
        """Standard deviation of the states beside the random force, in one segment: far below what sensors see, for the conditioning."""
        u = 1e-4 * self.resolution
        return np.concatenate([[u, 0.3 * u * self.velocity / self.displacement], 1e-5 * self.own])


@dataclasses.dataclass(frozen=True, kw_only=True)
class Weighed:
    """Whitened local systems of all segments, over the columns (z_(k-1), z_k, z_(k+1), shared, own) with z = (states, force).

    Attributes:
        gram, right: of the readings; (segments, columns, columns) and (segments, columns).
        square: sum of squared whitened residuals.
        log_determinant: of the readings' covariance.
        defect: derivative of z_(k+1) - phi_k; (segments, states, columns).
        gap: z_(k+1) - phi_k; (segments, states).
        linked: whether the segment was integrated, so that it links its knots; (segments,).
        samples: count of weighed readings.
        of_channels: weighed readings of each channel, and their share of the deviance; (channels, 2).
    """

    gram: np.ndarray
    right: np.ndarray
    square: float
    log_determinant: float
    defect: np.ndarray
    gap: np.ndarray
    linked: np.ndarray
    samples: int
    of_channels: np.ndarray
    _sums: list["Sums"] = dataclasses.field(default_factory=list, init=False, repr=False, compare=False)

    def sums(self, chains: Chains, size: int) -> "Sums":
        """What does not depend on the random force, added up once for many solutions."""
        if not self._sums:
            self._sums.append(_summed(self, chains, size))
        return self._sums[0]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Sums:
    """Local systems of the readings, added up over the chain, and those of the motion with the knots last.

    One knot more stands in front of the chain, since the first segment has none before it.

    Attributes:
        band: of the knots' Hessian, lower; (3 size, size (knots + 1)).
        rhs: gradient of the knots, and their Hessian's border with shared and own unknowns; (1 + shared + own, size (knots + 1)).
        border: the same products of shared and own unknowns, and with the residual, by record; (records, 1 + shared + own, ...).
        defect: derivative of the defects by both knots of a segment and by the border, and the defects, at the knot where the segment
            begins, 0 at the last one of a record; (states, 2 size + shared + own + 1, knots + 1).
    """

    band: np.ndarray
    rhs: np.ndarray
    border: np.ndarray
    defect: np.ndarray


def _summed(local: Weighed, chains: Chains, size: int) -> Sums:
    inside, count = 3 * size, size * (chains.knot_count + 1)
    outside = local.gram.shape[1] - inside
    band, rhs = np.zeros((inside, count)), np.zeros((1 + outside, count))
    start = size * chains.left
    for i in range(inside):
        rhs[0, start + i] += local.right[:, i]
        for j in range(i + 1):
            band[i - j, start + j] += local.gram[:, i, j]
        for j in range(outside):
            rhs[1 + j, start + i] += local.gram[:, i, inside + j]
    begins = np.flatnonzero(chains.first)
    border = np.zeros((len(begins), 1 + outside, 1 + outside))
    border[:, 1:, 1:] = np.add.reduceat(local.gram[:, inside:, inside:], begins, axis=0)
    border[:, 0, 1:] = border[:, 1:, 0] = np.add.reduceat(local.right[:, inside:], begins, axis=0)
    moving = np.zeros((local.gap.shape[1], local.defect.shape[-1] - size + 1, chains.knot_count + 1))
    moving[:, :-1, chains.left + 1], moving[:, -1, chains.left + 1] = local.defect[..., size:].transpose(1, 2, 0), local.gap.T
    return Sums(band=band, rhs=rhs, border=border, defect=moving)


def whitenings(chains: Chains, linear: Linearised, errors: tuple[ReadingError, ...]) -> tuple[Whitening, ...]:
    """By channel."""
    counted = (chains.weight > 0) & linear.done[:, None, None]
    return tuple(whitening(error, counted[..., c], chains.first) for c, error in zip(range(len(chains.channels)), errors, strict=True))


def reaching(by: np.ndarray, states: int, order: int) -> Float[np.ndarray, "segments reach columns"]:
    """Derivatives of the last `order` residuals of the segment before and of a segment's own, over the columns of `Weighed`.

    `by` are those of a segment's residuals by its states, its force, and the border; (segments, samples, columns).
    """
    found = np.zeros((len(by), order + by.shape[1], 2 * states + by.shape[-1] + 1))
    _put(found[:, :order], tail(by, order), states, 0)
    _put(found[:, order:], by, states, 1)
    return found


def _put(found: np.ndarray, by: np.ndarray, states: int, knot: int) -> None:
    """Put derivatives by the states at a knot, the force there and at the next one, and the border, into the columns of `Weighed`."""
    size = states + 1
    found[..., knot * size : (knot + 1) * size] = by[..., :size]
    found[..., (knot + 2) * size - 1] = by[..., size]
    found[..., 3 * size :] = by[..., size + 1 :]


def whitened_rows(
    chains: Chains, unknowns: Unknowns, border: Border, linear: Linearised, white: tuple[Whitening, ...]
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """By channel: derivative of the whitened residuals, (segments, samples, columns) as in `Weighed`, and these, (segments, samples)."""
    states = len(unknowns.states)
    by = scaled(chains, border, linear.by, states)
    for c, one in enumerate(white):
        yield one.applied(reaching(by[:, :, c], states, one.lags.shape[-1])), one(linear.residual[:, :, c])


def weighed(chains: Chains, unknowns: Unknowns, border: Border, linear: Linearised, at: Estimate, white: tuple[Whitening, ...]) -> Weighed:
    """Local systems under given reading errors."""
    states = len(unknowns.states)
    size, segments = states + 1, len(chains.left)
    columns = 3 * size + len(unknowns.shared) + len(unknowns.own)
    by_channel = list(whitened_rows(chains, unknowns, border, linear, white))
    squares = [float((residual**2).sum()) for _, residual in by_channel]
    rows, residuals = (np.concatenate(part, axis=1) for part in zip(*by_channel, strict=True))
    turned = rows.swapaxes(1, 2)
    defect = np.zeros((segments, states, columns))
    _put(defect, -scaled(chains, border, linear.end_by, states), states, 1)
    defect[:, np.arange(states), 2 * size + np.arange(states)] += 1.0
    gap = at.states[chains.left + 1] - linear.end
    lost = ~linear.done
    defect[lost], gap[lost] = 0.0, 0.0
    return Weighed(
        gram=turned @ rows,
        right=(turned @ residuals[..., None])[..., 0],
        square=sum(squares),
        log_determinant=sum(one.log_determinant for one in white),
        defect=defect,
        gap=gap,
        linked=linear.done,
        samples=sum(int((one.scale > 0).sum()) for one in white),
        of_channels=np.array([[(one.scale > 0).sum(), squares[c] + one.log_determinant] for c, one in enumerate(white)]),
    )


def scaled(chains: Chains, border: Border, by: np.ndarray, states: int) -> np.ndarray:
    """Derivatives by the border in its natural scale, 0 by what is held; (segments, ..., columns)."""
    own = border.own[chains.record]
    free = np.concatenate([np.broadcast_to(border.shared, (len(own), len(border.shared))), own], axis=1)
    factor = free * np.concatenate([border.shared_scale, border.own_scale])
    found = by.copy()
    found[..., states + 2 :] *= factor.reshape(len(factor), *(1,) * (by.ndim - 2), -1)
    return found


def residuals_after(
    chains: Chains, border: Border, linear: Linearised, shared: np.ndarray, own: np.ndarray, knots: np.ndarray
) -> Float[np.ndarray, "segments samples channels"]:
    """Linearised residuals of the readings after a step, over the declared noise."""
    state, force = knots[chains.left, :-1], np.stack([knots[chains.left, -1], knots[chains.left + 1, -1]], axis=1)
    outside = np.broadcast_to(shared * border.shared_scale * border.shared, (len(state), len(shared)))
    step = np.concatenate([state, force, outside, (own * border.own_scale * border.own)[chains.record]], axis=1)
    return linear.residual + np.einsum("ksci,ki->ksc", linear.by, step)


def motion_covariance(chains: Chains, scales: Scales, force: RandomForce, mass: float) -> Float[np.ndarray, "segments states states"]:
    """Of the states at the end of every segment, given its beginning and the random force at both ends.

    Noise of a recorded input moves the hammer: var(u') = q T with q = S_F / m^2 + S_a of white noise, var(u) = q T^3 / 3, and
    cov(u, u') = q T^2 / 2.
    """
    states, time = len(scales.floor), chains.duration
    covariance = np.zeros((len(chains.left), states, states))
    covariance[:, np.arange(states), np.arange(states)] = scales.floor**2
    covariance[:, :2, :2] += force.bridge(time, mass)
    driven = chains.input_noise @ (mass**-2, 1.0) * time
    covariance[:, :2, :2] += np.moveaxis(driven * np.array([[time**2 / 3.0, time / 2.0], [time / 2.0, np.ones_like(time)]]), -1, 0)
    return covariance
