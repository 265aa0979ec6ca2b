"""A diagnosis as tables and sentences of text, the same for the terminal and the page; and the summary that a terminal shows."""

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence

from rich.console import Group, RenderableType
from rich.text import Text

from identification.diagnosis.diagnosis import ADEQUATE, MISSING, RESTLESS, UNDECIDED, Asserted, Considered, Diagnosis
from identification.report.tables import Table, reading_errors, shares
from identification.report.verdict import RUN_MODEL
from identification.result.evidence import Disagreement
from identification.result.result import Quantity
from identification.wording.names import coordinate_label, plain_name, spoken, symbol_text
from identification.wording.numbers import NONE, chance_text, compact, grouped, joined, rounded, significant, unit_text, with_unit
from vibrojax.channels import CHANNELS
from vibrojax.effects import EFFECTS
from vibrojax.model import MASS


def diagnosis_summary(diagnosis: Diagnosis) -> Group:
    """Everything a reader wants on one screen after a diagnosis: the verdict, parameters before and after, and what else was considered."""
    found, listed = diagnosis.location, strongest(diagnosis)
    said = [*diagnosis.sentences, *([found.sentence] if found is not None and found.sentence not in diagnosis.sentences else [])]
    verdict = Text(headline(diagnosis), style="bold").append("".join(f"\n{sentence}" for sentence in said), "not bold")
    misfits = [f"{name} {' -> '.join(map(compact, values[:-1]))}" for name, *values in errors(diagnosis).rows]
    blocks: list[RenderableType] = [verdict, *_effects(diagnosis), Text("; ".join(misfits)), changes(diagnosis).for_terminal()]
    blocks += [reading_errors(diagnosis.reading_error, diagnosis.experiment).for_terminal(), Text(readings(diagnosis))]
    blocks += [candidates(diagnosis, listed[:6]).for_terminal()] if listed else []
    blocks += [Text(f"  {len(listed) - 6} more in the report")] if len(listed) > 6 else []
    blocks += [Text(f"next: {diagnosis.next_experiment}")] if diagnosis.next_experiment else []
    blocks += [Text(notice) for notice in notices(diagnosis)]
    return Group(*blocks, *(Text(f"warning: {warning}", style="bold") for warning in warnings(diagnosis)))


def _effects(diagnosis: Diagnosis) -> list[Text]:
    """A line an asserted effect, with its numbers; or the formula that was learned."""
    lines = []
    for one in diagnosis.effects:
        found = ", ".join(f"{symbol_text(p.symbol)} = {with_unit(compact(_value(p)), p.unit)}" for p in one.reported)
        lines.append(f"  {one.effect.name}{f' ({where(one)})' if where(one) else ''}: {probability_text(one.probability)}; {found}")
    if diagnosis.free_form:
        lines.append(f"  learned in its place: {diagnosis.free_form}")
    return list(map(Text, lines))


def headline(diagnosis: Diagnosis) -> str:
    """The verdict in a few words."""
    if diagnosis.verdict == UNDECIDED:
        return "Undecided: " + ("the model has not converged" if diagnosis.is_finished else "the budget ended the search")
    varying = [p.symbol for p in diagnosis.augmented.parameters if p.name in diagnosis.augmented.varying]
    varies = f"{joined(varying)} {'varies' if len(varying) == 1 else 'vary'} between records" if varying else ""
    if diagnosis.verdict == ADEQUATE:
        return f"No listed effect is missing, but {varies}" if varies else "Nothing is missing beyond the noise"
    if diagnosis.verdict == RESTLESS:
        cause = "a random force acts on the hammer" if diagnosis.unrest else "readings are off by more than their noise"
        return f"No listed effect is missing, but {cause}" + (f", and {varies}" if varies else "")
    if diagnosis.verdict == MISSING:
        return f"Missing: {joined([one.effect.summary + (f' ({where(one)})' if where(one) else '') for one in diagnosis.effects])}"
    return f"Something is missing that no {looked_for(diagnosis)} explains"


