"""All figures of one model or preset, made in one go, on one page."""

import dataclasses
import tomllib
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vibrojax.continuation import ForcedRig
from vibrojax.continuation.job import branch_finding, follow_and_write
from vibrojax.data_files import data_path
from vibrojax.errors import NoConvergenceError
from vibrojax.figure_style import SCREEN, FigureStyle
from vibrojax.model import Model
from vibrojax.presets import Preset, read_preset
from vibrojax.presets.single_impact import SingleImpact
from vibrojax.studies.base import natural_frequency
from vibrojax.studies.finding import finding
from vibrojax.studies.job import Job
from vibrojax.studies.run import make
from vibrojax.studies.write import write_study
from vibrojax.suspension import Linear

_RATIOS = (0.5, 5.0)
"""Omega/omega of all sweeps, as far as the thesis's maps go."""
_CURVE, _SWEEP, _LYAPUNOV, _MAP, _STATES, _MASSES = 151, 91, 91, (61, 41), 25, 117
_AT_ONCE = 2
"""Studies that are made at the same time."""
_CLEARANCES = (0.0, 6.0)
_REACH = (-4.0, 1.0)
"""Initial displacements over the gap where basins are looked for; velocities up to the first of them times gap Omega."""
_POINTS = ((1.75, 2.5), (2.0, 1.5), (2.0, 2.0))
"""(Omega/omega, gap/A0) of the basins of a model that is no preset: some of the thesis's."""
_UNDER_END, _BELOW, _ABOVE = 0.97, 0.5, 1.3


@dataclasses.dataclass(frozen=True)
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
    plates = [_response(f_n, gaps, rig, {}), *(_sweep("bifurcation", f_n, gap, rig, _SWEEP) for gap in gaps), _map(rig)]
    plates += [_sweep("lyapunov", f_n, gap, rig, _LYAPUNOV) for gap in gaps]
    plates += [_section(f_n, gap, 2.0, rig, (0.0, 0.0)) for gap in gaps]
    plates += [_branch(f_n, gap, 2.0 * f_n, rig, (0.0, 0.0), "") for gap in gaps]
    plates += [_basins(f_n, ratio, clearance, base_amplitude) for ratio, clearance in _POINTS]
    if isinstance(model.suspension, Linear):
        plates.append(_design(gaps[0], [f_n, 1.5 * f_n, 2.0 * f_n], rig))
    return plates


def preset_plates(preset: Preset) -> list[Plate]:
    """The figures of the thesis that a preset answers to, as `data/gallery.toml` lists them."""
    rows = tomllib.loads(data_path("gallery.toml").read_text(encoding="utf-8"))["figure"]
    return [
        dataclasses.replace(_of_row(preset, row), answers=row["answers"], caption=row["caption"], stated=tuple(row.get("stated", ())))
        for row in rows
        if row["preset"] == preset.name
    ]


def _of_row(preset: Preset, row: Mapping[str, Any]) -> Plate:
    f_n, amplitude = preset["natural_frequency_hz"], preset["base_amplitude"]
    rig = dict(base_amplitude=amplitude)
    gap, cycles = 1e-3 * row.get("gap_mm", 0.0), row.get("cycles", 0)
    match row["study"]:
        case "response":
            beside = [read_preset(name)["natural_frequency_hz"] for name in row.get("beside", ())]
            return _response(f_n, [gap] if "gap_mm" in row else preset.gaps, rig, {"f_n": beside} if beside else {})
        case "bifurcation":
            return _sweep("bifurcation", f_n, gap, rig, _SWEEP)
        case "peterka":
            return _map(rig)
        case "section":
            return _section(f_n, gap, row["ratio"], rig, _start(preset, gap, row["ratio"], cycles))
        case "basins":
            return _basins(f_n, row["ratio"], row["clearance"], amplitude)
        case "design":
            return _design(gap, row["frequencies"], rig)
        case "continue":  # the branch z = 1/n through a point below the upper end of the rigid stop's band
            ratio = _UNDER_END * _ideal(preset, gap, cycles).band_end()
            return _branch(f_n, gap, ratio * f_n, rig, _start(preset, gap, ratio, cycles), f"_one-in-{cycles}")
        case study:
            raise ValueError(f"data/gallery.toml names {study!r}, which no gallery shows: expected one of {', '.join(_TITLES)}")


def _response(f_n: float, gaps: Sequence[float], rig: dict[str, float], also: dict[str, list[float]]) -> Plate:
    frequencies = [f_n, *also.get("f_n", [])]
    swept = np.linspace(_RATIOS[0] * min(frequencies), (3.5 if also else _RATIOS[1]) * max(frequencies), _CURVE)
    stem = f"response_gap-{1e3 * gaps[0]:g}mm_stiffness" if also else "response"
    return Plate(stem, "response", dict(frequency_hz=swept, gap=list(gaps)), rig | (dict(also=also) if also else {}))


def _sweep(study: str, f_n: float, gap: float, rig: dict[str, float], count: int) -> Plate:
    axes = dict(values=np.linspace(_RATIOS[0] * f_n, _RATIOS[1] * f_n, count))
    return Plate(f"{study}_{_mm(gap)}", study, axes, rig | dict(parameter="frequency_hz", gap=gap))


def _map(rig: dict[str, float]) -> Plate:
    axes = dict(ratio=np.linspace(*_RATIOS, _MAP[0]), clearance=np.linspace(*_CLEARANCES, _MAP[1]))
    return Plate("peterka", "peterka", axes, rig)


def _section(f_n: float, gap: float, ratio: float, rig: dict[str, float], start: tuple[float, float]) -> Plate:
    settings = rig | dict(frequency_hz=ratio * f_n, gap=gap, u0=start[0], v0=start[1])
    return Plate(f"section_{_mm(gap)}_ratio-{ratio:g}", "section", {}, settings)


