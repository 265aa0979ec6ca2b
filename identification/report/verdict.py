"""Whether a fit is good, in one sentence, with the record and channel that speak most against it; and what to do next."""

import dataclasses
import math
from collections.abc import Iterator, Mapping

import numpy as np

from identification.estimation.held_back import has_signal, rms_nrmse
from identification.guesses.motion import input_noise
from identification.result.evidence import BY_NOISE, ONE_CHANNEL, OVERALL, chi2_limit
from identification.result.result import NOT_IDENTIFIABLE, Added, FitResult, SensorError, residual
from identification.wording.names import spoken, symbol_text
from identification.wording.numbers import chance_text, joined, percent, significant

GOOD, PARTLY, POOR = "good", "partly", "poor"
_COLOUR, _VARIANCE = 0.15, 0.1
"""One-step errors are called white with correlations up to this, and a variance as near to 1, beyond four standard errors."""
RUN_MODEL = "model.json holds {which}; `vibrojax simulate` runs it for any experiment with the same rig."


@dataclasses.dataclass(frozen=True, kw_only=True)
class Part:
    """Residuals of one channel of one record in "flight" or "contact": how many, and their chi-square."""

    file: str
    channel: str
    phase: str
    samples: int
    chi2: float

    @property
    def excess(self) -> float:
        """Chi-square over what noise could make of it."""
        return self.chi2 / chi2_limit(self.samples, ONE_CHANNEL)

    @property
    def words(self) -> str:
        return f"{spoken(self.channel)} in {self.phase} of {self.file}, {_times(math.sqrt(self.chi2))} the noise"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Verdict:
    """How good a fit is: level (`GOOD`, `PARTLY`, `POOR`), a sentence, and further ones."""

    level: str
    sentence: str
    remarks: tuple[str, ...]


def added_sentence(added: Added) -> str:
    """What effects added on request gain over the nominal model.

    Example:
        >>> added_sentence(Added(names=("mains_hum",), places=("impact_force",), gain=2.1, chance=0.3, bic=5.0, held_back=None))
        'Over the nominal model, mains_hum in impact_force gains 2.1 nats of likelihood (by chance: 0.3) and raises BIC by 5: not worth it.'
    """
    effects = joined([f"{name} in {place}" if place else name for name, place in zip(added.names, added.places, strict=True)])
    worth = "worth the parameters" if added.bic < 0 else "not worth it"
    one, chance = len(added.names) == 1, "below 1e-12" if added.chance < 1e-12 else f"{added.chance:.1g}"
    text = f"Over the nominal model, {effects} {'gains' if one else 'gain'} {added.gain:.4g} nats of likelihood (by chance: {chance})"
    text += f" and {'lower' if added.bic < 0 else 'raise'}{'s' if one else ''} BIC by {abs(added.bic):.4g}: {worth}."
    if added.held_back is not None:
        before, after = (percent(error, 1.0) if math.isfinite(error) else "unknown" for error in added.held_back)
        text += f" The error on the held-back records goes from {before} to {after}."
    return text


def judge(result: FitResult) -> Verdict:
    """Weigh the reduced chi-square of all records together, and of each channel of each record in flight and in contact.

    Where a random force has been found, that is what the model leaves.
    """
    found = list(parts(result))
    worst = max(found, key=lambda part: part.excess, default=None)
    times = math.sqrt(result.chi2_reduced) if result.chi2_reduced >= 0 else math.nan
    overall = f"reduced chi-square {significant(result.chi2_reduced)}"
    remarks = (*(() if result.added is None else (added_sentence(result.added),)), *_remarks(result, found))
    if result.unrest is not None:
        sentence = f"Beside the model a random force of {result.unrest.size} acts on the hammer; without it the misfit is "
        sentence, level, worst = f"{sentence}{_times(times)} the noise ({overall})", PARTLY, None
        if result.unrest.at_limit:
            sentence = (
                f"The model does NOT explain the records. {sentence}; the force is as large as a fit allows, do not trust the parameters"
            )
            level = POOR
    elif not result.chi2_reduced <= chi2_limit(result.degrees, OVERALL):
        sentence = f"The model does NOT explain the records: the misfit is {_times(times)} the noise ({overall})"
        level = POOR
    elif worst is not None and worst.excess > 1.0:
        sentence = f"The model explains the records on the whole ({overall}), but not everywhere"
        level = PARTLY
    else:
        sentence, level = f"The model explains the records to the noise ({overall})", GOOD
    clauses = [f"; worst is {worst.words}"] if level != GOOD and worst is not None else []
    if not result.converged:
        sentence, level = f"The iteration did NOT converge, and the numbers below are where it stopped. {sentence}", POOR
    for clause in filter(None, (not_white(result.reading_error), contradicting(result))):
        level = PARTLY if level == GOOD else level
        clauses.append(f"; {clause}")
    if result.held_back:
        worse = [(name, one) for one in result.held_back for name, error in one.nrmse.items() if has_signal(one, name) and not error < 1.0]
        unpredicted = [f"{spoken(name)} of {one.file}" for name, one in worse]
        level = PARTLY if unpredicted and level == GOOD else level
        if math.isfinite(error := rms_nrmse(result.held_back)):
            clauses.append(f"; the error on records held back is {percent(error, 1.0)}")
        clauses += [f", and {unpredicted[0]} is predicted no better than by its mean"] if unpredicted else []
    return Verdict(level=level, sentence=f"{sentence}{''.join(clauses)}.", remarks=remarks)


