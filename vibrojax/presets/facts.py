"""What the thesis's front matter states about the rigs' motion, each fact as something that a preset can be asked.

To add one: name its row in `data/thesis/`, write the question as a final subclass of `AbstractFact` that implements `ask`, then list it in
`FACTS`.
"""

import abc
import dataclasses
import functools
import tomllib
from typing import Any

import numpy as np

from vibrojax.data_files import data_path
from vibrojax.errors import NoConvergenceError
from vibrojax.presets.band import Band, band, coexisting
from vibrojax.presets.inference import GRID_HZ, fits_labels
from vibrojax.presets.preset import read_preset


@dataclasses.dataclass(frozen=True, kw_only=True)
class Answer:
    """What a preset gives, in words, and whether that is what is stated."""

    found: str
    reproduced: bool


@dataclasses.dataclass(frozen=True, kw_only=True)
class AbstractFact(abc.ABC):
    """One stated fact.

    Attributes:
        preset: name of the preset that is asked.
        rows: names of its rows in the preset's table of `data/thesis/`.
        used: whether it entered the search for the preset's numbers; then it is no test of the preset. How well the other facts predict
            it, `python -m benchmarks.preset_search` says.
        words: in place of the note of the first row.
    """

    preset: str
    rows: tuple[str, ...]
    used: bool = False
    words: str = ""

    @abc.abstractmethod
    def ask(self) -> Answer:
        """What the preset gives."""

    @property
    def values(self) -> tuple[float, ...]:
        """The stated numbers."""
        return tuple(float(row["value"]) for row in self._rows())

    @property
    def statement(self) -> str:
        """What is stated, in the words of the table."""
        first = self._rows()[0]
        values = ", ".join(f"{row['symbol']} = {float(row['value']):g} {row['unit']}".removesuffix(" 1") for row in self._rows())
        return f"{self.words or first.get('note', first['name'].replace('_', ' '))}: {values}"

    @property
    def source(self) -> str:
        """Where it is stated."""
        return ", ".join(dict.fromkeys(str(row["source"]) for row in self._rows()))

    def _rows(self) -> list[dict[str, Any]]:
        table = _table(read_preset(self.preset).thesis)
        return [table[name] for name in self.rows]


@dataclasses.dataclass(frozen=True, kw_only=True)
class LargestForce(AbstractFact):
    """The impact force of the band z = 1/n is largest at a frequency; reproduced to one step of the experiment's grid."""

    gap: float
    cycles: int

    def ask(self) -> Answer:
        """Frequency of the largest force along the stable stretch of the branch."""
        return _within(self.preset, self.gap, self.cycles, self.values[0], "largest")


