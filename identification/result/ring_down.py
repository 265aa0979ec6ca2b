"""Equivalent damping ratio and frequency against amplitude, from the turning points of a free vibration or from flights between impacts."""

import dataclasses
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import least_squares
from scipy.signal import find_peaks

_POINTS = 24
"""Points of one ring-down, at most: a longer one is read over several half cycles at a time."""
_OF_HALF_CYCLE = 0.3
"""Half width of the polynomial at a turning point, over the time from one turning point to the next."""
_DEGREE = 4
"""Of the polynomial at a turning point: at +-54 degrees of a cosine it is off by 3e-5 of the amplitude at most."""
_FEWEST = _DEGREE + 2
"""Samples at a turning point: one more than the polynomial has coefficients, so that they have a scatter."""
_MISSED = 1.5
"""Ratio of neighbouring half cycles above which a turning point between them was not recorded."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RingDown:
    """Damping and frequency of one free vibration by amplitude, from the largest on.

    Attributes:
        file: of the record.
        amplitude: half the distance between turning points, m.
        damping: equivalent viscous damping ratio, 1.
        damping_stderr: its standard error due to the noise.
        frequency: of the swing, Hz.
        frequency_stderr: its standard error due to the noise.
    """

    file: str
    amplitude: tuple[float, ...]
    damping: tuple[float, ...]
    damping_stderr: tuple[float, ...]
    frequency: tuple[float, ...]
    frequency_stderr: tuple[float, ...]


@dataclasses.dataclass(frozen=True, kw_only=True)
class RingDowns:
    """What the free vibrations of the records show, and what models make of the same vibrations.

    Attributes:
        measured: ring-downs as recorded.
        models: by name ("nominal", "augmented", or that of an effect beside the nominal model), the same of their simulated motion.
        left_out: by record file, why no decay can be read.
    """

    measured: tuple[RingDown, ...] = ()
    models: dict[str, tuple[RingDown, ...]] = dataclasses.field(default_factory=dict)
    left_out: dict[str, str] = dataclasses.field(default_factory=dict)


    def document(self) -> dict[str, Any]:
        """As plain data for `fit.json` and `diagnosis.json`; amplitudes in m, frequencies in Hz."""
        models = {name: [dataclasses.asdict(one) for one in found] for name, found in self.models.items()}
        return {"measured": [dataclasses.asdict(one) for one in self.measured], "models": models, "left_out": self.left_out}


@dataclasses.dataclass(frozen=True, kw_only=True)
class _Turns:
    """Turning points: time, s, displacement, m, and their standard errors."""

    time: np.ndarray
    time_stderr: np.ndarray
    value: np.ndarray
    value_stderr: np.ndarray


def ring_down(
    file: str, time: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"], *, noise: float, points: int = _POINTS
) -> RingDown | None:
    """Damping and frequency by amplitude of one free vibration; None where fewer than three turning points stand out of the noise.

    With swings S_i = |x_i - x_i+1| between turning points, in which an unknown zero cancels, the decrement per half cycle over m of them is
    delta = ln(S_i / S_i+m) / m, the damping ratio delta / sqrt(pi^2 + delta^2), the amplitude sqrt(S_i S_i+m) / 2, and the frequency
    (m + 1) / 2 over the time of the m + 1 half cycles. Turning points are those of local polynomials; errors follow from the noise, or from
    the scatter about the polynomial where that is larger.

    Arguments:
        file: of the record.
        time: of the samples, s.
        u: displacement in flight without a drive, m; NaN where it was not recorded.
        noise: its standard deviation, m.
        points: at most so many.

    Source: M. Jin, W. Chen, M. R. W. Brake, H. Song, J. Vib. Acoust. 142 (2020) 051111 (peak finding and fitting); we fit maxima and
    minima alike.
    """
    usable = np.isfinite(u)
    turns = _turns(time[usable], u[usable], noise) if usable.any() else None
    if turns is None or len(turns.time) < 3:
        return None
    count = len(turns.time) - 2
    every = -(-count // points)
    first = np.arange(0, count - every + 1, every)
    swings = np.abs(np.diff(turns.value))
    begin, end = swings[first], swings[first + every]
    last, over = first + every + 1, (every + 1) / 2
    lasting = turns.time[last] - turns.time[first]
    decrement = np.log(begin / end) / every
    error = np.sqrt(_swing_variance(turns, first) / begin**2 + _swing_variance(turns, first + every) / end**2)
    if every == 1:  # the turning point in the middle belongs to both swings
        error = np.sqrt(error**2 - 2.0 * turns.value_stderr[first + 1] ** 2 / (begin * end))
    damping = decrement / np.hypot(np.pi, decrement)
    time_error = np.hypot(turns.time_stderr[first], turns.time_stderr[last])
    return RingDown(
        file=file,
        amplitude=_plain(0.5 * np.sqrt(begin * end)),
        damping=_plain(damping),
        damping_stderr=_plain(error / every * np.pi**2 / np.hypot(np.pi, decrement) ** 3),
        frequency=_plain(over / lasting),
        frequency_stderr=_plain(over / lasting**2 * time_error),
    )


def one_flight(
    file: str,
    time: Float[np.ndarray, " samples"],
    u: Float[np.ndarray, " samples"],
    *,
    noise: float,
    level: float,
    frequency: float,
) -> RingDown | None:
    """Damping and frequency of one flight between impacts, as a single point; None where it does not swing out and back.

    A viscously damped sinusoid about a known level is fitted to the flight by least squares; the amplitude is that of its envelope in the
    middle. Errors follow from the noise, or from the scatter about the sinusoid where that is larger.

    Arguments:
        file: of the record.
        time: of the samples, s.
        u: displacement, m; NaN where it was not recorded.
        noise: its standard deviation, m.
        level: about which the flight swings, m.
        frequency: rough, Hz.
    """
    usable = np.isfinite(u)
    time, u = time[usable], u[usable] - level
    if len(u) < _FEWEST:
        return None
    furthest = int(np.argmax(np.abs(u)))
    if not _FEWEST // 2 <= furthest < len(u) - _FEWEST // 2 or abs(u[furthest]) < 2.0 * noise * np.sqrt(2.0 * np.log(len(u))):
        return None
    since, scale, omega = time - 0.5 * (time[0] + time[-1]), float(np.max(np.abs(u))), 2.0 * np.pi * frequency

    def parts(unknowns: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        cosine, sine, decay, pulse = unknowns
        envelope, turned = np.exp(-decay * omega * since), pulse * omega * since
        return envelope, envelope * (cosine * np.cos(turned) + sine * np.sin(turned)), turned

    def misfit(unknowns: np.ndarray) -> np.ndarray:
        return parts(unknowns)[1] - u / scale

    def slope(unknowns: np.ndarray) -> np.ndarray:
        envelope, value, turned = parts(unknowns)
        cosine, sine = unknowns[:2]
        by_pulse = envelope * omega * since * (sine * np.cos(turned) - cosine * np.sin(turned))
        return np.stack([envelope * np.cos(turned), envelope * np.sin(turned), -omega * since * value, by_pulse], axis=1)

    begin = np.array([0.0, 0.0, 0.0, 1.0])
    begin[:2] = np.linalg.lstsq(slope(begin)[:, :2], u / scale, rcond=None)[0]
    found = least_squares(misfit, begin, slope, method="lm")
    jacobian = slope(found.x)
    variance = max((noise / scale) ** 2, float(found.fun @ found.fun) / (len(u) - 4))
    covariance = variance * np.linalg.pinv(jacobian.T @ jacobian)
    (decay, pulse), errors = found.x[2:], np.sqrt(np.diag(covariance)[2:])
    return RingDown(
        file=file,
        amplitude=(scale * float(np.hypot(*found.x[:2])),),
        damping=(float(decay / np.hypot(decay, pulse)),),
        damping_stderr=(float(errors[0] / abs(pulse)),),
        frequency=(float(abs(pulse) * frequency),),
        frequency_stderr=(float(errors[1] * frequency),),
    )


def together(flights: Sequence[RingDown]) -> RingDown:
    """Flights of one record as one ring-down, by falling amplitude."""
    order = np.argsort([-one.amplitude[0] for one in flights])
    names = [field.name for field in dataclasses.fields(RingDown) if field.name != "file"]
    return RingDown(file=flights[0].file, **{name: tuple(getattr(flights[k], name)[0] for k in order) for name in names})


def _swing_variance(turns: _Turns, which: Int[np.ndarray, " swings"]) -> Float[np.ndarray, " swings"]:
    return turns.value_stderr[which] ** 2 + turns.value_stderr[which + 1] ** 2


def _turns(time: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"], noise: float) -> _Turns | None:
    """Turning points by local polynomials, up to the first that was missed."""
    rough = _alternating(u, noise)
    if len(rough) < 3:
        return None
    half = np.diff(time[rough])
    found = []
    for index, place in enumerate(rough):
        width = _OF_HALF_CYCLE * float(np.min(half[max(index - 1, 0) : index + 1]))
        one = _polynomial(time, u, time[place], width, noise)
        if one is None:
            return None
        found.append(one)
    at, at_error, value, value_error = np.array(found).T
    half = np.diff(at)
    odd = np.flatnonzero((half[1:] > _MISSED * half[:-1]) | (half[:-1] > _MISSED * half[1:]))
    kept = slice(0, int(odd[0]) + 2 if len(odd) else len(at))
    return _Turns(time=at[kept], time_stderr=at_error[kept], value=value[kept], value_stderr=value_error[kept])


def _alternating(u: Float[np.ndarray, " samples"], noise: float) -> Int[np.ndarray, " turns"]:
    """Samples at maxima and minima in turn, on either side of the middle, further apart than noise alone is in so many samples."""
    least = 2.0 * noise * np.sqrt(2.0 * np.log(max(len(u), 2)))
    places = np.sort(np.concatenate([find_peaks(sign * u, prominence=max(least, 1e-300))[0] for sign in (1.0, -1.0)]))
    if len(places) < 3:
        return places
    middle = float(np.median(0.5 * (u[places[1:]] + u[places[:-1]])))
    return np.array(list(_outermost(places, u - middle)), int)


def _outermost(places: Int[np.ndarray, " turns"], u: Float[np.ndarray, " samples"]) -> Iterator[int]:
    """Of the turning points between two crossings of the middle, the outermost."""
    for part in np.split(places, np.flatnonzero(np.diff(np.sign(u[places]))) + 1):
        yield int(part[np.argmax(np.abs(u[part]))])


def _polynomial(
    time: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"], place: float, width: float, noise: float
) -> tuple[float, float, float, float] | None:
    """Time and value of a turning point, each with its error; None where too few samples lie near."""
    first, end = np.searchsorted(time, (place - width, place + width))
    if end - first < _FEWEST:
        return None
    since = (time[first:end] - place) / width
    basis = np.vander(since, _DEGREE + 1, increasing=True)
    coefficients, _, _, _ = np.linalg.lstsq(basis, u[first:end], rcond=None)
    scatter = u[first:end] - basis @ coefficients
    variance = max(noise**2, float(scatter @ scatter) / (end - first - _DEGREE - 1))
    covariance = variance * np.linalg.inv(basis.T @ basis)
    slope, curvature = np.polynomial.polynomial.polyder(coefficients), np.polynomial.polynomial.polyder(coefficients, 2)
    roots = np.polynomial.polynomial.polyroots(slope)
    real = roots.real[np.abs(roots.imag) < 1e-9]
    if not len(real):
        return None
    at = float(real[np.argmin(np.abs(real))])
    powers = at ** np.arange(_DEGREE + 1)
    rates = np.arange(_DEGREE + 1) * np.concatenate([[0.0], powers[:-1]])
    bend = float(np.polynomial.polynomial.polyval(at, curvature))
    return (
        place + width * at,
        float(width * np.sqrt(rates @ covariance @ rates) / abs(bend)),
        float(powers @ coefficients),
        float(np.sqrt(powers @ covariance @ powers)),
    )


def _plain(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
