"""A batch of fits side by side: a table for the terminal, `batch.csv`, and `batch.html` with each parameter over the experiments."""

import csv
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from rich.console import Group
from rich.text import Text

from identification.report.base import PageStyle, Picture, panels, rendered, write_page
from identification.report.tables import Table
from identification.report.verdict import GOOD, PARTLY, POOR
from identification.result.batch import BAD_INPUT, NO_CONVERGENCE, BatchParameter, BatchRow
from identification.wording.names import heading
from identification.wording.numbers import NONE, joined, rounded, significant
from vibrojax.drawing import few_ticks
from vibrojax.errors import printable

TABLE, PAGE = "batch.csv", "batch.html"
_LEGEND = f"{GOOD}: the model explains the records to the noise; {PARTLY}: not everywhere; {POOR}: it does not. χ²: reduced chi-square."
_COUNTED = {
    GOOD: "explained to the noise",
    PARTLY: "not explained everywhere",
    POOR: "not explained",
    BAD_INPUT: "with bad input",
    NO_CONVERGENCE: "without convergence",
}
Rows = Sequence[BatchRow]


def batch_summary(rows: Rows) -> Group:
    """The table, a row an experiment in the order given; a line for each that could not be fitted, with the reason."""
    failed = [Text(f"{row.experiment}: {row.failure}") for row in rows if not row.fitted]
    return Group(batch_table(rows).for_terminal(), Text(_LEGEND), Text(f"{headline(rows)}."), *failed)


def batch_table(rows: Rows, *, linked: bool = False) -> Table:
    """Experiment, number, verdict, every parameter with its standard error, reduced chi-square, seconds; a row an experiment.

    With `linked`, the names of fitted experiments are links to their pages, as HTML.
    """
    columns = _columns(rows)
    cells = []
    for number, row in enumerate(rows, start=1):
        found = {(one.name, one.unit): one for one in row.parameters}
        estimates = (_estimate(found.get(key)) for key in columns)
        first = row.experiment
        if not linked:
            estimates = (cell.replace(" ± ", "±") for cell in estimates)  # so that no terminal breaks one there
        elif row.fitted:
            first = Markup('<a href="{}">{}</a>').format(quote(f"{row.experiment}/report.html"), row.experiment)
        cells.append((first, str(number), row.status, *estimates, significant(row.chi2_reduced), significant(row.seconds, 2)))
    return Table(columns=("experiment", "no.", "verdict", *columns.values(), "χ²", "s"), rows=tuple(cells), words=(0, 2))


def headline(rows: Rows) -> str:
    """How many experiments have which status.

    Example:
        >>> headline([BatchRow(experiment="a", digest="", status="good", seconds=1.0)])
        '1 of 1 experiments fitted: 1 explained to the noise'
    """
    counts = Counter(row.status for row in rows)
    parts = [f"{counts[status]} {words}" for status, words in _COUNTED.items() if counts[status]]
    return f"{sum(row.fitted for row in rows)} of {len(rows)} experiments fitted: {joined(parts)}"


def write_batch(rows: Rows, folder: Path, *, name: str, options: Mapping[str, Any], style: PageStyle) -> None:
    """Write `batch.csv`, `batch.html` and its picture into the folder that holds the results of each experiment.

    `name` is that of the batch; `options` of every fit are plain data.
    """
    _write_table(rows, folder / TABLE)
    fitted, failed = [row for row in rows if row.fitted], [row for row in rows if not row.fitted]
    images = rendered((_parameters,), rows, lambda picture: f"{name}; {headline(rows)}", style)
    level = GOOD if all(row.status == GOOD for row in rows) else POOR if failed or any(row.status == POOR for row in rows) else PARTLY
    spent = sum(row.seconds for row in rows)
    write_page(
        PAGE,
        images,
        style,
        folder,
        file=PAGE,
        next_steps=_next_steps(fitted, failed),
        provenance={key: value for key, value in options.items() if value is not None and value is not False and value != []},
        seconds={"all fits together": spent},
        name=name,
        rows=rows,
        failed=failed,
        spent=spent,
        level=level,
        headline=f"{headline(rows)}.",
        remarks=(),
        found=batch_table(rows, linked=True),
        legend=_LEGEND,
    )


