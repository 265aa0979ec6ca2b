"""What a figure is about, in one line: the rig, the record, its gap and its drive."""

from identification.experiment import Experiment
from identification.report.rows import recorded
from identification.result.result import RecordFit
from identification.wording.numbers import significant

_UNDRIVEN = {"drop-test": "drop test", "free-decay": "free decay"}


def subject(experiment: Experiment, records: tuple[RecordFit, ...], file: str | None) -> str:
    """The line below a figure.

    Args:
        experiment: names the rig.
        records: of the fit.
        file: of the one record that the figure shows; None where it shows all.
    """
    if file is None:
        return f"{experiment.name}; {len(records)} {'record' if len(records) == 1 else 'records'}"
    record = next(one for one in records if one.file == file)
    gap = f"gap {significant(1e3 * record.gap, 4)} mm"
    return "; ".join((experiment.name, file, gap, drive(record, experiment)))


def drive(record: RecordFit, experiment: Experiment) -> str:
    """How the rig was driven: "drive 6.5 Hz", "free decay", "drop test", or "drive as recorded"."""
    read = recorded(record, experiment)
    if read is not None and read.excitation_frequency is not None:
        return f"drive {significant(read.excitation_frequency, 4)} Hz"
    return _UNDRIVEN.get(record.kind, "drive as recorded")
