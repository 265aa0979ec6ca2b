"""Which figures a gallery holds: of a preset those that answer to figures of the thesis, of another model the usual studies.

To add one of a preset: write its row in `data/gallery.toml`.
"""

import dataclasses
import tomllib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from vibrojax.data_files import data_path
from vibrojax.model import Model
from vibrojax.presets import Preset, read_preset
from vibrojax.presets.single_impact import SingleImpact
from vibrojax.studies.base import natural_frequency
from vibrojax.suspension import Linear

_RATIOS = (0.5, 5.0)
"""Omega/omega of all sweeps, as far as the thesis's maps go."""
_CURVE, _SWEEP, _LYAPUNOV, _MAP, _STATES, _MASSES = 151, 91, 91, (61, 41), 31, 117
_CLEARANCES = (0.0, 6.0)
_REACH = (-4.0, 1.0)
"""Initial displacements over the gap where basins are looked for; velocities up to the first of them times gap Omega."""
_POINTS = ((1.75, 2.5), (2.0, 1.5), (2.0, 2.0))
"""(Omega/omega, gap/A0) of the basins of a model that is no preset: some of the thesis's."""
_UNDER_END, _BELOW, _ABOVE = 0.97, 0.5, 1.3


@dataclasses.dataclass(frozen=True, kw_only=True)
class Plate:
    """One figure to be made.

    Attributes:
        stem: of its files' names.
        study: a key of `vibrojax.studies.job.STUDIES`, or "continue" for a branch of periodic motion.
        axes: of the study; of a branch, `frequency` with its ends.
        settings: of the study.
        answers: which figures of the thesis it answers to; empty for none.
        caption: what the list of figures says of them.
        stated: names of the rows of the preset's table that state something there.
    """

    stem: str
    study: str
    axes: Mapping[str, Any]
    settings: Mapping[str, Any]
    answers: str = ""
    caption: str = ""
    stated: tuple[str, ...] = ()


def model_plates(model: Model, *, base_amplitude: float, gaps: Sequence[float]) -> list[Plate]:
    """The usual studies of any model.

    Arguments:
        model: the rig; its suspension has a natural frequency.
        base_amplitude: A0, m.
        gaps: m.

    Raises:
        InputError: the suspension has no natural frequency.
    """
    f_n = natural_frequency(model, "a gallery")
    rig = dict(base_amplitude=base_amplitude)
    plates = [_response(f_n, gaps, rig, {}), *(_bifurcation(f_n, gap, rig) for gap in gaps), _map(rig)]
    plates += [_lyapunov(f_n, gap, rig) for gap in gaps]
    plates += [_section(f_n, gap, 2.0, rig, (0.0, 0.0)) for gap in gaps]
    plates += [_branch(f_n, gap, 2.0 * f_n, rig, (0.0, 0.0), "") for gap in gaps]
    plates += [_basins(f_n, ratio, clearance, base_amplitude) for ratio, clearance in _POINTS]
    if isinstance(model.suspension, Linear):
        plates.append(_design(gaps[0], [f_n, 1.5 * f_n, 2.0 * f_n], rig))
    return plates


def preset_plates(preset: Preset) -> list[Plate]:
    """The figures of the thesis that a preset answers to, as `data/gallery.toml` lists them."""
    rows = tomllib.loads(data_path("gallery.toml").read_text(encoding="utf-8"))["figure"]
    return [_of_row(preset, row) for row in rows if row["preset"] == preset.name]


def _of_row(preset: Preset, row: Mapping[str, Any]) -> Plate:
    f_n, amplitude = preset["natural_frequency_hz"], preset["base_amplitude"]
    rig = dict(base_amplitude=amplitude)
    gap = 1e-3 * row.get("gap_mm", 0.0)
    study, cycles = row["study"], row.get("cycles", 0)
    made: dict[str, Callable[[], Plate]] = {
        "response": lambda: _response(
            f_n,
            [gap] if "gap_mm" in row else preset.gaps,
            rig,
            {"f_n": [read_preset(name)["natural_frequency_hz"] for name in row["beside"]]} if "beside" in row else {},
        ),
        "bifurcation": lambda: _bifurcation(f_n, gap, rig),
        "peterka": lambda: _map(rig),
        "section": lambda: _section(f_n, gap, row["ratio"], rig, _start(preset, gap, row["ratio"], cycles)),
        "basins": lambda: _basins(f_n, row["ratio"], row["clearance"], amplitude),
        "design": lambda: _design(gap, row["frequencies"], rig),
        "continue": lambda: _of_band(preset, gap, cycles, rig),
    }
    plate = made[study]()
    return dataclasses.replace(plate, answers=row["answers"], caption=row["caption"], stated=tuple(row.get("stated", ())))


