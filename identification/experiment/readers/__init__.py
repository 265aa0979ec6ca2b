"""Readers of record files, chosen by suffix. A format is known to the program by the import of its reader here."""

from collections.abc import Set as AbstractSet
from dataclasses import replace
from pathlib import Path, PurePath

import numpy as np

from identification.experiment.errors import ExperimentError, listed, shown
from identification.experiment.limits import LARGEST
from identification.experiment.readers.apart import APART
from identification.experiment.readers.base import AbstractReader as AbstractReader
from identification.experiment.readers.base import Columns as Columns
from identification.experiment.readers.base import Lost as Lost
from identification.experiment.readers.base import marks_of_nothing
from identification.experiment.readers.base import without as without

# isort: off
# In the order of messages.
from identification.experiment.readers.delimited import DelimitedReader as DelimitedReader
from identification.experiment.readers.delimited import ExcelReader as ExcelReader
from identification.experiment.readers.arrays import Hdf5Reader as Hdf5Reader
from identification.experiment.readers.arrays import MatReader as MatReader
from identification.experiment.readers.arrays import NpzReader as NpzReader
from identification.experiment.readers.recorder import TdmsReader as TdmsReader
from identification.experiment.readers.recorder import UffReader as UffReader
from identification.experiment.readers.recorder import Mdf4Reader as Mdf4Reader
# isort: on

READERS: tuple[AbstractReader, ...] = tuple(
    one() for name, one in vars().items() if isinstance(one, type) and issubclass(one, AbstractReader) and not name.startswith("Abstract")
)


def check_suffix(file: str) -> tuple[AbstractReader, str]:
    """The reader of a file and the suffix that chose it, by the file's name or path; upper and lower case are one.

    Example:
        >>> check_suffix("march/cart1.CSV.gz")[1]
        '.csv.gz'
    """
    by_suffix = {suffix: reader for reader in READERS for suffix in reader.suffixes}
    for suffix in sorted(by_suffix, key=len, reverse=True):
        if file.lower().endswith(suffix):
            return by_suffix[suffix], suffix
    raise ExperimentError(f"record {shown(file)} has an unknown suffix: expected one of {listed(by_suffix)}; export it to one of these")


def stem_of(file: str) -> str:
    """A record's name, its path without folder and suffix.

    Example:
        >>> stem_of("march/cart1.csv.gz")
        'cart1'
    """
    name = PurePath(file).name
    return name[: -len(check_suffix(file)[1])]


def read_columns(path: Path, wanted: AbstractSet[str], file: str) -> Columns:
    """Read the wanted columns of a record file, whatever its format.

    Args:
        path: an existing plain file.
        wanted: names of columns, as the file bears them.
        file: the record's name for messages.

    Returns:
        The file's column names and the wanted columns, float64, shape (samples,) each; NaN where a value marks that nothing was measured,
        as `lost` says.

    Raises:
        ExperimentError: the file is damaged or not as its format asks.
    """
    reader, _ = check_suffix(file)
    columns = APART.read(path, wanted, file, reader.format) if reader.apart else read_here(path, wanted, file)
    why = "is {}, a mark for no reading,"
    marked = [one for name, values in columns.values.items() for one in without(columns, name, marks_of_nothing(values), why)]
    return replace(columns, lost=(*columns.lost, *marked))


def read_here(path: Path, wanted: AbstractSet[str], file: str) -> Columns:
    """Read the wanted columns in this process, numbers that are infinite or beyond `LARGEST` as NaN; all else as for `read_columns`."""
    reader, _ = check_suffix(file)
    try:
        columns = reader.read(path, wanted)
        over = {name: np.flatnonzero(np.isinf(values)) for name, values in columns.values.items()}
        for values in columns.values.values():
            np.copyto(values, np.nan, where=~(np.abs(values) <= LARGEST))
        lost = [Lost(column=name, why="is infinite, as in an overload,", places=places) for name, places in over.items() if places.size]
        return replace(columns, lost=tuple(lost))
    except ExperimentError as error:
        raise ExperimentError(f"record {shown(file)}: {error}") from error
    except Exception as error:  # whatever a library finds wrong in a damaged file
        reason = (str(error) or type(error).__name__)[:200]
        raise ExperimentError(f"record {shown(file)} cannot be read as {reader.format} ({reason}): export it again") from error