def not_white(errors: Mapping[str, SensorError]) -> str:
    """The channel whose one-step errors are farthest from white with variance one, as a clause; empty where all are."""
    found = {}
    for name, one in errors.items():
        if one.variance is None or one.correlation is None:
            continue
        excess = abs(one.correlation) / (_COLOUR + 4.0 / math.sqrt(one.samples))
        if excess > 1.0 or abs(one.variance - 1.0) > _VARIANCE + 4.0 * math.sqrt(2.0 / one.samples):
            text = f"one-step errors of {spoken(name)} are not white (variance {one.variance:.2f}, correlation {one.correlation:.2f})"
            found[text] = max(excess, one.variance, 1.0 / one.variance)
    return f"{max(found, key=found.__getitem__)}: standard errors may be too small" if found else ""


def contradicting(result: FitResult) -> str:
    """The parameter in which records contradict each other most, as a clause; empty where noise could scatter all as much."""
    found = [one for one in result.between_records if not one.modelled and one.chance * len(result.between_records) < BY_NOISE]
    if not found:
        return ""
    one = min(found, key=lambda each: (each.chance, -each.chi2))
    symbol = symbol_text(result.named[one.name].spec.symbol)
    chi2 = f"chi-square {significant(one.chi2, 3)} of {one.degrees}, chance {chance_text(one.chance)}"
    return f"the records contradict each other in {symbol} ({chi2}): its standard error does not cover a new record"


def parts(result: FitResult) -> Iterator[Part]:
    """Every fitted channel, in flight and in contact, except in records whose free motion follows the noise of their input."""
    noisy = {record.file for record in result.experiment.records if any(input_noise(record))}
    for record in result.records:
        if record.file in noisy:
            continue
        for channel in record.chi2_reduced:
            r = residual(record, channel)
            for phase, chosen in (("flight", ~record.in_contact), ("contact", record.in_contact)):
                usable = chosen & np.isfinite(r)
                if usable.sum() >= 8:
                    chi2 = float(np.mean(r[usable] ** 2))
                    yield Part(file=record.file, channel=channel, phase=phase, samples=int(usable.sum()), chi2=chi2)


def misfitting_alone(found: list[Part]) -> str | None:
    """The only record that the model does not explain while it explains all others to the noise; None where there is no such record."""
    files, poor = list(dict.fromkeys(part.file for part in found)), []
    for file in files:
        own = [part for part in found if part.file == file]
        samples = sum(part.samples for part in own)
        if sum(part.samples * part.chi2 for part in own) / samples > chi2_limit(samples, OVERALL):
            poor.append(file)
    return poor[0] if len(poor) == 1 and len(files) > 1 else None


def _alone(result: FitResult, file: str) -> str:
    """What is said of the only record that misfits, with what it alone has."""
    fit = next(one for one in result.records if one.file == file)
    said = f"Only {file} misfits; the model explains the other {len(result.records) - 1} to the noise."
    seen = {"cart_displacement", "cart_acceleration"} & fit.measured.keys()
    if fit.kind == "cart-excitation" and not seen and (sine := next((n for n in fit.nuisances if n.name == "base_amplitude"), None)):
        return f"{said} Its cart was not recorded: the amplitude found, {1e3 * sine.value:.3g} mm, may be wrong, or its motion no sine."
    return f"{said} Look for what differs in it: gap, frequency, a channel, a disturbance."


def _remarks(result: FitResult, found: list[Part]) -> tuple[str, ...]:
    remarks = []
    if result.unrest is None and (file := misfitting_alone(found)) is not None:
        remarks.append(_alone(result, file))
    if result.chi2_reduced < 0.5:
        remarks.append("The misfit is well below the stated noise: the noise is stated too large, and the standard errors with it.")
    estimated = sorted({spoken(channel) for record in result.experiment.records for channel in record.noise_estimated})
    if estimated:
        remarks.append(f"Not declared, but estimated from the records themselves, is the noise of {', '.join(estimated)}.")
    return tuple(remarks)


def _times(number: float) -> str:
    return f"{significant(number, 2)} times"


def next_steps(result: FitResult, verdict: Verdict) -> tuple[str, ...]:
    """What an experimenter can do after a fit: sentences, the most urgent first."""
    steps = []
    if not result.converged:
        steps.append("Check units, signs, mass and gaps: the fit did not converge.")
    if verdict.level != GOOD:
        steps.append("`vibrojax diagnose` with the same experiment looks for what the model leaves out, and says where it acts.")
    if estimated := sorted({spoken(channel) for record in result.experiment.records for channel in record.noise_estimated}):
        steps.append(
            f"State the noise of {', '.join(estimated)} in experiment.toml, measured with the rig at rest: errors and verdict rest on it."
        )
    if unknown := [symbol_text(one.spec.symbol) for one in result.parameters if one.status == NOT_IDENTIFIABLE]:
        steps.append(f"Add records in which {', '.join(unknown)} shows, or fix {'it' if len(unknown) == 1 else 'them'} in experiment.toml.")
    if pairs := _inseparable(result):
        steps.append(f"Impacts at other speeds would separate {', '.join(pairs)}: their errors hold only for the pair.")
    if not result.held_back:
        steps.append("Mark a record with `held_back = true` and fit again: its misfit then says how well the model predicts.")
    return (*steps, RUN_MODEL.format(which="the fitted model"))


def _inseparable(result: FitResult) -> list[str]:
    """Pairs of contact parameters whose estimates are almost perfectly correlated."""
    symbols, law = {name: symbol_text(p.spec.symbol) for name, p in result.named.items()}, {p.name for p in result.model.law.parameters}
    return [
        f"{symbols[first]} and {symbols[second]}"
        for i, first in enumerate(result.correlated)
        for j, second in enumerate(result.correlated[:i])
        if {first, second} <= law and np.abs(result.correlation[i, j]) > 0.99
    ]
