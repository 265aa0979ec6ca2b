"""The verdict in sentences for a test engineer."""

import math
from collections.abc import Mapping, Sequence

from identification.diagnosis.decide import LEVEL
from identification.diagnosis.diagnosis import ADEQUATE, MISSING, RESTLESS, UNDECIDED, Asserted, Location, Side
from identification.result.evidence import Unrest
from identification.result.result import Quantity
from identification.wording.names import spoken
from identification.wording.numbers import joined, percent, rounded, significant, with_unit
from vibrojax.effects import EFFECTS


def sentences(
    verdict: str,
    effects: Sequence[Asserted],
    ambiguous: Mapping[str, Sequence[str]],
    location: Location | None,
    before: Side,
    after: Side,
    formula: str,
    unrest: Unrest | None = None,
    beyond: Mapping[str, float] = {},
    longer: Mapping[str, float] = {},
    *,
    reasons: Mapping[str, str] = {},
    finished: bool = True,
    limited: bool = False,
) -> tuple[str, ...]:
    """Verdict in sentences: what is missing, where, and its effect on the error; the first sentence is complete in itself.

    `ambiguous`: by effect, others that the records do not separate from it. `unrest`: random force beside the final model.
    `beyond`: errors of readings over the noise declared, by channel, where they are larger.
    `longer`: the same over the noise between neighbouring samples, where none is declared.
    `reasons`: why the best listed effects are not asserted, by name. `limited`: not all listed effects were looked for.
    """
    unseen = "records left out in turn" if len(before.records) > 1 else "the later half of the record, left out"
    if before.held_back:
        unseen = "the record held back" if len(before.held_back) == 1 else f"the {len(before.held_back)} records held back"
    if after.brief:
        unseen += " (with impacts: over a quarter of a period, from the state estimated there)"
    restless = () if unrest is None else (unrest.sentence(),)
    if verdict in (ADEQUATE, RESTLESS):
        return (
            _nothing_missing(verdict, before, after, unrest, beyond, longer),
            *restless,
            _error_of_nominal(before, unseen),
            *_varying(after),
        )
    where = (location.sentence,) if location is not None else ()
    falls = (
        f"Reduced chi-square falls from {before.chi2_reduced:.3g} to {after.chi2_reduced:.3g}; nothing could be left out of the fit."
        if math.isnan(before.held_out_nrmse)
        else f"The error on {unseen} {_moves(before, after)} from {percent(before.held_out_nrmse, 1.0)}"
        f" to {percent(after.held_out_nrmse, 1.0)}"
        f" (reduced chi-square from {before.chi2_reduced:.3g} to {after.chi2_reduced:.3g})."
    )
    if verdict == MISSING:
        named = joined([f"{one.effect.summary} ({_main(one)})" for one in effects])
        explain = "explains" if len(effects) == 1 else "explain"
        first = f"{named[0].upper()}{named[1:]} {explain} what the nominal model leaves out."
        doubts = [
            f"In place of {_summary(name)}, these records allow {joined([_summary(twin) for twin in twins], 'or')} too."
            for name, twins in ambiguous.items()
        ]
        return (first, *where, falls, *restless, *doubts, *_varying(after))
    no_effect = f"no {'effect that was looked for' if limited else 'listed effect'} explains"
    first = f"Something real is missing, and {no_effect} it."
    if verdict == UNDECIDED:
        first = "The model has not converged: there is no verdict." if finished else "The budget ended the search: there is no verdict."
    best = tuple(f"The best of them, {spoken(name)}, is not asserted: {reason}." for name, reason in list(reasons.items())[:1])
    learned = (_error_of_nominal(before, unseen),) if after is before else (falls,)
    if formula:
        learned = (f"A term learned from the records describes it: {formula}.", *learned)
    return (first, *best, *where, *learned, *restless, *_varying(after))


def _summary(name: str) -> str:
    """An effect in words."""
    return EFFECTS[name].summary if name in EFFECTS else spoken(name)


def _nothing_missing(
    verdict: str, before: Side, after: Side, unrest: Unrest | None, beyond: Mapping[str, float], longer: Mapping[str, float]
) -> str:
    """First sentence where no deterministic effect is missing; it names the parameters that need a value for each record."""
    chi2 = f"reduced chi-square {before.chi2_reduced:.3f}"
    each = joined([p.symbol for p in after.parameters if p.name in after.varying])
    if verdict == RESTLESS:
        beside = f" beside a separate value of {each} in each record" if each else ""
        cause = f"a random force acts on the hammer ({chi2} without it)"
        if unrest is None and beyond:
            channel, times = next(iter(beyond.items()))
            cause = f"the error of {spoken(channel)} is {significant(times, 2)} times its noise ({chi2})"
        return f"The misfit exceeds the sensors' noise, and no function of motion, drive, time or record explains it{beside}: {cause}."
    if longer:
        channel, times = next(iter(longer.items()))
        return (
            f"Nothing is missing that motion, drive, time or record show, but the error of {spoken(channel)} is"
            f" {significant(times, 2)} times its noise from sample to sample ({chi2}):"
            " declare the sensor's noise, and a diagnosis says whether that is too much."
        )
    if each:
        return f"With a separate value of {each} in each record, the nominal model explains the records to the noise ({chi2})."
    return f"Nothing beyond the noise: the nominal model explains the records ({chi2})."


def _error_of_nominal(before: Side, unseen: str) -> str:
    """Sentence on the nominal model's error on what its fit has not seen."""
    if math.isnan(before.held_out_nrmse):
        return "Nothing could be left out of the fit."
    return f"The error of the nominal model on {unseen} is {percent(before.held_out_nrmse, 1.0)}."


def _varying(side: Side) -> tuple[str, ...]:
    """Sentence on the parameter that varies most significantly between records, with its smallest and largest value."""
    differ = [one for one in side.disagreements if one.modelled or one.chance < LEVEL / len(side.disagreements)]
    if not differ:
        return ()
    worst = min(differ, key=lambda one: (not one.modelled, one.chance, -one.chi2 / one.degrees))
    p = next(p for p in side.parameters if p.name == worst.name)
    ends = sorted(worst.records.items(), key=lambda item: item[1][0])
    low, high = (f"{with_unit(rounded(*estimate).text, p.unit)} in {file}" for file, estimate in (ends[0], ends[-1]))
    return (f"{p.symbol} varies between records: {low}, {high}.",)


def _main(one: Asserted) -> str:
    """Place where the effect acts, and its parameters."""
    return ", ".join([*_places(one), *(_number(p) for p in one.reported)])


def _places(one: Asserted) -> list[str]:
    """Channel, and record if the effect acts in one alone."""
    channel = one.effect.channel
    return [text for text in (spoken(channel) if channel else None, one.effect.record) if text]


def _number(p: Quantity) -> str:
    return f"{p.symbol} = {with_unit(rounded(p.value, p.stderr).text, p.unit)}"


def _moves(before: Side, after: Side) -> str:
    return "falls" if after.held_out_nrmse <= before.held_out_nrmse else "rises"
