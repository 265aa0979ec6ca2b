"""`python -m benchmarks.concealed.level --rate 0.01 FILE ...`: the level of chance at which so many complete rigs are found wanting.

A parametric bootstrap: the files are what `python -m benchmarks.concealed --null N --json FILE` wrote, rigs that conceal nothing. Of each
the chance of the best candidate is taken, as the score test states it. An exact test would state a chance below p in a share p of the
rigs; how far this one is from that is measured here.
"""

import argparse
import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from benchmarks.resumable import finished

_TAIL = 0.5
"""Share of the rigs, the least chances, that the tail is fitted to."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Level:
    """Level of chance for one rate of false alarms.

    Attributes:
        alpha: the level.
        interval: that 95 % of bootstrap samples lie in.
        inflation: scale of the tail of -ln(chance); 1 where the test is exact.
        rigs: count.
        least: smallest chance among them.
    """

    alpha: float
    interval: tuple[float, float]
    inflation: float
    rigs: int
    least: float


def level(chances: Float[np.ndarray, " rigs"], rate: float, *, draws: int = 2000, seed: int = 0) -> Level:
    """Level below which the least chance of a complete rig lies at such a rate.

    -ln(chance) beyond its median falls off exponentially, with scale 1 where the test is exact; its scale is the mean excess (peaks over a
    threshold).

    Args:
        chances: the best candidate's, of each rig; between 0 and 1.
        rate: of false alarms, below a half.
        draws: samples with replacement for the interval.
        seed: of these.

    Source: J. Pickands, Ann. Stat. 3 (1975) 119-131; B. Efron, R. Tibshirani, An Introduction to the Bootstrap (1993), ch. 6.
    """
    if len(chances) < 2 or not 0.0 < rate < _TAIL:
        raise ValueError(
            f"a level needs two rigs at least and a rate between 0 and {_TAIL}; there are {len(chances)} rigs, the rate is {rate}"
        )
    values = -np.log(np.maximum(chances, 1e-300))
    rng = np.random.default_rng(seed)
    drawn = [_quantile(rng.choice(values, len(values)), rate)[0] for _ in range(draws)]
    quantile, scale = _quantile(values, rate)
    low, high = np.exp(-np.quantile(drawn, [0.975, 0.025]))
    return Level(
        alpha=float(np.exp(-quantile)),
        interval=(float(low), float(high)),
        inflation=scale,
        rigs=len(values),
        least=float(np.min(chances)),
    )


def _quantile(values: Float[np.ndarray, " rigs"], rate: float) -> tuple[float, float]:
    """Value that is passed at the rate, and the scale of the tail."""
    threshold = float(np.quantile(values, 1.0 - _TAIL))
    beyond = values[values > threshold]
    scale = float(np.mean(beyond - threshold)) if len(beyond) else 0.0
    return threshold + scale * np.log(len(beyond) / len(values) / rate) if len(beyond) else threshold, scale


def main() -> None:
    """Command line."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.concealed.level", description=(__doc__ or "").splitlines()[0])
    made.add_argument(
        "files", type=Path, nargs="+", metavar="FILE", help="written by `python -m benchmarks.concealed --null N --json FILE`"
    )
    made.add_argument("--rate", type=float, default=0.01, metavar="R", help="share of complete rigs that may be found wanting")
    options = made.parse_args()
    table = Table("rigs", "count", "least chance", "inflation", f"level at {options.rate:g}", "95 % interval")
    chances = {file.stem: _chances(file) for file in options.files}
    for name, values in [*chances.items(), ("all", np.concatenate(list(chances.values())))]:
        found = level(values, options.rate)
        low, high = found.interval
        row = (name, str(found.rigs), f"{found.least:.1e}", f"{found.inflation:.2f}", f"{found.alpha:.1e}", f"{low:.1e} … {high:.1e}")
        table.add_row(*row)
    Console().print(table)


def _chances(file: Path) -> Float[np.ndarray, " rigs"]:
    """Of every complete rig in a file."""
    trials = finished(file.with_suffix(".jsonl"), "key").values()
    return np.array([one["diagnosis"]["chance"] for one in trials if not one["effects"] and "diagnosis" in one])


if __name__ == "__main__":
    main()
