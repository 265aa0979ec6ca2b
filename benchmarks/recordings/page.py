"""The page about the recordings: a table, and a section for each."""

import shutil
from collections.abc import Sequence
from pathlib import Path

from benchmarks.recordings.known import Known
from benchmarks.recordings.runs import Run
from identification.wording.numbers import rounded, with_unit
from vibrojax.effects import EFFECTS

BEGIN, END = "<!-- written by python -m benchmarks.recordings: begin -->", "<!-- end -->"
_HEAD = """| recording | held-back error, nominal → augmented | reduced chi-square | the diagnosis | what is known | agrees | s | MB |
|---|---|---|---|---|---|---|---|"""


def write_page(page: Path, found: Sequence[tuple[Known, Run]]) -> None:
    """Put table and sections between the two marks of the page, and a picture of each beside it."""
    text = page.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise SystemExit(f"{page} lacks the lines {BEGIN!r} and {END!r}: put both where the table shall stand")
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    pictures = page.parent / "images" / "recordings"
    parts = [_HEAD, *(row(known, run) for known, run in found), "", *(section(known, run, pictures) for known, run in found)]
    page.write_text(f"{before}{BEGIN}\n\n" + "\n".join(parts).rstrip() + f"\n\n{END}{after}", encoding="utf-8")


def row(known: Known, run: Run) -> str:
    """One line of the table."""
    used = (_whole(run.seconds), _whole(run.peak_mb))
    if run.document is None:
        cells = (f"`{run.recipe}`", "–", "–", f"failed: {run.failure}", known.truth, "no", *used)
        return f"| {' | '.join(cells)} |"
    sides = [run.document[side] for side in ("nominal", "augmented")]
    error, chi2 = (" → ".join(_three(side[name]) for side in sides) for name in ("held_out_nrmse", "chi2_reduced"))
    agrees = known.agreement(run.named, run.stated)
    return f"| {' | '.join((f'`{run.recipe}`', error, chi2, said(run), known.truth, agrees, *used))} |"


def said(run: Run) -> str:
    """Verdict and what is named, with numbers, or the term that was learned."""
    document = run.document or {}
    if not document["effects"]:
        learned = document.get("free_form")
        return document["verdict"] + (f"; learned: {learned.replace('|', chr(92) + '|')}" if learned else "")
    return f"{document['verdict']}: " + "; ".join(f"{one['name']} ({numbers(one, _gaps(document))})" for one in document["effects"])


def _gaps(document: dict) -> set[float]:
    """Of the nominal model's records, m."""
    return {record["gap"] for record in document["nominal"].get("records", {}).values()}


def numbers(effect: dict, gaps: set[float]) -> str:
    """An effect's parameters with their errors; a place that counts from the gap stands on the axis of u where all records have one."""
    specs = {p.name: p for p in EFFECTS[effect["name"]].parameters}
    found = []
    for name, number in effect["parameters"].items():
        symbol, value = specs[name].symbol if name in specs else name, number["value"]
        if name in specs and specs[name].from_gap and len(gaps) == 1:
            symbol, value = specs[name].from_gap, value + min(gaps)
        found.append(f"{symbol} = {with_unit(rounded(value, number['stderr']).text, number['unit'])}")
    return ", ".join([*([effect["channel"]] if effect.get("channel") else []), *found])


def section(known: Known, run: Run, pictures: Path) -> str:
    """Question, what the program printed, a picture, what is known, and what these records do not identify."""
    lines = [f"## {run.recipe}", "", known.question, ""]
    if run.document is None:
        return "\n".join([*lines, f"The command failed: {run.failure}", ""])
    lines += [f"> {' '.join(run.document['sentences'])}", "", *(line for picture in shown(run, pictures) for line in (picture, ""))]
    return "\n".join([*lines, f"Known: {known.truth}.", f"Not identifiable: {known.cannot[0].lower()}{known.cannot[1:]}", ""])


def shown(run: Run, pictures: Path) -> list[str]:
    """Copy the picture of the record that gained, or else of what is missing; its Markdown."""
    found = [*sorted(run.folder.glob("record-*.png")), *run.folder.glob("missing.png")][:1]
    for file in found:
        pictures.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, pictures / f"{run.recipe}.png")
    return [f"![Measured, nominal and augmented model, and what either leaves](images/recordings/{run.recipe}.png)" for _ in found]


def _whole(figure: float | None) -> str:
    """A figure, where it was measured."""
    return "–" if figure is None else f"{figure:.0f}"


def _three(figure: float | None) -> str:
    """Three digits; a prediction that broke off has no error."""
    return "–" if figure is None else f"{figure:.3g}"
