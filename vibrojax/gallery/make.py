"""Make the figures of a gallery, and the page that shows them."""

import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from vibrojax.continuation import ForcedRig
from vibrojax.continuation.branch import finding as branch_finding
from vibrojax.continuation.job import follow_and_write
from vibrojax.data_files import data_path
from vibrojax.errors import NoConvergenceError
from vibrojax.figure_style import SCREEN, FigureStyle
from vibrojax.gallery.plates import Plate
from vibrojax.model import Model
from vibrojax.studies.finding import finding
from vibrojax.studies.job import Job
from vibrojax.studies.run import make
from vibrojax.studies.write import write_study

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
    found = []
    for number, plate in enumerate(plates, 1):
        progress(f"{number} of {len(plates)}: {plate.stem}")
        try:
            found.append(Made(plate, _one(model, plate, folder, look)))
        except NoConvergenceError as error:
            found.append(Made(plate, str(error), failed=True))
    (folder / PAGE).write_text(page(title, found, thesis=thesis), encoding="utf-8")
    return found


def page(title: str, found: Sequence[Made], *, thesis: str = "") -> str:
    """The page of a gallery as Markdown.

    Arguments:
        title: its heading.
        found: the plates in their order.
        thesis: as for `make_gallery`.
    """
    rows = _rows(thesis)
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


def _one(model: Model, plate: Plate, folder: Path, look: FigureStyle) -> str:
    """Make one plate and write it; the sentence of what it shows."""
    if plate.study == "continue":
        settings: Any = plate.settings
        rig = ForcedRig(model, gap=settings["gap"], base_amplitude=settings["base_amplitude"], frequency_hz=settings["at"])
        tail = plate.stem.removeprefix("branch")
        where: Any = dict(at=settings["at"], start=settings["start"])
        (branch,) = follow_and_write(rig, "frequency", plate.axes["frequency"], folder, tail=tail, look=look, **where)
        return branch_finding(branch)
    data = make(Job(study=plate.study, model=model, axes=plate.axes, settings=plate.settings))
    write_study(plate.study, data, folder, look=look, stem=plate.stem)
    return finding(plate.study, data)


def _rows(thesis: str) -> dict[str, dict[str, Any]]:
    if not thesis:
        return {}
    return {row["name"]: row for row in tomllib.loads(data_path("thesis", f"{thesis}.toml").read_text(encoding="utf-8"))["value"]}