def looked_for(diagnosis: Diagnosis) -> str:
    """What the search could name: any listed effect, or one of those that were looked for."""
    return "effect that was looked for" if diagnosis.is_limited else "listed effect"


def next_steps(diagnosis: Diagnosis) -> tuple[str, ...]:
    """What an experimenter can do after a diagnosis, the most urgent first."""
    steps = [] if diagnosis.is_finished else ["Allow more time with `--budget-minutes`: the search was not finished."]
    if diagnosis.next_experiment:
        steps.append(diagnosis.next_experiment)
    if diagnosis.is_complete:
        own = [f"[parameters.{name}]" for name in diagnosis.augmented.varying]
        setting = f", with `varies = true` in {joined(own)}," if own else ""
        steps.append(f"`fit-parameters` with the same experiment{setting} gives the parameters with intervals and correlations.")
    held = "the augmented model, nominal.json the nominal one" if diagnosis.is_augmented else "the nominal model"
    return (*steps, RUN_MODEL.format(which=held))


def warnings(diagnosis: Diagnosis) -> list[str]:
    """What the reader must see, without full stops; each once."""
    return list(dict.fromkeys(warning.rstrip(".") for warning in (*diagnosis.experiment.warnings, *diagnosis.warnings)))


def notices(diagnosis: Diagnosis) -> list[str]:
    """What was found odd, or done, when the records were read."""
    return grouped(
        (record.file, notice.rstrip("."))
        for record in (*diagnosis.nominal.records, *diagnosis.nominal.held_back)
        for notice in record.notices
    )


def effects_words(names: Sequence[str]) -> str:
    """What effects are, by their names.

    Example:
        >>> effects_words(["coulomb_friction", "sticky_tape"])
        'dry friction in the suspension and sticky tape'
    """
    return joined([EFFECTS[name].summary if name in EFFECTS else plain_name(name) for name in names])


def where(effect: Asserted) -> str:
    """Record and channel of an effect that does not act everywhere: "impact force, in cart1.csv"; or nothing."""
    channel = spoken(effect.effect.channel) if effect.effect.channel else ""
    return ", ".join(part for part in (channel, f"in {effect.effect.record}" if effect.effect.record else "") if part)


def probability_text(probability: float) -> str:
    """A probability in per cent, never rounded to certainty.

    Example:
        >>> probability_text(0.99999), probability_text(0.62), probability_text(1e-5)
        ('> 99.9 %', '62 %', '< 0.1 %')
    """
    if not math.isfinite(probability):
        return NONE
    if not 0.001 <= probability <= 0.999:
        return "> 99.9 %" if probability > 0.5 else "< 0.1 %"
    return f"{significant(100.0 * probability, 3 if 0.1 > min(probability, 1 - probability) else 2)} %"


def place(diagnosis: Diagnosis) -> list[tuple[str, str]]:
    """Where the misfit is: pairs of a heading and what is found under it."""
    found = diagnosis.location
    if found is None:
        return []
    look = next((coordinate_label(p.coordinate, p.unit) for p in found.profiles if p.coordinate == found.coordinate), None)
    pairs = [("channel", _shares({spoken(name): share for name, share in found.channels.items()}) or spoken(found.channel))]
    pairs += [("records", _shares(found.records))] if found.records else []
    pairs.append(("phase of the motion", found.phase))
    mostly = ""
    if found.interval is not None and look is not None:
        low, high = (significant(look.factor * end, 3) for end in found.interval)
        ends = f"between {low} and {high}" if NONE not in (low, high) else f"below {high}" if low == NONE else f"above {low}"
        mostly = f", mostly {ends} {look.unit}".rstrip()
    pairs.append(("follows", found.coordinate + mostly))
    pairs += [("begins at", f"{significant(found.time, 4)} s")] if found.time is not None else []
    pairs += [("only in", found.record)] if found.record is not None else []
    return pairs


