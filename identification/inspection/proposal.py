"""An experiment file: a template with every key, and a proposal for inspected files that is to be completed and checked."""

from pathlib import Path

from identification.experiment.channels import CHANNELS, TIME, example, is_stand_in, output_of, same_unit, si_unit
from identification.experiment.errors import listed
from identification.experiment.readers import stem_of
from identification.inspection.columns import Mapped, is_angle
from identification.inspection.inspect import Inspected, Inspection
from vibrojax.errors import printable

TEMPLATE = """\
# An experiment: one rig, and the records that were made with it. Put the recorded files beside this file.
# Numbers in this file are SI. "# text" is a remark; "#key = value", without a blank, is a setting that is switched off: take the "#" away.

schema = 1 # version of this format

[experiment]
#name = "rig-B, March" # for the report; left out, the folder's name

[hammer]
mass = 0.4 # kg, weighed with everything that moves with it
#estimate_mass = true # mass is a first guess only and is estimated; needs a force channel

# Constant forces on the hammer that are known; left out, there are none. Both are positive towards the stop.
#[rig]
#incline = "5 deg" # of the rail to the horizontal: the hammer is pulled by m g sin(incline) towards a stop that lies downhill
#constant_force = "0.2 N" # a weight on a string, a known preload

[suspension]
kind = "linear" # spring and damper; "pendulum" (wires), "pivot" (bearing, any angle) and "free" (no spring, no damper) are the others
#kind = "pendulum" # instead of the line above
#length = 0.09 # m: length of a pendulum's wires, or radius at which the displacement of a pivot is measured

[contact]
#law = "hunt-crossley" # contact law to fit; this one is taken when nothing is said

# One table for each parameter of which something is to be said: k_i, n, lambda_i, zeta, f_n or a parameter of the chosen law.
#[parameters.n]
#start = 1.5 # first guess, in the parameter's own unit
#fixed = true # hold the parameter at its start
#bounds = [1.2, 1.8] # lowest and highest value of the fit; left out, the usual range
#prior = { mean = 1.5, std = 0.05 } # what is known beside these records: a normal distribution
#varies = true # a value for each record about a common mean; how much they differ is estimated

# One table for each channel that was recorded; leave out what was not. Any channel but the time may be missing.
# unit:  of the recorded numbers, converted on reading: m mm um cm in mil ft, m/s^2 g, N kN mN lbf kip kgf. A file that states the unit
#        itself (.tdms, .unv, .uff, .mf4) needs none; where both say it, they must agree.
# sensitivity: of a sensor whose output was recorded, in V, mV or mA, from its calibration sheet: "11.2 mV/N", "100 mV/g", "0.8 V/mm".
#        The unit is then that of the output, left out where it is that of the sensitivity.
# sign: -1 where the sensor is mounted the other way round; its readings are multiplied by it.
# noise: standard deviation of the sensor in SI, whatever the unit; left out, it is estimated from each record.
# range: lowest and highest value in SI that the sensor can show; samples at or beyond it are left out.
# zero: standard deviation in SI of a constant that the channel may be off by; one is then estimated in every record. Left out: none.

# highpass, lowpass: of the sensor or its amplifier, where it is known: the model's readings pass it too. Left out: none.

# A filter of the recorder that is known and acts on all channels; the model's readings pass it, and nothing of it is estimated.
#[recorder]
#lowpass = { type = "butterworth", order = 4, corner = 1100.0 } # Hz

[sensors.hammer_displacement] # m, absolute; grows towards the stop
unit = "mm"
#sign = -1
#noise = 1.0e-5 # m
#range = [-0.01, 0.01] # m
#zero = 1.0e-4 # m

[sensors.cart_displacement] # m, absolute; same direction
unit = "mm"

[sensors.impact_force] # N, what the load cell behind the stop reads, positive in compression
unit = "N"
#highpass = { time_constant = 0.8 } # s, of a piezoelectric cell; or { type = "butterworth", order = 1, corner = 0.2 } (Hz)

#[sensors.relative_displacement] # m, hammer minus cart, where only their distance was measured
#unit = "mm"

#[sensors.hammer_acceleration] # m/s^2, absolute; same direction as the displacement
#sensitivity = "100 mV/g" # of a file in mV; a file in g or m/s^2 has a unit in its place

#[sensors.cart_acceleration] # m/s^2
#unit = "m/s^2"

#[sensors.applied_force] # N, drives the hammer in records of kind "forced"
#unit = "N"

#[sensors.reaction_force] # N, what suspension and stop resist with in records of kind "prescribed"
#unit = "N"

# One table for each record. Text files hold a header line with the columns' names, or one of units below it, and one line for each sample.
# file: .csv .tsv .txt .lvm (also .gz) .h5 .mat .npz, and with the extra "labdata" .tdms .unv .uff .mf4; relative to this folder
# kind: "drop-test"        cart at rest, hammer released, strikes the stop
#       "cart-excitation"  cart moves as a sine
#       "free-decay"       cart at rest, no contact
#       "forced"           cart at rest, a recorded force drives the hammer (channel applied_force)
#       "prescribed"       the hammer follows a recorded motion, and a force is compared
# gap:  clearance between hammer and stop at rest, m, as it was set; a small setting error is estimated

[[record]]
file = "drop.csv"
kind = "drop-test"
gap = 0.0

[[record]]
file = "cart1.csv"
kind = "cart-excitation"
gap = 0.001
excitation_frequency = 6.25 # Hz, as set, or "375 rpm"; amplitude and phase of the cart are estimated
#base = "measured" # "sine", or "measured" where the recorded cart motion is to drive the model
#held_back = true # never fitted: it is predicted, as a test of the fit
#columns = { time = "t", hammer_displacement = "LVDT 2 [mm]" } # channel = column, where a column does not bear the channel's name
#units = { cart_displacement = "um" } # of the numbers in this file, where neither the file nor the sensor's table is right
#mask = [[0.8, 0.9]] # s, stretches that are left out of every channel
#missing = -9999 # a value, or a list of them, that stands for no reading, in the file's own unit
#rebuild_time = true # the samples came evenly, and their stamps do not: even time, at sampling_frequency where it is given
#stretch = 1 # of a clock that steps back: which of the stretches is used, from 1
#drop_bad_time = true # leave out samples without a time stamp, or with that of the sample before
#crop = [0.2, 2.5] # s, first and last instant that are used, on the file's own clock
#lowpass = 500.0 # Hz: a low-pass without phase on every channel; far above one over the duration of a contact
#decimate = 4 # keep one sample of so many, behind an anti-alias filter
#resample = 2000.0 # Hz, instead of decimate: another rate, or even steps where those of the file are not
#detrend = { hammer_acceleration = "constant" } # take the mean ("constant") or a straight line ("linear") out of a channel
#time_unit = "ms" # of the time column: s, ms, us, min; left out, what the file states, else s
# The following are used by `vibrojax simulate`; a fit estimates them.
#base_amplitude = 0.002 # A0, m
#base_phase = 0.0 # rad: y = A0 sin(2 pi f t + base_phase)
#initial_displacement = -0.003 # m, hammer minus cart
#initial_velocity = 0.0 # m/s, hammer minus cart
#duration = 2.0 # s; with sampling_frequency it takes the place of a file that is not there
#sampling_frequency = 4000.0 # Hz
"""


