"""Equivalent damping ratio and frequency against amplitude, from the turning points of a free vibration or from flights between impacts."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int
from scipy.optimize import least_squares
from scipy.signal import find_peaks

_DEGREE = 4
"""Of the polynomial at a turning point: at +-54 degrees of a cosine it is off by 3e-5 of the amplitude at most."""
_FEWEST = _DEGREE + 2
"""Samples at a turning point: one more than the polynomial has coefficients, so that they have a scatter."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class RingDown:
    """Damping and frequency of one free vibration of a record by amplitude, from the largest on.

    The amplitude is half the distance between turning points, m, `damping` the equivalent viscous damping ratio, `frequency` that of the
    swing, Hz; standard errors are those due to the noise.
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

    `models` has ring-downs of simulated motion by name: "nominal" or "augmented". `left_out` says why no decay can be read, by record file.
    """

    measured: tuple[RingDown, ...] = ()
    models: dict[str, tuple[RingDown, ...]] = dataclasses.field(default_factory=dict)
    left_out: dict[str, str] = dataclasses.field(default_factory=dict)


def ring_down(file: str, time: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"], *, noise: float) -> RingDown | None:
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

    Source: M. Jin, W. Chen, M. R. W. Brake, H. Song, J. Vib. Acoust. 142 (2020) 051111 (peak finding and fitting); we fit maxima and
    minima alike.
    """
    usable = np.isfinite(u)
    turning, turning_error, value, value_error = _turns(time[usable], u[usable], noise) if usable.any() else np.zeros((4, 0))
    if len(value) < 3:
        return None
    count = len(value) - 2
    every = -(-count // 24)  # points at most: a longer one is read over several half cycles at a time
    first = np.arange(0, count - every + 1, every)
    swings = np.abs(np.diff(value))
    begin, end = swings[first], swings[first + every]
    last, over = first + every + 1, (every + 1) / 2
    lasting = turning[last] - turning[first]
    decrement = np.log(begin / end) / every
    variance = value_error[:-1] ** 2 + value_error[1:] ** 2  # of swings
    error = np.sqrt(variance[first] / begin**2 + variance[first + every] / end**2)
    if every == 1:  # the turning point in the middle belongs to both swings
        error = np.sqrt(error**2 - 2.0 * value_error[first + 1] ** 2 / (begin * end))
    damping = decrement / np.hypot(np.pi, decrement)
    time_error = np.hypot(turning_error[first], turning_error[last])
    return RingDown(
        file=file,
        amplitude=tuple((0.5 * np.sqrt(begin * end)).tolist()),
        damping=tuple(damping.tolist()),
        damping_stderr=tuple((error / every * np.pi**2 / np.hypot(np.pi, decrement) ** 3).tolist()),
        frequency=tuple((over / lasting).tolist()),
        frequency_stderr=tuple((over / lasting**2 * time_error).tolist()),
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

    The motion of an oscillator with viscous and dry friction, which is at rest at its turning point, is fitted by least squares. The
    damping ratio is that of the viscous oscillator that loses as much energy on the way: with A^2 = u^2 + (u' / omega)^2 at both ends,

    ln(A_1 / A_2) / (omega (t_2 - t_1) - (sin 2 omega t_2 - sin 2 omega t_1) / 2), t counted from the turning point.

    The amplitude is the distance of the turning point from the level. Errors follow from the noise, or from the scatter about the fitted
    motion where that is larger.

    Arguments are those of `ring_down`; `level` is the place of the hammer at rest, m, and `frequency` rough, Hz.
    """
    usable = np.isfinite(u)
    time, u = time[usable], u[usable] - level
    if len(u) < 2 * _FEWEST:
        return None
    furthest = int(np.argmax(np.abs(u)))
    if not _FEWEST // 2 <= furthest < len(u) - _FEWEST // 2 or abs(u[furthest]) < _range_of_noise(noise, len(u)):
        return None  # it does not turn, creeps, or rests
    scale, omega = float(u[furthest]), 2.0 * np.pi * frequency
    angle = omega * (time - time[furthest])
    found = least_squares(lambda x: _out_and_back(x, angle) - u / scale, [0.0, 1.0, 1.0, 0.0, 0.0], x_scale=[0.1, 1.0, 0.1, 0.1, 0.1])
    variance = max((noise / scale) ** 2, float(found.fun @ found.fun) / (len(u) - len(found.x)))
    covariance = variance * np.linalg.pinv(found.jac.T @ found.jac)
    damping, turn, pulse = _equivalent_damping(found.x, angle), abs(found.x[1]), abs(found.x[2])
    small = 1e-5 * np.eye(len(found.x))
    slope = np.array([(_equivalent_damping(found.x + d, angle) - _equivalent_damping(found.x - d, angle)) / 2e-5 for d in small])
    if not np.isfinite([damping, *slope]).all():
        return None
    return RingDown(
        file=file,
        amplitude=(abs(scale) * float(turn),),
        damping=(damping,),
        damping_stderr=(float(np.sqrt(slope @ covariance @ slope)),),
        frequency=(float(pulse * frequency),),
        frequency_stderr=(float(np.sqrt(covariance[2, 2]) * frequency),),
    )


def _out_and_back(unknowns: Float[np.ndarray, " unknowns"], angle: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
    """Motion with viscous and dry friction about its turning point: the place of that, its distance, frequency, damping ratio, friction."""
    place, turn, pulse, zeta, friction = unknowns
    since = pulse * (angle - place)
    middle = friction * np.sign(since)
    decay = np.exp(-np.clip(zeta * since, -20.0, 20.0))
    return middle + (turn - middle) * decay * (np.cos(since) + zeta * np.sin(since))


def _equivalent_damping(unknowns: Float[np.ndarray, " unknowns"], angle: Float[np.ndarray, " samples"]) -> float:
    """Damping ratio of the viscous oscillator that loses as much energy between both ends."""
    place, _, pulse, _, _ = unknowns
    ends, step = angle[[0, -1]], 1e-4
    u, later, earlier = (_out_and_back(unknowns, ends + shift) for shift in (0.0, step, -step))
    size = np.hypot(u, (later - earlier) / (2.0 * step * pulse))
    since = pulse * (ends - place)
    return float(np.log(size[0] / size[1]) / (since[1] - since[0] - 0.5 * (np.sin(2.0 * since[1]) - np.sin(2.0 * since[0]))))


def together(flights: Sequence[RingDown]) -> RingDown:
    """Flights of one record as one ring-down, by falling amplitude."""
    order = np.argsort([-one.amplitude[0] for one in flights])
    names = [field.name for field in dataclasses.fields(RingDown) if field.name != "file"]
    return RingDown(file=flights[0].file, **{name: tuple(getattr(flights[k], name)[0] for k in order) for name in names})


def _turns(time: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"], noise: float) -> Float[np.ndarray, "4 turns"]:
    """Time and value of turning points, each with its error, by local polynomials, up to the first that was missed or is not resolved."""
    rough, found = _alternating(u, noise), []
    half = np.diff(time[rough])
    for index, place in enumerate(rough if len(rough) > 2 else ()):
        width = 0.3 * float(np.min(half[max(index - 1, 0) : index + 1]))  # of a half cycle, which a polynomial follows
        one = _polynomial(time, u, float(time[place]), width, noise)
        if one is None:
            break
        found.append(one)
    if len(found) < 3:
        return np.zeros((4, 0))
    turns = np.array(found).T
    half = np.diff(turns[0])
    odd = np.flatnonzero((half[1:] > 1.5 * half[:-1]) | (half[:-1] > 1.5 * half[1:]))  # a turning point between was not recorded
    return turns[:, : int(odd[0]) + 2 if len(odd) else None]


def _alternating(u: Float[np.ndarray, " samples"], noise: float) -> Int[np.ndarray, " turns"]:
    """Samples at maxima and minima in turn, on either side of the middle, further apart than noise alone is in so many samples."""
    least = max(_range_of_noise(noise, len(u)), 1e-300)
    places = np.sort(np.concatenate([find_peaks(sign * u, prominence=least)[0] for sign in (1.0, -1.0)]))
    if len(places) < 3:
        return places
    off = u[places] - float(np.median(0.5 * (u[places[1:]] + u[places[:-1]])))
    between_crossings = np.split(np.arange(len(places)), np.flatnonzero(np.diff(np.sign(off))) + 1)
    return np.array([places[part[np.argmax(np.abs(off[part]))]] for part in between_crossings], int)


def _range_of_noise(noise: float, samples: int) -> float:
    """From the smallest to the largest of so many samples of white noise, as expected."""
    return 2.0 * noise * float(np.sqrt(2.0 * np.log(max(samples, 2))))


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
