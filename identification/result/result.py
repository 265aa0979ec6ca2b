"""Result of a fit: parameters with standard errors, the fitted model, and every record with its prediction, residuals and impacts."""

import dataclasses
from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from identification.experiment import Experiment, si_unit
from identification.experiment.samples import runs_of
from identification.result.evidence import Disagreement, Unrest
from identification.result.posterior import PosteriorSample
from identification.result.ring_down import RingDowns
from identification.result.store import series
from vibrojax.model import Model
from vibrojax.parameters import Parameter

OK, AT_BOUND, NOT_IDENTIFIABLE, FIXED = "ok", "at bound", "not identifiable from these records", "fixed"


@dataclasses.dataclass(frozen=True, kw_only=True)
class ParameterEstimate:
    """Estimate of one shared parameter with standard error, interval and status.

    Attributes:
        spec: name, symbol, unit.
        value: estimate, in `spec.unit`.
        stderr: standard error in the same unit; None where it has no meaning.
        ci95: 95 % interval; None where it has no meaning.
        interval: "normal" (symmetric in the fit's own coordinate) or "profile" (profile likelihood).
        initial: first guess.
        status: one of `OK`, `AT_BOUND`, `NOT_IDENTIFIABLE`, `FIXED`.
        reason: why the status is not `OK`; empty otherwise.
        between: standard deviation between records, in the same unit, of one that may vary; None where it is the same in all.
    """

    spec: Parameter
    value: float
    stderr: float | None
    ci95: tuple[float, float] | None
    interval: str
    initial: float
    status: str
    reason: str = ""
    between: float | None = None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Quantity:
    """An estimated quantity: SI value, standard error (None where it has no meaning), unit, and symbol where tables use one."""

    name: str
    symbol: str = ""
    unit: str
    value: float
    stderr: float | None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Horizon:
    """Error of a model's forecasts so far ahead.

    Attributes:
        periods: of the slower of suspension and drive; None for the free motion through the whole record.
        seconds: s.
        nrmse: by channel: root mean square error over the channel's standard deviation.
    """

    periods: float | None
    seconds: float
    nrmse: dict[str, float]


@dataclasses.dataclass(frozen=True, kw_only=True)
class RecordFit:
    """One record with its prediction; arrays have shape (samples,) and hold NaN where nothing was recorded.

    Attributes:
        file: of the record.
        kind: as in the experiment.
        gap: as set plus the estimated setting error, m.
        nuisances: numbers estimated for this record only: base amplitude and phase, setting error of the gap.
        time: s.
        measured: by channel, SI.
        predicted: by channel, SI; also channels that were not recorded.
        noise: standard deviation by recorded channel, SI.
        nrmse: by recorded channel: root-mean-square residual over the standard deviation of the measured channel.
        chi2_reduced: by recorded channel: mean squared residual over the noise variance.
        relative_displacement: predicted u, m.
        relative_velocity: predicted u', m/s.
        in_contact: predicted, bool.
        window: index of the window that each sample belongs to.
        notices: remarks of the file reader.
        horizons: errors of forecasts of a held-back record, by how far they reach.
    """

    file: str
    kind: str
    gap: float
    nuisances: tuple[Quantity, ...]
    time: np.ndarray = series("time", unit="s", words="time")
    measured: dict[str, np.ndarray] = series("time", unit=lambda self, channel: si_unit(channel), words="{key}, measured")
    predicted: dict[str, np.ndarray] = series("time", unit=lambda self, channel: si_unit(channel), words="{key}, model", name="model")
    noise: dict[str, float]
    nrmse: dict[str, float]
    chi2_reduced: dict[str, float]
    relative_displacement: np.ndarray = series("time", unit="m", words="u of the fitted motion, hammer minus cart")
    relative_velocity: np.ndarray = series("time", unit="m/s", words="velocity of u in the fitted motion")
    in_contact: np.ndarray = series("time", words="whether hammer and stop touch in the fitted motion")
    window: np.ndarray = series("time", words="number of the window that the sample was fitted in")
    notices: tuple[str, ...] = ()
    horizons: tuple[Horizon, ...] = ()

    @property
    def windows(self) -> int:
        """How many windows were fitted."""
        return len(np.unique(self.window))

    @property
    def samples(self) -> int:
        """How many samples were fitted."""
        return len(self.window)


@dataclasses.dataclass(frozen=True, kw_only=True)
class SensorError:
    """Error of one channel's readings.

    Attributes:
        rms: standard deviation, in `unit`; over all records.
        unit: SI.
        order: of its autoregression, 0 for white noise.
        over_noise: standard deviation over the noise that is declared, or read off the record.
        variance: of the standardised one-step errors, 1 where physics and sizes are right; None where rounding hides it.
        correlation: the largest of these errors at 1 to 4 samples, 0 where they are white.
        samples: count of them.
    """

    rms: float
    unit: str
    order: int
    over_noise: float
    variance: float | None
    correlation: float | None
    samples: int


