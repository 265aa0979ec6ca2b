"""Which cases are drawn: a job is a name, from which its random numbers follow, and an order for the simulator."""

import dataclasses
import itertools
import zlib
from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.simulator import EFFECTS, KINDS, LISTED, UNLISTED, UNREST, Order
from benchmarks.simulator.case import SAMPLES, WITHOUT

SERIES = {"calibration": 70_001, "published": 90_001}
"""First word of every seed. Thresholds may be set on the first series only; published figures come from the second only."""
STRENGTHS = (0.4, 1.3)
_PAIR_STRENGTHS = (0.6, 1.3)
_CHANNELS = ("all", "no load cell", "all", "no accelerometer")
"""In turn, where the caller does not choose."""
_NOT_PAIRED = frozenset({"missing_stop"})


@dataclasses.dataclass(frozen=True, kw_only=True)
class Job:
    """One case to draw, write and diagnose."""

    key: str
    group: str
    """Which: "null", "listed", "off-list", "pair" or "weak"."""
    seed: tuple[int, ...]
    order: Order

    def rng(self, attempt: int = 0) -> np.random.Generator:
        """The job's own random numbers, the same whatever else runs; others for another attempt."""
        return np.random.default_rng((*self.seed, 100 + attempt))

    @property
    def settings(self) -> dict:
        """All that decides what is drawn, as plain data."""
        order = dataclasses.asdict(self.order)
        if not self.order.unrest:  # so that quiet cases drawn before there was unrest stay what they are
            del order["unrest"]
        return {"seed": self.seed, "order": order}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Draw:
    """How many of each, and what may vary."""

    null: int = 0
    per_effect: int = 0
    off_list: int = 0
    pairs: int = 0
    weak: tuple[float, ...] = ()
    """Strengths at which every listed effect is drawn `per_effect` times more."""
    effects: tuple[str, ...] = tuple(EFFECTS)
    """Those that are drawn one at a time."""
    noise: tuple[float, ...] = (1.0,)
    channels: tuple[str, ...] = _CHANNELS
    driven: tuple[int, ...] = (3,)
    unrest: tuple[str, ...] = ()
    """Names in `UNREST`: all of them in every case."""
    series: str = "calibration"
    seed: int = 0
    samples: tuple[int, int] = SAMPLES


def jobs(draw: Draw) -> list[Job]:
    """All cases, those without an effect first; a case depends on its name and on the settings that vary, not on how many there are."""
    listed = [name for name in LISTED if name in draw.effects]
    unlisted = [name for name in UNLISTED if name in draw.effects]
    found = [_job(draw, "null", "null", number, number) for number in range(draw.null)]
    for group, names, count in (("listed", listed, draw.per_effect), ("off-list", unlisted, draw.off_list)):
        for (place, name), number in itertools.product(enumerate(names), range(count)):
            found.append(_job(draw, group, name, number, place + number, names=(name,)))
    for strength, (place, name), number in itertools.product(draw.weak, enumerate(listed), range(draw.per_effect)):
        found.append(_job(draw, "weak", f"{name}={strength:g}", number, place + number, names=(name,), strength=strength))
    found += [_job(draw, "pair", "pair", number, number, names=None) for number in range(draw.pairs)]
    return found


def _job(
    draw: Draw, group: str, what: str, number: int, turn: int, *, names: Sequence[str] | None = (), strength: float | None = None
) -> Job:
    """One case; rigs, noise, channels and the number of records take turns, `turn` says whose; no `names` means any two."""
    key = f"{what}-{number:04d}"
    seed = (SERIES[draw.series], draw.seed, zlib.crc32(key.encode("ascii")))
    rng = np.random.default_rng(seed)
    if names is None:
        allowed = [name for name in LISTED if name not in _NOT_PAIRED]
        names = tuple(str(name) for name in rng.choice(allowed, 2, replace=False))
    low, high = _PAIR_STRENGTHS if group == "pair" else STRENGTHS
    order = Order(
        kind=list(KINDS)[turn % len(KINDS)],
        effects=tuple((name, float(rng.uniform(low, high)) if strength is None else strength) for name in names),
        noise=_in_turn(draw.noise, turn // len(KINDS)),
        channels=_in_turn(_seen(draw.channels, names), turn // len(KINDS)),
        driven=_in_turn(draw.driven, turn // len(KINDS)),
        samples=draw.samples,
        unrest=tuple(sorted(set(draw.unrest), key=UNREST.index)),
    )
    return Job(key=key, group=group, seed=seed, order=order)


def _in_turn(values: Sequence, turn: int):
    return values[turn % len(values)]


def _seen(channels: Iterable[str], names: Iterable[str]) -> tuple[str, ...]:
    """The choices that keep every channel without which one of the effects could not be seen; all channels if none does."""
    needs = {channel for name in names for channel in EFFECTS[name].needs}
    return tuple(name for name in channels if not needs & set(WITHOUT[name])) or ("all",)
