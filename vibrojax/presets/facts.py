"""What the thesis's front matter states about the rigs' motion, each fact as something that a preset can be asked.

Bands of motion with one impact in n cycles come from continuation of the compliant rig, coexistence of motions with and without impacts
from many initial states.

To add one: name its row in `data/thesis/`, write the question as a final subclass of `AbstractFact` that implements `ask`, then list it in
`FACTS`.
"""

import abc
import dataclasses
import functools
import tomllib
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from vibrojax.continuation import find_orbit, follow
from vibrojax.continuation.branch import Branch
from vibrojax.continuation.rig import ForcedRig, as_arrays, strobe
from vibrojax.data_files import data_path
from vibrojax.errors import NoConvergenceError
from vibrojax.integrate import Landing
from vibrojax.presets.preset import Preset, read_preset
from vibrojax.presets.single_impact import SingleImpact

GRID_HZ = 0.25
"""Every frequency that the front matter states is a multiple of this: taken as the step of the experiment's sweeps."""
_BELOW, _ABOVE = 0.95, 1.4
_FLIGHT, _CONTACT_STEPS = 0.03, 30.0
"""Longest step in flight over 1 / omega_n, and steps in an impact: places of bands to 1e-3."""
_SETTLING, _WATCHED, _SIDE = 1500, 8, 6
_AT_TOP, _UNDER_END = 0.98, 0.97


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
class BandPlace(AbstractFact):
    """At a frequency the impact force of the band z = 1/n is largest, or something changes, which is read as the band's upper end.

    Reproduced to one step of the experiment's grid.
    """

    place: Literal["largest", "end"]
    gap: float
    cycles: int

    def ask(self) -> Answer:
        """Frequency of the largest force along the stable stretch of the branch, or that at which the band ceases to be stable."""
        try:
            found = band(self.preset, self.gap, self.cycles)
        except NoConvergenceError as error:
            return Answer(found=f"no band z = 1/{self.cycles}: {error}", reproduced=False)
        words, value = ("force largest at", found.largest) if self.place == "largest" else ("band ends at", found.end)
        return Answer(found=f"z = 1/{self.cycles}: {words} {value:.2f} Hz", reproduced=abs(value - self.values[0]) <= GRID_HZ)


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


def _place(preset: str, place: Literal["largest", "end"], row: str, *, gap: float, cycles: int) -> AbstractFact:
    return BandPlace(preset=preset, rows=(row,), place=place, gap=gap, cycles=cycles, used=True)