@dataclasses.dataclass(frozen=True, kw_only=True)
class Added:
    """Effects added to the nominal model on request, and what they gain over it.

    Attributes:
        names: of the effects.
        places: channel or record that each acts on; empty where it acts on all.
        gain: of log-likelihood, nats.
        chance: probability of that gain by chance, as the best of all candidates of the effects (an upper bound).
        bic: Bayesian information criterion, less that of the nominal model: negative where the effects are worth their parameters.
        held_back: rms normalised error on the records held back, of the nominal model and with the effects; None without such records.
    """

    names: tuple[str, ...]
    places: tuple[str, ...]
    gain: float
    chance: float
    bic: float
    held_back: tuple[float, float] | None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Likelihood:
    """How likely the records are under the fitted contact law, to be compared between laws that were fitted to the same samples.

    Attributes:
        deviance: -2 log likelihood at the estimated contact parameters, all other unknowns integrated out; up to a constant of the records.
        samples: count of the readings that it is of.
        held_back: -2 log predictive density of the records held back, up to a constant of them; None without such records.
    """

    deviance: float
    samples: int
    held_back: float | None


@dataclasses.dataclass(frozen=True, kw_only=True)
class StartedFrom:
    """The earlier fit whose values took the place of first guesses.

    Attributes:
        file: its fit.json, as given.
        sha256: of that file.
        taken: values by name, SI.
        left_out: names of values that both fits have and that were not taken, each with the reason.
    """

    file: str
    sha256: str
    taken: dict[str, float]
    left_out: dict[str, str]

    def sentence(self) -> str:
        """Which values were taken, and which were not, in words.

        Example:
            >>> StartedFrom(file="fit.json", sha256="", taken={"n": 1.5}, left_out={"k_i": "its n is another"}).sentence()
            'started from fit.json: n = 1.5; not taken: k_i (its n is another)'
        """
        values = ", ".join(f"{name} = {value:.4g}" for name, value in self.taken.items()) or "none of its values"
        reasons = ", ".join(f"{name} ({reason})" for name, reason in self.left_out.items())
        return f"started from {self.file}: {values}" + (f"; not taken: {reasons}" if reasons else "")


@dataclasses.dataclass(frozen=True, kw_only=True)
class LikelihoodProfile:
    """Profile of one parameter: its values, in its unit, and twice the fall of the log-likelihood with all else at its optimum."""

    name: str
    values: tuple[float, ...]
    rise: tuple[float, ...]


@dataclasses.dataclass(frozen=True, kw_only=True)
class ProfileMap:
    """The same of two parameters, on a grid along the axes of their ellipse: values of the first and second, and `rise`, by row."""

    names: tuple[str, str]
    first: tuple[tuple[float, ...], ...]
    second: tuple[tuple[float, ...], ...]
    rise: tuple[tuple[float, ...], ...]


@dataclasses.dataclass(frozen=True, kw_only=True)
class Profiles:
    """Profiles of the likelihood: of every identifiable parameter, and of a pair; None where there is no pair."""

    single: tuple[LikelihoodProfile, ...]
    pair: ProfileMap | None


