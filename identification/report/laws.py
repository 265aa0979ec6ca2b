"""Contact laws that were fitted to the same records, side by side: a table for the terminal, and `comparison.csv`."""

import csv
import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path

from rich.console import Group
from rich.text import Text

from identification.estimation.held_back import rms_nrmse
from identification.report.tables import Table
from identification.report.verdict import GOOD, judge
from identification.result.result import FIXED, OK, FitResult, ParameterEstimate
from identification.wording.names import symbol_text
from identification.wording.numbers import NONE, rounded, significant, with_unit

FILE_NAME = "comparison.csv"
_PREDICTED = ("NRMSE", "2Δln p")
_LEGEND = (
    "2Δln L, ΔBIC: twice the log-likelihood and the Bayesian information criterion, less those of the first law; par.: contact parameters "
    "that were estimated; samples: readings that were fitted; χ²: reduced chi-square of the free motion"
)
_OF_PREDICTED = "; NRMSE, 2Δln p: error, and twice the log predictive density less that of the first law, of the records held back"


@dataclasses.dataclass(frozen=True, kw_only=True)
class LawScore:
    """One law's fit beside that of the best law.

    `contact` holds the parameters of the law with their errors; `count` of them were estimated from so many `samples`. Less those of the
    best law: `gain`, twice the log-likelihood; `bic`, the Bayesian information criterion, 0 or more; `density_gain`, twice the log
    predictive density of the records held back, whose rms normalised error is `nrmse`. None where a number is not known or is one of other
    samples than the best law's.
    """

    law: str
    result: FitResult
    contact: tuple[ParameterEstimate, ...]
    count: int
    samples: int | None
    gain: float | None
    bic: float | None
    nrmse: float | None
    density_gain: float | None


def law_scores(results: Mapping[str, FitResult]) -> tuple[LawScore, ...]:
    """Fits by name of the law, the best first: by the Bayesian information criterion, -2 log-likelihood + count log(samples).

    A law without contact may be fitted to thinned records; it comes last, since its likelihood is not one of the same samples.
    """
    known = {law: one.likelihood for law, one in results.items() if one.likelihood is not None}
    touching = [one for law, one in known.items() if results[law].model.law.parameters] or list(known.values())
    most = max((one.samples for one in touching), default=0)
    contact = {law: tuple(one.named[p.name] for p in one.model.law.parameters if p.name in one.named) for law, one in results.items()}
    count = {law: sum(p.status != FIXED for p in those) for law, those in contact.items()}
    bic = {law: one.deviance + count[law] * math.log(max(most, 1)) for law, one in known.items() if one.samples == most}
    order = sorted(results, key=lambda law: bic.get(law, math.inf))
    best = known[order[0]] if bic else None
    scores = []
    for law in order:
        result, own = results[law], known.get(law)
        comparable = own if law in bic else None
        scores.append(
            LawScore(
                law=law,
                result=result,
                contact=contact[law],
                count=count[law],
                samples=None if own is None else own.samples,
                gain=None if comparable is None or best is None else best.deviance - comparable.deviance,
                bic=bic[law] - bic[order[0]] if law in bic else None,
                nrmse=rms_nrmse(result.held_back) if result.held_back else None,
                density_gain=None if comparable is None or best is None else _less(best.held_back, comparable.held_back),
            )
        )
    return tuple(scores)


def _less(number: float | None, other: float | None) -> float | None:
    return None if number is None or other is None else number - other


def law_summary(scores: tuple[LawScore, ...], refused: Mapping[str, Exception]) -> Group:
    """How good the best law's fit is; the table of the laws, the best first; laws that could not be fitted; warnings of the best fit."""
    table = law_table(scores)
    lines = [_LEGEND + (_OF_PREDICTED if _PREDICTED[0] in table.columns else "")] if scores else []
    lines += [f"{law} cannot be fitted: {reason}" for law, reason in refused.items()]
    lines += [
        f"{one.law}: fitted to {one.samples} samples, {scores[0].law} to {scores[0].samples}: likelihoods cannot be compared"
        for one in scores
        if one.gain is None and one.samples is not None and scores[0].samples is not None
    ]
    lines += [f"{one.law}: warning: {warning}" for one in scores[:1] for warning in one.result.warnings]
    return Group(*([_headline(scores[0]), table.for_terminal()] if scores else []), *map(Text, lines))


def _headline(best: LawScore) -> Text:
    """The verdict on the fit of the best law, as a fit by itself opens with."""
    verdict = judge(best.result)
    text = Text(f"Best: {best.result.model.law.title}. {verdict.sentence}", style="bold" if verdict.level != GOOD else "")
    begin = best.result.started_from
    return text.append("" if begin is None else f"\n{begin.sentence()}", "not bold")


def law_table(scores: tuple[LawScore, ...]) -> Table:
    """A row a law, the best first; likelihoods and BIC are differences to the first row."""
    rows = tuple(
        (
            one.result.model.law.title,
            significant(one.gain),
            significant(one.bic),
            str(one.count),
            NONE if one.samples is None else str(one.samples),
            significant(one.result.chi2_reduced),
            significant(one.nrmse, 2),
            significant(one.density_gain),
            "\n".join(map(_estimate, one.contact)),
        )
        for one in scores
    )
    columns = ("law", "2Δln L", "ΔBIC", "par.", "samples", "χ²", *_PREDICTED, "contact parameters")
    table = Table(columns=columns, rows=rows, words=(0, 8), bold=(0,))
    return table if any(one.nrmse is not None for one in scores) else table.without(*_PREDICTED)


def _estimate(one: ParameterEstimate) -> str:
    """Symbol, value with error and unit of a parameter, and its status where it has no error."""
    text = f"{symbol_text(one.spec.symbol)} = {with_unit(rounded(one.value, one.stderr).text, one.spec.unit)}"
    return text if one.status == OK else f"{text} ({one.status})"


def write_laws(scores: tuple[LawScore, ...], refused: Mapping[str, Exception], path: Path) -> None:
    """Write the comparison as CSV, SI: the columns of the table, with a column for each contact parameter and for its standard error.

    Laws that could not be fitted come last, with the reason. A cell stays empty where there is no number.
    """
    names = list(dict.fromkeys(p.spec.name for one in scores for p in one.contact))
    head = ["law", "log_likelihood_twice_difference", "bic_difference", "contact_parameters", "samples", "chi2_reduced", "held_back_nrmse"]
    head += ["held_back_log_density_twice_difference", *(f"{name}{end}" for name in names for end in ("", "_stderr")), "reason"]
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file)
        table.writerow(head)
        for one in scores:
            found = {p.spec.name: (p.value, p.stderr) for p in one.contact}
            numbers = [one.gain, one.bic, one.count, one.samples, one.result.chi2_reduced, one.nrmse, one.density_gain]
            table.writerow([one.law, *numbers, *(number for name in names for number in found.get(name, (None, None))), ""])
        for law, reason in refused.items():
            table.writerow([law, *[None] * (len(head) - 2), reason])
