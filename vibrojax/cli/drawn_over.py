"""What a study's figure shows over its own results: borders over a map, branches over sweeps, manifolds over basins."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from vibrojax.errors import InputError


@dataclasses.dataclass(frozen=True, kw_only=True)
class Over:
    """What is asked for by options; nothing where left out.

    Attributes:
        borders: of a Peterka map, the `borders.csv` of `vibrojax continue --along`.
        branches: of a bifurcation diagram, tables of `vibrojax continue`.
        manifolds: of basins, cycles of the longest saddle orbit whose manifolds are drawn.
    """

    borders: Path | None = None
    branches: Sequence[Path] = ()
    manifolds: int | None = None

    def check(self, jobs: Sequence[Any]) -> None:
        """Refuse what cannot be drawn over the studies, before they are made.

        Raises:
            InputError: several diagrams for branches of one rig, files that are no branches, or basins that have no manifolds
                (`basin_manifolds.checked_rig`).
        """
        if self.branches and len(jobs) > 1:
            raise InputError(f"--branches is given with {len(jobs)} diagrams: expected one, that of the branches; give one value of each")
        if self.branches:
            from vibrojax.studies.continuation_lines import read_branches

            read_branches(self.branches, jobs[0].settings["parameter"])
        if self.manifolds is not None:
            from vibrojax.studies.basin_manifolds import checked_rig

            for job in jobs:
                checked_rig(job.model, self.manifolds, job.axes["u0"], job.axes["v0"], job.settings)

    def drawn(self, data: Any, model: Any, say: Callable[[str], None]) -> Any:
        """The study with what is drawn over it."""
        if self.borders is not None:
            from vibrojax.studies.continuation_lines import with_borders

            data = with_borders(data, model, self.borders)
        if self.branches:
            from vibrojax.studies.continuation_lines import with_branches

            data = with_branches(data, self.branches)
        if self.manifolds is not None:
            from vibrojax.studies.basin_manifolds import with_manifolds

            data = with_manifolds(data, model, self.manifolds, say)
        return data


NOTHING_OVER = Over()
