"""From the search to what is asserted: probabilities, twins, and the list of all that was considered."""

import dataclasses

import numpy as np

from identification.discrepancy.diagnosis import Asserted, Considered, Number
from identification.discrepancy.evidence import best_of_each, chance, trials
from identification.discrepancy.refit import Fitted
from identification.discrepancy.score import Candidate
from identification.discrepancy.search import Rival, Round, Search
from identification.fit import free_unknowns
from identification.layout import Active
from identification.uncertainty import uncertainty
from vibrojax.channels import UNITS
from vibrojax.effects import AbstractEffect
from vibrojax.effects.base import UNIT_OF_CHANNEL

TWIN = 8.0
"""Drop of the cost (half chi-square) by which the best must beat a rival to be told from it."""
_SHOWN = 12


def numbers(fitted: Fitted, chi2_reduced: float, adequate_below: float) -> tuple[Number, ...]:
    """Every shared parameter with its standard error."""
    prepared, outcome = fitted.prepared, fitted.outcome
    active = active_of(fitted)
    spread = uncertainty(outcome.equations, outcome.estimate, active, chi2_reduced, adequate_below)
    found = []
    for index, p in enumerate(prepared.layout.parameters):
        value = p.to_physical(outcome.estimate.shared[index])
        known = bool(active.shared[index] and spread.identifiable[index])
        stderr = float(spread.stderr[index] * p.slope(value)) if known else None
        found.append(Number(name=p.name, symbol=p.symbol, unit=p.unit, value=float(value), stderr=stderr))
    return tuple(found)


def active_of(fitted: Fitted) -> Active:
    """What the fit estimated."""
    return free_unknowns(fitted.prepared)


def of_effect(effect: AbstractEffect, shared: tuple[Number, ...], fitted: Fitted) -> tuple[Number, ...]:
    """An effect's own parameters under their short names; of those that each record has of its own, the root mean square."""
    prefix = f"{effect.name}."
    found = [dataclasses.replace(n, name=n.name.removeprefix(prefix)) for n in shared if n.name.startswith(prefix)]
    layout, nuisances = fitted.prepared.layout, fitted.outcome.estimate.nuisances
    for column, p in enumerate(layout.record_parameters, start=3):
        if p.name.startswith(prefix):
            value = float(np.sqrt(np.mean((nuisances[:, column] * p.scale) ** 2)))
            unit = UNITS[effect.channel] if p.unit == UNIT_OF_CHANNEL and effect.channel else p.unit
            found.append(Number(name=p.name.removeprefix(prefix), symbol=p.symbol, unit=unit, value=value, stderr=None))
    return tuple(found)


def probability(rounds: tuple[Round, ...], name: str, samples: int) -> float:
    """Of an effect among those that were fitted in its place, by the Bayesian information criterion."""
    for one in rounds:
        if one.rivals and one.rivals[0].name == name:
            worth = [-rival.cost - 0.5 * np.log(samples) * rival.fitted.unknowns for rival in one.rivals]
            shares = dict.fromkeys((rival.name for rival in one.rivals), 0.0)
            for rival, value in zip(one.rivals, worth, strict=True):
                shares[rival.name] += float(np.exp(max(value - max(worth), -700.0)))
            doubt = chance(2.0 * (one.cost - one.rivals[0].cost), one.rivals[0].candidate.degrees, 1)
            return min(0.999, (1.0 - doubt) * shares[name] / sum(shares.values()))
    return 0.5


def twins(rounds: tuple[Round, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    """Effects that fit about as well in the place of an asserted one."""
    found: list[str] = []
    for one in rounds:
        if one.rivals and one.rivals[0].name in names:
            lowest = one.rivals[0].cost
            found += [rival.name for rival in one.rivals[1:] if rival.cost - lowest < TWIN and rival.name not in names]
    return tuple(dict.fromkeys(found))


def considered(search: Search) -> tuple[Considered, ...]:
    """Everything that was looked at, round by round, the most promising first."""
    rows: list[Considered] = []
    for one in search.rounds:
        refitted = {id(rival.candidate): rival for rival in one.rivals}
        by_name = {_key(rival.candidate): rival for rival in one.rivals}
        rows += [
            _row(candidate, one.scored.found, refitted.get(id(candidate)) or by_name.get(_key(candidate)), one)
            for candidate in list(best_of_each(one.scored.found).values())[:_SHOWN]
        ]
    beside = search.last.fitted.names
    rows += [
        Considered(
            name=candidate.name,
            detail=detail(candidate),
            gain=candidate.gain,
            chance=chance(candidate.gain, candidate.degrees, trials(search.last.found, candidate.name)),
            drop=None,
            bic=None,
            held_out=None,
            beside=beside,
        )
        for candidate in list(best_of_each(search.last.found).values())[:_SHOWN]
    ]
    return tuple(rows)


def _key(candidate: Candidate) -> tuple[str, str | None]:
    return candidate.name, candidate.members[0].channel


def _row(candidate: Candidate, found: list[Candidate], rival: Rival | None, one: Round) -> Considered:
    samples = float(np.log(sum(len(row) for row in one.scored.at.weight)))
    best = one.rivals[0] if one.rivals else None
    drop = bic = None
    if rival is not None and best is not None:
        drop = 2.0 * (one.cost - rival.cost)
        bic = 2.0 * (rival.cost - best.cost) + samples * (rival.fitted.unknowns - best.fitted.unknowns)
    return Considered(
        name=candidate.name,
        detail=detail(candidate),
        gain=candidate.gain,
        chance=chance(candidate.gain, candidate.degrees, trials(found, candidate.name)),
        drop=drop,
        bic=bic,
        held_out=None,
        beside=one.scored.fitted.names,
    )


def detail(candidate: Candidate) -> str:
    """Which channel, record or grid point."""
    effect = candidate.members[0]
    own = [f"{p.symbol} {float(getattr(effect, p.field)):.3g} {p.unit}" for p in effect.parameters if p.name.endswith("_hz") or p.searched]
    return ", ".join([text for text in (effect.channel, effect.record) if text] + own)


def asserted(search: Search, fitted: Fitted, shared: tuple[Number, ...], samples: int) -> tuple[Asserted, ...]:
    """The effects of the final model, by probability."""
    found = [
        Asserted(
            effect=effect,
            probability=probability(search.rounds, effect.name, samples),
            parameters=of_effect(effect, shared, fitted),
        )
        for effect in fitted.model.effects
    ]
    return tuple(sorted(found, key=lambda one: -one.probability))
