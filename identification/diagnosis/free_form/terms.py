"""Library of free-form terms, their score-test columns, and their forward selection."""

import dataclasses
import itertools
from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import chdtri

from identification.diagnosis.calibration import ALPHA
from identification.diagnosis.free_form.missing_force import missing_force
from identification.diagnosis.score.periodogram import periodogram
from identification.diagnosis.score.score import Projector, Reduced, information, reduced
from identification.diagnosis.score.signature import Course
from identification.least_squares.block_arrow import covariance
from identification.likelihood.linearised import Linearised
from identification.likelihood.response import Perturbation, response
from identification.windows.prepare import Prepared
from vibrojax.effects import Motion
from vibrojax.effects.free_form import LINES, FreeForm

_ORDER = 5
"""Highest order of a polynomial in u and u'."""
_FORCES = (
    *(
        "1",
        "t",
        "t^2",
        "t u",
        "t u'",
        "t^2 u",
        "|u'| u'",
        "|u| u",
        "|u| u'",
        "u |u'|",
        "u^2 |u'| u'",
        "sign(u)",
        "sign(u')",
        "sign(u) |u'|",
    ),
    *("contact", "delta", "delta^2", "delta^3", "delta'", "delta delta'", "delta^2 delta'", "|delta'| delta'", "delta |delta'|"),
    *("t contact", "t delta", "t delta^2", "t delta'"),
)
_READINGS = ("1", "t", "t^2", "u^2", "u^3", "t u")
_REACHES = (0.05, 0.1, 0.2, 0.4, 0.8)
"""Decay lengths of a force near the stop, over the amplitude."""
_TIME_CONSTANTS = (0.05, 0.12, 0.3, 0.8)
"""Time constants of an exponential approach, over the longest record."""
_PEAKS = 3
"""Spectral lines proposed for each carrier."""
_CARRIERS = ("1", "u")
_ALIKE = 0.5
"""Share of its gain that a line must keep with one amplitude common to all records."""
_LOWEST, _APART = 1.5, 0.06
"""Lowest frequency of a line, and frequency spacing, in cycles per longest record."""
_TRIFLE = 0.02
"""Relative gain below which forward selection stops until the refit."""
_DETERMINED = 1e-7
"""Residual share of a column, after projection on the fitted parameters, above which its strength is identifiable."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Group:
    """A candidate term with its score-test columns.

    Attributes:
        members: the effect at strength 1; sine and cosine of a line.
        columns: derivative of the residual; for a line, one per member and record.
        searched: number of alternatives from which it was selected.
        shape: "near", "settled" or "sine" if the term has a shape parameter to estimate, else empty.
    """

    members: tuple[FreeForm, ...]
    columns: tuple[Reduced, ...]
    searched: int = 1
    shape: str = ""

    @property
    def degrees(self) -> int:
        """Number of parameters to estimate."""
        return len(self.columns) + bool(self.shape)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Choice:
    """A selection of terms with first-order strengths and expected improvement (score test)."""

    groups: tuple[Group, ...]
    factors: tuple[np.ndarray, ...]
    gain: float
    worth: float
    """Expected gain less the price of all parameters (BIC and number of alternatives)."""


def force_groups(prepared: Prepared, by: Projector, courses: tuple[Course, ...], mass: float) -> list[Group]:
    """All force terms, and the strongest spectral lines of the missing force."""
    at = by.at
    powers = [(i, j) for i, j in itertools.product(range(_ORDER + 1), repeat=2) if 2 <= i + j <= _ORDER]
    polynomials = [" ".join(_powered(base, k) for base, k in (("u", i), ("u'", j)) if k) for i, j in powers]
    plain = [FreeForm(terms=(term,), c1=1.0) for term in (*_FORCES, *polynomials)]
    inside = at.inside
    amplitude = float(np.abs(at.u[inside]).max())
    near = [FreeForm(terms=("near",), c1=1.0, d=part * amplitude) for part in _REACHES]
    found = [_group(by, courses, mass, one, len(plain)) for one in plain]
    found += [_group(by, courses, mass, one, len(plain) * len(near), "near") for one in near]
    return [*found, *_settling(by, courses, mass, "", len(plain)), *lines(prepared, by, courses, mass)]


def reading_groups(by: Projector, courses: tuple[Course, ...], mass: float, channel: str) -> list[Group]:
    """All terms that a sensor may add to its reading."""
    plain = [FreeForm(terms=(term,), of_channel=channel, c1=1.0) for term in _READINGS]
    found = [_group(by, courses, mass, one, len(plain)) for one in plain]
    return [*found, *_settling(by, courses, mass, channel, len(plain))]


def _settling(by: Projector, courses: tuple[Course, ...], mass: float, channel: str, count: int) -> list[Group]:
    """Terms that approach a constant exponentially, 1 - exp(-t / tau), as a force or as a stiffness."""
    longest = max(float(course.ts[-1] - course.ts[0]) for course in courses)
    taus = [part * longest for part in _TIME_CONSTANTS]
    terms = ("settled",) if channel else ("settled", "settled u")
    settled = [FreeForm(terms=(term,), of_channel=channel, c1=1.0, tau=tau) for term in terms for tau in taus]
    return [_group(by, courses, mass, one, count * len(settled), "settled") for one in settled]


def _group(by: Projector, courses: tuple[Course, ...], mass: float, member: FreeForm, searched: int, shape: str = "") -> Group:
    return Group(members=(member,), columns=tuple(columns_of(by, courses, mass, (member,))), searched=searched, shape=shape)


def _powered(base: str, power: int) -> str:
    return base if power == 1 else f"{base}^{power}"


def columns_of(by: Projector, courses: tuple[Course, ...], mass: float, effects: Sequence[FreeForm]) -> list[Reduced]:
    """Score-test column of each effect: the change of the residual, orthogonal to the fit."""
    return reduced(by, np.stack([change(by.at, courses, mass, effect) for effect in effects], axis=1))


def change(at: Linearised, courses: tuple[Course, ...], mass: float, effect: FreeForm) -> np.ndarray:
    """Change of the residual due to an effect at its strength, to first order, (windows, time, channels)."""
    none = np.zeros_like(at.u)
    values = along(at, courses, effect)
    perturbation = Perturbation(
        force=none if effect.channel else values,
        stop_position=none,
        stop_velocity=none,
        base_displacement=none,
        base_acceleration=none,
        readings={effect.of_channel: values} if effect.channel else {},
    )
    return response(at, mass, perturbation)


def along(at: Linearised, courses: tuple[Course, ...], effect: FreeForm) -> np.ndarray:
    """Value of an effect's terms along the fitted motion, (windows, time)."""
    whole = np.zeros_like(at.u)
    for index, course in enumerate(courses):
        indentation = course.system.indentation(course.u)
        motion = Motion(
            t=course.ts, u=course.u, v=course.v, indentation=indentation, indentation_rate=course.v, in_contact=course.in_contact
        )
        windows, values = at.in_windows(np.asarray(effect.total(motion)), index)
        whole[windows] = values
    return whole