def _basins(f_n: float, ratio: float, clearance: float, amplitude: float) -> Plate:
    gap = clearance * amplitude
    reach = -_REACH[0] * gap * 2.0 * np.pi * ratio * f_n
    axes = dict(u0=np.linspace(_REACH[0] * gap, _REACH[1] * gap, _STATES), v0=np.linspace(-reach, reach, _STATES))
    settings = dict(base_amplitude=amplitude, gap=gap, frequency_hz=ratio * f_n)
    return Plate(f"basins_ratio-{ratio:g}_clearance-{clearance:g}", "basins", axes, settings)


def _design(gap: float, frequencies: Sequence[float], rig: dict[str, float]) -> Plate:
    axes = dict(mass_ratio=np.linspace(0.1, 3.0, _MASSES), frequency_hz=list(frequencies))
    return Plate("design", "design", axes, rig | dict(gap=gap))


def _branch(f_n: float, gap: float, at: float, rig: dict[str, float], start: tuple[float, float], band: str) -> Plate:
    ends = (max(_BELOW * at, _RATIOS[0] * f_n), _ABOVE * at)
    return Plate(f"branch_{_mm(gap)}{band}", "continue", dict(frequency=ends), rig | dict(gap=gap, at=at, start=start))


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


PAGE = "index.md"
_TITLES = {
    "response": "Impact force against frequency",
    "bifurcation": "Bifurcation diagram",
    "peterka": "Peterka map",
    "section": "One operating point",
    "basins": "Basins of attraction",
    "lyapunov": "Lyapunov exponent",
    "design": "Hammer design",
    "continue": "Branch of periodic motion",
}


class Made(NamedTuple):
    """A plate that was made: what it shows in one sentence, or why it could not be made."""

    plate: Plate
    found: str
    failed: bool = False


def make_gallery(
    model: Model,
    plates: Sequence[Plate],
    folder: Path,
    *,
    title: str,
    thesis: str = "",
    look: FigureStyle = SCREEN,
    progress: Callable[[str], None] = lambda stage: None,
) -> list[Made]:
    """Make every plate, write its files into a folder, and the page `index.md` beside them.

    A motion that cannot be integrated, or a branch on which no orbit is found, is named on the page with the reason.

    Arguments:
        model: the rig.
        plates: what to make.
        folder: that exists.
        title: of the page.
        thesis: name of the table in `data/thesis/` whose rows the plates name; empty for none.
        look: sizes of the figures.
        progress: called with each plate.
    """
    found: list[Made] = []
    begun: deque[Future | None] = deque()
    pool = ThreadPoolExecutor(_AT_ONCE)  # studies compile and integrate outside the interpreter; figures are drawn one by one
    try:
        for number, plate in enumerate(plates, 1):
            progress(f"{number} of {len(plates)}: {plate.stem}")
            for other in plates[number - 1 + len(begun) : number + _AT_ONCE]:
                if other.study == "continue":  # a branch is followed and written in one
                    begun.append(None)
                else:
                    begun.append(pool.submit(make, Job(study=other.study, model=model, axes=other.axes, settings=other.settings)))
            try:
                found.append(Made(plate, _written(model, plate, begun.popleft(), folder, look)))
            except NoConvergenceError as error:
                found.append(Made(plate, str(error), failed=True))
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
    (folder / PAGE).write_text(page(title, found, thesis=thesis), encoding="utf-8")
    return found


def page(title: str, found: Sequence[Made], *, thesis: str = "") -> str:
    """The page of a gallery as Markdown.

    Arguments:
        title: its heading.
        found: the plates in their order.
        thesis: as for `make_gallery`.
    """
    table = tomllib.loads(data_path("thesis", f"{thesis}.toml").read_text(encoding="utf-8"))["value"] if thesis else []
    rows = {row["name"]: row for row in table}
    lines = [f"# {title}", ""]
    for plate, sentence, failed in found:
        lines += [f"## {_heading(plate)}", ""]
        lines += [f"Not made: {sentence}." if failed else f"![{_TITLES[plate.study]}]({plate.stem}.png)", ""]
        if plate.answers:
            lines.append(f'- Thesis: figure{"s" if " " in plate.answers.strip(" abc") else ""} {plate.answers}, "{plate.caption}".')
        for name in plate.stated:
            row = rows[name]
            lines.append(f"- Stated there: {row.get('note', name)}: {row['symbol']} = {row['value']:g} {row['unit']} ({row['source']}).")
        if not failed:
            lines.append(f"- Here: {sentence}. [Caption]({plate.stem}.md).")
        lines.append("")
    return "\n".join(lines)


def _heading(plate: Plate) -> str:
    """Title of a plate: its study, and what tells it from the others of that study."""
    rest = plate.stem.partition("_")[2].replace("_", ", ").replace("-", " ").replace("mm", " mm")
    return f"{_TITLES[plate.study]}: {rest}" if rest else _TITLES[plate.study]


def _written(model: Model, plate: Plate, study: Future | None, folder: Path, look: FigureStyle) -> str:
    """Write a plate once its study is done; without one, follow its branch. The sentence of what it shows."""
    if study is not None:
        data = study.result()
        write_study(plate.study, data, folder, look=look, stem=plate.stem)
        return finding(plate.study, data)
    settings: Any = plate.settings
    rig = ForcedRig(model, gap=settings["gap"], base_amplitude=settings["base_amplitude"], frequency_hz=settings["at"])
    where: Any = dict(tail=plate.stem.removeprefix("branch"), at=settings["at"], start=settings["start"])
    (branch,) = follow_and_write(rig, "frequency", plate.axes["frequency"], folder, look=look, **where)
    return branch_finding(branch)