@dataclasses.dataclass(frozen=True, kw_only=True)
class BandEnd(AbstractFact):
    """Something changes at a frequency: read as the upper end of the band z = 1/n; reproduced to one step of the experiment's grid."""

    gap: float
    cycles: int

    def ask(self) -> Answer:
        """Frequency at which the band ceases to be stable."""
        return _within(self.preset, self.gap, self.cycles, self.values[0], "end")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Coexistence(AbstractFact):
    """At (Omega/omega, gap/A0) the rig may strike the stop or stay off it, by how it is started.

    Reproduced where both motions last: starts that stop striking between 1500 and 3000 cycles mark a long transient, not a basin.
    """

    def ask(self) -> Answer:
        """Both kinds of motion, by brute force."""
        found = coexisting(read_preset(self.preset), *self.values)
        rest = "rest stays off" if found.stays_off else "nothing stays off"
        words = f"{rest}; of {found.starts} starts {found.early} strike after 1500 cycles, {found.late} after 3000"
        return Answer(found=words, reproduced=found.stays_off and 0 < found.late == found.early)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Labels(AbstractFact):
    """The printed Omega/omega belong to frequencies of the experiment's grid."""

    def ask(self) -> Answer:
        """Whether rounding such frequencies over f_n gives every label."""
        f_n = read_preset(self.preset)["natural_frequency_hz"]
        fits = fits_labels(f_n, self.values)
        return Answer(
            found=f"f_n = {f_n:g} Hz {'gives all' if fits else 'does not give all'} from multiples of {GRID_HZ:g} Hz", reproduced=fits
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Beat(AbstractFact):
    """Without impacts the rig beats: reproduced if one beat is shorter than the time in which the free vibration dies down by e."""

    def ask(self) -> Answer:
        """Beat 1 / |f - f_n| against 1 / (zeta omega_n)."""
        preset = read_preset(self.preset)
        beat = 1.0 / abs(self.values[0] - preset["natural_frequency_hz"])
        decay = 1.0 / (preset["damping_ratio"] * preset.omega_n)
        return Answer(found=f"one beat takes {beat:.1f} s, decay {decay:.1f} s (damping assumed)", reproduced=beat < decay)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Held(AbstractFact):
    """A stated setting that the preset holds."""

    number: str
    factor: float = 1.0
    """From the unit of the row to SI."""

    def ask(self) -> Answer:
        """The preset's number."""
        number = read_preset(self.preset).numbers[self.number]
        return Answer(found=f"{number.value:g} {number.unit}", reproduced=bool(np.isclose(number.value, self.factor * self.values[0])))


def _basins(preset: str, prefix: str, count: int) -> list[AbstractFact]:
    names = [(f"{prefix}_{index}_frequency_ratio", f"{prefix}_{index}_gap_ratio") for index in range(1, count + 1)]
    return [Coexistence(preset=preset, rows=rows, used=True) for rows in names]


_COMPARED = ("0_0_at_2_7", "0_0_at_3_8", "1_0_at_1_5", "1_0_at_3_3", "1_0_at_4_7", "2_4_at_1_2", "2_4_at_1_4", "2_4_at_2_7")
FACTS: tuple[AbstractFact, ...] = (
    Beat(preset="wires", rows=("no_impact_beat",)),
    Labels(preset="wires", rows=tuple(f"compared_gap_{name}" for name in _COMPARED), used=True, words="compared at"),
    BandEnd(preset="wires", rows=("observed_gap_0_0_at_4_75",), gap=0.0, cycles=1, used=True),
    LargestForce(preset="wires", rows=("observed_gap_0_0_at_7_25",), gap=0.0, cycles=2, used=True),
    BandEnd(preset="wires", rows=("observed_gap_0_0_at_8_25",), gap=0.0, cycles=2, used=True),
    BandEnd(preset="wires", rows=("observed_gap_0_0_at_8_5",), gap=0.0, cycles=2, used=True),
    LargestForce(preset="wires", rows=("observed_gap_1_0_at_3_0",), gap=1e-3, cycles=1, used=True),
    LargestForce(preset="wires", rows=("observed_gap_1_0_at_6_25",), gap=1e-3, cycles=2, used=True),
    BandEnd(preset="wires", rows=("observed_gap_1_0_at_7_0",), gap=1e-3, cycles=2, used=True),
    *_basins("wires", "basin", 6),
    LargestForce(preset="beam_170", rows=("observed_170_gap_0_at_9_0",), gap=0.0, cycles=1, used=True),
    BandEnd(preset="beam_170", rows=("observed_170_gap_0_at_12_25",), gap=0.0, cycles=1, used=True),
    *_basins("beam_170", "basin_170", 2),
    *_basins("beam_150", "basin_150", 2),
    *_basins("beam_135", "basin_135", 2),
    Held(preset="drilling_hammer", rows=("hammer_mass",), number="mass", used=True),
    Held(preset="drilling_hammer", rows=("excitation_frequency",), number="excitation_frequency", used=True),
    Held(preset="drilling_hammer", rows=("excitation_amplitude_30",), number="base_amplitude", factor=1e-3, used=True),
    Held(preset="drilling_hammer", rows=("weight_on_bit",), number="weight_on_bit", factor=1e3, used=True),
)
"""Every fact about motion; frequencies that are only shown, with nothing said about them, are none."""


@functools.cache
def _table(name: str) -> dict[str, dict[str, Any]]:
    rows = tomllib.loads(data_path("thesis", f"{name}.toml").read_text(encoding="utf-8"))["value"]
    return {row["name"]: row for row in rows}


def _within(preset: str, gap: float, cycles: int, stated: float, place: str) -> Answer:
    """Whether a place of a band lies within a step of the grid of what is stated."""
    words = {"largest": "force largest at", "end": "band ends at"}
    try:
        here: Band = band(preset, gap, cycles)
    except NoConvergenceError as error:
        return Answer(found=f"no band z = 1/{cycles}: {error}", reproduced=False)
    value = float(getattr(here, place))
    return Answer(found=f"z = 1/{cycles}: {words[place]} {value:.2f} Hz", reproduced=abs(value - stated) <= GRID_HZ)
