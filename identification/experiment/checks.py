"""Mistakes in records and their description, stated in one line: what was given, what was expected, what to do.

A check is a function from a record, and from what is declared beside it, to findings. A finding names the record's file and, where there is
one, the sample, counted from 1, with its time. It refuses where records and description certainly contradict each other, and doubts where
the description is unlikely. Loading, for a fit or a diagnosis, and `vibrojax inspect` ask the same checks.

To add one: write such a function, then list it in `CHECKS`.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float64
from scipy.constants import g

from identification.experiment.channels import AT_REST, CART_CHANNELS, MOTION_CHANNELS, NEAR, is_stand_in, mistaken_unit, si_unit
from identification.experiment.errors import ExperimentError, shown
from identification.experiment.experiment import Record, Sensor
from identification.experiment.samples import find_saturation
from identification.experiment.signals import (
    CONTACT,
    FEWEST_IMPACTS,
    ONE_BODY,
    Impact,
    Response,
    contact_force,
    felt_impacts,
    fit_sine,
    is_steady,
    motion_ratio,
    noise_coherence,
    pulls,
    relative_displacement,
    response,
    scale_ratios,
    sine_at,
)

MOSTLY_SINE = 0.5
"""Share of a channel's variance beyond which a sine explains most of it."""
MISTAKEN = {
    2.0 * np.pi: "as if it were in rad/s; excitation_frequency is in Hz",
    60.0: "as if it were in revolutions per minute; excitation_frequency is in Hz",
    1e3: 'as if its time stamps were in ms; add time_unit = "ms" to the record',
    1e6: 'as if its time stamps were in us; add time_unit = "us" to the record',
    1e-3: 'as if its time stamps were in s and not in ms; set time_unit = "s" in the record',
    1e-6: 'as if its time stamps were in s and not in us; set time_unit = "s" in the record',
}
"""What a set frequency may be that is so many times that of the cart."""
SURE = 5.0
"""Standard errors beyond which a coefficient of many samples has a sign, or a factor is the same in all records."""
EXCHANGE = "exchange the two in 'columns' of the record"
FAR = 10.0
"""Beyond this ratio of impact force to inertia no calibration is off: mass or unit is wrong."""
SLIP = 5e-3
"""m: a gap that was set wrong by more is no setting error, which a fit estimates with a standard deviation of a millimetre."""
ONE_MOTION = (ONE_BODY[0], ("relative_displacement", "hammer_acceleration"), ONE_BODY[1])
"""Pairs of channels: one may be computed from the other."""


@dataclass(frozen=True)
class Finding:
    """What a check found: one sentence, and whether it refuses the record or doubts it."""

    sentence: str
    refuses: bool = False


@dataclass(frozen=True, kw_only=True)
class Declared:
    """What is declared beside a record.

    Attributes:
        units: of its channels; None where the file states one.
        through: channels that are read through a sensitivity, which may be wrong by any factor.
        mass: of the hammer, kg; None where it is not known.
        stop: whether the rig has one.
        zero: whether the zeros of the displacements are known.
    """

    units: Mapping[str, str | None] = field(default_factory=dict)
    through: frozenset[str] = frozenset()
    mass: float | None = None
    stop: bool = True
    zero: bool = True