def lines(prepared: Prepared, by: Projector, courses: tuple[Course, ...], mass: float) -> list[Group]:
    """Strongest spectral lines of the missing force, constant or proportional to u, with a phase per record."""
    missing = missing_force(prepared, by.at, mass)
    if missing is None:
        return []
    force, stderr = missing
    weight = np.where(np.isfinite(stderr), 1.0 / np.where(np.isfinite(stderr), stderr, 1.0) ** 2, 0.0)
    longest = max(float(record.time[-1] - record.time[0]) for record in prepared.experiment.records)
    found = []
    for carrier in _CARRIERS:
        term = "sine_1" if carrier == "1" else f"{carrier} sine_1"
        shape = along(by.at, courses, FreeForm(terms=(carrier,), c1=1.0))
        frequencies, power = periodogram(prepared, by.at, weight * force * shape, weight * shape**2, lowest=_LOWEST, apart=_APART)
        if not frequencies.size:
            continue
        searched = int(frequencies[-1] * longest)
        for _ in range(_PEAKS):
            peak = float(frequencies[np.argmax(power)])
            power = np.where(np.abs(frequencies - peak) < 2.0 / longest, 0.0, power)
            near = [peak + step / longest for step in (-0.6, -0.3, 0.0, 0.3, 0.6) if peak + step / longest > 0]
            tried = [_line(by, courses, mass, term, one, searched) for one in near]
            best = max(tried, key=lambda group: _gains(by, group)[0])
            whole, alike = _gains(by, best)
            if alike > _ALIKE * whole:
                found.append(best)
    return found


def _line(by: Projector, courses: tuple[Course, ...], mass: float, term: str, frequency: float, searched: int) -> Group:
    """Sine and cosine of one frequency as columns, one per record."""
    members = tuple(FreeForm(terms=(term,), c1=1.0, f1_hz=frequency, p1=phase) for phase in (0.0, 0.5 * np.pi))
    whole = columns_of(by, courses, mass, members)
    columns = [one.restricted_to(by.at.record == record) for one in whole for record in range(len(courses))]
    return Group(members=members, columns=tuple(columns), searched=searched, shape="sine")


def _gains(by: Projector, line: Group) -> tuple[float, float]:
    """Expected decrease of chi-square due to a line: with an amplitude per record, and with one common amplitude."""
    total, matrix = information(by, line.columns)
    factors = -covariance(matrix) @ total
    sine, cosine = factors.reshape(2, -1)
    shared = common_amplitude(line, factors) * np.concatenate([np.cos(np.arctan2(cosine, sine)), np.sin(np.arctan2(cosine, sine))])
    return float(-total @ factors), float(-2.0 * total @ shared - shared @ matrix @ shared)


def common_amplitude(line: Group, factors: np.ndarray) -> float:
    """Common amplitude of a line: the mean of the records' amplitudes, weighted with their information."""
    sine, cosine = factors.reshape(2, -1)
    known = np.array([column.squared for column in line.columns]).reshape(2, -1).sum(axis=0)
    return float(np.sum(known * np.hypot(sine, cosine)) / max(known.sum(), 1e-300))


