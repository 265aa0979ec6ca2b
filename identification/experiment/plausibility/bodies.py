"""Whether the channels of hammer and cart are what they are called, and whether both displacements grow the same way."""

import numpy as np
from jaxtyping import Float

from identification.experiment.errors import DoubtError, shown
from identification.experiment.plausibility.drive import MOSTLY_SINE
from identification.experiment.plausibility.impulses import Impact
from identification.experiment.plausibility.sine import amplitude_at, fit_sine
from identification.experiment.record import Record
from identification.experiment.settings.scales import NEAR, motion_ratio

AT_REST = ("drop-test", "free-decay")
"""Kinds in which the cart rests."""
SHOW_CONTACT = frozenset(("impact_force", "hammer_acceleration"))
SURE = 5.0
"""Standard errors beyond which a coefficient of many samples has a sign."""
DRIVEN = 0.1
"""Motion of the cart over that of the hammer below which it may be the recoil of a yielding frame."""
STEADY = 0.02
"""Relative difference of amplitude between the thirds of a record within which a motion is driven, and no ringing of a frame."""
EXCHANGE = "exchange the two in 'columns' of the record"


def check_bodies(record: Record, impacts: list[Impact]) -> None:
    """Compare the motions of hammer and cart with what drives them.

    Args:
        record: with its channels and noise.
        impacts: that load cell or accelerometer show.

    Raises:
        DoubtError: hammer and cart are exchanged, or one of them points the other way; the message says what to write.
    """
    if record.base != "sine":
        return
    if record.kind in AT_REST:
        _check_rest(record)
    if record.kind != "cart-excitation" or not {"hammer_displacement", "cart_displacement"} <= record.channels.keys():
        return
    _check_accelerometer(record)
    if not SHOW_CONTACT.isdisjoint(record.channels):
        _check_cart_direction(record, impacts)


def _check_rest(record: Record) -> None:
    """In a record whose cart rests, the hammer moves more than the cart, noise aside, and the cart is not driven."""
    for quantity in ("displacement", "acceleration"):
        hammer, cart = (record.channels.get(f"{body}_{quantity}") for body in ("hammer", "cart"))
        if hammer is None or cart is None:
            continue
        noise = [record.noise.get(f"{body}_{quantity}", 0.0) for body in ("hammer", "cart")]
        moved, rested = (float(np.sqrt(max(np.nanvar(one) - std**2, 0.0))) for one, std in zip((hammer, cart), noise, strict=True))
        if rested > moved + max(noise):
            raise DoubtError(
                f"in record {shown(record.file)} cart_{quantity} moves more than hammer_{quantity} (standard deviations {rested:.3g} and "
                f'{moved:.3g} beyond the noise): expected a cart at rest in a {record.kind}; {EXCHANGE}, or set kind = "cart-excitation"'
            )
        sine = fit_sine(record.time, cart) if rested > DRIVEN * moved else None
        if sine is not None and sine.share > MOSTLY_SINE and _is_steady(record.time, cart, sine.frequency):
            raise DoubtError(
                f"in record {shown(record.file)} cart_{quantity} is a sine of {sine.rounded:.6g} Hz: expected a cart at rest in a "
                f'{record.kind}; set kind = "cart-excitation" and excitation_frequency = {sine.rounded:.6g}'
            )


def _is_steady(time: Float[np.ndarray, " samples"], values: Float[np.ndarray, " samples"], frequency: float) -> bool:
    """Whether a sine has one amplitude in all thirds of the record; False where a third is shorter than two periods."""
    third = time.size // 3
    if third < 16 or frequency * float(time[third] - time[0]) < 2.0:
        return False
    parts = (slice(third), slice(third, -third), slice(-third, None))
    amplitudes = [amplitude_at(time[part], values[part], frequency) for part in parts]
    return max(amplitudes) < (1.0 + STEADY) * min(amplitudes)


def _check_accelerometer(record: Record) -> None:
    """The hammer's accelerometer shows the motion of its displacement and not that of the cart's."""
    felt = record.channels.get("hammer_acceleration")
    if felt is None:
        return
    own, other = (motion_ratio(record.time, record.channels[f"{body}_displacement"], felt) for body in ("hammer", "cart"))
    if own is None and other is not None and abs(other - 1.0) < NEAR:
        raise DoubtError(
            f"hammer_acceleration of record {shown(record.file)} is that of cart_displacement and not of hammer_displacement: expected one "
            f"motion of the hammer; {EXCHANGE}"
        )


def _check_cart_direction(record: Record, impacts: list[Impact]) -> None:
    """In flight the spring pulls the hammer towards the cart: x'' = -omega_n^2 (x - y), so x and y act with opposite signs."""
    pull, stderr = _pulls(record, impacts)
    if pull is not None and pull[0] < -SURE * stderr[0] and pull[1] < -SURE * stderr[1]:
        raise DoubtError(
            f"cart_displacement of record {shown(record.file)} points away from the stop: the spring pulls the hammer to where the cart is "
            "not; expected that both displacements grow towards the stop; set sign = -1 in [sensors.cart_displacement]"
        )


def _pulls(record: Record, impacts: list[Impact]) -> tuple[Float[np.ndarray, " 2"] | None, Float[np.ndarray, " 2"]]:
    """Coefficients of x and y in x'', 1/s^2, and their standard errors, from the weak form of the equation; none for little flight.

    x'' = a x + b y + c x' + d y' + e is multiplied by a bump over half a period of the drive and integrated by parts.
    """
    step = float(np.median(np.diff(record.time)))
    length = round(0.5 / (record.excitation_frequency or np.inf) / step)
    if length < 16:
        return None, np.zeros(2)
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
        return None, np.zeros(2)
    table = np.array(rows)
    matrix, right = table[:, 1:], table[:, 0]
    scale = np.linalg.norm(matrix, axis=0)
    solution, *_ = np.linalg.lstsq(matrix / scale, right, rcond=None)
    scatter = right - matrix / scale @ solution
    overlap = 4.0  # rows that hold a sample
    covariance = np.linalg.pinv((matrix / scale).T @ (matrix / scale)) * overlap * float(scatter @ scatter) / (len(right) - matrix.shape[1])
    return (solution / scale)[:2], (np.sqrt(np.diag(covariance)) / scale)[:2]