def check_drive(record: Record, declared: Declared) -> Iterator[Finding]:
    """The set frequency is that of the sine that the cart's own motion is.

    They contradict each other where a sine explains most of the motion and one of the set frequency does not, and where they are further
    apart than twice the change of the frequency from the record's first half to its second.
    """
    channel = next((name for name in CART_CHANNELS if name in record.channels), None)
    asked = record.excitation_frequency
    if record.kind != "cart-excitation" or record.base != "sine" or asked is None or channel is None:
        return
    time, values = record.time, record.channels[channel]
    middle = time.size // 2
    whole, first, second = (fit_sine(time[part], values[part]) for part in (slice(None), slice(middle), slice(middle, None)))
    if whole is None or first is None or second is None:
        return
    explained = whole.share > MOSTLY_SINE and sine_at(time, values, asked)[2] < MOSTLY_SINE
    if not explained or abs(whole.frequency - asked) <= 2.0 * abs(second.frequency - first.frequency):
        return
    given = (
        f"{channel} of record {shown(record.file)} is a sine of {whole.rounded:.6g} Hz, and excitation_frequency is {asked:g} Hz: "
        "expected one frequency"
    )
    resolved = 1.0 / float(time[-1] - time[0])
    for ratio, words in MISTAKEN.items():
        if abs(asked / ratio - whole.frequency) < resolved:
            yield Finding(f"{given}; it is {asked / whole.frequency:.4g} times that of the cart, {words}", refuses=True)
    yield Finding(f"{given}; set excitation_frequency = {whole.rounded:.6g}")


def check_directions(record: Record, declared: Declared) -> Iterator[Finding]:
    """The stop pushes the hammer back: the force is positive, and the hammer, whose displacement grows towards the stop, loses speed.

    The cart gets what the hammer loses, or nothing. A channel that is late or early shows the same as one that points the other way.
    """
    impacts = _load_cell_impacts(record)
    if is_turned(record):
        yield Finding(
            f"impact_force of record {shown(record.file)} falls in {len(impacts)} impacts, {_first(record, impacts)}: expected a "
            "force that is positive in compression; set sign = -1 in [sensors.impact_force]",
            refuses=True,
        )
    channel, hammer = _hammer_response(record, impacts)
    if hammer is None:
        return
    cart = response(record, "cart_displacement", impacts) if "cart_displacement" in record.channels else None
    if cart is not None and cart.sign < 0 and channel == "hammer_displacement" and cart.slope < hammer.slope:
        yield Finding(
            f"cart_displacement of record {shown(record.file)} loses speed in its {cart.impacts} impacts, {_first(record, impacts)}, and "
            f"hammer_displacement does not: expected that the stop pushes the hammer back; {EXCHANGE}, unless a channel is late or early"
        )
    if hammer.sign > 0:
        yield Finding(
            f"{channel} of record {shown(record.file)} gains speed in its {hammer.impacts} impacts, {_first(record, impacts)}: "
            "expected that it grows towards the stop, which pushes the hammer back; "
            f"set sign = -1 in [sensors.{channel}], unless a channel is late or early"
        )


def is_turned(record: Record) -> bool:
    """Whether a load cell reads most of the impulse of its impacts, and the strongest of them, as pulls.

    A preload that an impact relieves is none, nor is a hum between impacts, whose half waves may have more impulse than these. Single
    samples say nothing: compared are the third strongest pull and push of all impacts.
    """
    impacts, felt = _load_cell_impacts(record), contact_force(record)
    falls = len(impacts) >= FEWEST_IMPACTS and sum(impact.impulse for impact in impacts) < 0.0
    if not falls or felt is None or not np.nanmin(record.channels["impact_force"]) < -felt[1]:
        return False
    of_each = [felt[0][impact.first : impact.end] for impact in impacts]
    pull, push = (np.partition([float(np.nanmax(sign * one)) for one in of_each], -FEWEST_IMPACTS)[-FEWEST_IMPACTS] for sign in (-1, 1))
    return bool(pull > push)


