"""Formats of laboratory recorders that are known by name but cannot be read yet."""

from collections.abc import Set as AbstractSet
from pathlib import Path

from identification.experiment.errors import ExperimentError, shown
from identification.experiment.readers.base import AbstractReader, Columns


class UnavailableReader(AbstractReader):
    """Says that a recorder's own format has no reader yet."""

    suffixes = (".tdms", ".unv", ".uff")
    format = "recorder file"

    def read(self, path: Path, wanted: AbstractSet[str]) -> Columns:
        """Refuse the file.

        Raises:
            ExperimentError: always.
        """
        raise ExperimentError(
            f"{shown(path.suffix)} files need the 'labdata' reader, which is not there yet: "
            "expected .csv, .csv.gz, .h5, .mat or .npz; export the record to one of these"
        )
