"""What the samples of a channel show by themselves: a sine, impacts, saturation, noise, and whether two channels show one motion."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float64
from scipy import stats
from scipy.optimize import least_squares
from scipy.signal import coherence, detrend, welch
from scipy.signal.windows import hann

from identification.experiment.channels import MOTION_CHANNELS, STRUCK
from identification.experiment.experiment import Record
from identification.experiment.noise import MAD_TO_STD, estimate_noise
from identification.experiment.samples import runs_of

CONTACT = 6.0
"""Standard deviations of its noise beyond which a signal shows a contact, or that the hammer was let go."""
FEWEST_SAMPLES, FEWEST_IMPACTS = 6, 3
MOSTLY_APART = 0.5
"""A force that is strong for a larger part of the samples is an offset rather than impacts."""
ONE_BODY = (("hammer_displacement", "hammer_acceleration"), ("cart_displacement", "cart_acceleration"))
"""Absolute displacement and acceleration of one body."""
Samples = Float64[np.ndarray, " samples"]


@dataclass(frozen=True, kw_only=True)
class Sine:
    """A sine with an offset, fitted to a channel.

    Attributes:
        frequency: Hz.
        stderr: of the frequency, Hz, taking the residual for white.
        share: of the channel's variance that the sine explains, 0 to 1.
    """

    frequency: float
    stderr: float
    share: float

    @property
    def rounded(self) -> float:
        """The frequency with the fewest decimals that lie within three standard errors of it: what an operator may have set."""
        for decimals in range(7):
            if abs(round(self.frequency, decimals) - self.frequency) <= 3.0 * self.stderr and round(self.frequency, decimals) > 0.0:
                return round(self.frequency, decimals)
        return self.frequency


def fit_sine(time: Samples, values: Samples) -> Sine | None:
    """Find the strongest line of the periodogram and fit a sine there, its frequency included, to the usable samples of a channel.

    None where the channel stands still or is too short.

    Example:
        >>> t = np.arange(2000) / 500.0
        >>> fit_sine(t, np.sin(2 * np.pi * 6.25 * t) + np.random.default_rng(0).normal(0.0, 0.01, t.size)).rounded
        6.25
    """
    usable = np.isfinite(values)
    t, v = time[usable], values[usable]
    if t.size < 16 or np.ptp(v) == 0.0:
        return None
    even = np.linspace(t[0], t[-1], t.size)
    power = np.abs(np.fft.rfft(np.hanning(t.size) * (np.interp(even, t, v) - v.mean()))) ** 2
    power[0] = 0.0
    line = float(np.fft.rfftfreq(t.size, even[1] - even[0])[int(np.argmax(power))])
    t, scaled = t - t.mean(), v / np.std(v)
    start, *_ = np.linalg.lstsq(_basis(t, line), scaled, rcond=None)
    fit = least_squares(lambda x: _basis(t, x[0]) @ x[1:] - scaled, [line, *start], x_scale="jac", method="lm", max_nfev=100)
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac) * 2.0 * fit.cost / (t.size - 4)
    share = max(0.0, 1.0 - 2.0 * float(fit.cost) / t.size)
    return Sine(frequency=abs(float(fit.x[0])), stderr=float(np.sqrt(covariance[0, 0])), share=share)


def sine_at(time: Samples, values: Samples, frequency: float) -> tuple[float, float, float]:
    """Amplitude, in the unit of the channel, phase at t = 0, rad, and share of the variance, 0 to 1, of a sine of a given frequency, Hz.

    Example:
        >>> t = np.arange(2000) / 500.0
        >>> np.round(sine_at(t, 3.0 + 0.7 * np.sin(2 * np.pi * 6.25 * t + 0.2), 6.25), 6).tolist()
        [0.7, 0.2, 1.0]
    """
    usable = np.isfinite(values)
    v, basis = values[usable], _basis(time[usable], frequency)
    (sine, cosine, offset), *_ = np.linalg.lstsq(basis, v, rcond=None)
    share = 1.0 - float(np.var(v - basis @ (sine, cosine, offset))) / max(float(np.var(v)), 1e-300)
    return float(np.hypot(sine, cosine)), float(np.arctan2(cosine, sine)), max(0.0, share)


def is_steady(time: Samples, values: Samples, frequency: float) -> bool:
    """Whether a sine has one amplitude in all thirds of the record, as a driven one; False where a third is shorter than two periods."""
    third = time.size // 3
    if third < 16 or frequency * float(time[third] - time[0]) < 2.0:
        return False
    amplitudes = [sine_at(time[part], values[part], frequency)[0] for part in (slice(third), slice(third, -third), slice(-third, None))]
    return max(amplitudes) < 1.02 * min(amplitudes)


def _basis(t: np.ndarray, frequency: float) -> np.ndarray:
    """Sine, cosine and offset."""
    angle = 2.0 * np.pi * frequency * t
    return np.stack([np.sin(angle), np.cos(angle), np.ones_like(t)], axis=1)


@dataclass(frozen=True, kw_only=True)
class Impact:
    """One stretch in which a contact is felt: index of its first sample, index past its last, and impulse, N s."""

    first: int
    end: int
    impulse: float


def contact_force(record: Record) -> tuple[Samples, float] | None:
    """What is felt of a contact, and the level beyond which it is one, noise being below.

    It is the load cell's force from its median, N; without a load cell the deceleration of a hammer beside a cart that is at rest or a
    sine, m/s^2. None where neither was recorded.
    """
    force, felt = record.channels.get("impact_force"), record.channels.get("hammer_acceleration")
    if force is not None:
        noise = record.noise.get("impact_force")
        return None if noise is None else (force - np.nanmedian(force), CONTACT * noise)
    if felt is None or record.base != "sine" or record.kind not in STRUCK:
        return None
    deceleration = np.nanmedian(felt) - felt
    usual = MAD_TO_STD * float(np.median(np.abs(np.nan_to_num(deceleration))))
    return (deceleration, CONTACT * usual) if usual > 0.0 else None


def felt_impacts(record: Record) -> list[Impact]:
    """Every contact that load cell or accelerometer show, in order of time.

    A gap of fewer than `FEWEST_SAMPLES` samples does not part two of them. Impulses are over the mass, m/s, where an accelerometer shows
    them. None where hammer and stop are not mostly apart, for then it is not known what the load cell reads at rest.
    """
    felt = contact_force(record)
    if felt is None:
        return []
    rest = np.nan_to_num(felt[0])
    inside = np.abs(rest) > felt[1]
    if inside.mean() > MOSTLY_APART:
        return []
    found: list[tuple[int, int]] = []
    for first, end in zip(*(edges.tolist() for edges in runs_of(inside)), strict=True):
        if found and first - found[-1][1] < FEWEST_SAMPLES:
            found[-1] = (found[-1][0], end)
        else:
            found.append((first, end))
    wider = [slice(max(first - 1, 0), end + 1) for first, end in found]  # a sample more on either side
    impulses = [float(np.trapezoid(rest[part], record.time[part])) for part in wider]
    return [Impact(first=first, end=end, impulse=impulse) for (first, end), impulse in zip(found, impulses, strict=True)]


def relative_displacement(record: Record) -> np.ndarray | None:
    """Relative displacement, m, as recorded; None where it was not."""
    channel = next((name for name in MOTION_CHANNELS if name in record.channels), None)
    if channel is None:
        return None
    moves = record.kind == "cart-excitation" or record.base == "measured"
    if channel == "relative_displacement" or not moves:
        return record.channels[channel]
    cart = record.channels.get("cart_displacement")
    return None if cart is None else record.channels[channel] - cart


@dataclass(frozen=True, kw_only=True)
class Response:
    """Change of a body's speed over the impulse of the impacts, by least squares: -1/m for the hammer.

    Attributes:
        slope: 1/kg.
        stderr: from the scatter between the impacts.
        impacts: number of them.
    """

    slope: float
    stderr: float
    impacts: int

    @property
    def sign(self) -> int:
        """1 or -1; 0 where a slope as large, without any, has a probability above 1e-4."""
        return 0 if abs(self.slope) < stats.t.isf(0.5e-4, self.impacts - 1) * self.stderr else int(np.sign(self.slope))


def response(record: Record, channel: str, impacts: list[Impact]) -> Response | None:
    """How a body's speed, the slope of its displacement `channel`, answers to impacts; None below `FEWEST_IMPACTS` with flight around."""
    changes = list(_changes(record.time, record.channels[channel], impacts))
    if len(changes) < FEWEST_IMPACTS:
        return None
    impulse, change = np.array(changes).T
    slope = float(impulse @ change / (impulse @ impulse))
    scatter = change - slope * impulse
    return Response(slope=slope, stderr=float(np.sqrt(scatter @ scatter / (len(changes) - 1) / (impulse @ impulse))), impacts=len(changes))


