"""An effect that a rig can conceal: a name, and a function that turns a strength into numbers.

At strength 1 the effect is clearly there; 0.4 is weak. The numbers are relative to the rig's own forces (k A0, A0 omega_n).

To add one: write its physics into `kernel.py` (or its fault into `faults.py`), write `draw(rng, setting, strength) -> Hidden` in the file
of its kind, then list it in `effects/__init__.py`.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from benchmarks.simulator.effects.setting import Setting
from benchmarks.simulator.hidden import Hidden

Draw = Callable[[np.random.Generator, Setting, float], Hidden]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Effect:
    """One entry of the table of effects."""

    name: str
    draw: Draw
    needs: frozenset[str] = frozenset()
    """Channels without which it cannot be seen at all."""


def either_sign(rng: np.random.Generator) -> float:
    """Plus or minus one."""
    return float(rng.choice((-1.0, 1.0)))
