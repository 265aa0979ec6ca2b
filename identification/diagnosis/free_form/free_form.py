"""Free-form term for a misfit that no listed effect explains: a sum of few factors of the motion, fitted with all other parameters."""

import dataclasses
import time
from collections.abc import Callable, Mapping

import numpy as np

from identification.diagnosis.errors import errors
from identification.diagnosis.free_form.formula import common_phase, formula
from identification.diagnosis.free_form.terms import Choice, change_by, common_amplitude, force_groups, lines, reading_groups, select
from identification.diagnosis.refit import beside, with_model
from identification.diagnosis.relevance import residual_share
from identification.diagnosis.score.profiled import is_resolved, profiled_gains
from identification.diagnosis.score.score import Projector, projector
from identification.diagnosis.score.scored import Scored
from identification.diagnosis.score.signature import Course, courses
from identification.least_squares.uncertainty import Uncertainty
from identification.likelihood.fitted import Fitted, fitted
from identification.likelihood.joint import point
from identification.windows.layout import Estimate
from identification.windows.prepare import Prepared
from vibrojax.effects.free_form import LINES, MOST_TERMS, FreeForm, factors
from vibrojax.errors import NoConvergenceError
from vibrojax.model import Model

_ROUNDS = 2
_SIGNIFICANT = 3.0
"""Coefficient over its standard error below which a term is dropped."""
_MOST = 0.9
"""Explained share of the misfit below which the formula states that share."""
_PREFIX = f"{FreeForm.name}."


@dataclasses.dataclass(frozen=True, kw_only=True)
class Learned:
    """A fitted free-form term with its model and formula.

    Attributes:
        fitted: the model with the term, all parameters fitted together.
        effect: the term with its numbers; the phase of a sine is that common to all records, 0 where each has its own.
        formula: equation with standard errors; states the explained share of the misfit where that is below `_MOST`.
        gain: twice the log-likelihood gain over the model without it.
    """

    fitted: Fitted
    effect: FreeForm
    formula: str
    gain: float


def learn(
    scored: Scored,
    *,
    most_terms: int = 4,
    deadline: float = np.inf,
    progress: Callable[[str], None] = lambda stage: None,
) -> Learned | None:
    """Select and fit a force on the hammer, or an addition to one channel, as a sum of few terms; None where no term is significant.

    The score test ranks the terms as it ranks effects. Forward selection adds them one by one at the price of their numbers. All parameters
    are fitted together, and terms with coefficients below three standard errors are dropped. Then all terms are scored once more.

    Args:
        scored: all candidates beside the model that the term is added to.
        most_terms: at most 6.
        deadline: time (`time.monotonic`) after which no further round begins.
        progress: called with a line of text at each stage.
    """
    model, effect, at = scored.fitted, None, (scored.by, scored.courses)
    for _ in range(_ROUNDS):
        progress("learning a free-form term" if effect is None else f"scoring further terms beside {effect.equation}")
        choice = _chosen(model, effect, *at, min(most_terms, MOST_TERMS))
        if not choice.groups:
            break
        try:
            start = beside(model, change_by(choice, at[0].at, at[1], float(model.model.mass)))
            new = _significant(_fit(_extended(model, effect, choice, start), model))
        except (NoConvergenceError, np.linalg.LinAlgError):
            break
        if new is None or not new.criterion < model.criterion:
            break
        model, effect = new, _effect(new)
        if time.monotonic() > deadline or len(effect.terms) >= most_terms:
            break
        at = projector(model), courses(model.prepared, model.point.at, model.estimate)
    gain = 2.0 * (model.log_likelihood - scored.fitted.log_likelihood)
    return None if effect is None else _described(model, scored.fitted, gain)


