"""How well a model predicts records that nobody fitted: noise-free, from a known start."""

import numpy as np

_TOUCHING = 0.02
"""Contact, as a share of the record's highest force."""


def sealed_errors(model, experiment) -> dict:
    """Mean errors over the sealed records; a record that cannot be simulated counts as error 1 with its message.

    `displacement`: rms error of the hammer's displacement over its rms; 1 is no better than no model, sqrt 2 an independent motion.
    `peaks`: the same of the sorted peak forces of all impacts, missing impacts counting as zero: it asks for the right impacts at any time,
    which is what remains to be predicted once motions have diverged.
    """
    from identification.estimation.simulate import simulate_record

    errors, failures = [], []
    for record in experiment.records:
        try:
            found = simulate_record(model, record)
        except Exception as error:  # noqa: BLE001 - a model that does not run has predicted nothing
            failures.append(f"{record.file}: {type(error).__name__}: {error}")
            errors.append({"displacement": 1.0, "peaks": 1.0})
            continue
        errors.append(
            {
                "displacement": displacement_error(found["hammer_displacement"], record.channels["hammer_displacement"]),
                "peaks": peak_error(found["impact_force"], record.channels["impact_force"]),
            }
        )
    means = {name: float(np.mean([error[name] for error in errors])) for name in ("displacement", "peaks")}
    return means | ({"failures": failures} if failures else {})


def displacement_error(found: np.ndarray, truth: np.ndarray) -> float:
    """Rms error over the rms of the truth about its mean; 10 at most, and for what is not finite."""
    error = float(np.sqrt(np.mean((found - truth) ** 2)) / np.std(truth))
    return min(error, 10.0) if np.isfinite(error) else 10.0


def peak_error(found: np.ndarray, truth: np.ndarray) -> float:
    """Rms difference of the sorted peak forces over the rms of the true ones; 0 if neither has an impact, 10 at most."""
    level = _TOUCHING * float(truth.max())
    ours, theirs = impact_peaks(found, level), impact_peaks(truth, level)
    if not len(theirs):
        return float(len(ours) > 0)
    count = max(len(ours), len(theirs))
    ours, theirs = (np.pad(peaks, (0, count - len(peaks))) for peaks in (ours, theirs))
    error = float(np.sqrt(np.sum((ours - theirs) ** 2) / np.sum(theirs**2)))
    return min(error, 10.0) if np.isfinite(error) else 10.0


def impact_peaks(force: np.ndarray, level: float) -> np.ndarray:
    """Highest force of every stretch above `level`, N, largest first."""
    above = np.concatenate([[False], force > max(level, 0.0), [False]])
    edges = np.flatnonzero(above[1:] != above[:-1]).reshape(-1, 2)
    return np.sort([force[first:last].max() for first, last in edges])[::-1]
