"""What a diagnosis returns: the verdict, its evidence, and both models beside the records."""

import dataclasses
from typing import Any

import numpy as np

from identification.experiment import Experiment
from identification.result.result import RecordFit
from identification.result.unrest import Unrest
from vibrojax.effects import AbstractEffect
from vibrojax.model import Model

NOT_FINISHED = "not finished"
"""Begin of the warning of a search that the budget has ended."""
ADEQUATE, RESTLESS, MISSING, UNLISTED = "adequate", "restless", "missing", "unlisted"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Number:
    """A parameter as estimated: SI value, standard error (None where it has no meaning), unit and symbol."""

    name: str
    symbol: str
    unit: str
    value: float
    stderr: float | None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Asserted:
    """An effect that the verdict asserts, or that its last sentence weighs.

    Attributes:
        effect: with its estimated numbers.
        probability: of being the cause among everything considered.
        parameters: estimated.
        gap: as set, m, where all records have the same; else None.
    """

    effect: AbstractEffect
    probability: float
    parameters: tuple[Number, ...]
    gap: float | None = None

    @property
    def told(self) -> tuple[Number, ...]:
        """The parameters as readers are told them: a place that counts from the gap as set stands on the axis of u, if there is one gap."""
        symbols = {p.name: p.from_gap for p in self.effect.parameters if p.from_gap} if self.gap is not None else {}
        return tuple(self._place(one, symbols[one.name]) if one.name in symbols else one for one in self.parameters)

    def _place(self, one: Number, symbol: str) -> Number:
        return dataclasses.replace(one, name="position_of_the_stop", symbol=symbol, value=(self.gap or 0.0) + one.value)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Profile:
    """What is missing against one coordinate: bins with mean and standard error of it.

    Attributes:
        coordinate: "time", "excitation phase", "displacement", "velocity", "indentation", "impact speed" or "time since impact".
        unit: of the coordinate.
        quantity: what is missing: "force" (N), or the residual of a channel, in its noise.
        center, mean, stderr: (bins,).
        explained: share of the excess misfit's variance that the mean explains.
    """

    coordinate: str
    unit: str
    quantity: str
    center: np.ndarray
    mean: np.ndarray
    stderr: np.ndarray
    explained: float


@dataclasses.dataclass(frozen=True, kw_only=True)
class Bend:
    """Where force against indentation bends, read off the records without integrating a motion.

    Attributes:
        depth: indentation from which on it is harder, m.
        files: of the records with contacts.
        record: (samples,) which of these each sample in contact is of.
        contact: (samples,) number of its contact, no two alike.
        indentation: (samples,) from where the records, smoothed, say that the stop begins, m.
        force: (samples,) that the load cell shows, or the hammer's inertia where that tells nothing, N.
        straight, bent: (samples,) force of the contact law that describes these best, without and with a bend, N.
    """

    depth: float
    files: tuple[str, ...]
    record: np.ndarray
    contact: np.ndarray
    indentation: np.ndarray
    force: np.ndarray
    straight: np.ndarray
    bent: np.ndarray

    @property
    def deeper(self) -> tuple[str, ...]:
        """Files of the records with samples beyond it."""
        return tuple(file for index, file in enumerate(self.files) if (self.indentation[self.record == index] > self.depth).any())


@dataclasses.dataclass(frozen=True, kw_only=True)
class Location:
    """Where the nominal model goes wrong.

    Attributes:
        channel: that shows it most.
        channels: share of the excess misfit by channel.
        records: share of the excess misfit by record file.
        phase: "free flight", "contact", "separation", "after impact" or "all".
        coordinate: that explains it best.
        interval: of that coordinate, in its unit, that holds most of it; None where it acts everywhere.
        time: s, of an effect that begins at an instant; else None.
        record: file, of an effect that acts in one record only; else None.
        sentence: that a test engineer understands.
        profiles: by coordinate, the best first.
        bend: of the contact law, if the records show one and no listed effect explains the misfit.
        maps: by record file, mean squared residual over the noise variance in equal parts of the record (rows) and of the excitation
            period (columns); (24, 24); NaN where there is none.
    """

    channel: str
    channels: dict[str, float]
    records: dict[str, float]
    phase: str
    coordinate: str
    interval: tuple[float, float] | None
    time: float | None
    record: str | None
    sentence: str
    profiles: tuple[Profile, ...]
    maps: dict[str, np.ndarray]
    bend: Bend | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Considered:
    """One candidate that was looked at.

    Attributes:
        name: of the effect.
        detail: which channel, record or frequency.
        gain: expected improvement of twice the log-likelihood (score test).
        chance: probability that chance alone gives as much.
        drop: improvement of twice the log-likelihood when the whole was fitted again with it; a lower bound where the fit ended early,
            since it could not become the best; None where it was not fitted.
        bic: Bayesian information criterion after that, less that of the best; None where it was not fitted.
        held_out: fall of the error on windows left out of the fit, over the standard deviation of the record; None where it was not fitted.
        beside: effects that were in the model already.
    """

    name: str
    detail: str
    gain: float
    chance: float
    drop: float | None
    bic: float | None
    held_out: float | None
    beside: tuple[str, ...]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Disagreement:
    """How a parameter differs from record to record.

    Attributes:
        name: of the parameter.
        chi2: scatter of the records' own estimates over their errors.
        degrees: records that determine it, less one.
        chance: that noise alone scatters them as much.
        records: by file, what it alone would estimate and the standard error, SI.
    """

    name: str
    chi2: float
    degrees: int
    chance: float
    records: dict[str, tuple[float, float]]

    @property
    def scatter(self) -> float:
        """Standard deviation of the values beyond their errors, SI, by the method of moments (DerSimonian and Laird 1986).

        0 where one record alone tells the parameter.
        """
        value, weight = np.array([(value, stderr**-2.0) for value, stderr in self.records.values()]).T
        chi2 = float(weight @ (value - weight @ value / weight.sum()) ** 2)
        of_others = float(weight.sum() - weight @ weight / weight.sum())
        return float(np.sqrt(max(chi2 - len(value) + 1, 0.0) / of_others)) if of_others > 0 else 0.0


