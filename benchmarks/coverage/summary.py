"""From many trials to shares with intervals."""

from collections.abc import Sequence

import numpy as np
from rich.table import Table
from scipy.stats import binomtest

ORDER = ("k_i", "n", "lambda_i", "zeta", "f_n", "gap_error", "base_amplitude", "base_phase")


def summary(trials: Sequence[dict]) -> dict:
    """Coverage with its 95 % interval (Clopper and Pearson 1934), mean and standard deviation of z, by parameter; and the failures.

    What every record has of its own (gap errors, base amplitudes) counts once a record: records of one fit are not independent, and that
    interval is narrower than it should be.
    """
    fitted = [t for t in trials if "rows" in t]
    chi2 = [t["chi2_reduced"] for t in fitted]
    seconds = [t["seconds"] for t in trials]
    return {
        "experiments": len(trials),
        "parameters": {name: _parameter(name, fitted) for name in ORDER},
        "chi2_reduced": {"least": min(chi2, default=None), "largest": max(chi2, default=None)},
        "not_converged": [t["key"] for t in fitted if not t["converged"]],
        "failures": {t["key"]: t["failure"] for t in trials if "failure" in t},
        "seconds_per_experiment": float(np.median(seconds)) if seconds else None,
    }


def _parameter(name: str, fitted: Sequence[dict]) -> dict:
    rows = [row for t in fitted for row in t["rows"] if row["name"] == name]
    judged = [row for row in rows if row["z"] is not None]
    if not judged:
        return {"of": 0, "without_error": len(rows)}
    covered, z = sum(row["covered"] for row in judged), np.array([row["z"] for row in judged])
    interval = binomtest(covered, len(judged)).proportion_ci(0.95)
    return {
        "covered": covered,
        "of": len(judged),
        "share": covered / len(judged),
        "ci95": [float(interval.low), float(interval.high)],
        "z_mean": float(z.mean()),
        "z_std": float(z.std(ddof=1)) if len(z) > 1 else None,
        "z_farthest": float(np.abs(z).max()),
        "without_error": len(rows) - len(judged),
    }


def table(rig: str, result: dict) -> Table:
    """The same for reading."""
    title = f"95 % intervals in {result['experiments']} simulated experiments, {rig} rigs"
    columns = ("parameter", "cover the truth", "share", "its 95 % interval", "mean z", "std z", "farthest z", "no error given")
    shown = Table(*columns, title=title)
    for name, row in result["parameters"].items():
        if not row["of"]:
            shown.add_row(name, "-", "", "", "", "", "", str(row["without_error"]))
            continue
        low, high = row["ci95"]
        spread = "" if row["z_std"] is None else f"{row['z_std']:.2f}"
        numbers = (f"{row['share']:.3f}", f"{low:.3f} … {high:.3f}", f"{row['z_mean']:+.2f}", spread, f"{row['z_farthest']:.1f}")
        shown.add_row(name, f"{row['covered']} of {row['of']}", *numbers, str(row["without_error"]))
    return shown
