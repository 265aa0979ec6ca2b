"""Floquet multipliers of a periodic orbit, and functions that vanish where its stability changes."""

import numpy as np
from jaxtyping import Bool, Complex, Float

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
