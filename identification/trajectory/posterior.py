"""What the chain leaves uncertain, segment by segment, and the products of reading errors that are expected under it.

The covariance of three neighbouring knots is a part of the inverse of the banded Hessian, by a recursion from the last knot to the first:
with H = L L', G_k = (L_(k+1,k); L_(k+2,k)) L_kk^-1 and S_k the covariance of the knots k+1 and k+2,

    cov(z_k) = (L_kk L_kk')^-1 + G_k' S_k G_k,   cov(z_k, (z_(k+1), z_(k+2))) = -G_k' S_k.

Source: K. Takahashi, J. Fagan, M. Chen, Formation of a sparse bus impedance matrix, Proc. PICA (1973) 63-69; R. A. Fisher's identity, as in
T. A. Louis, J. R. Stat. Soc. B 44 (1982) 226-233: the gradient of a marginal likelihood is the expected gradient of the joint one.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from identification.trajectory.chain_equations import Border, reaching, residuals_after, scaled
from identification.trajectory.elimination import Solution
from identification.trajectory.motion import Linearised
from identification.trajectory.reading_error import run_lengths, tail
from identification.trajectory.segments import Chains, Unknowns


def knots_covariance(solution: Solution) -> Float[np.ndarray, "knots three three"]:
    """Covariance of each knot with the two behind it, given the numbers outside the chain; three times (states + force).

    Raises:
        LinAlgError: it grows beyond all bounds towards the first knot.
    """
    knots, size = solution.knots.shape
    factor, rows = solution.factor, np.arange(3 * size)
    padded = np.concatenate([factor, np.zeros((3 * size, 2 * size))], axis=1)
    begin = size * np.arange(knots)
    column = np.zeros((knots, 3 * size, size))  # L below and at the diagonal, by block
    for j in range(size):
        column[:, j:, j] = padded[rows[: 3 * size - j], begin[:, None] + j]
    inverse = np.linalg.inv(column[:, :size])
    gain = column[:, size:] @ inverse
    own = inverse.swapaxes(1, 2) @ inverse
    found, behind = np.zeros((knots, 3 * size, 3 * size)), np.zeros((2 * size, 2 * size))
    with np.errstate(over="ignore", invalid="ignore"):
        for k in range(knots - 1, -1, -1):
            across = -behind @ gain[k]
            here = found[k]
            here[:size, :size] = own[k] - gain[k].T @ across
            here[size:, :size], here[:size, size:], here[size:, size:] = across, across.T, behind
            behind = here[: 2 * size, : 2 * size]
    if not np.isfinite(behind).all():
        raise np.linalg.LinAlgError("the covariance of the knots overflows")
    return found


def segments_covariance(chains: Chains, solution: Solution) -> Float[np.ndarray, "segments columns columns"]:
    """Posterior covariance of what a segment's readings depend on, in the order of `Weighed`.

    Raises:
        LinAlgError: see `knots_covariance`.
    """
    size = solution.knots.shape[1]
    between, before = knots_covariance(solution), np.maximum(chains.left - 1, 0)
    inside = between[before]
    early = chains.left == 0  # no knot stands before the first one
    inside[early] = 0.0
    inside[np.ix_(early, np.arange(size, 3 * size), np.arange(size, 3 * size))] = between[chains.left[early], : 2 * size, : 2 * size]
    outside = solution.outside_covariance
    by = solution.knots_by_outside.reshape(len(solution.knots), size, -1)
    places = np.stack([before, chains.left, chains.left + 1], axis=1)
    fixed = np.broadcast_to(np.eye(outside.shape[1]), (len(places), *outside.shape[1:]))
    turn = np.concatenate([by[places].reshape(len(places), 3 * size, -1), fixed], axis=1)
    found = turn @ outside[chains.record] @ turn.swapaxes(1, 2)
    found[:, : 3 * size, : 3 * size] += inside
    return found


def expected_products(
    chains: Chains, unknowns: Unknowns, border: Border, linear: Linearised, solution: Solution, highest: int
) -> Iterator[tuple[Float[np.ndarray, "runs lags lags"], Float[np.ndarray, " runs"]]]:
    """By channel: expected sums of r_(i-j) r_(i-l) over the samples that have 0, 1, ..., `highest` counted ones in a row before them.

    And how many samples these are. Residuals are over the declared noise; products of more lags than samples before mean nothing.

    Raises:
        LinAlgError: see `knots_covariance`.
    """
    states, samples = len(unknowns.states), chains.samples
    covariance = segments_covariance(chains, solution)
    mean = residuals_after(chains, border, linear, solution.shared, solution.own, solution.knots)
    by = scaled(chains, border, linear.by, states)
    counted = (chains.weight > 0) & linear.done[:, None, None]
    for c in range(len(chains.channels)):
        here = counted[..., c]
        runs = run_lengths(here, chains.first, highest)
        rows = reaching(by[:, :, c], states, highest)
        values = np.concatenate([tail(mean[..., c], highest), mean[..., c]], axis=1)
        products = rows @ covariance @ rows.swapaxes(1, 2)
        products += values[:, :, None] * values[:, None, :]
        sums, full = np.zeros((highest + 1, highest + 1, highest + 1)), (here & (runs == highest)).all(axis=1)
        together = (full.astype(float) @ products.reshape(len(products), -1)).reshape(products.shape[1:])  # most segments are alike
        some, counts, lengths = products[~full], here[~full], runs[~full]
        for i in range(samples):
            lags = slice(i, i + highest + 1)
            sums[highest] += together[lags, lags]
            window = some[:, lags, lags].reshape(len(some), (highest + 1) ** 2)
            for run in np.unique(lengths[counts[:, i], i]):
                total = (counts[:, i] & (lengths[:, i] == run)).astype(float) @ window
                sums[run] += total.reshape(highest + 1, highest + 1)
        yield sums[:, ::-1, ::-1], np.array([np.sum(here & (runs == run)) for run in range(highest + 1)], float)
