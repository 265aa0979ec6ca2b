"""From the search to what is asserted: probabilities, twins, and the list of all that was considered."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.discrepancy.diagnosis import Asserted, Considered, Number
from identification.discrepancy.evidence import best_of_each, chance, trials
from identification.discrepancy.held_out import HeldOut
from identification.discrepancy.look import Scored
from identification.discrepancy.refit import Fitted
from identification.discrepancy.robust import Tolerance
from identification.discrepancy.score import Candidate
from identification.discrepancy.search import Round, Search
from identification.discrepancy.short_list import Rival
from vibrojax.channels import UNITS
from vibrojax.effects import AbstractEffect
from vibrojax.effects.base import UNIT_OF_CHANNEL

TWIN = 8.0
"""Drop of the cost (half chi-square) by which the best must beat a rival to be told from it."""
_SHOWN = 12
_PREDICTED = 1.2
"""Cost over that of the best up to which a rival's predictions are looked at."""


def of_effect(effect: AbstractEffect, shared: tuple[Number, ...], fitted: Fitted) -> tuple[Number, ...]:
    """An effect's own parameters under their short names; of the parts that each record has of its own, the amplitude.

    That is the root of their summed squares, as root mean square over the records.
    """
    prefix = f"{effect.name}."
    found = [dataclasses.replace(n, name=n.name.removeprefix(prefix)) for n in shared if n.name.startswith(prefix)]
    layout = fitted.prepared.layout
    nuisances = fitted.outcome.estimate.nuisances[:, layout.without_effects :]
    parts = [(p, nuisances[:, column] * p.scale) for column, p in enumerate(layout.record_parameters) if p.name.startswith(prefix)]
    if parts:
        size = float(np.sqrt(np.mean(sum(values**2 for _, values in parts))))
        unit = parts[0][0].unit
        unit = UNITS[effect.channel] if unit == UNIT_OF_CHANNEL and effect.channel else unit
        found.append(Number(name="amplitude", symbol="A", unit=unit, value=size, stderr=None))
    return tuple(found)


def probability(rounds: tuple[Round, ...], name: str, allowed: Tolerance, *, dispersion: float = 1.0) -> float:
    """Of an effect among those that were fitted in its place, by the Bayesian information criterion, less the chance of noise.

    Where more than noise is left, the criterion is divided by the dispersion (quasi-likelihood, Wedderburn 1974).
    """
    for one in rounds:
        if one.rivals and one.rivals[0].name == name:
            best = one.rivals[0]
            shares = dict.fromkeys((rival.name for rival in one.rivals), 0.0)
            for rival in one.rivals:
                shares[rival.name] += float(np.exp(-0.5 * min((rival.bic(allowed) - best.bic(allowed)) / dispersion, 1400.0)))
            doubt = chance(2.0 * (one.cost - best.cost), best.candidate.degrees, trials(one.scored.found, name))
            return min(0.999, (1.0 - doubt) * shares[name] / sum(shares.values()))
    return 0.5


def twins(rounds: tuple[Round, ...], names: tuple[str, ...], *, dispersion: float = 1.0) -> tuple[str, ...]:
    """Effects that fit about as well in the place of an asserted one; differences count as in `probability`."""
    found: list[str] = []
    for one in rounds:
        if one.rivals and one.rivals[0].name in names:
            lowest = one.rivals[0].cost
            found += [rival.name for rival in one.rivals[1:] if rival.cost - lowest < TWIN * dispersion and rival.name not in names]
    return tuple(dict.fromkeys(found))


def considered(search: Search, allowed: Tolerance, predicted: Callable[[Fitted], HeldOut]) -> tuple[Considered, ...]:
    """Everything that was looked at, round by round, the most promising first; those refitted to all records also by what they predict."""
    rows: list[Considered] = []
    for one in search.rounds:
        before = predicted(one.scored.fitted).chi2
        by_name = {_key(rival.candidate): rival for rival in one.rivals}
        listed = list(best_of_each(one.scored.found).values())[:_SHOWN]
        for candidate in listed:
            rival = by_name.get(_key(candidate))
            rows.append(_row(candidate, one.scored, {} if rival is None else _refitted(rival, one, before, allowed, predicted)))
    listed = list(best_of_each(search.last.found).values())[:_SHOWN]
    return (*rows, *(_row(candidate, search.last, {}) for candidate in listed))


def _key(candidate: Candidate) -> tuple[str, str | None]:
    return candidate.name, candidate.members[0].channel


def _row(candidate: Candidate, scored: Scored, refitted: dict[str, float]) -> Considered:
    return Considered(
        name=candidate.name,
        detail=detail(candidate),
        gain=candidate.gain,
        chance=chance(candidate.gain, candidate.degrees, trials(scored.found, candidate.name)),
        drop=refitted.get("drop"),
        bic=refitted.get("bic"),
        held_out=refitted.get("held_out"),
        beside=scored.fitted.names,
    )


def _refitted(rival: Rival, one: Round, before: float, allowed: Tolerance, predicted: Callable[[Fitted], HeldOut]) -> dict[str, float]:
    """What became of a candidate that was fitted again."""
    best = one.rivals[0]
    found = {"drop": 2.0 * (one.cost - rival.cost), "bic": rival.bic(allowed) - best.bic(allowed)}
    if len(rival.fitted.prepared.record) == len(one.scored.fitted.prepared.record) and rival.cost < _PREDICTED * best.cost:
        found["held_out"] = before - predicted(rival.fitted).chi2
    return found


def detail(candidate: Candidate) -> str:
    """Which channel, record or grid point."""
    effect = candidate.members[0]
    own = [f"{p.symbol} {float(getattr(effect, p.field)):.3g} {p.unit}" for p in effect.parameters if p.name.endswith("_hz") or p.searched]
    return ", ".join([text for text in (effect.channel, effect.record) if text] + own)


def asserted(search: Search, fitted: Fitted, shared: tuple[Number, ...], allowed: Tolerance) -> tuple[Asserted, ...]:
    """The effects of the final model, by probability."""
    dispersion = search.dispersion(allowed)
    gaps = {record.gap for record in fitted.prepared.experiment.records}
    gap = gaps.pop() if len(gaps) == 1 else None
    found = [
        Asserted(
            effect=effect,
            probability=probability(search.rounds, effect.name, allowed, dispersion=dispersion),
            parameters=of_effect(effect, shared, fitted),
            gap=gap,
        )
        for effect in fitted.model.effects
    ]
    return tuple(sorted(found, key=lambda one: -one.probability))