def template() -> str:
    """TOML text that describes two records, whose files must be put beside it."""
    return TEMPLATE


HEAD = """\
# Proposed from the recorded files. Fill in the lines that say TO FILL IN (take the "#" away), and check every guess.
# Numbers in this file are SI; `vibrojax new` writes a template with all that can be said.

schema = 1

[experiment]
name = {name}

"""
WEIGHED = """\
[hammer]
# mass = 0.4 # TO FILL IN: kg, weighed with everything that moves with it
"""
ESTIMATED = """\
[hammer]
mass = 1.0 # guess: a first value{moment}, estimated from the applied force; weighed, put it here and take the next line out
estimate_mass = true
"""
ANY = """\
[hammer]
mass = 1.0 # without a force or an impact it moves nothing{moment}
"""
SPRING = """\
[suspension]
kind = "linear" # guess: or "pendulum" with length = ... (m), "pivot" with length, "free"
"""
BEARING = """\
[suspension]
kind = "pivot" # guess: an angle is recorded
length = 1.0 # m: so that the arc is the angle in rad, mass the moment of inertia in kg m^2, and forces are moments in N m
"""
NO_STOP = """\
[contact]
law = "none" # guess: no record shows an impact; take it out where there is a stop, and set every kind and gap
"""
UNKNOWN = """\
# [sensors.hammer_displacement] # TO FILL IN: such a table for every channel that a record names in 'columns'
# unit = "m"{outputs}
"""
FAR_GAP = 100.0
"""m: of a record without a stop."""