def strongest_line(scored: Scored) -> float:
    """Expected gain of the strongest sinusoidal force at a free frequency, as of the listed effects; 0 where it is not significant."""
    fitted, mass = scored.fitted, float(scored.fitted.model.mass)
    groups = lines(fitted.prepared, scored.by, scored.courses, mass)
    choice = select(scored.by, groups, fitted.samples, 1) if groups else None
    if choice is None or not choice.groups:
        return 0.0
    if not is_resolved(fitted):
        return choice.gain
    change = change_by(choice, scored.at, scored.courses, mass)
    return max(choice.gain, float(profiled_gains(fitted, change[:, None], np.array([False]))[0]))


def _fit(prepared: Prepared, beside: Fitted) -> Fitted:
    return fitted(point(prepared, prepared.start, beside.variances), measure_noise=False)


def _effect(fitted: Fitted) -> FreeForm:
    found = fitted.model.effects[-1]
    assert isinstance(found, FreeForm)
    return found


def _chosen(fitted: Fitted, effect: FreeForm | None, by: Projector, along: tuple[Course, ...], most: int) -> Choice:
    """The selection of terms with the highest worth, over a force on the hammer and an addition to each channel."""
    mass, samples = float(fitted.model.mass), fitted.samples
    used = {base for term in effect.terms for base, _ in factors(term)} if effect else set()
    room_for_lines = LINES - sum(base.startswith("sine_") for base in used)
    taken = frozenset(used & {"near", "settled"})
    room = most - (len(effect.terms) if effect else 0)
    channels = [name for index, name in enumerate(by.at.channels) if (by.at.weight[..., index] > 0).any()]
    homes = ["", *channels] if effect is None else [effect.of_channel]
    choices = []
    for home in homes:
        groups = reading_groups(by, along, mass, home) if home else force_groups(fitted.prepared, by, along, mass)
        fresh = [group for group in groups if effect is None or group.members[0].terms[0] not in effect.terms]
        choices.append(select(by, fresh, samples, room, room_for_lines, taken))
    return max(choices, key=lambda choice: choice.worth)


def _extended(fitted: Fitted, effect: FreeForm | None, choice: Choice, start: Estimate) -> Prepared:
    """The model with the selected terms added at their first-order strengths; everything else starts at `start`."""
    model = fitted.prepared.model.replace(fitted.prepared.layout.physical(start.shared))
    records = len(start.nuisances)
    of_channel = choice.groups[0].members[0].of_channel
    terms = list(effect.terms) if effect else []
    values = {p.field: float(getattr(effect, p.field)) for p in effect.parameters} if effect else {}
    scales = list(effect.scales) if effect else []
    phases: dict[str, np.ndarray] = {}
    for group, factor in zip(choice.groups, choice.factors, strict=True):
        member = group.members[0]
        term, strength = member.terms[0], float(factor[0])
        if group.shape == "sine":
            line = next(k for k in range(1, LINES + 1) if not any(f"sine_{k}" in one for one in terms))
            term = term.replace("sine_1", f"sine_{line}")
            sine, cosine = factor.reshape(2, records)
            strength = common_amplitude(group, factor)
            phases[f"{_PREFIX}p{line}"] = np.arctan2(cosine, sine)
            values[f"f{line}_hz"] = float(member.f1_hz)
        elif group.shape:
            field = {"near": "d", "settled": "tau"}[group.shape]
            values[field] = float(getattr(member, field))
        terms.append(term)
        scales.append(max(abs(strength), 1e-300))
        values[f"c{len(terms)}"] = strength
    learned = FreeForm(terms=tuple(terms), of_channel=of_channel, scales=tuple(scales), **values)
    others = model.effects[:-1] if effect else model.effects
    return _restated(fitted, start, dataclasses.replace(model, effects=(*others, learned)), phases)


