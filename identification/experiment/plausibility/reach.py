"""Whether the hammer reaches its stop where a contact is expected."""

import numpy as np

from identification.experiment.channels import MOTION_CHANNELS
from identification.experiment.errors import DoubtError, ExperimentError, shown
from identification.experiment.plausibility.impulses import CONTACT, Impact
from identification.experiment.record import Record

SLIP = 5e-3
"""m: a gap that was set wrong by more is no setting error, which a fit estimates with a standard deviation of a millimetre."""


def check_impacts(record: Record) -> None:
    """A drop test with a load cell shows an impact.

    Args:
        record: with its noise.

    Raises:
        DoubtError: it shows none.
    """
    if record.kind != "drop-test" or "impact_force" not in record.noise:
        return
    force = record.channels["impact_force"]
    largest = float(np.nanmax(np.abs(force - np.nanmedian(force))))
    if largest > CONTACT * record.noise["impact_force"]:
        return
    raise DoubtError(
        f"record {shown(record.file)} is a drop-test, and impact_force shows no impact in it (at most {largest:.3g} N, less than "
        f'{CONTACT:g} times its noise of {record.noise["impact_force"]:.3g} N): expected at least one; set kind = "free-decay", or check '
        "the load cell, its cable and its unit"
    )


def check_gap(record: Record, impacts: list[Impact], *, offset: bool) -> None:
    """The gap is where the hammer stands when an impact begins.

    Args:
        record: with its channels.
        impacts: that load cell or accelerometer show; without them nothing is checked but that a drop test comes to its stop.
        offset: whether the zero of a displacement is declared to be unknown.

    Raises:
        ExperimentError: the gap would be right in mm.
        DoubtError: the hammer strikes where there is no stop, or never comes to it; the message gives the gap that would be right.
    """
    u = _relative(record)
    if u is None or offset or record.kind in ("free-decay", "prescribed"):
        return
    if impacts:
        touches = np.array([u[max(impact.first - 1, 0)] for impact in impacts])
        place, spread = float(np.median(touches)), float(np.ptp(touches))
        if abs(record.gap - place) > max(SLIP, spread):
            hint = _in_mm(record.gap, place)
            raise (ExperimentError if hint else DoubtError)(
                f"gap of record {shown(record.file)} is {record.gap:g} m, and its impacts begin where the hammer stands at {place:.3g} m: "
                f"expected about the same; set gap = {place:.3g} (m){hint}"
            )
    elif record.kind == "drop-test" and record.gap - float(np.nanmax(u)) > max(SLIP, float(np.ptp(u[np.isfinite(u)]))):
        hint = _in_mm(record.gap, float(np.nanmax(u)))
        raise (ExperimentError if hint else DoubtError)(
            f"gap of record {shown(record.file)} is {record.gap:g} m, and its hammer comes no further than {float(np.nanmax(u)):.3g} m: "
            f"expected that it strikes in a drop-test; correct the gap, which is in m{hint}"
        )


def _in_mm(gap: float, place: float) -> str:
    """A hint where the number would be right in mm."""
    return f"; {gap:g} mm would be gap = {1e-3 * gap:g}" if gap and abs(1e-3 * gap - place) < SLIP else ""


def _relative(record: Record) -> np.ndarray | None:
    """Relative displacement, m, as recorded; None where it was not."""
    channel = next((name for name in MOTION_CHANNELS if name in record.channels), None)
    if channel is None:
        return None
    moves = record.kind == "cart-excitation" or record.base == "measured"
    if channel == "relative_displacement" or not moves:
        return record.channels[channel]
    cart = record.channels.get("cart_displacement")
    return None if cart is None else record.channels[channel] - cart