def propose(inspection: Inspection, folder: Path) -> str:
    """Write an experiment file for inspected files.

    Args:
        inspection: from `inspect_path`.
        folder: where the experiment file shall lie; the files are named relative to it.

    Returns:
        TOML text. With mass and gaps filled in it loads, if at least one file has a channel and sound time stamps.
    """
    usable = [one for one in inspection.files if _reason(one, inspection) == ""]
    sensors: dict[str, tuple[Mapped, Inspected]] = {}
    for one in usable:
        for each in one.mapped:
            if each.channel not in sensors or _certainty(each) > _certainty(sensors[each.channel][0]):
                sensors[each.channel] = each, one
    stopless = bool(usable) and all(one.mapped and one.guess.kind in ("free-decay", "forced") and not one.guess.impacts for one in usable)
    parts = [
        HEAD.format(name=_text(inspection.folder.resolve().name or "experiment")),
        *_rig([each for each, _ in sensors.values()], stopless),
    ]
    turned = any(one.turned for one in usable)
    parts += [
        _sensor(*sensors[channel], turned=turned and channel == "impact_force", stopless=stopless)
        for channel in CHANNELS
        if channel in sensors
    ]
    if unknown := [column for one in usable if not one.mapped for column in one.found.columns]:
        outputs = [f"{printable(column.name)} in {printable(column.unit)}" for column in unknown if output_of(column.unit)]
        hint = f' # in its place give the sensitivity of each sensor, such as "11.2 mV/N", for {listed(outputs)}' if outputs else ""
        parts.append(UNKNOWN.format(outputs=hint))
    parts += [
        _record(one, inspection, folder, {channel: each for channel, (each, _) in sensors.items()}, stopless) for one in inspection.files
    ]
    parts += [f"# {printable(name)} is left out: {printable(reason)}\n" for name, reason in inspection.failed.items()]
    return "\n".join(parts)


def _rig(mapped: list[Mapped], stopless: bool) -> list[str]:
    """The tables on the hammer, its suspension and its stop."""
    angle, channels = any(map(is_angle, mapped)), {each.channel for each in mapped}
    moment = " of the moment of inertia, kg m^2" if angle else ""
    hammer = WEIGHED
    if stopless and (angle or "applied_force" not in channels):  # a moment of inertia is seldom known
        hammer = (ESTIMATED if "applied_force" in channels else ANY).format(moment=moment)
    return [hammer, BEARING if angle else SPRING, *([NO_STOP] if stopless else [])]


def _reason(one: Inspected, inspection: Inspection) -> str:
    """Why a file cannot be a record; empty where it can."""
    if one.time.problem:
        return one.time.problem
    stem = stem_of(one.found.file)
    twin = next(other for other in inspection.files if stem_of(other.found.file) == stem)
    return "" if twin is one else f"{printable(twin.found.file)} has the same name but for its suffix; rename one"


def _certainty(each: Mapped) -> int:
    """A stated unit beats a guess, and a guess with a reason beats one without."""
    return 2 if not each.guessed else int(each.unit != si_unit(each.channel))


def _sensor(each: Mapped, one: Inspected, *, turned: bool, stopless: bool) -> str:
    """The table of a channel, as its first record has it; `turned` where impacts read as pulls, `stopless` where no gap has a zero."""
    file = printable(one.found.file)
    unit = f"# guess: {each.guessed}" if each.guessed else f"# as {file} states"
    sign = ["sign = -1 # guess: it falls in impacts, and a load cell has to rise in compression"] if turned else []
    if each.is_output:
        return "\n".join([f"[sensors.{each.channel}]", *_output(each, file), *sign]) + "\n"
    line = f'unit = "{each.unit}" {unit}'
    if each.unknown:
        line = f'# unit = "{each.unit}" # TO FILL IN: the unit of the numbers in {file}, for {each.guessed}'
    lines = [f"[sensors.{each.channel}]", line, *sign]
    si = si_unit(each.channel)
    if stopless and each.zero:
        why = f"how uncertain the zero of {file} is; every record's is estimated"
        known = f"zero = {each.zero * each.factor:.2g} # guess, {si}: {why}"
        lines.append(f"# zero = {each.zero:.2g} # TO FILL IN: this, of the file's unit, in {si}: {why}" if each.unknown else known)
    if each.unknown:
        return "\n".join(lines) + "\n"
    facts = next(facts for facts in one.columns if facts.column == each.column.name)
    if facts.noise is not None:
        lines.append(f"# noise = {facts.noise * each.factor:.2g} # {si}; left out, it is estimated from each record: this is {file}")
    if facts.saturation:
        ends = sorted(found.level * each.factor for found in facts.saturation)
        low, high = (-ends[0], ends[0]) if len(ends) == 1 and ends[0] > 0 else (ends[0], ends[-1] if len(ends) > 1 else -ends[0])
        lines.append(f"# range = [{low:.6g}, {high:.6g}] # {si}; {file} seems to saturate: samples beyond are then left out")
    return "\n".join(lines) + "\n"


def _output(each: Mapped, file: str) -> list[str]:
    """What a sensor needs whose output was recorded."""
    said = f"from its calibration sheet, for {file} is in {each.unit}"
    lines = [f'# sensitivity = "{example(CHANNELS[each.channel], each.unit)}" # TO FILL IN: {said}']
    if is_stand_in(each.unit) and CHANNELS[each.channel] != "acceleration":
        lines.append(f'# unit = "{each.unit}" # in its place, where the volt stands for the quantity itself, as in an electronic analogue')
    return lines


