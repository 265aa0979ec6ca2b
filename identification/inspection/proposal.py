"""A proposal of an experiment file for inspected files, to be completed and checked."""

from pathlib import Path

from identification.experiment.channels import CHANNELS, TIME, example, is_stand_in, output_of, same_unit, si_unit
from identification.experiment.errors import listed
from identification.experiment.readers import stem_of
from identification.inspection.columns import ANGULAR, Mapped
from identification.inspection.inspect import Inspected, Inspection
from vibrojax.errors import printable

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


def propose(inspection: Inspection, folder: Path) -> str:
    """An experiment file for inspected files, as TOML text; `folder` is where it shall lie, the files are named relative to it.

    With mass and gaps filled in it loads, if at least one file has a channel and sound time stamps.
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
    angle, channels = any(each.unit in ANGULAR for each in mapped), {each.channel for each in mapped}
    moment = " of the moment of inertia, kg m^2" if angle else ""
    hammer = WEIGHED
    if stopless and (angle or "applied_force" not in channels):  # a moment of inertia is seldom known
        hammer = (ESTIMATED if "applied_force" in channels else ANY).format(moment=moment)
    return [hammer, BEARING if angle else SPRING, *([NO_STOP] if stopless else [])]


def _reason(one: Inspected, inspection: Inspection) -> str:
    """Why a file cannot be a record; empty where it can."""
    if one.found.problem:
        return one.found.problem
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
    if each.column.noise is not None:
        lines.append(f"# noise = {each.column.noise * each.factor:.2g} # {si}; left out, it is estimated from each record: this is {file}")
    if each.column.saturation:
        ends = sorted(found.level * each.factor for found in each.column.saturation)
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
        "gap = 100.0 # no stop" if stopless else "# gap = 0.0 # TO FILL IN: m, clearance between hammer and stop at rest as it was set",
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
        means = _braces(dict.fromkeys(off, "constant"))
        lines.append(f"detrend = {means} # guess: far from 0 beside the swing; remove it, and zero, where the rig rests at 0")
    taken = {each.column.name for each in one.mapped}
    left = [_text(column.name) for column in found.columns if column.name not in taken]
    if not one.mapped:  # each line by itself, since a table within braces stands whole
        lines += [f"columns.{channel} = {_text(name)} # guess" for channel, name in names.items()]
        lines += [f"# columns.hammer_displacement = {name} # TO FILL IN: or another channel, where it is one" for name in left]
    elif names:
        lines.append(f"columns = {_braces(names)} # guess")
    if one.mapped and left:
        lines.append(
            f"# not taken for a channel: {', '.join(left)}; name what is one in columns = {{ CHANNEL = ... }}, with a [sensors.CHANNEL]"
        )
    units = {each.channel: each.unit for each in one.mapped if _differs(each, sensors[each.channel])}
    unknown = [each.channel for each in one.mapped if each.unknown and each.column.in_file]
    if unknown:
        text = _braces({channel: si_unit(channel) for channel in unknown})
        lines.append(f"# units = {text} # TO FILL IN: the units of this file's numbers, whose own statement is not known")
    if units:
        lines.append(f"units = {_braces(units)} # of this file's numbers")
    if found.untimed:
        return "\n".join(lines) + "\n"
    if found.clock.stretch is not None:
        lines.append(f"stretch = {found.clock.stretch} # guess: the longest between the instants at which the clock steps back")
    if found.clock.rebuild:
        lines.append("rebuild_time = true # guess: stamps repeat; give the sampling_frequency (Hz) beside it where it is known")
    elif one.uneven:
        lines.append(f"# rebuild_time = true # {one.uneven}: where the samples came evenly, and only their stamps vary")
    if found.time_guessed:
        lines.append(f"time_unit = {_text(found.time_unit)} # guess: {found.time_guessed}; is {found.rate:.4g} Hz right?")
    elif found.time_factor != 1.0 and not found.time.in_file:
        lines.append(f"time_unit = {_text(found.time.unit)}")
    return "\n".join(lines) + "\n"


def _differs(each: Mapped, declared: Mapped) -> bool:
    """Whether a file's unit is not the declared one, or the file states one that is not to be believed."""
    if each.unknown or (each.guessed and not each.column.in_file):
        return False
    stated = each.column.in_file and not same_unit(each.column.unit, each.unit, each.dimension)
    return stated or (each.factor != declared.factor and (not each.is_output or each.column.in_file))


def _braces(values: dict[str, str]) -> str:
    """A TOML table in one line."""
    return f"{{ {', '.join(f'{key} = {_text(value)}' for key, value in values.items())} }}"


def _text(value: str) -> str:
    """A TOML string."""
    escaped = (each if each.isprintable() else f"\\U{ord(each):08x}" for each in value.replace("\\", "\\\\").replace('"', '\\"'))
    return f'"{"".join(escaped)}"'
