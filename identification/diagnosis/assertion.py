"""Posterior probabilities of the asserted effects, inseparable alternatives, and the table of all scored candidates."""

import dataclasses
from collections.abc import Callable

import numpy as np

from identification.diagnosis.calibration import WITHIN_CHANCE
from identification.diagnosis.diagnosis import Asserted, Considered, Number
from identification.diagnosis.score.score import Candidate
from identification.diagnosis.score.scored import Scored, best_of_each, trials
from identification.diagnosis.search.alternatives import Alternative
from identification.diagnosis.search.forward import Search, Step
from identification.likelihood.evidence import chance
from identification.likelihood.fitted import Fitted
from vibrojax.effects import AbstractEffect

_DECIMALS = 4
"""Of a probability."""


def of_effect(effect: AbstractEffect, shared: tuple[Number, ...], fitted: Fitted) -> tuple[Number, ...]:
    """Estimated parameters of one effect, named without the effect's prefix; parameters estimated per record appear as one amplitude A.

    A is the root mean square, over the records, of the root of their summed squares.
    """
    prefix = f"{effect.name}."
    found = [dataclasses.replace(n, name=n.name.removeprefix(prefix)) for n in shared if n.name.startswith(prefix)]
    layout = fitted.prepared.layout
    nuisances = fitted.estimate.nuisances[:, layout.without_effects :]
    parts = [(p, nuisances[:, column] * p.scale) for column, p in enumerate(layout.record_parameters) if p.name.startswith(prefix)]
    if parts:
        size = float(np.sqrt(np.mean(sum(values**2 for _, values in parts))))
        found.append(Number(name="amplitude", symbol="A", unit=parts[0][0].unit, value=size, stderr=None))
    return tuple(found)


def probability(steps: tuple[Step, ...], name: str) -> float:
    """Posterior probability of an effect: its weight exp(-BIC / 2) among the alternatives of its search step, times 1 - p of the best.

    p is the probability that noise alone gives the gain of the best alternative (`chance`).
    """
    for one in steps:
        if one.alternatives[0].name == name:
            best = one.alternatives[0]
            weights = [
                float(np.exp(-0.5 * min(alternative.fitted.criterion - best.fitted.criterion, 1400.0))) for alternative in one.alternatives
            ]
            mine = sum(weight for weight, alternative in zip(weights, one.alternatives, strict=True) if alternative.name == name)
            numbers = max(best.fitted.unknowns - one.scored.fitted.unknowns, 1)
            return (1.0 - chance(best.gain, numbers, trials(one.scored.found, name))) * mine / sum(weights)
    raise KeyError(name)


def twins(steps: tuple[Step, ...], names: tuple[str, ...]) -> tuple[str, ...]:
    """Effects that the records cannot separate from an asserted one: their BIC in its place is higher by less than `WITHIN_CHANCE`."""
    found: list[str] = []
    for one in steps:
        if one.alternatives[0].name not in names:
            continue
        lowest = one.alternatives[0].fitted.criterion
        near = [alternative.name for alternative in one.alternatives[1:] if alternative.fitted.criterion - lowest < WITHIN_CHANCE]
        found += [name for name in near if name not in names]
    return tuple(dict.fromkeys(found))


def considered(search: Search, predicted: Callable[[Fitted], float]) -> tuple[Considered, ...]:
    """Table of all scored candidates, by search step and decreasing expected gain, with refit results for those that were fitted."""
    rows: list[Considered] = []
    for one in search.steps:
        rows += _rows(one.scored, one.alternatives, predicted)
    return (*rows, *_rows(search.last, search.refused, predicted))


def _rows(scored: Scored, alternatives: tuple[Alternative, ...], predicted: Callable[[Fitted], float]) -> list[Considered]:
    by_name = {_key(alternative.candidate): alternative for alternative in reversed(alternatives)}
    rows = []
    for candidate in best_of_each(scored.found).values():
        alternative = by_name.get(_key(candidate))
        fitted = {} if alternative is None else _in_full(alternative, alternatives[0], scored, predicted)
        rows.append(
            Considered(
                name=candidate.name,
                detail=detail(candidate),
                gain=candidate.gain,
                chance=chance(candidate.gain, candidate.degrees, trials(scored.found, candidate.name)),
                drop=fitted.get("drop"),
                bic=fitted.get("bic"),
                held_out=fitted.get("held_out"),
                beside=scored.fitted.names,
            )
        )
    return rows


def _key(candidate: Candidate) -> tuple[str, str | None]:
    return candidate.name, candidate.members[0].channel


def _in_full(alternative: Alternative, best: Alternative, scored: Scored, predicted: Callable[[Fitted], float]) -> dict[str, float]:
    """Refit results of one candidate: log-likelihood gain, BIC less that of the best, fall of the held-out error."""
    return {
        "drop": alternative.gain,
        "bic": alternative.fitted.criterion - best.fitted.criterion,
        "held_out": predicted(scored.fitted) - predicted(alternative.fitted),
    }


def detail(candidate: Candidate) -> str:
    """Channel, record and searched or frequency parameters of a candidate, as text."""
    effect = candidate.members[0]
    own = [f"{p.symbol} {float(getattr(effect, p.field)):.3g} {p.unit}" for p in effect.parameters if p.name.endswith("_hz") or p.searched]
    return ", ".join([text for text in (effect.channel, effect.record) if text] + own)


def asserted(search: Search, fitted: Fitted, shared: tuple[Number, ...]) -> tuple[Asserted, ...]:
    """Effects of the final model with posterior probability and parameters, the most probable first.

    Probabilities are given to four decimals, no finer than `ALPHA`; effects with equal ones stay in the order in which they were added.
    """
    gaps = {record.gap for record in fitted.prepared.experiment.records}
    gap = gaps.pop() if len(gaps) == 1 else None
    found = [
        Asserted(
            effect=effect,
            probability=round(probability(search.steps, effect.name), _DECIMALS),
            parameters=of_effect(effect, shared, fitted),
            gap=gap,
        )
        for effect in fitted.model.effects
    ]
    return tuple(sorted(found, key=lambda one: -one.probability))