def _record(one: Inspected, inspection: Inspection, folder: Path, sensors: dict[str, Mapped], stopless: bool) -> str:
    """The table of a record; a comment where the file cannot be one."""
    found, guess = one.found, one.guess
    reason = _reason(one, inspection)
    if reason:
        return f"# {printable(found.file)} is left out: {printable(reason)}\n"
    file = (inspection.folder / found.file).resolve().relative_to(folder.resolve()).as_posix()
    lines = [
        "[[record]]",
        f"file = {_text(file)}",
        f'kind = "{guess.kind}" # guess: {guess.why}',
        f"gap = {FAR_GAP} # no stop"
        if stopless
        else "# gap = 0.0 # TO FILL IN: m, clearance between hammer and stop at rest as it was set",
    ]
    if found.untimed:
        lines.append("# sampling_frequency = 1000.0 # TO FILL IN: Hz; the file has no time stamps")
        lines += ["# excitation_frequency = 6.25 # TO FILL IN: Hz, as set"] if guess.sine is not None else []
    elif guess.sine is not None:
        lines.append(f"excitation_frequency = {guess.sine.rounded!r} # guess, Hz: from the cart's periodogram; put the set value here")
    if guess.measured:
        lines.append('base = "measured" # guess: the recorded cart motion drives the model')
    names = {each.channel: each.column.name for each in one.mapped if not each.exact}
    names |= {TIME: found.time.name} if found.time.name not in (TIME, "") else {}
    if off := [each.channel for each in one.mapped if stopless and each.zero]:
        means = ", ".join(f'{channel} = "constant"' for channel in off)
        lines.append(f"detrend = {{ {means} }} # guess: far from 0 beside the swing; remove it, and zero, where the rig rests at 0")
    taken = {each.column.name for each in one.mapped}
    left = [_text(column.name) for column in found.columns if column.name not in taken]
    if not one.mapped:  # each line by itself, since a table within braces stands whole
        lines += [f"columns.{channel} = {_text(name)} # guess" for channel, name in names.items()]
        lines += [f"# columns.hammer_displacement = {name} # TO FILL IN: or another channel, where it is one" for name in left]
    elif names:
        lines.append(f"columns = {{ {', '.join(f'{channel} = {_text(name)}' for channel, name in names.items())} }} # guess")
    if one.mapped and left:
        lines.append(
            f"# not taken for a channel: {', '.join(left)}; name what is one in columns = {{ CHANNEL = ... }}, with a [sensors.CHANNEL]"
        )
    units = {each.channel: each.unit for each in one.mapped if _differs(each, sensors[each.channel])}
    unknown = [each.channel for each in one.mapped if each.unknown and each.column.in_file]
    if unknown:
        text = ", ".join(f'{channel} = "{si_unit(channel)}"' for channel in unknown)
        lines.append(f"# units = {{ {text} }} # TO FILL IN: the units of this file's numbers, whose own statement is not known")
    if units:
        lines.append(f"units = {{ {', '.join(f'{channel} = {_text(unit)}' for channel, unit in units.items())} }} # of this file's numbers")
    if found.untimed:
        return "\n".join(lines) + "\n"
    if found.clock.stretch is not None:
        lines.append(f"stretch = {found.clock.stretch} # guess: the longest between the instants at which the clock steps back")
    if found.clock.rebuild:
        lines.append("rebuild_time = true # guess: stamps repeat; give the sampling_frequency (Hz) beside it where it is known")
    elif one.uneven:
        lines.append(f"# rebuild_time = true # {one.uneven}: where the samples came evenly, and only their stamps vary")
    if found.time_guessed:
        lines.append(f"time_unit = {_text(found.time_unit)} # guess: {found.time_guessed}; is {one.time.rate:.4g} Hz right?")
    elif found.time_factor != 1.0 and not found.time.in_file:
        lines.append(f"time_unit = {_text(found.time.unit)}")
    return "\n".join(lines) + "\n"


def _differs(each: Mapped, declared: Mapped) -> bool:
    """Whether a file's unit is not the declared one, or the file states one that is not to be believed."""
    if each.unknown or (each.guessed and not each.column.in_file):
        return False
    stated = each.column.in_file and not same_unit(each.column.unit, each.unit, each.dimension)
    return stated or (each.factor != declared.factor and (not each.is_output or each.column.in_file))


def _text(value: str) -> str:
    """A TOML string."""
    escaped = (each if each.isprintable() else f"\\U{ord(each):08x}" for each in value.replace("\\", "\\\\").replace('"', '\\"'))
    return f'"{"".join(escaped)}"'
