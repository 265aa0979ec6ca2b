"""Baseline: SINDy's sequentially thresholded least squares (Brunton, Proctor and Kutz 2016) as PySINDy has it, on the same terms.

The threshold is the one of a series whose terms have the least Bayesian information criterion.
"""

import warnings
from pathlib import Path

import numpy as np

from benchmarks.concealed.bic import criterion
from benchmarks.concealed.force_balance import force_balance
from benchmarks.concealed.library import Regression, regression

NAME = "sindy"
_THRESHOLDS = tuple(np.geomspace(1e-3, 0.3, 11))
"""A term must reach this share of the whole force, both as root mean squares over the rows."""
_RIDGE = 1e-9


def name_effect(folder: Path) -> list[str]:
    """Effects of the surviving terms, first the one that would be missed most; empty where none survives."""
    return sparse_terms(regression(force_balance(folder)))


def sparse_terms(law: Regression) -> list[str]:
    """Nominal terms always stay; columns and target are scaled to a root mean square of 1, so coefficients are shares of the force."""
    names = np.array([name for name, columns in law.terms.items() for _ in range(columns.shape[1])])
    terms = np.concatenate(list(law.terms.values()), axis=1)
    names, terms = names[np.any(terms != 0.0, axis=0)], terms[:, np.any(terms != 0.0, axis=0)]
    nominal = law.nominal[:, np.any(law.nominal != 0.0, axis=0)]

    def score(kept: np.ndarray) -> float:
        return criterion(np.concatenate([nominal, terms[:, kept]], axis=1), law)

    supports = [_support(nominal, terms, law.target, threshold) for threshold in _THRESHOLDS]
    best = min(supports, key=score)
    loss = {str(name): score(best & (names != name)) for name in dict.fromkeys(names[best])}
    return sorted(loss, key=lambda name: -loss[name])


def _support(nominal: np.ndarray, terms: np.ndarray, target: np.ndarray, threshold: float) -> np.ndarray:
    """Which terms stay, by sequential thresholding."""
    from pysindy.optimizers import STLSQ  # pyright: ignore[reportMissingImports] - of the extra `compare`

    columns = np.concatenate([nominal, terms], axis=1)
    scaled = columns / np.linalg.norm(columns, axis=0)
    candidates = list(range(nominal.shape[1], columns.shape[1]))
    # PySINDy 2.1 raises IndexError in its last, unthresholded fit if some columns are fixed; without ridge that fit changes nothing
    optimizer = STLSQ(threshold=threshold, alpha=_RIDGE, sparse_ind=candidates, unbias=False)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that few terms are left is what is wanted
        optimizer.fit(scaled, target[:, None] / np.linalg.norm(target))
    return np.asarray(optimizer.coef_)[0] != 0.0
