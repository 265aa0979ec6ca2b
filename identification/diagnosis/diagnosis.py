"""Result of a diagnosis: the verdict, its evidence, and the nominal and augmented models with their predictions."""

import dataclasses
from typing import Any

import numpy as np

from identification.experiment import Experiment
from identification.result.evidence import Disagreement, Unrest
from identification.result.result import Quantity, RecordFit, SensorError
from identification.result.ring_down import RingDowns
from identification.result.store import series
from vibrojax.effects import AbstractEffect
from vibrojax.model import Model

NOT_FINISHED = "not finished"
"""First words of the warning that the time budget ended the search."""
LIMITED = "limited on request"
"""Begin of the warning of a diagnosis that did not look for all listed effects."""
ADEQUATE, RESTLESS, MISSING, UNLISTED, UNDECIDED = "adequate", "restless", "missing", "unlisted", "undecided"
_MISSING = " of what is missing ({self.quantity}) against {self.coordinate}"


@dataclasses.dataclass(frozen=True, kw_only=True)
class Asserted:
    """An effect of the final model, asserted as missing from the nominal one.

    Attributes:
        effect: with its estimated numbers.
        probability: posterior, among all alternatives of its search step.
        parameters: estimated.
        gap: as set, m, where all records have the same; else None.
    """

    effect: AbstractEffect
    probability: float
    parameters: tuple[Quantity, ...]
    gap: float | None = None

    @property
    def reported(self) -> tuple[Quantity, ...]:
        """The parameters as reported: a position relative to the gap as set is given on the axis of u, if all records have the same gap."""
        symbols = {p.name: p.from_gap for p in self.effect.parameters if p.from_gap} if self.gap is not None else {}
        return tuple(self._place(one, symbols[one.name]) if one.name in symbols else one for one in self.parameters)

    def _place(self, one: Quantity, symbol: str) -> Quantity:
        return dataclasses.replace(one, name="position_of_the_stop", symbol=symbol, value=(self.gap or 0.0) + one.value)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Profile:
    """Mean missing force, or residual, against one coordinate of the motion, in bins.

    Attributes:
        coordinate: "displacement", "velocity", "indentation", "time" or "reading".
        unit: of the coordinate.
        quantity: "force" (N), "stop" (its place), or a channel: its error over the noise, or, over time, that of its gain.
        center, mean, stderr: (bins,); median coordinate, mean and standard error of the quantity.
        explained: gain of likelihood by the free form over this coordinate, over that of the best one.
        turns: whether the force acts the other way while u' < 0; `mean` is then that while u' > 0.
    """

    coordinate: str
    unit: str
    quantity: str
    center: np.ndarray = series("bin", unit=lambda self, _: self.unit, words="center" + _MISSING)
    mean: np.ndarray = series("bin", unit=lambda self, _: self.size_unit, words="mean" + _MISSING)
    stderr: np.ndarray = series("bin", unit=lambda self, _: self.size_unit, words="stderr" + _MISSING)
    explained: float
    turns: bool = False

    @property
    def is_even(self) -> bool:
        """Whether one number describes the quantity along the whole coordinate as well as its bins do (H. Akaike, 1974)."""
        off = (self.mean - self.average) / np.maximum(self.stderr, 1e-300)
        return bool(np.sum(off**2) < 2.0 * (len(off) - 1))

    @property
    def average(self) -> float:
        """Of the bins, by their standard errors."""
        return float(np.average(self.mean, weights=np.maximum(self.stderr, 1e-300) ** -2.0))

    @property
    def rms(self) -> float:
        """Root mean square beyond the errors, of the bins by their standard errors: one that is hardly visited says little."""
        weight = np.maximum(self.stderr, 1e-300) ** -2.0
        return float(np.sqrt(max(np.sum(weight * self.mean**2) - len(weight), 0.0) / np.sum(weight)))

    @property
    def size_unit(self) -> str:
        """Unit of the quantity: that of a force or a place, or none for a residual over the noise."""
        return {"force": "N", "stop": "m"}.get(self.quantity, "1")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Location:
    """Location of the nominal model's misfit: channel, record, phase of the motion and coordinate.

    Attributes:
        channel: with the largest share of the excess misfit.
        channels: share of the excess misfit by channel.
        records: share of the excess misfit by record file.
        phase: "free flight", "contact" or "all".
        coordinate: that explains the misfit best.
        interval: of that coordinate, in its unit, that holds most of the misfit; None where it is everywhere.
        time: onset, s, of an effect that begins at an instant; else None.
        record: file, of an effect that acts in one record only; else None.
        sentence: the location in words for a test engineer.
        profiles: by coordinate, the best first.
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
    maps: dict[str, np.ndarray] = series(
        "part_of_record",
        "part_of_period",
        words="mean squared residual over the noise variance, by part of the record and of the excitation period",
    )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Considered:
    """One scored candidate, with its refit results if it was fitted.

    Attributes:
        name: of the effect.
        detail: which channel, record or frequency.
        gain: expected improvement of twice the log-likelihood (score test).
        chance: probability that noise alone gives as much (Bonferroni).
        drop: improvement of twice the log-likelihood after the refit, at first order with all variances estimated anew where it was not
            fitted; None where it was not weighed, or its fit failed.
        bic: Bayesian information criterion on the records fitted, less that of the best; None as for `drop`.
        held_out: improvement of twice the log predictive density of the records held back; None without any, or where it was not fitted.
        beside: effects already in the model.
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
class Side:
    """A fitted model (nominal or augmented) with its errors and predictions.

    Attributes:
        model: fitted.
        parameters: all shared ones, those of effects included.
        chi2_reduced: of the whole fit.
        held_out_nrmse: error on the records held back, root mean square over them and their channels; without any, of
            records left out in turn, or of the later half of a single one, see `left_out`.
        brief: whether that error is over a quarter of a period in motions with impacts, from the states estimated there.
        records: with their predictions.
        disagreements: of the parameters between records.
        held_back: records left out of every fit, with their predictions.
    """

    model: Model
    parameters: tuple[Quantity, ...]
    chi2_reduced: float
    held_out_nrmse: float
    records: tuple[RecordFit, ...]
    disagreements: tuple[Disagreement, ...] = ()
    held_back: tuple[RecordFit, ...] = ()
    brief: bool = False

    @property
    def varying(self) -> tuple[str, ...]:
        """Names of the parameters that have a value for each record in the model."""
        return tuple(one.name for one in self.disagreements if one.modelled)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """The verdict on one experiment.

    Attributes:
        verdict: `ADEQUATE`, `RESTLESS`, `MISSING`, `UNLISTED` or `UNDECIDED`.
        sentences: the verdict in words: first what is missing, then its effect on the error; two to six of them.
        effects: asserted, the most probable first.
        free_form: formula of the learned term where no listed effect explains the misfit; empty otherwise.
        ambiguous_with: names of effects that these records cannot separate from the asserted ones.
        location: of the misfit; None where there is none.
        considered: all candidates, by search step and decreasing expected gain.
        nominal, augmented: nominal and final model; the same where nothing is missing.
        unrest: random force beside the augmented model; None where it is not significant.
        reading_error: size and order of every sensor's error, by channel.
        next_experiment: a further record that would separate the leading alternatives.
        warnings: for the reader.
        seconds: wall time by stage.
        ring_downs: damping and frequency of free vibrations by amplitude, as recorded and of both models.
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
    reading_error: dict[str, SensorError]
    next_experiment: str
    warnings: tuple[str, ...]
    seconds: dict[str, float]
    ring_downs: RingDowns = dataclasses.field(default_factory=RingDowns)

    @property
    def is_finished(self) -> bool:
        """Whether the search ended before its time budget."""
        return not any(warning.startswith(NOT_FINISHED) for warning in self.warnings)

    @property
    def is_limited(self) -> bool:
        """Whether the search was limited on request to some of the listed effects."""
        return any(warning.startswith(LIMITED) for warning in self.warnings)

    @property
    def is_complete(self) -> bool:
        """Whether no deterministic effect is missing from the nominal model: `ADEQUATE` or `RESTLESS`."""
        return self.verdict in (ADEQUATE, RESTLESS)

    @property
    def is_augmented(self) -> bool:
        """Whether there is a model beside the nominal one."""
        return self.augmented is not self.nominal

    @property
    def nominal_model(self) -> Model:
        """The nominal model as fitted."""
        return self.nominal.model

    @property
    def model(self) -> Model:
        """The final, augmented model."""
        return self.augmented.model

    def document(self, provenance: dict[str, Any] | None = None) -> dict[str, Any]:
        """The diagnosis as plain data for `diagnosis.json`."""
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
            "reading_error": {name: {"rms": one.rms, "unit": one.unit, "order": one.order} for name, one in self.reading_error.items()},
            "ring_downs": dataclasses.asdict(self.ring_downs),
            "free_form": self.free_form,
            "next_experiment": self.next_experiment,
            "sentences": list(self.sentences),
            "considered": [dataclasses.asdict(one) for one in self.considered],
            "warnings": list(self.warnings),
            "provenance": dict(provenance or {}),
        }


def _side(side: Side) -> dict[str, Any]:
    return {
        "chi2_reduced": side.chi2_reduced,
        "held_out_nrmse": side.held_out_nrmse,
        "brief": side.brief,
        "between_records": {one.name: one.document() for one in side.disagreements},
        "records": {record.file: {"gap": record.gap, "nrmse": record.nrmse} for record in side.records},
        "held_back": {record.file: record.nrmse for record in side.held_back},
    }


def _location(location: Location | None) -> dict[str, Any] | None:
    if location is None:
        return None
    plain = ("channel", "records", "channels", "phase", "coordinate", "interval", "time", "record", "sentence")
    return {name: getattr(location, name) for name in plain}