@dataclasses.dataclass(frozen=True, kw_only=True)
class FitResult:
    """Result of the fit of one experiment.

    Attributes:
        experiment: that was fitted.
        model: fitted; runs with any integrator.
        parameters: shared by all records, in the order of the tables.
        derived: computed from them (stiffness k, damping c).
        correlation: matrix over `correlated`.
        correlated: names of the estimated parameters, the axes of `correlation`.
        chi2_reduced: chi-square of the free motion, without random force, over degrees of freedom.
        degrees: number of weighted samples less that of estimated unknowns.
        records: fitted records with their predictions.
        held_back: held-back records with their predictions.
        converged: False if the iteration stopped early.
        discretisation: largest shift of any parameter, in standard errors, when every step of the integrator is halved.
        warnings: sentences for the reader of the result.
        unrest: random force on the hammer; None where it is not significant.
        reading_error: of each compared channel.
        force_share: share of the squared misfit of the free motion that goes away with the random force; the rest is errors of readings.
        seed: of every random draw.
        seconds: wall time by stage.
        added: effects that were added on request; None for the nominal model.
        between_records: each parameter that several records identify, as each of them alone estimates it.
        ring_downs: damping and frequency by amplitude of free vibrations.
        smoothing: width of a smoothed contact switch that was fitted as well, m; None for the exact contact alone.
        smoothed: parameters of the smoothed law, SI; None without it.
        posterior: sample of the parameters' posterior; None where none was asked for.
        profiles: of the likelihood; None where none were asked for.
        likelihood: of the contact law; None where it is not known.
        started_from: the earlier fit from whose values this one started; None where it started from first guesses.
    """

    experiment: Experiment
    model: Model
    parameters: tuple[ParameterEstimate, ...]
    derived: tuple[Quantity, ...]
    correlation: np.ndarray = series("row", "column", words="correlation of the estimated parameters")
    correlated: tuple[str, ...]
    chi2_reduced: float
    degrees: int
    records: tuple[RecordFit, ...]
    converged: bool
    discretisation: float
    warnings: tuple[str, ...]
    unrest: Unrest | None
    reading_error: dict[str, SensorError]
    force_share: float
    seed: int
    seconds: dict[str, float]
    held_back: tuple[RecordFit, ...] = ()
    added: Added | None = None
    between_records: tuple[Disagreement, ...] = ()
    ring_downs: RingDowns = dataclasses.field(default_factory=RingDowns)
    smoothing: float | None = None
    smoothed: dict[str, float] | None = None
    posterior: PosteriorSample | None = None
    profiles: Profiles | None = None
    likelihood: Likelihood | None = None
    started_from: StartedFrom | None = None

    @property
    def named(self) -> dict[str, ParameterEstimate]:
        """The parameters by name."""
        return {one.spec.name: one for one in self.parameters}


@dataclasses.dataclass(frozen=True, kw_only=True)
class Impact:
    """One contact of the fitted motion: samples `first` up to and without `end`."""

    first: int
    end: int

    def around(self, samples: int, *, before: float = 1.0, after: float = 1.5) -> slice:
        """Samples from `before` to `after` contact durations about the contact, inside a record of `samples` samples."""
        length = max(self.end - self.first, 8)
        return slice(max(int(self.first - before * length), 0), min(int(self.end + after * length), samples))


def residual(record: RecordFit, channel: str) -> Float[np.ndarray, " samples"]:
    """(measured - model) / noise; NaN where nothing was recorded."""
    return (record.measured[channel] - record.predicted[channel]) / record.noise[channel]


def largest(values: Float[np.ndarray, " samples"]) -> float:
    """Largest magnitude among the finite values; 0 where none is."""
    return float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0))


def impacts(record: RecordFit) -> list[Impact]:
    """Contacts of the fitted motion in order; interruptions of a few samples do not separate them."""
    return merged(Impact(first=int(first), end=int(end)) for first, end in zip(*runs_of(record.in_contact), strict=True))


def merged(parts: Iterable[Impact]) -> list[Impact]:
    """Contacts in order of time; those separated by three samples at most become one."""
    found: list[Impact] = []
    for one in sorted(parts, key=lambda part: part.first):
        if found and one.first - found[-1].end <= 3:
            found[-1] = dataclasses.replace(found[-1], end=max(one.end, found[-1].end))
        else:
            found.append(one)
    return found


def strength(record: RecordFit, impact: Impact) -> float:
    """Largest force of the fitted law in one impact, N."""
    return largest(record.predicted["impact_force"][impact.first : impact.end])


def misfit(record: RecordFit, impact: Impact) -> float:
    """Mean squared residual of all fitted channels around one impact."""
    part = impact.around(len(record.time), before=0.2, after=0.2)
    squares = np.concatenate([np.zeros(0), *(residual(record, channel)[part] ** 2 for channel in record.chi2_reduced)])
    usable = squares[np.isfinite(squares)]
    return float(usable.mean()) if len(usable) else 0.0


def notable(record: RecordFit) -> list[Impact]:
    """The strongest and the worst-fitted impact, in order of time; where they are one, also the first or the last."""
    found = impacts(record)
    if not found:
        return []
    chosen = [max(found, key=lambda i: strength(record, i)), max(found, key=lambda i: misfit(record, i)), found[0], found[-1]]
    distinct = list({impact.first: impact for impact in chosen}.values())[:2]
    return sorted(distinct, key=lambda impact: impact.first)


def measured_displacement(record: RecordFit) -> Float[np.ndarray, " samples"] | None:
    """Measured u = x - y, m; the predicted cart replaces one that was not recorded. None without a hammer channel."""
    if "relative_displacement" in record.measured:
        return record.measured["relative_displacement"]
    if "hammer_displacement" not in record.measured:
        return None
    return record.measured["hammer_displacement"] - record.measured.get("cart_displacement", record.predicted["cart_displacement"])
