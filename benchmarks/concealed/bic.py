"""Baseline: effects are added one after the other as long as the Bayesian information criterion falls (Schwarz 1978)."""

from pathlib import Path

import numpy as np

from benchmarks.concealed.force_balance import force_balance
from benchmarks.concealed.library import Regression, regression

NAME = "bic"
_DECISIVE = 10.0
"""A smaller drop of the criterion is no evidence (Kass and Raftery 1995)."""
_AT_MOST = 4
"""Effects."""


def name_effect(folder: Path) -> list[str]:
    """The chosen effects, the first chosen first; empty where the nominal terms suffice, "unlisted" for a term that is no listed effect."""
    return forward_selection(regression(force_balance(folder)))


def forward_selection(law: Regression) -> list[str]:
    """Greedy search over effects: no orthogonal score, no nuisances, no correlation between samples."""
    chosen: list[str] = []
    columns = law.nominal
    best = criterion(columns, law)
    while len(chosen) < _AT_MOST:
        left = {name: np.concatenate([columns, terms], axis=1) for name, terms in law.terms.items() if name not in chosen}
        scores = {name: criterion(each, law) for name, each in left.items()}
        name = min(scores, key=lambda each: scores[each])
        if scores[name] > best - _DECISIVE:
            break
        best, columns = scores[name], left[name]
        chosen.append(name)
    return chosen


def criterion(columns: np.ndarray, law: Regression) -> float:
    """N ln(RSS / N) + p ln N with the best coefficients of these columns."""
    scale = np.linalg.norm(columns, axis=0)
    kept = columns[:, scale > 0.0] / scale[scale > 0.0]
    solution = np.linalg.lstsq(kept, law.target, rcond=1e-12)[0]
    misfit = float(np.sum((law.target - kept @ solution) ** 2))
    return law.count * np.log(misfit / law.count) + kept.shape[1] * np.log(law.count)