def _changes(time: Samples, values: Samples, impacts: list[Impact]) -> Iterator[tuple[float, float]]:
    """Impulse and change of speed of every contact beside which there is flight of its own length, or `FEWEST_SAMPLES`.

    Beside the contact the motion is a parabola, whose curvature is that of the flight, and its place and slope change in the contact.
    """
    ends = [0, *(impact.end for impact in impacts)]
    begins = [*(impact.first for impact in impacts[1:]), time.size]
    for impact, end, begin in zip(impacts, ends, begins, strict=False):
        reach = max(impact.end - impact.first, FEWEST_SAMPLES)
        before = np.arange(max(impact.first - 1 - reach, end), max(impact.first - 1, 0))
        after = np.arange(impact.end + 1, min(impact.end + 1 + reach, begin))
        both = np.concatenate([before, after])
        if min(before.size, after.size) < FEWEST_SAMPLES or not np.isfinite(values[both]).all():
            continue
        span = float(time[both[-1]] - time[both[0]])
        t = (time[both] - 0.5 * (time[impact.first] + time[impact.end - 1])) / span
        later = (both >= impact.end).astype(float)
        columns = np.stack([np.ones_like(t), t, t**2, later, later * t], axis=1)
        solution, *_ = np.linalg.lstsq(columns, values[both], rcond=None)
        yield impact.impulse, float(solution[4]) / span


