"""Undeclared saturation: reported, never masked, because it is a finding in itself."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int

from identification.experiment.channels import si_unit
from identification.experiment.columns.missing import runs_of

MIN_RUN = 4
MIN_RUNS = 2
# A smooth crest that quantisation flattens for four samples falls by about three steps within two more; a cut one falls faster.
STEEP_STEPS = 8.0
BASELINE_SHARE = 0.5
BASELINE_NEAR_ZERO = 0.02
SAMPLED_DIGITS = 1000


@dataclass(frozen=True, kw_only=True)
class Saturation:
    """One level at which a channel is cut off.

    Attributes:
        level: SI.
        side: "largest" or "smallest".
        runs: number of stretches at that level.
        samples: number of samples in them.
    """

    level: float
    side: str
    runs: int
    samples: int


def find_saturation(values: Float64[np.ndarray, " samples"]) -> tuple[Saturation, ...]:
    """Look for repeated runs at exactly a channel's largest or smallest value, entered or left steeply.

    Not taken for saturation: a level near zero or one that holds half of all samples (a channel at rest), and crests or rest levels that
    only quantisation makes flat.

    Args:
        values: one channel, SI, shape (samples,); NaN where not usable.

    Returns:
        At most two findings.

    Example:
        >>> wave = np.sin(np.linspace(0.0, 20.0, 200))
        >>> [found.side for found in find_saturation(np.minimum(wave, 0.8))]
        ['largest']
    """
    finite = values[np.isfinite(values)]
    if finite.size == 0 or finite.max() == finite.min():
        return ()
    span = float(finite.max() - finite.min())
    found = []
    for side, signed in (("largest", values), ("smallest", -values)):
        peak = float(np.nanmax(signed))
        at = signed == peak
        if abs(peak) <= BASELINE_NEAR_ZERO * span or at.sum() >= BASELINE_SHARE * finite.size:
            continue
        first, past = runs_of(at)
        long = past - first >= MIN_RUN
        if long.sum() < MIN_RUNS:
            continue
        steep = long & (_fall(signed, peak, first, past) > STEEP_STEPS * _resolution(finite, abs(peak)))
        if steep.sum() >= MIN_RUNS:
            level = peak if side == "largest" else -peak
            found.append(Saturation(level=level, side=side, runs=int(steep.sum()), samples=int((past - first)[steep].sum())))
    return tuple(found)


def saturation_notices(values: Float64[np.ndarray, " samples"], channel: str) -> tuple[str, ...]:
    """Notices on undeclared saturation.

    Args:
        values: one channel, SI, shape (samples,).
        channel: its name.

    Returns:
        One sentence for each level found.
    """
    return tuple(
        f"{channel}: {found.samples} samples in {found.runs} stretches lie at exactly {found.level:.6g} {si_unit(channel)}, the "
        f"{found.side} value: the channel saturates; kept as recorded. To leave them out, declare 'range' in [sensors.{channel}]."
        for found in find_saturation(values)
    )


def _fall(
    signed: Float64[np.ndarray, " samples"], peak: float, first: Int[np.ndarray, " runs"], past: Int[np.ndarray, " runs"]
) -> Float64[np.ndarray, " runs"]:
    """How far below the peak the channel is two samples before and behind each run, whichever is more; shape (runs,)."""
    padded = np.concatenate(([np.nan, np.nan], signed, [np.nan, np.nan]))
    return np.fmax(np.nan_to_num(peak - padded[first], nan=0.0), np.nan_to_num(peak - padded[past + 3], nan=0.0))


def _resolution(finite: Float64[np.ndarray, " usable"], size: float) -> float:
    """Step between neighbouring values of about `size`: that of the quantisation, or of the digits the numbers were printed with."""
    levels = np.diff(np.unique(finite))
    sample = finite[:: max(1, finite.size // SAMPLED_DIGITS)]
    digits = max(len(f"{abs(value):.11e}".partition("e")[0].replace(".", "").rstrip("0")) for value in sample)
    return max(float(levels.min()), 10.0 ** (np.floor(np.log10(size)) - digits + 1))
