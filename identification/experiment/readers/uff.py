"""Universal files: data sets 58 (functions at nodal degrees of freedom), text or binary."""

from collections.abc import Set as AbstractSet
from pathlib import Path
from typing import Any

import numpy as np

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.limits import text_limit
from identification.experiment.readers.base import AbstractReader, Columns
from identification.experiment.readers.recorder import RecorderChannel, load_library, silenced, stated, to_columns

LIBRARY = "pyuff"
FUNCTION, DELIMITER = 58, b"    -1"
TAIL_BYTES = 200
TIME_RESPONSES = (0, 1)
"""Function types: unknown, and time response."""
TIME_AXES = (0, 1, 17)
"""Specific data types of an abscissa: unknown, general, and time."""
DIRECTIONS = {0: "", 1: "+X", -1: "-X", 2: "+Y", -2: "-Y", 3: "+Z", -3: "-Z", 4: "+RX", -4: "-RX", 5: "+RY", -5: "-RY", 6: "+RZ", -6: "-RZ"}


class UffReader(AbstractReader):
    """Reads time responses.

    A channel bears the first ID line, or its node and direction ("12+Z") where ID lines are empty or repeat, or "dataset 3". Unit: the
    label of the ordinate's units. Time: the abscissa, evenly or unevenly spaced, in the unit of its label.
    """

    suffixes = (".unv", ".uff")
    format = "universal file"
    apart = True
    library = LIBRARY

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Read the wanted columns; arguments, result and errors as for every reader."""
        library = load_library(LIBRARY, "universal (.unv, .uff)")
        _check_end(path)
        with silenced(LIBRARY):
            file = library.UFF(str(path))
            places = [place for place, kind in enumerate(file.get_set_types()) if kind == FUNCTION]
            heads = [file.read_sets(place, header_only=True) for place in places]
            names = _names(heads)
            channels = [_channel(file, place, head, name) for place, head, name in zip(places, heads, names, strict=True)]
            return to_columns(channels, wanted, path.stat().st_size)


def _check_end(path: Path) -> None:
    """Every data set ends with a line "-1"; a file that was cut off does not."""
    size = path.stat().st_size
    if size > text_limit(size):
        raise ExperimentError(f"the file has {size} bytes: expected at most {text_limit(size)}; cut or decimate the record")
    with path.open("rb") as stream:
        stream.seek(max(0, size - TAIL_BYTES))
        tail = stream.read()
    if not tail.rstrip().endswith(DELIMITER):
        raise ExperimentError("the file does not end with a line '    -1': expected a complete universal file; copy or export it again")


def _names(heads: list[dict[str, Any]]) -> list[str]:
    """The first way of naming that gives every data set a name of its own."""
    by_text = [str(head["id1"]).strip() for head in heads]
    by_place = [f"{head['rsp_node']}{DIRECTIONS.get(head['rsp_dir'], '')}" for head in heads]
    for names in (by_text, by_place):
        if all(stated(name) for name in names) and len(set(names)) == len(names):
            return names
    return [f"dataset {number}" for number in range(1, len(heads) + 1)]


def _channel(file: Any, place: int, head: dict[str, Any], name: str) -> RecorderChannel:
    """Describe a data set; it is read once, when either its samples or its time stamps are asked for."""
    data: dict[str, np.ndarray] = {}

    def loaded(key: str) -> np.ndarray:
        if not data:
            if head["func_type"] not in TIME_RESPONSES or head["abscissa_spec_data_type"] not in TIME_AXES:
                raise ExperimentError(
                    f"data set {shown(name)} is of function type {head['func_type']} over an abscissa of type "
                    f"{head['abscissa_spec_data_type']}: expected a time response (1) over time (17); export the time histories"
                )
            whole = file.read_sets(place)
            if len(whole["data"]) != head["num_pts"]:
                raise ExperimentError(
                    f"data set {shown(name)} holds {len(whole['data'])} samples and announces {head['num_pts']}: "
                    "the file is damaged, export it again"
                )
            data.update(x=whole["x"], data=whole["data"])
        return data[key]

    return RecorderChannel(
        name=name,
        unit=str(head["ordinate_axis_units_lab"]),
        samples=int(head["num_pts"]),
        read=lambda: loaded("data"),
        time=lambda: loaded("x"),
        time_unit=str(head["abscissa_axis_units_lab"]),
    )
