"""From an experiment folder to an experiment."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path, PurePosixPath

from identification.experiment.channels import CHANNELS, MOTION_CHANNELS
from identification.experiment.checks import check_records, without_computed
from identification.experiment.errors import ExperimentError, check_printable, listed, shown
from identification.experiment.experiment import Experiment, Record
from identification.experiment.load_record import load_record
from identification.experiment.noise import with_noise
from identification.experiment.readers import stem_of
from identification.experiment.settings import (
    RecordSettings,
    read_filters,
    read_load,
    read_parameters,
    read_record_settings,
    read_sensors,
    read_suspension,
)
from identification.experiment.toml_file import Table, find_experiment_file, parse_toml

SCHEMA = 1
TABLES = ("experiment", "hammer", "rig", "suspension", "contact", "parameters", "sensors", "recorder")


def load_experiment(path: str | PathLike[str], *, need_files: bool = True) -> Experiment:
    """Read an experiment and all its records.

    Args:
        path: a folder with `experiment.toml`, or such a file.
        need_files: False, for simulation, lets a record go without its file if it gives `duration` and `sampling_frequency`, or without
            channels; where the file is there, its time stamps are used.

    Returns:
        The experiment, SI throughout; what was found odd stands in the notices of the records.

    Raises:
        ExperimentError: the experiment cannot be used as it stands; the message is one line.

    Example:
        >>> load_experiment("nowhere")
        Traceback (most recent call last):
        identification.experiment.errors.ExperimentError: nowhere does not exist: expected an experiment's folder or its \
experiment.toml; check the path
    """
    file = find_experiment_file(Path(path))
    values, digest = parse_toml(file)
    top = Table(values=values, where=file.name)
    top.allow("schema", *TABLES, "record")
    if (schema := values.get("schema")) is None:
        raise ExperimentError(f"schema is missing in {file.name}: expected {SCHEMA}; add a first line 'schema = {SCHEMA}'")
    if isinstance(schema, bool) or schema != SCHEMA:
        raise ExperimentError(f"schema in {file.name} is {shown(schema)}: expected {SCHEMA}; correct it, or update the program")
    tables = {key: top.table(key, f"[{key}]") for key in TABLES}
    for key, known in {"experiment": ("name",), "hammer": ("mass", "estimate_mass"), "contact": ("law",)}.items():
        tables[key].allow(*known)
    mass = tables["hammer"].needed_number("mass", unit="kg", positive=True)
    suspension = read_suspension(tables["suspension"])
    sensors = read_sensors(tables["sensors"])
    settings = _record_settings(values.get("record"), file.name, to_fit=need_files)
    records = without_computed([load_record(each, file.parent, sensors, need_file=need_files) for each in settings])
    mass_is_known = not tables["hammer"].flag("estimate_mass")
    if need_files:
        check_fittable(records, mass_is_known=mass_is_known)
    records = with_noise(records, sensors, needed=need_files)
    law = tables["contact"].string("law")
    measured = {channel: sensor for channel, sensor in sensors.items() if sensor.sensitivity is None}
    units = [dict.fromkeys(sensors) | {name: each.units.get(name, one.unit) for name, one in measured.items()} for each in settings]
    warnings = check_records(records, units, sensors, mass=mass if mass_is_known else None, law=law) if need_files else ()
    return Experiment(
        name=check_printable(tables["experiment"].string("name") or file.parent.resolve().name, "the name of the experiment"),
        folder=file.parent,
        mass=mass,
        mass_is_known=mass_is_known,
        suspension=suspension,
        load=read_load(tables["rig"], suspension),
        law=law,
        parameters=read_parameters(tables["parameters"]),
        sensors=sensors,
        filters=read_filters(tables["recorder"], tables["sensors"]),
        records=records,
        warnings=warnings,
        sha256=digest,
    )


def _record_settings(tables: object, name: str, *, to_fit: bool) -> list[RecordSettings]:
    """Check all `[[record]]` tables, and that no two of them mean one file or would write one result file."""
    if isinstance(tables, dict):
        raise ExperimentError(f"[record] in {name} is a single table: expected one for each record; write [[record]]")
    if not isinstance(tables, list) or not tables:
        raise ExperimentError(f"{name} has no record: expected at least one table [[record]] with file, kind and gap; add it")
    numbered = ((number, table) for number, table in enumerate(tables, start=1) if isinstance(table, dict))
    without = [str(table.get("file", number)) for number, table in numbered if "gap" not in table]
    if len(without) > 1:  # a proposed file lacks them all, and one message for each would be one run for each
        raise ExperimentError(
            f"gap is missing in {len(without)} records of {name} ({listed(without)}): expected a finite number in m; "
            "add a line 'gap = …' to each"
        )
    settings = [read_record_settings(values, number) for number, values in enumerate(tables, start=1)]
    if to_fit and all(each.record.held_back for each in settings):
        raise ExperimentError(f"every record of {name} is held back: expected at least one to fit; set held_back = false there")
    files: dict[PurePosixPath, RecordSettings] = {}
    stems: dict[str, RecordSettings] = {}
    for each in settings:
        if files.setdefault(PurePosixPath(each.record.file), each) is not each:
            raise ExperimentError(f"{each.where} is there twice: expected every file once; remove one of the two tables")
        if (earlier := stems.setdefault(stem_of(each.record.file), each)) is not each:
            raise ExperimentError(
                f"{each.where} and {earlier.where} have one name but for folder or suffix: expected different names, "
                "because results bear them; rename one"
            )
    return settings


_MOTION = (*MOTION_CHANNELS, "hammer_acceleration")


def check_fittable(records: Sequence[Record], *, mass_is_known: bool) -> None:
    """Refuse records that no fit can use: without the hammer's motion, or without a force where the mass is estimated."""
    for record in records:
        if not record.channels.keys() & set(_MOTION):
            raise ExperimentError(
                f"record {shown(record.file)} shows no motion of the hammer, only {listed(record.channels)}: expected one of "
                f"{listed(_MOTION)}; add its table [sensors.…] and name its column in 'columns' of the record"
            )
    forces = [channel for channel, dimension in CHANNELS.items() if dimension == "force"]
    held = {channel for record in records if not record.held_back for channel in record.channels}
    if not mass_is_known and not held & set(forces):
        raise ExperimentError(
            f"the mass is to be estimated, and no fitted record holds a force: expected one of {listed(forces)}, since motion alone "
            "identifies only ratios to the mass; weigh the hammer and remove 'estimate_mass'"
        )