def _shares(shares: Mapping[str, float]) -> str:
    """Names with their shares, the largest first; what has none is left out."""
    largest = sorted(((name, share) for name, share in shares.items() if share >= 0.005), key=lambda item: -item[1])
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in largest)


def changes(diagnosis: Diagnosis) -> Table:
    """Every parameter of either model, before and after; the shift in standard errors of the nominal fit."""
    before = {one.name: one for one in diagnosis.nominal.parameters}
    after = {one.name: one for one in _as_stated(diagnosis)} if diagnosis.is_augmented else before
    found = before | after
    known = {p.name: p.meaning for model in (diagnosis.nominal_model, diagnosis.model) for p in (MASS, *model.parameters)}
    names = tuple(known.get(name) or name.rpartition(".")[2].replace("_", " ") for name in found)
    rows = tuple(
        (one.symbol, _value(before.get(name)), _value(after.get(name)), unit_text(one.unit), _shift(before.get(name), after.get(name)))
        for name, one in found.items()
    )
    table = Table(
        columns=("parameter", "nominal", "augmented", "unit", "shift"), rows=rows, words=(0, 3), symbols=True, names=names, meanings=names
    )
    return table if diagnosis.is_augmented else table.without("augmented", "shift")


def _as_stated(diagnosis: Diagnosis) -> list[Quantity]:
    """Parameters of the augmented model, those of asserted effects in the form in which they are stated."""
    reported = {
        f"{one.effect.name}.{as_estimated.name}": dataclasses.replace(as_reported, name=f"{one.effect.name}.{as_reported.name}")
        for one in diagnosis.effects
        for as_estimated, as_reported in zip(one.parameters, one.reported, strict=True)
    }
    return [reported.get(one.name, one) for one in diagnosis.augmented.parameters]


def _value(one: Quantity | None) -> str:
    return NONE if one is None else rounded(one.value, one.stderr).text


def _shift(before: Quantity | None, after: Quantity | None) -> str:
    """After less before over the standard error that the nominal fit states; one that rounds to nothing is "none"."""
    if before is None:
        return "new"
    if after is None or before is after or not before.stderr:
        return NONE
    shift = (after.value - before.value) / before.stderr
    if not math.isfinite(shift):
        return NONE
    return f"{'+' if shift > 0 else ''}{significant(shift, 2)} σ" if abs(shift) >= 0.05 else "none"


def readings(diagnosis: Diagnosis) -> str:
    """Which share of the final model's misfit is random force and which is error of the readings, in one sentence."""
    records, sizes = diagnosis.augmented.records, diagnosis.reading_error
    shown = [(one.samples, name, chi2) for one in records for name, chi2 in one.chi2_reduced.items()]
    whole, of_readings = sum(n * chi2 for n, _, chi2 in shown), sum(n * sizes[name].over_noise ** 2 for n, name, _ in shown)
    return shares(sizes, diagnosis.unrest, min(max(1.0 - of_readings / max(whole, 1e-300), 0.0), 1.0))


def unseen(diagnosis: Diagnosis) -> str:
    """What the error of prediction is measured on."""
    brief = " (with impacts: over a quarter of a period)" if diagnosis.augmented.brief else ""
    if diagnosis.nominal.held_back:
        return f"records held back{brief}"
    return f"records left out in turn{brief}" if len(diagnosis.nominal.records) > 1 else f"the later half, from the earlier{brief}"


def errors(diagnosis: Diagnosis) -> Table:
    """Misfit of both models: on all records, and on what their parameters were not fitted to."""
    before, after = diagnosis.nominal, diagnosis.augmented
    rows = (
        ("reduced chi-square, all records", significant(before.chi2_reduced, 3), significant(after.chi2_reduced, 3), "1"),
        (f"NRMSE on {unseen(diagnosis)}", significant(before.held_out_nrmse, 3), significant(after.held_out_nrmse, 3), "0"),
    )
    table = Table(columns=("", "nominal", "augmented", "at best"), rows=rows)
    return table if diagnosis.is_augmented else table.without("augmented")