def pulls(record: Record, impacts: list[Impact]) -> tuple[Float[np.ndarray, " 2"], Float[np.ndarray, " 2"]] | None:
    """Coefficients of hammer x and cart y in x'', 1/s^2, and their standard errors, in flight; None where there is little flight.

    x'' = a x + b y + c x' + d y' + e is multiplied by a bump over half a period of the drive and integrated by parts (weak form).
    """
    step = float(np.median(np.diff(record.time)))
    length = round(0.5 / (record.excitation_frequency or np.inf) / step)
    if length < 16:
        return None
    s = np.linspace(-1.0, 1.0, length)
    half = 0.5 * (length - 1) * step
    value, slope = (1.0 - s**2) ** 3, -6.0 * s * (1.0 - s**2) ** 2 / half
    curve = (-6.0 * (1.0 - s**2) ** 2 + 24.0 * s**2 * (1.0 - s**2)) / half**2
    x, y = (record.channels[f"{body}_displacement"] for body in ("hammer", "cart"))
    struck = np.zeros(record.time.size, bool)
    for impact in impacts:
        struck[max(impact.first - 2, 0) : impact.end + 2] = True
    clear = ~struck & np.isfinite(x + y)
    rows = [
        (x[part] @ curve, x[part] @ value, y[part] @ value, -(x[part] @ slope), -(y[part] @ slope), value.sum())
        for first in range(0, record.time.size - length + 1, max(length // 4, 1))
        if clear[part := slice(first, first + length)].all()
    ]
    if len(rows) < 10:
        return None
    table = np.array(rows)
    matrix, right = table[:, 1:], table[:, 0]
    scale = np.linalg.norm(matrix, axis=0)
    if not (scale > 0.0).all():  # a dead channel pulls nothing
        return None
    solution, *_ = np.linalg.lstsq(matrix / scale, right, rcond=None)
    scatter = right - matrix / scale @ solution
    overlap = 4.0  # rows that hold a sample
    covariance = np.linalg.pinv((matrix / scale).T @ (matrix / scale)) * overlap * float(scatter @ scatter) / (len(right) - matrix.shape[1])
    return (solution / scale)[:2], (np.sqrt(np.diag(covariance)) / scale)[:2]


def scale_ratios(record: Record, mass: float | None) -> Iterator[tuple[str, str, float]]:
    """Pairs of channels that show the same, and the first over what the second gives for it."""
    channels = record.channels
    for displacement, acceleration in ONE_BODY:
        if displacement in channels and acceleration in channels:
            ratio = motion_ratio(record.time, channels[displacement], channels[acceleration])
            if ratio is not None:
                yield acceleration, displacement, ratio
    if mass is not None and {"impact_force", "hammer_acceleration"} <= channels.keys():
        ratio = _force_ratio(channels["impact_force"], -mass * channels["hammer_acceleration"])
        if ratio is not None:
            yield "impact_force", "hammer_acceleration", ratio


def motion_ratio(time: Samples, displacement: Samples, acceleration: Samples) -> float | None:
    """How many times an acceleration is the second derivative of a displacement, from the strong lines of both.

    None where the two do not show the same motion, and where samples are missing or unevenly spaced.
    """
    steps = np.diff(time)
    if len(time) <= 16 or np.ptp(steps) >= 1e-3 * steps.mean() or not np.isfinite(displacement + acceleration).all():
        return None
    window = hann(len(time))
    omega = 2.0 * np.pi * np.fft.rfftfreq(len(time), float(steps.mean()))
    moved, felt = (np.fft.rfft(window * detrend(values)) for values in (displacement, acceleration))
    size = np.abs(moved)
    size[:4] = 0.0  # the window smears these lines, and an accelerometer does not feel them
    strong = size > 1e-2 * size.max()
    return _ratio(-(omega[strong] ** 2) * moved[strong], felt[strong])


def _force_ratio(force: Samples, inertia: Samples) -> float | None:
    """How many times a force is mass times deceleration where it is strong; None where it shows no impacts, or something else."""
    known = np.isfinite(force) & np.isfinite(inertia)
    if not known.any():
        return None
    strong = known & (np.abs(force) > 0.3 * np.max(np.abs(force[known])))
    return _ratio(inertia[strong], force[strong]) if 3 <= strong.sum() < MOSTLY_APART * known.sum() else None


def _ratio(a: np.ndarray, b: np.ndarray) -> float | None:
    """How many times `a` is in `b`, by least squares without a mean, because both rest at zero; None where they do not correlate."""
    product = float(np.vdot(a, b).real)
    alike = abs(product) > 0.95 * max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300)
    return product / float(np.vdot(a, a).real) if alike else None


def noise_coherence(one: Samples, other: Samples) -> tuple[float, tuple[float, float]]:
    """Coherence of two channels where one of them shows noise alone, and the share of the frequencies at which each does.

    Second differences make signals small against the noise. A frequency counts as noise where the power is less than twice that of the
    white noise which the highest differences show (`estimate_noise`). J. S. Bendat, A. G. Piersol, Random Data, 4th ed. (2010), ch. 6.
    Both are evenly sampled, at the same instants.

    Returns:
        The coherence, 0 to 1, the larger of that in the noise of either; and the two shares. 0 where fewer than 512 samples without a gap
        are usable in both, or where one shows no noise.
    """
    runs = np.stack(runs_of(np.isfinite(one) & np.isfinite(other)), axis=1).tolist()
    run = slice(*max(runs, key=lambda run: run[1] - run[0], default=[0, 0]))
    first, second = one[run], other[run]
    noises = [noise for noise in (estimate_noise(first), estimate_noise(second)) if noise is not None]
    if len(first) < 512 or len(noises) < 2:
        return 0.0, (0.0, 0.0)
    length = min(256, len(first) // 16)
    frequency, common = coherence(np.diff(first, 2), np.diff(second, 2), nperseg=length)
    means, shares = [], []
    for values, noise in zip((first, second), noises, strict=True):
        power = welch(np.diff(values, 2), nperseg=length)[1]
        noisy = power < 4.0 * noise**2 * (2.0 * np.sin(np.pi * frequency)) ** 4
        shares.append(float(noisy.mean()))
        means.append(float(common[noisy].mean()) if noisy.any() else 0.0)
    return max(means), (shares[0], shares[1])
