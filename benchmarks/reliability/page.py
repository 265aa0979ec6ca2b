"""The tables of docs/reliability.md, from the JSON of the campaign."""

import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

BEGIN, END = "<!-- written by python -m benchmarks.reliability: begin -->", "<!-- end -->"
_PARTS = ("by_kind", "killed", "steps_of_writing", "requests_to_end", "without_room", "studies_killed", "stores")


def write_page(page: Path, figures: Sequence[dict[str, Any]]) -> None:
    """Put the tables between the two marks of the page.

    Args:
        page: a Markdown file.
        figures: as calls of the command have written them. Kills, requests to end and full disks add up; what else two of them hold is
            taken from the later one.

    Raises:
        SystemExit: the marks are not there, or the figures are of revisions whose programs differ.
    """
    text = page.read_text(encoding="utf-8")
    if text.count(BEGIN) != 1 or text.count(END) != 1:
        raise SystemExit(f"{page} lacks the lines {BEGIN!r} and {END!r}: put both where the tables shall stand")
    revisions = list(dict.fromkeys(each for one in figures for each in (*one["input_revisions"], one["machine"]["revision"])))
    if other := next((each for each in revisions if not same_program(each, revisions[-1])), None):
        raise SystemExit(f"the figures are of revisions {other} and {revisions[-1]}, whose programs differ: expected one program")
    found = {
        name: one[name]
        for one in figures
        for name in (*_PARTS, "peers", "resumed_identical", "studies_killed_between_tiles")
        if one.get(name)
    }
    names = dict.fromkeys(name for one in figures for name in one.get("killed", {}))
    if names:
        found["killed"] = {name: _together([one["killed"][name] for one in figures if name in one.get("killed", {})]) for name in names}
    for name in ("requests_to_end", "without_room"):
        if several := [one[name] for one in figures if one.get(name)]:
            found[name] = _together(several)
    parts = [f"Revision {revisions[-1]}, one core of {figures[-1]['machine']['processor']}, which others used as well.", ""]
    parts += _inputs(found["by_kind"], found.get("peers", {})) if "by_kind" in found else []
    parts += _disturbed(found)
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    page.write_text(f"{before}{BEGIN}\n\n" + "\n".join(parts).rstrip() + f"\n\n{END}{after}", encoding="utf-8")


def _together(counts: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Counts of several calls, added; of what is called the longest, the longest."""
    return {name: (max if name.startswith("longest") else sum)(one[name] for one in counts) for name in counts[0]}


def same_program(one: str | None, other: str | None) -> bool:
    """Whether two revisions differ in nothing but benchmarks, tests and pages."""
    command = ["git", "-C", str(Path(__file__).parent), "diff", "--quiet", str(one), str(other), "--", ":/vibrojax", ":/identification"]
    return one == other or subprocess.run(command, capture_output=True).returncode == 0


def _inputs(by_kind: dict[str, dict[str, Any]], by_peer: dict[str, dict[str, Any]]) -> list[str]:
    """A row for each kind, and one for all."""
    head = (
        "kind",
        "inputs",
        "refused",
        "accepted",
        "tracebacks",
        "crashes",
        "over 20 s or 2 GB",
        "contained",
        "per CPU second",
        "slowest, s",
    )
    names = ("inputs", "refused", "accepted", "tracebacks", "crashes", "hangs", "contained")
    rows = [[kind, *(one[name] for name in names), one["per_cpu_second"], f"{one['slowest_s']:.2f}"] for kind, one in by_kind.items()]
    total = [sum(one[name] for one in by_kind.values()) for name in names]
    rows.append(["all", *total, "", f"{max(one['slowest_s'] for one in by_kind.values()):.2f}"])
    others = [[kind, one["inputs"], one["refused"], one["crashes"], one["hangs"]] for kind, one in by_peer.items()]
    more = ["", *_table(("read by others", "inputs", "exceptions", "crashes", "over 20 s or 2 GB"), others)] if others else []
    read, failed = total[0], sum(total[3:6])
    bound = (
        f"With no failure among {read}, fewer than one such input in {read // 3} fails (95 % confidence)." if not failed and read else ""
    )
    return [*_table(head, rows), *more, "", *([bound, ""] if bound else [])]


def _disturbed(found: dict[str, Any]) -> list[str]:
    """A row for each way of disturbing."""
    rows: list[list[Any]] = []
    for name, one in found.get("killed", {}).items():
        what = f"kills of {name}, {one['while_computing']} of them before anything was written"
        rows.append([what, one["kills"], f"{one['mixed']} mixed sets, {one['remains_not_cleared']} with remains after the next run"])
    if one := found.get("steps_of_writing"):
        said = f"{one['mixed']} mixed sets, {one['unexpected']} unexpected errors, {one['not_mended']} not mended by the next run"
        rows.append(["steps of replacing a set, killed or failing", one["steps"], said])
    if one := found.get("requests_to_end"):
        late = f"{one['late']} later than 2 s (the longest {one['longest_s']:.2f} s)"
        said = f"{one['other_status']} swallowed, {late}, {one['left_something']} left something"
        rows.append([f"SIGINT, SIGTERM, SIGHUP within {one['seconds']} s", one["signals"], said])
    if (one := found.get("without_room")) and one["attempts"]:
        rows.append(["full disks", one["attempts"], f"{one['not_one_line']} without one line, {one['changed']} changed the old set"])
    if count := found.get("studies_killed"):
        between = found.get("studies_killed_between_tiles", 0)
        said = f"{count - found.get('resumed_identical', 0)} resumed to other bytes"
        rows.append([f"kills of studies, {between} of them between two tiles", count, said])
    if one := found.get("stores"):
        said = f"{one['refused']} refused, {one['repaired']} repaired to the same bytes, {one['unnoticed']} unnoticed"
        rows.append(["damaged stores", sum(one.values()), said])
    return _table(("disturbed", "times", "what came of it"), rows) if rows else []


def _table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[str]:
    return [f"| {' | '.join(map(str, row))} |" for row in (head, ["---"] * len(head), *rows)]
