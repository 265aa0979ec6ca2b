"""The terms of the simpler methods: columns over the rows of a force balance, and the effect that each would mean."""

import dataclasses

import numpy as np

from benchmarks.concealed.force_balance import Balance, Samples

UNLISTED = "unlisted"
_V_SMALL = 3e-3
"""m/s; the sign of the velocity is smoothed over this."""
_STEPS = (0.3, 0.4, 0.5, 0.6, 0.7)
"""Where in a record the gap may jump, as shares of its length."""
_DEPTHS = (0.6, 0.8, 0.93)
"""Where a stop behind the first may begin, as shares of the largest indentation."""


@dataclasses.dataclass(frozen=True)
class Regression:
    """Rows divided by their errors: target = nominal a + sum over effects of terms b + 1."""

    target: np.ndarray
    nominal: np.ndarray
    """Columns that always take part: spring, damper, contact law."""
    terms: dict[str, np.ndarray]
    """Columns of each effect, by its name; those under "unlisted" mean no listed effect."""
    count: int
    """Rows that there were before they were condensed."""


def regression(balance: Balance) -> Regression:
    """Rows of all records, those of the inertia before those of the load cells."""
    records = balance.records

    def rows(columns: list[np.ndarray]) -> np.ndarray:
        return np.concatenate([each / s.sigma[:, None] for each, s in zip(columns, records, strict=True)])

    nominal, stop = rows([np.stack([s.u, s.v], axis=1) for s in records]), rows([_stop(s, len(records)) for s in records])
    farthest, deepest = max(float(-s.u.min()) for s in records), max(float(s.delta.max()) for s in records)
    parts = [_terms(s, len(records), farthest, deepest) for s in records]
    terms = {name: rows([part[name] for part in parts]) for name in parts[0]}
    if balance.stop_is_known:
        nominal = np.concatenate([nominal, stop], axis=1)
    else:
        terms["missing_stop"] = stop
    target = np.concatenate([s.inertia / s.sigma for s in records])
    return condensed(_with_load_cell(Regression(target, nominal, terms, len(target)), records))


def condensed(law: Regression) -> Regression:
    """As few rows as columns, with the same sums of squares for any coefficients: the triangle of a QR decomposition."""
    blocks = [law.nominal, *law.terms.values(), law.target[:, None]]
    triangle = np.linalg.qr(np.concatenate(blocks, axis=1), mode="r")
    nominal, *terms, target = np.split(triangle, np.cumsum([block.shape[1] for block in blocks])[:-1], axis=1)
    return Regression(target[:, 0], nominal, dict(zip(law.terms, terms, strict=True)), law.count)


def _stop(s: Samples, records: int) -> np.ndarray:
    """A contact law of free exponent by three powers, and each record's error of the gap."""
    depth = np.maximum(s.delta, 0.0)
    contact = [depth**power * factor for power in (1.0, 1.5, 2.0) for factor in (1.0, s.v)]
    return np.stack([*contact, *_per_record([np.sqrt(depth)], s, records)], axis=1)


def _terms(s: Samples, records: int, farthest: float, deepest: float) -> dict[str, np.ndarray]:
    """Columns of one record, of the effects that act on the hammer."""
    depth, flight = np.maximum(s.delta, 0.0), ~s.contact
    leaving = (s.v < 0.0) & (s.delta < 0.0) & (s.delta > -4e-4)
    columns = {
        "coulomb_friction": [np.tanh(s.v / _V_SMALL)],
        "quadratic_drag": [s.v * np.abs(s.v)],
        "asymmetric_damping": [np.abs(s.v)],
        "cubic_stiffness": [s.u**3],
        "constant_force": [np.ones_like(s.t)],
        "hysteresis": [s.memory],
        "base_harmonics": [function(order * s.angle) * bool(s.omega) for order in (2, 3) for function in (np.sin, np.cos)],
        "frequency_drift": [s.omega * s.amplitude * s.t**2 * np.cos(s.angle)],
        "cart_recoil": [s.wobble],
        "gap_drift": [s.t * np.sqrt(depth)],
        "gap_step": _per_record([np.sqrt(depth) * (s.t > share * s.t[-1]) for share in _STEPS], s, records),
        "contact_adhesion": [leaving.astype(float)],
        "back_stop": [np.maximum(-s.u - 0.8 * farthest, 0.0) ** 1.5],
        "deep_stop": [np.maximum(depth - share * max(deepest, 0.0), 0.0) ** 1.5 for share in _DEPTHS],
        "stop_compliance": [np.where(s.contact, s.v, 0.0)],
        "mains_hum": _per_record([f(2.0 * np.pi * line * s.t) * flight for line in (50.0, 60.0) for f in (np.sin, np.cos)], s, records),
        UNLISTED: [s.u**2, s.u * s.v, np.abs(s.u) * s.v, s.t, s.t * s.u],
    }
    return {name: np.stack(each, axis=1) for name, each in columns.items()}


def _per_record(columns: list[np.ndarray], s: Samples, records: int) -> list[np.ndarray]:
    """Columns with a coefficient of their own in each record."""
    zero = np.zeros_like(s.t)
    return [column if number == s.record else zero for number in range(records) for column in columns]


def _with_load_cell(law: Regression, records: tuple[Samples, ...]) -> Regression:
    """Append the rows of the load cells: reading minus force of the balance, explained by faults of the load cell."""
    if any(s.load is None for s in records):
        return law
    k, c = np.linalg.lstsq(law.nominal, law.target, rcond=None)[0][:2]
    target, faults = [], {"gain_error": [], "force_lag": [], "force_clipping": []}
    for s in records:
        force = s.inertia - k * s.u - c * s.v
        load = np.asarray(s.load)
        sigma = np.hypot(s.sigma, s.load_sigma)
        target.append((load - force) / sigma)
        faults["gain_error"].append(np.where(s.contact, force, 0.0) / sigma)
        faults["force_lag"].append(np.where(s.contact, np.gradient(force, s.t), 0.0) / sigma)
        faults["force_clipping"].append(np.where(s.contact, np.minimum(load.max() - force, 0.0), 0.0) / sigma)
    rows = sum(len(each) for each in target)
    terms = {name: np.concatenate([columns, np.zeros((rows, columns.shape[1]))]) for name, columns in law.terms.items()}
    above = np.zeros(len(law.target))
    terms |= {name: np.concatenate([above, *columns])[:, None] for name, columns in faults.items()}
    nominal = np.concatenate([law.nominal, np.zeros((rows, law.nominal.shape[1]))])
    return Regression(np.concatenate([law.target, *target]), nominal, terms, law.count + rows)
