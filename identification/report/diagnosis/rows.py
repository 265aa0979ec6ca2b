"""A diagnosis as rows of text, the same for the terminal and the page."""

import dataclasses
import itertools
import math
from collections.abc import Iterator

from identification.diagnosis.diagnosis import Considered, Diagnosis, Number
from identification.report.diagnosis.words import beside, effect_words, plain_name
from identification.result.variation import Disagreement
from identification.wording.names import spoken, symbol_text
from identification.wording.numbers import NONE, chance_text, rounded, significant, unit_text
from vibrojax.channels import CHANNELS
from vibrojax.model import MASS
from vibrojax.parameters import Parameter

_BESIDE_ONE_MODEL = 12
"""Candidates that are shown beside one model, at most."""
_SHOWN_SHIFT = 0.05
"""Standard errors; a smaller shift is printed as none."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class NumberRow:
    """One estimated number as printed."""

    symbol: str
    name: str
    meaning: str
    value: str
    unit: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class ChangeRow:
    """One parameter before and after; the shift in standard errors of the nominal fit."""

    symbol: str
    name: str
    before: str
    after: str
    unit: str
    shift: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class ScatterRow:
    """Whether a parameter holds still from record to record, in both models."""

    symbol: str
    before: str
    after: str
    apart: str


@dataclasses.dataclass(frozen=True, kw_only=True)
class CandidateRow:
    """One candidate as printed; the drop and what follows from a refit are `NONE` where it was not refitted."""

    name: str
    words: str
    detail: str
    beside: str
    gain: str
    chance: str
    drop: str
    bic: str
    held_out: str
    asserted: bool


@dataclasses.dataclass(frozen=True, kw_only=True)
class ErrorRow:
    """One measure of misfit, before and after."""

    name: str
    before: str
    after: str
    best: str


def number_rows(numbers: tuple[Number, ...], known: tuple[Parameter, ...] = ()) -> list[NumberRow]:
    """Numbers with their errors, and what each means where that is known."""
    meanings = {p.name: p.meaning for p in known}
    return [
        NumberRow(
            symbol=one.symbol,
            name=plain_name(one.name),
            meaning=meanings.get(one.name) or plain_name(one.name),
            value=rounded(one.value, one.stderr).text,
            unit=unit_text(one.unit),
        )
        for one in numbers
    ]


def learned_rows(diagnosis: Diagnosis) -> list[NumberRow]:
    """Numbers of the effects of the augmented model, as its own parameters have them."""
    meanings = tuple(p for p in diagnosis.model.parameters if "." in p.name)
    return number_rows(tuple(one for one in diagnosis.augmented.parameters if "." in one.name), meanings)


def change_rows(diagnosis: Diagnosis) -> list[ChangeRow]:
    """Every parameter of either model, before and after."""
    before = {one.name: one for one in diagnosis.nominal.parameters}
    after = {one.name: one for one in _as_stated(diagnosis)}
    if not diagnosis.is_augmented:
        after = before
    meanings = {p.name: p.meaning for model in (diagnosis.nominal_model, diagnosis.model) for p in (MASS, *model.parameters)}
    return [
        ChangeRow(
            symbol=(before.get(name) or after[name]).symbol,
            name=meanings.get(name) or plain_name(name.partition(".")[2] or name),
            before=_value(before.get(name)),
            after=_value(after.get(name)),
            unit=unit_text((before.get(name) or after[name]).unit),
            shift=_shift(before.get(name), after.get(name)),
        )
        for name in (before | after)
    ]


def _as_stated(diagnosis: Diagnosis) -> tuple[Number, ...]:
    """Parameters of the augmented model, those of asserted effects in the form in which they are stated."""
    reported = {
        f"{one.effect.name}.{as_estimated.name}": dataclasses.replace(as_reported, name=f"{one.effect.name}.{as_reported.name}")
        for one in diagnosis.effects
        for as_estimated, as_reported in zip(one.parameters, one.reported, strict=True)
    }
    return tuple(reported.get(one.name, one) for one in diagnosis.augmented.parameters)


def scatter_rows(diagnosis: Diagnosis) -> list[ScatterRow]:
    """Every parameter that several records determine, in both models."""
    before = {one.name: one for one in diagnosis.nominal.disagreements}
    after = {one.name: one for one in diagnosis.augmented.disagreements}
    symbols = {one.name: one.symbol for side in (diagnosis.nominal, diagnosis.augmented) for one in side.parameters}
    return [
        ScatterRow(
            symbol=symbols[name],
            before=_agrees(before.get(name)),
            after=_agrees(after.get(name)),
            apart=_apart(before.get(name) or after[name]),
        )
        for name in (before | after)
    ]


def _agrees(one: Disagreement | None) -> str:
    """Scatter between records, and its chance."""
    return NONE if one is None else f"{significant(one.chi2, 3)} of {one.degrees} ({chance_text(one.chance)})"


def _apart(one: Disagreement) -> str:
    """The two records that differ most."""
    least, most = (chosen(one.records, key=lambda file: one.records[file][0]) for chosen in (min, max))
    return ", ".join(f"{file} {rounded(*one.records[file]).text}" for file in (least, most))


def candidate_rows(diagnosis: Diagnosis, most: int | None = None) -> list[CandidateRow]:
    """Candidates, the strongest first."""
    asserted = {one.effect.name for one in diagnosis.effects}
    return [_candidate(one, one.name in asserted) for one in strongest(diagnosis)[:most]]


def strongest(diagnosis: Diagnosis) -> tuple[Considered, ...]:
    """The best beside each model in the order of the diagnosis; where nothing is missing, all, the least likely by chance first."""
    if diagnosis.is_complete:
        return tuple(sorted(diagnosis.considered, key=lambda one: one.chance))
    models = itertools.groupby(diagnosis.considered, lambda one: one.beside)
    return tuple(one for _, beside in models for one in itertools.islice(beside, _BESIDE_ONE_MODEL))


def error_rows(diagnosis: Diagnosis) -> list[ErrorRow]:
    """Misfit of both models: on all records, and on parts of them that a fit did not see."""
    before, after = diagnosis.nominal, diagnosis.augmented
    pairs = (
        ("reduced chi-square, all records", before.chi2_reduced, after.chi2_reduced, "1"),
        (
            f"NRMSE on {'records held back' if before.held_back else 'windows left out of the fit'}",
            before.held_out_nrmse,
            after.held_out_nrmse,
            "0",
        ),
    )
    return [ErrorRow(name=name, before=significant(a, 3), after=significant(b, 3), best=best) for name, a, b, best in pairs]


def warnings(diagnosis: Diagnosis) -> list[str]:
    """What the reader must see, without full stops; each once."""
    return list(dict.fromkeys(warning.rstrip(".") for warning in (*diagnosis.experiment.warnings, *diagnosis.warnings)))


def notices(diagnosis: Diagnosis) -> Iterator[str]:
    """What was found odd when the records were read; what several records have in common is stated once for all of them."""
    files: dict[str, list[str]] = {}
    for record in diagnosis.experiment.records:
        for notice in record.notices:
            files.setdefault(notice.rstrip("."), []).append(record.file)
    for notice, those in files.items():
        yield f"{', '.join(those)}: {notice}"


def _candidate(one: Considered, asserted: bool) -> CandidateRow:
    return CandidateRow(
        name=one.name,
        words=effect_words(one.name),
        detail=spoken_detail(one.detail),
        beside=beside(one),
        gain=_count(one.gain),
        chance=chance_text(one.chance),
        drop=_count(one.drop),
        bic=_count(one.bic),
        held_out=_count(one.held_out),
        asserted=asserted,
    )


def spoken_detail(detail: str) -> str:
    """What distinguishes a candidate from others of its kind, channels by their words."""
    for channel in CHANNELS:
        detail = detail.replace(channel, spoken(channel))
    return detail


def _count(number: float | None) -> str:
    """A difference of chi-square: whole numbers from a hundred on."""
    if number is None or not math.isfinite(number):
        return NONE
    return f"{number:.0f}".replace("-", "−") if 100 <= abs(number) < 1e6 else significant(number, 3)


def _value(one: Number | None) -> str:
    return NONE if one is None else rounded(one.value, one.stderr).text


def _shift(before: Number | None, after: Number | None) -> str:
    """After less before over the standard error that the nominal fit states."""
    if before is None:
        return "new"
    if after is None or before is after or before.stderr is None or not before.stderr > 0:
        return NONE
    shift = (after.value - before.value) / before.stderr
    if not math.isfinite(shift):
        return NONE
    return f"{'+' if shift > 0 else ''}{significant(shift, 2)} σ" if abs(shift) >= _SHOWN_SHIFT else "none"


def symbol_and_name(symbol: str, name: str) -> str:
    """For a terminal: the symbol, then the name if it is another."""
    return symbol_text(symbol) if symbol == name else f"{symbol_text(symbol)}  {name}"
