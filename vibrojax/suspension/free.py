"""No suspension at all."""

from typing import ClassVar

from vibrojax.parameters import Parameter
from vibrojax.suspension.base import AbstractSuspension, Scalars


class Free(AbstractSuspension):
    """u'' = drive: a body that moves freely between impacts, such as a rider on an air track."""

    name: ClassVar[str] = "free"
    parameters: ClassVar[tuple[Parameter, ...]] = ()

    def acceleration(self, u: Scalars, v: Scalars, drive: Scalars) -> Scalars:
        """Relative acceleration, m/s^2."""
        return drive