def misfits(diagnosis: Diagnosis) -> Table:
    """Root mean square residual over the noise of every channel of every record, before and after."""
    after, rows = {record.file: record for record in diagnosis.augmented.records}, []
    for record in diagnosis.nominal.records:
        for channel, chi2 in record.chi2_reduced.items():
            later = after.get(record.file, record).chi2_reduced.get(channel, math.nan)
            rows.append((record.file, spoken(channel), significant(chi2**0.5, 3), significant(later**0.5, 3)))
    table = Table(columns=("record", "channel", "nominal", "augmented"), rows=tuple(rows), words=(0, 1))
    return table if diagnosis.is_augmented else table.without("augmented")


def scatter(diagnosis: Diagnosis) -> Table:
    """Whether a parameter is the same in all records, in both models, and the two records that differ most."""
    before, after = ({one.name: one for one in side.disagreements} for side in (diagnosis.nominal, diagnosis.augmented))
    symbols = {p.name: p.symbol for side in (diagnosis.nominal, diagnosis.augmented) for p in side.parameters}
    rows = tuple(
        (symbols[name], _agrees(before.get(name)), _agrees(after.get(name)), _apart(before.get(name) or after[name]))
        for name in before | after
    )
    table = Table(columns=("parameter", "nominal", "augmented", "furthest apart"), rows=rows, words=(0, 3), symbols=True)
    return table if diagnosis.is_augmented else table.without("augmented")


def _agrees(one: Disagreement | None) -> str:
    """Scatter between records, and its chance."""
    return NONE if one is None else f"{significant(one.chi2, 3)} of {one.degrees} ({chance_text(one.chance)})"


def _apart(one: Disagreement) -> str:
    least, most = (chosen(one.records, key=lambda file: one.records[file][0]) for chosen in (min, max))
    return ", ".join(f"{file} {rounded(*one.records[file]).text}" for file in (least, most))


def strongest(diagnosis: Diagnosis) -> tuple[Considered, ...]:
    """The best beside each model in the order of the diagnosis; where nothing is missing, all, the least likely by chance first."""
    if diagnosis.is_complete:
        return tuple(sorted(diagnosis.considered, key=lambda one: one.chance))
    models = itertools.groupby(diagnosis.considered, lambda one: one.beside)
    return tuple(one for _, beside in models for one in itertools.islice(beside, 12))


def candidates(diagnosis: Diagnosis, shown: Sequence[Considered]) -> Table:
    """Candidates with their scores; columns in which none of them has a number are left out. Asserted ones are bold."""
    asserted, rows = {one.effect.name for one in diagnosis.effects}, tuple(_candidate(one) for one in shown)
    columns = ("candidate", "beside", "expected", "chance", "gain", "held back", "BIC")
    bold = tuple(number for number, one in enumerate(shown) if one.name in asserted)
    unknown = [heading for place, heading in enumerate(columns) if rows and all(row[place] == NONE for row in rows)]
    meanings = tuple(effects_words([one.name]) for one in shown)
    return Table(columns=columns, rows=rows, words=(0, 1), meanings=meanings, bold=bold).without(*unknown)


def _candidate(one: Considered) -> tuple[str, ...]:
    detail = one.detail
    for channel in CHANNELS:
        detail = detail.replace(channel, spoken(channel))
    beside = joined([plain_name(name) for name in one.beside]) or "nominal"
    counts = (_count(number) for number in (one.drop, one.held_out, one.bic))
    return (plain_name(one.name) + (f", {detail}" if detail else ""), beside, _count(one.gain), chance_text(one.chance), *counts)


def _count(number: float | None) -> str:
    """A difference of chi-square: whole numbers from a hundred on."""
    if number is None or not math.isfinite(number):
        return NONE
    return f"{number:.0f}".replace("-", "−") if 100 <= abs(number) < 1e6 else significant(number, 3)