_COMPARED = ("0_0_at_2_7", "0_0_at_3_8", "1_0_at_1_5", "1_0_at_3_3", "1_0_at_4_7", "2_4_at_1_2", "2_4_at_1_4", "2_4_at_2_7")
FACTS: tuple[AbstractFact, ...] = (
    Beat(preset="wires", rows=("no_impact_beat",)),
    Labels(preset="wires", rows=tuple(f"compared_gap_{name}" for name in _COMPARED), used=True, words="compared at"),
    _place("wires", "end", "observed_gap_0_0_at_4_75", gap=0.0, cycles=1),
    _place("wires", "largest", "observed_gap_0_0_at_7_25", gap=0.0, cycles=2),
    _place("wires", "end", "observed_gap_0_0_at_8_25", gap=0.0, cycles=2),
    _place("wires", "end", "observed_gap_0_0_at_8_5", gap=0.0, cycles=2),
    _place("wires", "largest", "observed_gap_1_0_at_3_0", gap=1e-3, cycles=1),
    _place("wires", "largest", "observed_gap_1_0_at_6_25", gap=1e-3, cycles=2),
    _place("wires", "end", "observed_gap_1_0_at_7_0", gap=1e-3, cycles=2),
    *_basins("wires", "basin", 6),
    _place("beam_170", "largest", "observed_170_gap_0_at_9_0", gap=0.0, cycles=1),
    _place("beam_170", "end", "observed_170_gap_0_at_12_25", gap=0.0, cycles=1),
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


def fits_labels(f_n: float, labels: Sequence[float]) -> bool:
    """Whether every printed Omega/omega is a frequency of the grid over f_n, rounded to the one decimal that is printed."""
    ratios = np.round(np.arange(1, 200) * GRID_HZ / f_n, 1)
    return all(np.any(np.abs(ratios - label) < 1e-9) for label in labels)


class Band(NamedTuple):
    """The stable stretch of a branch z = 1/n around its start."""

    largest: float
    """Frequency at which the peak force is largest, Hz."""
    end: float
    """Upper end of stability, Hz."""


@functools.cache
def band(name: str, gap: float, cycles: int) -> Band:
    """Band z = 1/n of a preset, by continuation of the compliant rig from the rigid stop's closed form.

    Arguments:
        name: of the preset.
        gap: m.
        cycles: n.

    Raises:
        NoConvergenceError: no such motion is found.
    """
    preset = read_preset(name)
    ideal = _ideal(preset, gap / preset["base_amplitude"], cycles)
    ratio = _AT_TOP * 2.0 * cycles if gap == 0 else _UNDER_END * ideal.band_end()
    frequency, landing = ratio * preset["natural_frequency_hz"], _landing(preset)
    orbit = find_orbit(preset.rig(gap=gap, frequency=frequency), _scaled(preset, ideal, ratio), cycles=cycles, landing=landing)
    limits = (_BELOW * frequency, _ABOVE * frequency)
    branch = follow(orbit, "frequency", limits, landing=landing, longest_step=0.1)
    return _stable_stretch(branch, frequency)


class Coexisting(NamedTuple):
    """Which motions were found at one place."""

    stays_off: bool
    """Whether the orbit without impacts clears the stop."""
    starts: int
    """How many initial states were run."""
    early: int
    """How many of them strike the stop after 1500 cycles."""
    late: int
    """After 3000; fewer than `early` means that motion with impacts dies out, however slowly, and is no attractor for them."""


def coexisting(preset: Preset, ratio: float, gap_ratio: float) -> Coexisting:
    """Motions at (Omega/omega, gap/A0) by brute force.

    Starts fill u from -4 to 1 gaps and u' within 4 gap Omega; one more is the rigid stop's z = 1/1, or rest where there is none. Each is
    watched for 8 cycles after 1500 and after 3000.
    """
    amplitude = preset["base_amplitude"]
    gap, frequency = gap_ratio * amplitude, ratio * preset["natural_frequency_hz"]
    rig = preset.rig(gap=gap, frequency=frequency)
    free = find_orbit(rig.replace("gap", 1e3 * amplitude), np.zeros(2), landing=_landing(preset))
    stays_off = float(free.passage.closest) + 1e3 * amplitude < gap
    reach = 4.0 * gap * 2.0 * np.pi * frequency
    u, v = np.meshgrid(np.linspace(-4.0, 1.0, _SIDE) * gap, np.linspace(-reach, reach, _SIDE))
    states = np.stack([u.ravel(), v.ravel()], axis=1)
    ideal = _ideal(preset, gap_ratio, 1)
    one_more = _scaled(preset, ideal, ratio) if np.isfinite(ideal.speed(ratio)) else np.zeros(2)
    states = np.concatenate([states, one_more[None]])
    early, late = (int(np.sum(strikes)) for strikes in _strikes(_landing(preset), as_arrays(rig), jnp.asarray(states)))
    return Coexisting(stays_off=stays_off, starts=len(states), early=early, late=late)


@eqx.filter_jit
def _strikes(landing: Landing, rig: ForcedRig, states: Float[Array, "starts 2"]) -> Any:
    """Whether the motion from each start touches the stop after one and after two times of settling."""

    def one(state):
        struck = []
        for _ in range(2):
            state, _ = strobe(landing, rig, jnp.asarray(_SETTLING), state)
            state, passage = strobe(landing, rig, jnp.asarray(_WATCHED), state)
            struck.append(passage.touches > 0)
        return struck

    return jax.vmap(one)(states)


def _landing(preset: Preset) -> Landing:
    """The integrator, its step an array so that all presets share one compiled program."""
    return Landing(contact_steps=_CONTACT_STEPS, flight_step=jnp.asarray(_FLIGHT / preset.omega_n))


def _ideal(preset: Preset, gap_ratio: float, cycles: int) -> SingleImpact:
    return SingleImpact(damping_ratio=preset["damping_ratio"], restitution=preset["restitution"], gap=gap_ratio, cycles=cycles)


def _scaled(preset: Preset, ideal: SingleImpact, ratio: float) -> np.ndarray:
    """State of the closed form in SI."""
    return ideal.state(ratio) * preset["base_amplitude"] * np.array([1.0, preset.omega_n])


def _stable_stretch(branch: Branch, frequency: float) -> Band:
    """The stable points joined to the start without a break."""
    start = int(np.argmin(np.abs(branch.parameter - frequency) + np.where(branch.stable, 0.0, np.inf)))
    unstable = np.flatnonzero(~branch.stable)
    first = unstable[unstable < start].max(initial=-1) + 1
    last = unstable[unstable > start].min(initial=len(branch.parameter))
    frequencies, forces = branch.parameter[first:last], branch.peak_force[first:last]
    top, beyond = int(np.argmax(forces)), branch.parameter[last : last + 1]
    found = [p.parameter for p in branch.special if beyond.size and frequencies[-1] <= p.parameter <= max(beyond[0], frequencies[-1])]
    return Band(largest=float(frequencies[top]), end=max([float(frequencies.max()), *found]))
