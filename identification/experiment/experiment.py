"""An experiment: the rig as the operator described it, and its records."""

from dataclasses import dataclass, field, replace
from pathlib import Path

from identification.experiment.record import Record
from identification.experiment.rig import Load, ParameterOption, Suspension
from identification.experiment.sensor import Sensor


@dataclass(frozen=True, kw_only=True, eq=False)
class Experiment:
    """Everything that an experiment folder says.

    Attributes:
        name: as declared, else the folder's name.
        folder: where it was read.
        mass: of the hammer, kg, above 0.
        mass_is_known: False where the mass was not weighed and is to be estimated, `mass` being the first guess.
        suspension: how the hammer hangs.
        load: constant forces on the hammer that are known.
        law: name of the contact law the operator chose, not checked here; None for the nominal one.
        parameters: what the operator wants of single parameters, by name.
        sensors: by channel.
        records: at least one, in the order of the file.
        sha256: of the experiment file's bytes, hexadecimal.
        warnings: sentences on what is odd about the experiment and may be right.
    """

    name: str
    folder: Path
    mass: float
    suspension: Suspension
    records: tuple[Record, ...]
    sha256: str
    mass_is_known: bool = True
    load: Load = Load()
    law: str | None = None
    parameters: dict[str, ParameterOption] = field(default_factory=dict)
    sensors: dict[str, Sensor] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    @property
    def fitting(self) -> "Experiment":
        """The experiment without its held-back records: what a fit may see."""
        return replace(self, records=tuple(record for record in self.records if not record.held_back))

    @property
    def only_decays(self) -> bool:
        """Whether nothing but free decays was recorded, which have no impact."""
        return all(record.kind == "free-decay" for record in self.records)

    @property
    def held_back(self) -> tuple[Record, ...]:
        """Records that no fit may see."""
        return tuple(record for record in self.records if record.held_back)