def _restated(fitted: Fitted, estimate: Estimate, model: Model, phases: Mapping[str, np.ndarray]) -> Prepared:
    """The same windows under a model with another free-form term; parameters per record keep their values by name."""
    layout = fitted.prepared.layout
    kept = {name: estimate.nuisances[:, index] for index, name in enumerate(layout.nuisances)} | dict(phases)
    names = (*layout.nuisances[: len(layout.nuisances) - len(layout.record_parameters)], *(p.name for p in model.record_parameters))
    return with_model(fitted.prepared, model, np.stack([kept[name] for name in names], axis=1), estimate.states, estimate.force)


def _significant(model: Fitted) -> Fitted | None:
    """The model after backward elimination of terms below three standard errors, refitted each time; None if no term remains."""
    while True:
        effect, stderr = _effect(model), _stderr(model, errors(model))
        kept = [k for k in range(1, len(effect.terms) + 1) if abs(float(getattr(effect, f"c{k}"))) >= _SIGNIFICANT * stderr[f"c{k}"]]
        if len(kept) == len(effect.terms):
            return model
        if not kept:
            return None
        less = dataclasses.replace(model.model, effects=(*model.model.effects[:-1], _only(effect, kept)))
        model = _fit(_restated(model, model.estimate, less, {}), model)


def _only(effect: FreeForm, kept: list[int]) -> FreeForm:
    """The free-form term with only the kept terms, counted from 1."""
    values = {p.field: float(getattr(effect, p.field)) for p in effect.parameters if not p.field.startswith("c")}
    values |= {f"c{new}": float(getattr(effect, f"c{old}")) for new, old in enumerate(kept, start=1)}
    terms, scales = tuple(effect.terms[k - 1] for k in kept), tuple(effect.scales[k - 1] for k in kept)
    return FreeForm(terms=terms, of_channel=effect.of_channel, scales=scales, **values)


def _stderr(fitted: Fitted, spread: Uncertainty) -> dict[str, float]:
    """Standard error of every shared parameter of the term, SI; infinite where it is not identifiable."""
    found, effect = {}, _effect(fitted)
    for index, p in enumerate(fitted.prepared.layout.parameters):
        if p.name.startswith(_PREFIX):
            name = p.name.removeprefix(_PREFIX)
            own = next(one for one in effect.parameters if one.name == name)
            sigma = float(spread.stderr[index]) * own.slope(float(getattr(effect, own.field)))
            found[name] = sigma if sigma > 0 else np.inf
    return found


def _described(fitted: Fitted, before: Fitted, gain: float) -> Learned:
    """The fitted term with its formula, and with the phases common to all records."""
    effect, spread, layout = _effect(fitted), errors(fitted), fitted.prepared.layout
    stderr, nuisances = _stderr(fitted, spread), fitted.estimate.nuisances
    of_nuisances = spread.stderr[layout.shared :].reshape(nuisances.shape)
    signs = {base: np.sign(float(getattr(effect, f"c{k}"))) for k, term in enumerate(effect.terms, start=1) for base, _ in factors(term)}
    phases = {}
    for index, name in enumerate(layout.nuisances):
        field = name.removeprefix(_PREFIX)
        if name == field or not field.startswith("p"):
            continue
        turn = np.pi if signs[f"sine_{field[1:]}"] < 0 else 0.0
        common = common_phase(nuisances[:, index] + turn, of_nuisances[:, index])
        if common is not None:
            phases[field] = common
            effect = dataclasses.replace(effect, **{field: (common[0] - turn) % (2.0 * np.pi)})
    model = dataclasses.replace(fitted.prepared.model, effects=(*fitted.prepared.model.effects[:-1], effect))
    prepared = dataclasses.replace(fitted.prepared, model=model)
    fitted = dataclasses.replace(fitted, point=dataclasses.replace(fitted.point, prepared=prepared))
    explained = float(np.clip(1.0 - residual_share(fitted, before), 0.0, 1.0))
    words = formula(effect, stderr, phases) + ("" if explained > _MOST else f"; explains {100 * explained:.0f} % of the misfit")
    return Learned(fitted=fitted, effect=_effect(fitted), formula=words, gain=gain)