def check_bodies(record: Record, declared: Declared) -> Iterator[Finding]:
    """Hammer and cart are what they are called, and both displacements grow the same way.

    A cart that rests moves less than its hammer and is not driven; the hammer's accelerometer shows the motion of its displacement and not
    that of the cart's; in flight the spring pulls the hammer towards the cart, x'' = -omega_n^2 (x - y): x and y act with opposite signs.
    """
    if record.base != "sine":
        return
    if record.kind in AT_REST:
        yield from _check_rest(record)
    if record.kind != "cart-excitation" or not {"hammer_displacement", "cart_displacement"} <= record.channels.keys():
        return
    felt = record.channels.get("hammer_acceleration")
    if felt is not None:
        own, other = (motion_ratio(record.time, record.channels[f"{body}_displacement"], felt) for body in ("hammer", "cart"))
        if own is None and other is not None and abs(other - 1.0) < NEAR:
            yield Finding(
                f"hammer_acceleration of record {shown(record.file)} is that of cart_displacement and not of hammer_displacement: "
                f"expected one motion of the hammer; {EXCHANGE}"
            )
    found = pulls(record, felt_impacts(record)) if {"impact_force", "hammer_acceleration"} & record.channels.keys() else None
    if found is not None and (found[0] < -SURE * found[1]).all():
        yield Finding(
            f"cart_displacement of record {shown(record.file)} points away from the stop: the spring pulls the hammer to where the "
            "cart is not; expected that both displacements grow towards the stop; set sign = -1 in [sensors.cart_displacement]"
        )


def _check_rest(record: Record) -> Iterator[Finding]:
    """In a record whose cart rests, the hammer moves more than the cart, noise aside, and the cart is not driven."""
    for quantity in ("displacement", "acceleration"):
        hammer, cart = (record.channels.get(f"{body}_{quantity}") for body in ("hammer", "cart"))
        if hammer is None or cart is None:
            continue
        noise = [record.noise.get(f"{body}_{quantity}", 0.0) for body in ("hammer", "cart")]
        moved, rested = (float(np.sqrt(max(np.nanvar(one) - std**2, 0.0))) for one, std in zip((hammer, cart), noise, strict=True))
        if rested > moved + max(noise):
            yield Finding(
                f"in record {shown(record.file)} cart_{quantity} moves more than hammer_{quantity} (standard deviations {rested:.3g} "
                f"and {moved:.3g} beyond the noise): expected a cart at rest in a {record.kind}; {EXCHANGE}, or set kind = "
                '"cart-excitation"'
            )
        sine = fit_sine(record.time, cart) if rested > 0.1 * moved else None  # less may be the recoil of a yielding frame
        if sine is not None and sine.share > MOSTLY_SINE and is_steady(record.time, cart, sine.frequency):
            yield Finding(
                f"in record {shown(record.file)} cart_{quantity} is a sine of {sine.rounded:.6g} Hz: expected a cart at rest in a "
                f'{record.kind}; set kind = "cart-excitation" and excitation_frequency = {sine.rounded:.6g}'
            )


def check_scales(record: Record, declared: Declared) -> Iterator[Finding]:
    """Channels that show one motion show it on one scale and in one direction, and impulses are mass times change of speed.

    Accelerations are compared with displacements, the force of the impacts with mass times deceleration and with what it does to the
    hammer's speed. A channel in a stand-in for an SI unit, such as the volt, is not compared with another.
    """
    gives = "what {} gives for it"
    for one, other, ratio in scale_ratios(record, declared.mass):
        units = {name: declared.units.get(name) for name in (one, other)}
        if any(map(is_stand_in, units.values())):
            continue
        if ratio < 0.0:
            yield Finding(
                f"{one} and {other} point opposite ways in record {shown(record.file)}: expected both to grow towards the stop, and the "
                f"impact force to be positive in compression; {_turned(record, one, other)}",
                refuses=True,
            )
        mass = ", or mass in [hammer]" if one == "impact_force" else ""
        through = declared.through & {one, other}
        if through and any(abs(ratio / slip - 1.0) < NEAR for slip in (1e3, 1e-3, 1e6, 1e-6, g, 1.0 / g)):
            where = " or ".join(f"{'sensitivity or ' if name in through else ''}unit in [sensors.{name}]" for name in (one, other))
            yield _slip(record, one, gives.format(other), ratio, f", a factor between units: expected one motion; correct {where}{mass}")
        for channel, partner, factor in ((one, other, ratio), (other, one, 1.0 / ratio)) if not through else ():
            if unit := mistaken_unit(channel, factor, units[channel]):
                unit += " or its time in ms" if abs(abs(ratio) * 1e-6 - 1.0) < NEAR else ""
                remedy = f"correct 'unit' in [sensors.{channel}], or 'units' of the record{mass}"
                yield _slip(
                    record, channel, gives.format(partner), factor, f", as if its numbers were in {unit}: expected one motion; {remedy}"
                )
        if one == "impact_force" and not 1.0 / FAR < ratio < FAR:
            remedy = "correct 'mass' in [hammer], which is in kg, or the unit of the load cell or of the accelerometer"
            yield _slip(record, one, "mass times deceleration", ratio, f": expected about the same; {remedy}")
    yield from _check_momentum(record, declared)