@dataclasses.dataclass(frozen=True, kw_only=True)
class Side:
    """One of the two models beside the records.

    Attributes:
        model: fitted.
        parameters: every shared one, those of effects too.
        chi2_reduced: of the whole.
        held_out_nrmse: error on the records held back, root mean square over them and their channels; without any, on windows left out
            of the fit, see `held_out`.
        records: beside their predictions.
        disagreements: of the parameters between records.
        held_back: records that no fit has seen, beside their predictions.
    """

    model: Model
    parameters: tuple[Number, ...]
    chi2_reduced: float
    held_out_nrmse: float
    records: tuple[RecordFit, ...]
    disagreements: tuple[Disagreement, ...] = ()
    held_back: tuple[RecordFit, ...] = ()


@dataclasses.dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The verdict on one experiment.

    Attributes:
        verdict: `ADEQUATE`, `RESTLESS`, `MISSING` or `UNLISTED`.
        sentences: the verdict in words, first what is missing, then what it does to the error; two to six of them.
        effects: asserted, by probability.
        free_form: formula of the term that was learned where no listed effect explains the misfit; empty otherwise.
        ambiguous_with: names of effects that these records cannot tell from the asserted ones.
        location: of the misfit; None where there is none.
        considered: all candidates, the best first.
        nominal, augmented: models before and after; the same where nothing is missing.
        unrest: random force beside the augmented model; None where there is no evidence of one.
        next_experiment: what would separate the leading causes.
        warnings: that the reader must see.
        seconds: wall time by stage.
    """

    experiment: Experiment
    verdict: str
    sentences: tuple[str, ...]
    effects: tuple[Asserted, ...]
    free_form: str
    ambiguous_with: tuple[str, ...]
    location: Location | None
    considered: tuple[Considered, ...]
    nominal: Side
    augmented: Side
    unrest: Unrest | None
    next_experiment: str
    warnings: tuple[str, ...]
    seconds: dict[str, float]

    @property
    def is_finished(self) -> bool:
        """Whether the search ended before the budget did."""
        return not any(warning.startswith(NOT_FINISHED) for warning in self.warnings)

    @property
    def is_complete(self) -> bool:
        """Whether the nominal model lacks nothing that could be modelled: `ADEQUATE` or `RESTLESS`."""
        return self.verdict in (ADEQUATE, RESTLESS)

    @property
    def nominal_model(self) -> Model:
        """Before."""
        return self.nominal.model

    @property
    def model(self) -> Model:
        """After."""
        return self.augmented.model

    def document(self, provenance: dict[str, Any] | None = None) -> dict[str, Any]:
        """`diagnosis.json`."""
        return {
            "schema": 1,
            "verdict": self.verdict,
            "effects": [
                {
                    "name": one.effect.name,
                    "probability": one.probability,
                    "parameters": {p.name: {"value": p.value, "stderr": p.stderr, "unit": p.unit} for p in one.parameters},
                }
                | ({"record": one.effect.record} if one.effect.record else {})
                | ({"channel": one.effect.channel} if one.effect.channel else {})
                for one in self.effects
            ],
            "ambiguous_with": list(self.ambiguous_with),
            "location": _location(self.location),
            "nominal": _side(self.nominal),
            "augmented": _side(self.augmented),
            "unrest": None if self.unrest is None else self.unrest.document(),
            "free_form": self.free_form,
            "next_experiment": self.next_experiment,
            "sentences": list(self.sentences),
            "considered": [dataclasses.asdict(one) for one in self.considered],
            "warnings": list(self.warnings),
            "provenance": dict(provenance or {}),
        }


def _side(side: Side) -> dict[str, Any]:
    differ = {
        one.name: {
            "chi2": one.chi2,
            "degrees": one.degrees,
            "chance": one.chance,
            "records": {file: {"value": value, "stderr": stderr} for file, (value, stderr) in one.records.items()},
        }
        for one in side.disagreements
    }
    return {
        "chi2_reduced": side.chi2_reduced,
        "held_out_nrmse": side.held_out_nrmse,
        "between_records": differ,
        "records": {record.file: {"gap": record.gap, "nrmse": record.nrmse} for record in side.records},
        "held_back": {record.file: record.nrmse for record in side.held_back},
    }


def _location(location: Location | None) -> dict[str, Any] | None:
    if location is None:
        return None
    plain = ("channel", "records", "channels", "phase", "coordinate", "interval", "time", "record", "sentence")
    bend = None if location.bend is None else {"depth": location.bend.depth, "records": list(location.bend.deeper)}
    return {name: getattr(location, name) for name in plain} | {"bend": bend}