def _response(f_n: float, gaps: Sequence[float], rig: dict[str, float], also: dict[str, list[float]]) -> Plate:
    highest = max([f_n, *also.get("f_n", [])])
    lowest = min([f_n, *also.get("f_n", [])])
    frequency = np.linspace(_RATIOS[0] * lowest, (3.5 if also else _RATIOS[1]) * highest, _CURVE)
    stem = f"response_gap-{1e3 * gaps[0]:g}mm_stiffness" if also else "response"
    return Plate(
        stem=stem, study="response", axes=dict(frequency_hz=frequency, gap=list(gaps)), settings=rig | (dict(also=also) if also else {})
    )


def _along(f_n: float, count: int) -> np.ndarray:
    return np.linspace(_RATIOS[0] * f_n, _RATIOS[1] * f_n, count)


def _bifurcation(f_n: float, gap: float, rig: dict[str, float]) -> Plate:
    settings = rig | dict(parameter="frequency_hz", gap=gap)
    return Plate(stem=f"bifurcation_{_mm(gap)}", study="bifurcation", axes=dict(values=_along(f_n, _SWEEP)), settings=settings)


def _lyapunov(f_n: float, gap: float, rig: dict[str, float]) -> Plate:
    settings = rig | dict(parameter="frequency_hz", gap=gap)
    return Plate(stem=f"lyapunov_{_mm(gap)}", study="lyapunov", axes=dict(values=_along(f_n, _LYAPUNOV)), settings=settings)


def _map(rig: dict[str, float]) -> Plate:
    axes = dict(ratio=np.linspace(*_RATIOS, _MAP[0]), clearance=np.linspace(*_CLEARANCES, _MAP[1]))
    return Plate(stem="peterka", study="peterka", axes=axes, settings=rig)


def _section(f_n: float, gap: float, ratio: float, rig: dict[str, float], start: tuple[float, float]) -> Plate:
    settings = rig | dict(frequency_hz=ratio * f_n, gap=gap, u0=start[0], v0=start[1])
    return Plate(stem=f"section_{_mm(gap)}_ratio-{ratio:g}", study="section", axes={}, settings=settings)


def _basins(f_n: float, ratio: float, clearance: float, amplitude: float) -> Plate:
    gap = clearance * amplitude
    reach = -_REACH[0] * gap * 2.0 * np.pi * ratio * f_n
    axes = dict(u0=np.linspace(_REACH[0] * gap, _REACH[1] * gap, _STATES), v0=np.linspace(-reach, reach, _STATES))
    settings = dict(base_amplitude=amplitude, gap=gap, frequency_hz=ratio * f_n)
    return Plate(stem=f"basins_ratio-{ratio:g}_clearance-{clearance:g}", study="basins", axes=axes, settings=settings)


def _design(gap: float, frequencies: Sequence[float], rig: dict[str, float]) -> Plate:
    axes = dict(mass_ratio=np.linspace(0.1, 3.0, _MASSES), frequency_hz=list(frequencies))
    return Plate(stem="design", study="design", axes=axes, settings=rig | dict(gap=gap))


def _branch(f_n: float, gap: float, at: float, rig: dict[str, float], start: tuple[float, float], band: str) -> Plate:
    settings = rig | dict(gap=gap, at=at, start=start)
    ends = (max(_BELOW * at, _RATIOS[0] * f_n), _ABOVE * at)
    return Plate(stem=f"branch_{_mm(gap)}{band}", study="continue", axes=dict(frequency=ends), settings=settings)


def _of_band(preset: Preset, gap: float, cycles: int, rig: dict[str, float]) -> Plate:
    """The branch z = 1/n through a point below the upper end of the rigid stop's band."""
    ratio = _UNDER_END * _ideal(preset, gap, cycles).band_end()
    f_n = preset["natural_frequency_hz"]
    return _branch(f_n, gap, ratio * f_n, rig, _start(preset, gap, ratio, cycles), f"_one-in-{cycles}")


def _start(preset: Preset, gap: float, ratio: float, cycles: int) -> tuple[float, float]:
    """State on the rigid stop's z = 1/n; at rest where none is asked for, or there is none."""
    ideal = _ideal(preset, gap, max(cycles, 1))
    if cycles == 0 or not np.isfinite(ideal.speed(ratio)):
        return 0.0, 0.0
    u, v = ideal.state(ratio) * preset["base_amplitude"] * np.array([1.0, preset.omega_n])
    return float(u), float(v)


def _ideal(preset: Preset, gap: float, cycles: int) -> SingleImpact:
    restitution = preset["restitution"] if "restitution" in preset.numbers else 0.8
    return SingleImpact(damping_ratio=preset["damping_ratio"], restitution=restitution, gap=gap / preset["base_amplitude"], cycles=cycles)


def _mm(gap: float) -> str:
    return f"gap-{1e3 * gap:g}mm"