def _slip(record: Record, channel: str, given: str, factor: float, cause: str) -> Finding:
    """A channel that reads so many times what another one gives for it."""
    return Finding(f"{channel} is {factor:.2g} times {given} in record {shown(record.file)}{cause}", refuses=True)


def _check_momentum(record: Record, declared: Declared) -> Iterator[Finding]:
    """A load cell that clips or lags and a compliant stop change the ratio by less than a factor of ten, a mistaken unit by more."""
    impacts, mass = _load_cell_impacts(record), declared.mass
    channel, hammer = _hammer_response(record, impacts)
    if hammer is None or mass is None or hammer.sign >= 0 or 1.0 / FAR < (ratio := -hammer.slope * mass) < FAR:
        return
    suspect = declared.through & {channel, "impact_force"}
    factors = {} if suspect else {channel: ratio, "impact_force": 1.0 / ratio}
    units = {name: mistaken_unit(name, factor, declared.units.get(name)) for name, factor in factors.items()}
    causes = [f"{name} were in {unit}" for name, unit in units.items() if unit]
    causes += ["mass were in g"] if abs(ratio / 1e3 - 1.0) < NEAR else []
    causes += ["time were in ms"] if abs(ratio / 1e-6 - 1.0) < NEAR else []
    yield Finding(
        f"mass times the change of speed of {channel} is {ratio:.2g} times the impulse of impact_force in {hammer.impacts} impacts of "
        f"record {shown(record.file)}, {_first(record, impacts)}: expected about the same"
        f"{', as it is if ' + ' or '.join(causes) if causes else ''}; correct 'mass', which is in kg, a unit, "
        f"{'a sensitivity, ' if suspect else ''}or 'time_unit' of the record",
        refuses=bool(causes),
    )


def _turned(record: Record, one: str, other: str) -> str:
    """Which of two channels is to be turned round: the load cell, whose pushes are positive, tells; else the operator has to."""
    force = record.channels.get("impact_force")
    if force is None:
        return f"set sign = -1 in [sensors.{one}] or in [sensors.{other}]"
    rest = force - np.nanmedian(force)
    upright = np.nanmax(rest) > -np.nanmin(rest)
    return f"set sign = -1 in [sensors.{'hammer_acceleration' if upright and one.startswith(('impact', 'hammer')) else one}]"


