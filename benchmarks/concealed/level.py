"""`python -m benchmarks.concealed.level --rate 0.01 FILE ...`: the level of chance that candidates pass on so many complete rigs.

The files are those of `python -m benchmarks.concealed --null N --json FILE`: simulated rigs that conceal nothing. The score test states a
chance for the best candidate of every kind. Were it exact, that would be below p on a share p of the rigs; how far it is from that is
measured here. What passes is fitted, and named only if the fit bears it out: the share of rigs on which an effect is named is no larger.
"""

import argparse
import dataclasses
import itertools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from rich.console import Console
from rich.table import Table

from benchmarks.resumable import finished


@dataclasses.dataclass(frozen=True, kw_only=True)
class Level:
    """Level of chance for one rate of false alarms.

    Attributes:
        alpha: the level, for one kind of candidate.
        interval: that 95 % of samples of the rigs, drawn with replacement, lie in.
        inflation: scale of the tail of -ln(chance); 1 where the test is exact and the kinds are independent.
        rigs: count.
        least: smallest chance among them.
    """

    alpha: float
    interval: tuple[float, float]
    inflation: float
    rigs: int
    least: float


def level(chances: Sequence[Float[np.ndarray, " kinds"]], rate: float, *, draws: int = 2000, seed: int = 0) -> Level:
    """The level below which some kind's chance lies on such a share of complete rigs.

    The least of K chances p counts as the chance 1 - (1 - p)^K of the whole rig. Its -ln beyond the median falls off exponentially, with
    scale 1 where the test is exact; the scale is the mean excess (peaks over a threshold).

    Args:
        chances: of every kind, rig by rig; between 0 and 1.
        rate: share of the rigs.
        draws: samples with replacement for the interval.
        seed: of these.

    Raises:
        ValueError: fewer than two rigs, or a rate that the tail does not reach.

    Source: Z. Sidak, JASA 62 (1967) 626-633; J. Pickands, Ann. Stat. 3 (1975) 119-131; B. Efron, R. Tibshirani, An Introduction to the
    Bootstrap (1993), ch. 6.
    """
    if len(chances) < 2:
        raise ValueError(f"a level needs two rigs or more that conceal nothing, and there are {len(chances)}: draw more with --null")
    least, kinds = np.array([one.min() for one in chances]), int(np.median([len(one) for one in chances]))
    whole = -np.expm1(kinds * np.log1p(-np.clip(least, 1e-300, 1.0 - 1e-15)))
    values = -np.log(whole)
    threshold = float(np.median(values))
    if not 0.0 < rate < np.mean(values > threshold):
        raise ValueError(f"a rate between 0 and {np.mean(values > threshold):.2g} can be told from these rigs, and {rate:g} was asked for")
    rng = np.random.default_rng(seed)
    drawn = [_quantile(rng.choice(values, len(values)), rate)[0] for _ in range(draws)]
    quantile, scale = _quantile(values, rate)
    alpha, low, high = -np.expm1(np.log1p(-np.exp(-np.array([quantile, *np.quantile(drawn, [0.975, 0.025])]))) / kinds)
    return Level(alpha=float(alpha), interval=(float(low), float(high)), inflation=scale, rigs=len(values), least=float(least.min()))


def _quantile(values: Float[np.ndarray, " rigs"], rate: float) -> tuple[float, float]:
    """Value that is passed at the rate, and the scale of the tail beyond the median."""
    threshold = float(np.median(values))
    beyond = values[values > threshold]
    scale = float(np.mean(beyond - threshold)) if len(beyond) else 0.0
    return threshold + scale * max(float(np.log(max(len(beyond), 1) / len(values) / rate)), 0.0), scale


def main() -> None:
    """Command line."""
    made = argparse.ArgumentParser(prog="python -m benchmarks.concealed.level", description=(__doc__ or "").splitlines()[0])
    made.add_argument(
        "files", type=Path, nargs="+", metavar="FILE", help="written by `python -m benchmarks.concealed --null N --json FILE`"
    )
    made.add_argument(
        "--rate", type=float, default=0.01, metavar="R", help="share of complete rigs on which a candidate may be significant"
    )
    options = made.parse_args()
    table = Table("rigs", "count", "least chance", "inflation", f"level at {options.rate:g}", "95 % interval")
    try:
        chances = {str(file): _chances(file) for file in options.files}
        for name, rigs in (chances | {"all": list(itertools.chain(*chances.values()))}).items():
            found = level(rigs, options.rate)
            low, high = found.interval
            row = (name, str(found.rigs), f"{found.least:.1e}", f"{found.inflation:.2f}", f"{found.alpha:.1e}", f"{low:.1e} … {high:.1e}")
            table.add_row(*row)
    except (ValueError, FileNotFoundError) as error:
        made.error(str(error))
    Console().print(table)


def _chances(file: Path) -> list[Float[np.ndarray, " kinds"]]:
    """Of every complete rig in a file."""
    lines = file.with_suffix(".jsonl")
    if not lines.exists():
        raise FileNotFoundError(f"{lines} is not there: it is written by `python -m benchmarks.concealed --null N --json {file}`")
    complete = [one["diagnosis"] for one in finished(lines, "key").values() if not one["effects"] and "diagnosis" in one]
    if not all("chances" in one for one in complete):
        raise ValueError(f"{lines} is of an older version, which kept no chances: count these rigs again")
    return [np.array(one["chances"]) for one in complete if one["chances"]]


if __name__ == "__main__":
    main()
