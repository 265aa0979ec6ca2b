"""Raw layouts of recordings made by others: one function each, from a file of the data set to columns."""

from pathlib import Path

import numpy as np
from scipy.io import loadmat
from scipy.signal import savgol_filter

from identification.recipes.base import Cut, RawReader
from vibrojax.errors import InputError

AIR_TRACK_HZ = 500.0
MARKERS = ("a X", "b X")
STEP_S = 2e-5
ACCELERATION_PER_COUNT = 16.0 / 32768.0 * 9.80665
AXIAL = 1
"""Row of the accelerometer that points along the spring."""
HALF_WINDOW = 50
"""Samples on either side of the local quartics that differentiate the displacement twice: 1 ms."""
TIME, STROKE, FORCE = 0, 1, 2
"""Columns of a test."""
PCB_HZ = 51_200.0
QUIET = 900
"""First samples, before the table hits, whose mean is what the amplifiers read at rest."""
_PARTS = (("Time_id", "Y_id"), ("Time_vad", "Y_vad"))
"""Fields of the file of segments: those meant to be fitted, then those meant for validation; one recording in all."""
_SWING = "Theta1"
"""Field of the file of one free swing."""
SILVERBOX_HZ = 1e7 / 2**14


def air_track(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Two riders on an air track, seen by motion-capture cameras.

    Distance of the two riders along the track, negative so that it grows while they approach.

    Args:
        folder: of the data set.
        cut: which file, and which part of it.

    Returns:
        `time`, s, and `closing`, mm; NaN where a marker was lost (the cell is empty, no number, or exactly zero).

    Raises:
        InputError: the file is no table of the two riders' markers.
    """
    lines = (folder / cut.source).read_text(encoding="latin-1").splitlines()
    header = next((row for row, line in enumerate(lines) if set(MARKERS) <= set(_cells(line))), None)
    if header is None:
        raise InputError(f"{cut.source} has no line with the columns {', '.join(MARKERS)}: expected a table of the two riders' markers")
    places = [_cells(lines[header]).index(marker) for marker in MARKERS]
    table = np.array([[_number(cells, place) for place in places] for cells in map(_cells, lines[header + 1 :])])
    time = np.arange(len(table)) / AIR_TRACK_HZ
    kept = (time >= cut.start) & (time <= cut.stop)
    return {"time": time[kept] - cut.start, "closing": -np.abs(table[kept, 0] - table[kept, 1])}


def _cells(line: str) -> list[str]:
    return [cell.strip() for cell in line.split("\t")]


def _number(cells: list[str], place: int) -> float:
    """A coordinate; NaN where the cameras lost the marker."""
    try:
        return float(cells[place]) or np.nan
    except (IndexError, ValueError):
        return np.nan


def cyberdiver(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A two-mass impactor with a programmed spring between its nose and its body.

    Compression of the spring, acceleration of the body as its accelerometer reads it, and that of the nose.

    In free fall, before the nose meets the water, spring and accelerometer read zero; what they do read there, on average over the
    option `rest` (s, s), is taken off. The nose has no accelerometer: its acceleration is the body's less the second derivative of
    the compression. An accelerometer feels no gravity, so neither does a model that it drives.

    Args:
        folder: of the data set.
        cut: which file and part; options `run` (name of the run), `rest` (two instants, s) and `every` (samples kept: every how many).

    Returns:
        `time`, s; `compression`, mm; `body` and `nose`, m/s^2.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        compression = 1e-3 * archive[f"{cut.options['run']}/pos_um"].astype(float)
        body = ACCELERATION_PER_COUNT * archive[f"{cut.options['run']}/acc_counts"][AXIAL].astype(float)
        begin = 1e-6 * float(archive[f"{cut.options['run']}/t0_us"])
    time = begin + STEP_S * np.arange(len(compression))
    first, last = cut.options["rest"]
    rest = (time >= first) & (time <= last)
    compression, body = compression - compression[rest].mean(), body - body[rest].mean()
    curvature = 1e-3 * savgol_filter(compression, 2 * HALF_WINDOW + 1, 4, deriv=2, delta=STEP_S)
    kept = np.flatnonzero((time >= cut.start) & (time <= cut.stop))[:: cut.options["every"]]
    return {
        "time": time[kept] - time[kept[0]],
        "compression": compression[kept],
        "body": body[kept],
        "nose": (body - curvature)[kept],
    }


def free_swing(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """The arm of a rotary inverted pendulum swinging freely, with a magnetic encoder.

    Angle from the encoder's zero.

    The first line of a file names the numbers of the second: angle of the trigger, sampling rate, duration. One angle a line follows.

    Args:
        folder: of the data set.
        cut: which file and part, from the file's first sample.

    Returns:
        `time`, s, and `angle`, degrees.
    """
    _, rate, _ = np.loadtxt(folder / cut.source, delimiter=",", skiprows=1, max_rows=1)
    angle = np.loadtxt(folder / cut.source, skiprows=2)
    time = np.arange(len(angle)) / rate
    kept = (time >= cut.start) & (time <= cut.stop)
    return {"time": time[kept] - time[kept][0], "angle": angle[kept]}


def friction_backlash(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A friction damper that a testing machine moves to and fro.

    Stroke and force of one test.

    Args:
        folder: of the data set.
        cut: which file and part; options `test` (name of the test) and `every` (samples kept: every how many).

    Returns:
        `time`, s; `stroke`, in; `force`, kip, positive while it resists a motion towards positive stroke.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        table = archive[cut.options["test"]].astype(float)
    kept = np.flatnonzero((table[:, TIME] >= cut.start) & (table[:, TIME] <= cut.stop))[:: cut.options["every"]]
    return {"time": table[kept, TIME] - table[kept[0], TIME], "stroke": table[kept, STROKE], "force": table[kept, FORCE]}


def pcb_shock(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A printed circuit board on a drop table: accelerations of table and board.

    Accelerations around one hit, each less its mean before it.

    Args:
        folder: of the data set.
        cut: which file and part; option `test` (name of the test).

    Returns:
        `time`, s; `table` and `board`, m/s^2.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        both = archive[cut.options["test"]].astype(float)
    both -= both[:QUIET].mean(axis=0)
    time = np.arange(len(both)) / PCB_HZ
    kept = (time >= cut.start) & (time <= cut.stop)
    return {"time": time[kept] - time[kept][0], "table": both[kept, 0], "board": both[kept, 1]}


def pendulum(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A pendulum arm on its bearing, with an encoder.

    Angle from hanging.

    Args:
        folder: of the data set.
        cut: which file and part, on the file's own clock; option `every` (samples kept: every how many).

    Returns:
        `time`, s, and `angle`, rad.
    """
    archive = loadmat(folder / cut.source)
    time, angle = _swing(archive) if _SWING in archive else _segments(archive)
    kept = np.flatnonzero((time >= cut.start) & (time <= cut.stop))[:: cut.options["every"]]
    return {"time": time[kept] - time[kept[0]], "angle": angle[kept] - np.pi}


def _segments(archive: dict) -> tuple[np.ndarray, np.ndarray]:
    """Time and angle of all segments, which follow each other; the second row, angular rate, is derived and not used."""
    times = [each[0].ravel() for clock, _ in _PARTS for each in archive[clock]]
    angles = [each[0][0] for _, values in _PARTS for each in archive[values]]
    return np.concatenate(times).astype(float), np.concatenate(angles).astype(float)


def _swing(archive: dict) -> tuple[np.ndarray, np.ndarray]:
    """Time and angle as the recorder's structure holds them."""
    record = archive[_SWING][0, 0]
    values = record["signals"][0, 0]["values"]
    return record["time"].ravel().astype(float), values.ravel().astype(float)


def silverbox(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """An electronic circuit that behaves as a mass on a spring.

    Input and output voltage, each less its mean over the whole file, as the authors advise.

    Args:
        folder: of the data set.
        cut: which file, and which part of it.

    Returns:
        `time`, s; `input` and `output`, V.
    """
    archive = loadmat(folder / cut.source, variable_names=["V1", "V2"])
    drive, response = (archive[name].ravel().astype(float) for name in ("V1", "V2"))
    time = np.arange(len(drive)) / SILVERBOX_HZ
    kept = (time >= cut.start) & (time <= cut.stop)
    return {
        "time": time[kept] - time[kept][0],
        "input": (drive - drive.mean())[kept],
        "output": (response - response.mean())[kept],
    }


def table(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A comma-separated table with a header, one column a channel.

    Columns under the names of the header, in the units of the file.

    Args:
        folder: of the data set.
        cut: which file and part, on the file's own clock.

    Returns:
        `time`, s, and every other column.

    Raises:
        InputError: there is no column `time`, or no sample in that part.
    """
    table = np.genfromtxt(folder / cut.source, delimiter=",", names=True, deletechars="", replace_space=" ")
    names = table.dtype.names or ()
    if "time" not in names:
        raise InputError(f"{cut.source} has the columns {', '.join(names)}: expected one of the name time, in s")
    kept = (table["time"] >= cut.start) & (table["time"] <= cut.stop)
    if not kept.any():
        raise InputError(f"{cut.source} has no sample between {cut.start:g} and {cut.stop:g} s: correct start and stop of the record")
    columns = {name: table[name][kept] for name in names}
    return columns | {"time": columns["time"] - columns["time"][0]}


RAW_READERS: dict[str, RawReader] = {
    "air-track": air_track,
    "cyberdiver": cyberdiver,
    "free-swing": free_swing,
    "friction-backlash": friction_backlash,
    "pcb-shock": pcb_shock,
    "pendulum": pendulum,
    "silverbox": silverbox,
    "table": table,
}
"""By the name that a `recipe.toml` gives as its reader."""