def change_by(choice: Choice, at: Linearised, courses: tuple[Course, ...], mass: float) -> np.ndarray:
    """Change of the residual due to the selected terms at their strengths, to first order, (windows, time, channels)."""
    whole = np.zeros_like(at.residual)
    for group, factors in zip(choice.groups, choice.factors, strict=True):
        for member, of_records in zip(group.members, factors.reshape(len(group.members), -1), strict=True):
            factor = of_records[at.record] if group.shape == "sine" else of_records[[0]]
            whole += factor[:, None, None] * change(at, courses, mass, member)
    return whole


@dataclasses.dataclass(frozen=True, kw_only=True)
class _ExpectedGains:
    """Expected improvement (score test) of any subset of the groups, given by index, and the price of its parameters."""

    scores: np.ndarray
    information: np.ndarray
    index: list[np.ndarray]
    fine: np.ndarray
    prices: np.ndarray

    def gain(self, chosen: Sequence[int]) -> float:
        """Expected decrease of chi-square."""
        part = np.concatenate([self.index[k] for k in chosen]) if chosen else np.zeros(0, int)
        part = part[self.fine[part]]
        if not len(part):
            return 0.0
        return float(self.scores[part] @ covariance(self.information[np.ix_(part, part)]) @ self.scores[part])

    def worth(self, chosen: Sequence[int]) -> float:
        """Expected decrease of chi-square less the price."""
        return self.gain(chosen) - float(self.prices[list(chosen)].sum())

    def factors(self, chosen: Sequence[int]) -> tuple[np.ndarray, ...]:
        """First-order strength of every column of each group, 0 where it is not identifiable."""
        part = np.concatenate([self.index[k] for k in chosen])
        inverse = covariance(self.information[np.ix_(part, part)] * np.outer(self.fine[part], self.fine[part]))
        factors = -inverse @ (self.scores[part] * self.fine[part])
        return tuple(np.split(factors, np.cumsum([len(self.index[k]) for k in chosen])[:-1]))


def _expected_gains(by: Projector, groups: Sequence[Group], samples: int) -> _ExpectedGains:
    columns = [column for group in groups for column in group.columns]
    total, matrix = information(by, columns)
    begin = np.cumsum([0, *(len(group.columns) for group in groups)])
    index = [np.arange(a, b) for a, b in itertools.pairwise(begin)]
    raw = np.array([column.squared for column in columns])
    prices = np.array(
        [len(i) * np.log(samples) + 2.0 * np.log(g.searched) + bool(g.shape) * np.log(samples) for g, i in zip(groups, index, strict=True)]
    )
    return _ExpectedGains(scores=total, information=matrix, index=index, fine=np.diag(matrix) > _DETERMINED * raw, prices=prices)


def select(
    by: Projector, groups: Sequence[Group], samples: int, most: int, lines: int = LINES, taken: frozenset[str] = frozenset()
) -> Choice:
    """Select at most `most` groups with the largest expected gain less the price of their parameters.

    Forward selection; after each addition, every selected term is replaced or dropped if that raises the worth. `lines` is the number of
    sines still available, `taken` the shapes no longer available.
    """
    expected = _expected_gains(by, groups, samples)
    least = np.array([chdtri(g.degrees, min(ALPHA / g.searched, 1.0)) for g in groups])

    def determined(k: int) -> bool:
        fine = expected.fine[expected.index[k]]
        return bool(fine.all()) if groups[k].shape != "sine" else bool(fine.any())

    def allowed(chosen: Sequence[int]) -> bool:
        shapes = [groups[k].shape for k in chosen if groups[k].shape]
        single = [shape for shape in shapes if shape != "sine"]
        return shapes.count("sine") <= lines and len(set(single)) == len(single) and not taken & set(single)

    usable = [k for k in range(len(groups)) if determined(k)]
    chosen: list[int] = []
    while len(chosen) < most:
        tries = [[*chosen, k] for k in usable if k not in chosen and allowed([*chosen, k])]
        if not tries:
            break
        best, before = max(tries, key=expected.worth), expected.gain(chosen)
        if expected.gain(best) - before < max(expected.prices[best[-1]], least[best[-1]], _TRIFLE * before):
            break
        chosen = _settled([*best], usable, expected.worth, allowed)
    if not chosen:
        return Choice(groups=(), factors=(), gain=0.0, worth=0.0)
    held = tuple(groups[k] for k in chosen)
    return Choice(groups=held, factors=expected.factors(chosen), gain=expected.gain(chosen), worth=expected.worth(chosen))


def _settled(
    chosen: list[int], usable: list[int], worth: Callable[[Sequence[int]], float], allowed: Callable[[Sequence[int]], bool]
) -> list[int]:
    """The selection after replacing or dropping each term in turn where that raises the worth."""
    for place in range(len(chosen)):
        if len(chosen) == 1:
            break
        others = chosen[:place] + chosen[place + 1 :]
        tries = [chosen, *([*others, k] for k in usable if k not in chosen and allowed([*others, k]))]
        chosen = max(tries, key=worth)
        if worth(others) > worth(chosen):
            return others
    return chosen