def _write_table(rows: Rows, path: Path) -> None:
    """CSV, SI, a row an experiment; a cell stays empty where there is no number."""
    names = list(dict.fromkeys(name for name, _ in _columns(rows)))
    head = ["experiment", "status", "headline", "law", *(f"{name}{end}" for name in names for end in ("", "_stderr", "_status"))]
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow([*head, "chi2_reduced", "seconds", "failure"])
        for row in rows:
            found = {one.name: (one.value, one.stderr, one.status) for one in row.parameters}
            estimates = (cell for name in names for cell in found.get(name, (None, None, None)))
            table.writerow(
                [row.experiment, row.status, row.headline, row.law, *estimates, row.chi2_reduced, round(row.seconds, 3), row.failure]
            )


def _columns(rows: Rows) -> dict[tuple[str, str], str]:
    """Headings by name and unit of every parameter that any fit has; laws may have one name for quantities of different units."""
    found = {(one.name, one.unit): one for row in rows for one in row.parameters}
    return {key: heading(one.symbol, one.unit) for key, one in found.items()}


def _estimate(one: BatchParameter | None) -> str:
    return NONE if one is None or one.value is None else rounded(one.value, one.stderr).text


def _next_steps(fitted: Rows, failed: Rows) -> tuple[str, ...]:
    steps = []
    if failed:
        steps.append(
            "Correct the experiments that could not be fitted and give the same command again: it fits only them, and what has changed."
        )
    if suspect := [row.experiment for row in fitted if row.status == POOR] or [row.experiment for row in fitted if row.status == PARTLY]:
        steps.append(f"`vibrojax diagnose` looks for what the model leaves out; begin with {printable(suspect[0])}.")
    return tuple(steps)


def _parameters(rows: Rows, style: PageStyle) -> Iterator[Picture]:
    """One picture: a panel a parameter, its estimates over the number of the experiment, with standard errors."""
    columns = _columns(rows)
    if not columns:
        return
    figure, grid = panels((1.1,) * len(columns), gap=(0.12, 0.5), sharex=True)
    for axes, (key, words) in zip(grid[:, 0], columns.items(), strict=True):
        placed = [(number, one) for number, row in enumerate(rows, 1) for one in row.parameters if (one.name, one.unit) == key]
        _estimates(axes, [(number, one) for number, one in placed if one.value is not None], style)
        axes.set_ylabel(words)
    grid[-1, 0].set_xlim(0.5, len(rows) + 0.5)
    grid[-1, 0].xaxis.set_major_locator(MaxNLocator(8, integer=True))
    grid[-1, 0].set_xlabel("number of the experiment")
    headings = joined(list(columns.values()))
    yield Picture(
        name="batch-parameters",
        section="parameters",
        caption="Each parameter over the experiments, in the order of the table, with its standard error; a hollow mark has none.",
        alt=f"{headings} over the number of the experiment.",
        figure=figure,
    )


def _estimates(axes: Axes, placed: list[tuple[int, BatchParameter]], style: PageStyle) -> None:
    known = np.array([(number, one.value, one.stderr) for number, one in placed if one.stderr is not None], dtype=float).reshape(-1, 3)
    without = np.array([(number, one.value) for number, one in placed if one.stderr is None], dtype=float).reshape(-1, 2)
    axes.errorbar(*known.T[:2], yerr=known[:, 2], fmt=".", color=style.model, ecolor=style.measured, elinewidth=0.8, markersize=4.0)
    axes.plot(*without.T, "o", markerfacecolor="none", markeredgecolor=style.model, markersize=3.0, linewidth=0.0)
    few_ticks(axes, y=3)