def check_contact(record: Record, declared: Declared) -> Iterator[Finding]:
    """A drop test shows an impact, and the gap is where the hammer stands when an impact begins.

    Where no impact is felt, the hammer of a drop test comes to its gap.
    """
    if not declared.stop:
        return
    felt, u = contact_force(record), relative_displacement(record)
    if record.kind == "drop-test" and felt is not None and "impact_force" in record.channels:
        at = int(np.nanargmax(np.abs(felt[0])))
        if (largest := float(np.abs(felt[0][at]))) <= felt[1]:
            noise = record.noise["impact_force"]
            yield Finding(
                f"record {shown(record.file)} is a drop-test, and impact_force shows no impact in it (at most {largest:.3g} N, at "
                f"{_place(record, at)}, less than {CONTACT:g} times its noise of {noise:.3g} N): expected at least one; set kind = "
                '"free-decay", or check the load cell, its cable and its unit'
            )
    if u is None or not declared.zero or record.kind in ("free-decay", "prescribed"):
        return
    given, impacts = f"gap of record {shown(record.file)} is {record.gap:g} m", felt_impacts(record)
    if impacts:
        touches = u[[max(impact.first - 1, 0) for impact in impacts]]
        place = float(np.median(touches))
        if abs(record.gap - place) > max(SLIP, float(np.ptp(touches))):
            hint = _in_mm(record.gap, place)
            yield Finding(
                f"{given}, and its {len(impacts)} impacts, {_first(record, impacts)}, begin where the hammer stands at {place:.3g} m: "
                f"expected about the same; set gap = {place:.3g} (m){hint}",
                refuses=bool(hint),
            )
    elif record.kind == "drop-test":
        at = int(np.nanargmax(u))
        if record.gap - float(u[at]) > max(SLIP, float(np.ptp(u[np.isfinite(u)]))):
            hint = _in_mm(record.gap, float(u[at]))
            yield Finding(
                f"{given}, and its hammer comes no further than {float(u[at]):.3g} m, at {_place(record, at)}: expected that it "
                f"strikes in a drop-test; correct the gap, which is in m{hint}",
                refuses=bool(hint),
            )


def _in_mm(gap: float, place: float) -> str:
    """A hint where the number would be right in mm."""
    return f"; {gap:g} mm would be gap = {1e-3 * gap:g}" if gap and abs(1e-3 * gap - place) < SLIP else ""


CHECKS: tuple[Callable[[Record, Declared], Iterator[Finding]], ...]
CHECKS = (check_drive, check_directions, check_bodies, check_scales, check_contact)
"""Of one record, in the order in which the first that finds something speaks: what follows from it would only mislead."""


def first_finding(record: Record, declared: Declared) -> Finding | None:
    """What the first check that finds something says; None where a record suits its description."""
    return next((finding for check in CHECKS for finding in check(record, declared)), None)


def all_findings(record: Record, declared: Declared) -> Iterator[Finding]:
    """What is found in one record alone, before it is part of an experiment; saturation apart, which is a fact of a column."""
    first = first_finding(record, declared)
    yield from check_calibrations([record], declared.mass) if first is None else [first]
    for pair in ONE_MOTION:
        yield from (finding for _, finding in check_computed(record, pair))


def check_records(
    records: Sequence[Record],
    units: Sequence[Mapping[str, str | None]],
    sensors: Mapping[str, Sensor],
    *,
    mass: float | None,
    law: str | None,
) -> tuple[str, ...]:
    """Refuse a description that the records contradict; give sentences on one that they make unlikely and that may be right.

    `units` are declared for the channels of each record; `mass`, kg, is None where it is to be estimated; `law` is the name of the contact
    law, "none" for a rig without a stop, or None for the nominal one.

    Raises:
        ExperimentError: what is wrong, in one line, with the value that would be right where the records show it.
    """
    zero = all(sensor.zero is None for channel, sensor in sensors.items() if channel.endswith("displacement"))
    through = frozenset(channel for channel, sensor in sensors.items() if sensor.sensitivity is not None)
    doubts = []
    for record, own in zip(records, units, strict=True):
        finding = first_finding(record, Declared(units=own, through=through, mass=mass, stop=law != "none", zero=zero))
        if finding is not None and finding.refuses:
            raise ExperimentError(finding.sentence)
        doubts += [] if finding is None else [finding.sentence]
    return (*doubts, *(finding.sentence for finding in check_calibrations(records, mass)))


