"""Raw layouts of recordings made by others: one function each, from a file of the data set to columns.

A raw reader knows the layout of one data set and nothing else: it returns columns under names and in units of its choice, which the
recipe's `experiment.toml` then declares.

To add one: write a function of the type `RawReader`, which ends with `_part`, then list it in `RAW_READERS`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.constants import g as STANDARD_GRAVITY
from scipy.io import loadmat
from scipy.signal import savgol_filter

from vibrojax.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Cut:
    """One record of a recipe: a stretch of a raw file.

    Attributes:
        file: name of the record, as in the experiment file.
        source: raw file, relative to the data set's folder.
        start: first instant, s, on the raw file's clock.
        stop: last instant, s.
        options: what else the raw reader needs to know, and `every`: one sample of so many is kept.
    """

    file: str
    source: str
    start: float
    stop: float
    options: Mapping[str, Any]


RawReader = Callable[[Path, Cut], dict[str, np.ndarray]]
"""From the data set's folder and a cut to columns of equal length, `time` (s, from 0) among them."""


def _part(cut: Cut, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The part of a file's columns, on its own clock, that a cut names; its time begins at 0."""
    time = columns["time"]
    kept = np.flatnonzero((time >= cut.start) & (time <= cut.stop))[:: cut.options.get("every", 1)]
    if not kept.size:
        raise InputError(f"{cut.source} has no sample between {cut.start:g} and {cut.stop:g} s: correct start and stop of the record")
    return {name: values[kept] for name, values in columns.items()} | {"time": time[kept] - time[kept[0]]}


MARKERS = ("a X", "b X")


def air_track(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """Two riders on an air track, seen by motion-capture cameras.

    Returns:
        `closing`, mm, the distance of the two riders along the track, negative so that it grows while they approach; NaN where a marker was
        lost (the cell is empty, no number, or exactly zero).

    Raises:
        InputError: the file is no table of the two riders' markers.
    """
    rows = [[cell.strip() for cell in line.split("\t")] for line in (folder / cut.source).read_text(encoding="latin-1").splitlines()]
    header = next((row for row, cells in enumerate(rows) if set(MARKERS) <= set(cells)), None)
    if header is None:
        raise InputError(f"{cut.source} has no line with the columns {', '.join(MARKERS)}: expected a table of the two riders' markers")
    places = [rows[header].index(marker) for marker in MARKERS]
    first, second = np.array([[_coordinate(cells, place) for place in places] for cells in rows[header + 1 :]]).T
    hertz = 500.0
    return _part(cut, {"time": np.arange(len(first)) / hertz, "closing": -np.abs(first - second)})


def _coordinate(cells: list[str], place: int) -> float:
    """A coordinate; NaN where the cameras lost the marker."""
    try:
        return float(cells[place]) or np.nan
    except (IndexError, ValueError):
        return np.nan


STEP_S = 2e-5
AXIAL = 1
"""Row of the accelerometer that points along the spring."""


def cyberdiver(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A two-mass impactor with a programmed spring between its nose and its body.

    In free fall, before the nose meets the water, spring and accelerometer read zero; what they do read there, on average over the
    option `rest` (s, s), is taken off. The nose has no accelerometer: its acceleration is the body's less the second derivative of
    the compression, by local quartics over 1 ms to either side. An accelerometer feels no gravity, so neither does a model that it
    drives. Option `run`: name of the run.

    Returns:
        `compression` of the spring, mm; accelerations `body`, as its accelerometer reads it, and `nose`, m/s^2.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        compression = 1e-3 * archive[f"{cut.options['run']}/pos_um"].astype(float)
        body = 16.0 / 2**15 * STANDARD_GRAVITY * archive[f"{cut.options['run']}/acc_counts"][AXIAL].astype(float)
        begin = 1e-6 * float(archive[f"{cut.options['run']}/t0_us"])
    time = begin + STEP_S * np.arange(len(compression))
    first, last = cut.options["rest"]
    rest = (time >= first) & (time <= last)
    compression, body = compression - compression[rest].mean(), body - body[rest].mean()
    curvature = 1e-3 * savgol_filter(compression, 101, 4, deriv=2, delta=STEP_S)
    return _part(cut, {"time": time, "compression": compression, "body": body, "nose": body - curvature})


def free_swing(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """The arm of a rotary inverted pendulum swinging freely, with a magnetic encoder.

    The first line of a file names the numbers of the second: angle of the trigger, sampling rate, duration. One angle a line follows.

    Returns:
        `angle` from the encoder's zero, degrees.
    """
    _, rate, _ = np.loadtxt(folder / cut.source, delimiter=",", skiprows=1, max_rows=1)
    angle = np.loadtxt(folder / cut.source, skiprows=2)
    return _part(cut, {"time": np.arange(len(angle)) / rate, "angle": angle})


def friction_backlash(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A friction damper that a testing machine moves to and fro; option `test`: name of the test.

    Returns:
        `stroke`, in; `force`, kip, positive while it resists a motion towards positive stroke.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        time, stroke, force = archive[cut.options["test"]].astype(float).T[:3]
    return _part(cut, {"time": time, "stroke": stroke, "force": force})


PCB_HZ = 51_200.0


def pcb_shock(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A printed circuit board on a drop table; option `test`: name of the test.

    Returns:
        Accelerations `table` and `board` around one hit, m/s^2, each less its mean before it.
    """
    with np.load(folder / cut.source, allow_pickle=False) as archive:
        both = archive[cut.options["test"]].astype(float)
    both -= both[:900].mean(axis=0)  # before the table hits
    return _part(cut, {"time": np.arange(len(both)) / PCB_HZ, "table": both[:, 0], "board": both[:, 1]})


def pendulum(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A pendulum arm on its bearing, with an encoder.

    A file holds one free swing, as the recorder's structure `Theta1`, or segments that follow each other, those meant to be fitted, then
    those meant for validation; the second row of these, the angular rate, is derived and not used.

    Returns:
        `angle` from hanging, rad.
    """
    archive = loadmat(folder / cut.source)
    if "Theta1" in archive:
        swing = archive["Theta1"][0, 0]
        time, angle = swing["time"].ravel(), swing["signals"][0, 0]["values"].ravel()
    else:
        time = np.concatenate([each[0].ravel() for name in ("Time_id", "Time_vad") for each in archive[name]])
        angle = np.concatenate([each[0][0] for name in ("Y_id", "Y_vad") for each in archive[name]])
    return _part(cut, {"time": time.astype(float), "angle": angle.astype(float) - np.pi})


SILVERBOX_HZ = 1e7 / 2**14


def silverbox(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """An electronic circuit that behaves as a mass on a spring.

    Returns:
        `input` and `output`, V, each less its mean over the whole file, as the authors advise.
    """
    archive = loadmat(folder / cut.source, variable_names=["V1", "V2"])
    drive, response = (archive[name].ravel().astype(float) for name in ("V1", "V2"))
    time = np.arange(len(drive)) / SILVERBOX_HZ
    return _part(cut, {"time": time, "input": drive - drive.mean(), "output": response - response.mean()})


def table(folder: Path, cut: Cut) -> dict[str, np.ndarray]:
    """A comma-separated table with a header, one column a channel: under the names of the header, in the units of the file.

    Raises:
        InputError: there is no column `time`.
    """
    columns = np.genfromtxt(folder / cut.source, delimiter=",", names=True, deletechars="", replace_space=" ")
    names = columns.dtype.names or ()
    if "time" not in names:
        raise InputError(f"{cut.source} has the columns {', '.join(names)}: expected one of the name time, in s")
    return _part(cut, {name: columns[name] for name in names})


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