def check_calibrations(records: Sequence[Record], mass: float | None) -> Iterator[Finding]:
    """Channels that show one motion show it on scales that agree; a factor that is the same in all records and no unit is doubted.

    A factor within the usual error of calibrations is not reported, nor one that changes between records.
    """
    found: dict[tuple[str, str], list[float]] = {}
    for record in records:
        for one, other, ratio in scale_ratios(record, mass):
            found.setdefault((one, other), []).append(ratio)
    for (one, other), ratios in found.items():
        mean, scatter = float(np.mean(ratios)), float(np.std(ratios))
        if abs(mean - 1.0) > max(NEAR, SURE * scatter):
            expected = "mass times deceleration" if one == "impact_force" else f"what {other} gives for it"
            yield Finding(
                f"{one} is {mean:.3g} times {expected}, in {len(ratios)} record{'s' if len(ratios) > 1 else ''}: check the "
                "calibration of both; `vibrojax diagnose` tells which of them is off (gain_error)."
            )


def check_computed(record: Record, pair: tuple[str, str]) -> Iterator[tuple[str, Finding]]:
    """A channel that the logger computed from another one is no independent evidence, for its noise is that of its source.

    A prescribed motion keeps its own, and a record that was filtered is not judged. Given are the computed channel and the finding.
    """
    if _is_judged(record, pair):
        common, white = noise_coherence(*(record.channels[name] for name in pair))
        source, computed = pair if white[0] >= white[1] else pair[::-1]  # the source has the whiter noise
        if common > 0.75:  # of two sensors it is near 0
            sentence = f"{computed}: computed from {source}, whose noise it shares (coherence {common:.2f}); it is not used, because the "
            yield computed, Finding(sentence + "same measurement would count twice.")


def _is_judged(record: Record, pair: tuple[str, str]) -> bool:
    return record.kind != "prescribed" and not record.sensed and set(pair) <= record.channels.keys()


def without_computed(records: Sequence[Record]) -> list[Record]:
    """Records without their computed channels, with a notice on each.

    Of each pair of channels the longest record that can be judged comes first, the others only where that one holds a computed channel.
    """
    kept = list(records)
    for pair in ONE_MOTION:
        judged = [place for place, record in enumerate(kept) if _is_judged(record, pair)]
        longest = max(judged, key=lambda place: kept[place].time.size, default=None)
        if longest is None or next(check_computed(kept[longest], pair), None) is None:
            continue
        for place in judged:
            for computed, finding in check_computed(kept[place], pair):
                channels = {name: values for name, values in kept[place].channels.items() if name != computed}
                kept[place] = replace(kept[place], channels=channels, notices=(*kept[place].notices, finding.sentence))
    return kept


def check_saturation(time: Float64[np.ndarray, " samples"], values: Float64[np.ndarray, " samples"], channel: str) -> Iterator[Finding]:
    """A channel is not cut off at a level that nobody declared: reported and never masked, because it is a finding in itself."""
    for found in find_saturation(values):
        yield Finding(
            f"{channel}: {found.samples} samples in {found.runs} stretches lie at exactly {found.level:.6g} {si_unit(channel)}, the "
            f"{found.side} value: the channel saturates; kept as recorded. The first is sample {found.first + 1}, {time[found.first]:.6g} "
            f"s. To leave them out, declare 'range' in [sensors.{channel}]."
        )


def _load_cell_impacts(record: Record) -> list[Impact]:
    """Impacts that a load cell, and no accelerometer, shows."""
    return felt_impacts(record) if "impact_force" in record.channels else []


def _hammer_response(record: Record, impacts: list[Impact]) -> tuple[str, Response | None]:
    """The hammer's displacement, and how its speed answers to impacts; None where that is not recorded."""
    channel = next((name for name in MOTION_CHANNELS if name in record.channels), "")
    return channel, response(record, channel, impacts) if channel and impacts else None


def _first(record: Record, impacts: list[Impact]) -> str:
    """Where the first of some impacts is."""
    return f"the first at {_place(record, impacts[0].first)}"


def _place(record: Record, index: int) -> str:
    """A sample, counted from 1, and its time."""
    return f"sample {index + 1}, {record.time[index]:.6g} s"
