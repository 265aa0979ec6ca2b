"""A study as plain data, cut into tiles.

One idea carries long studies: a study on part of its axes is that part of the study. So the axes of a job are cut into blocks, each block
(a tile) is made by the very function that makes the whole, anywhere and in any order, and put where it belongs. Sweeps alone have an
order: each stretch goes on from the state in which the one before ended. Draws of the model's parameters are one more axis.
"""

import dataclasses
import itertools
import math
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import jax
import numpy as np
import xarray as xr

from vibrojax import __version__
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.model_file import model_document
from vibrojax.studies.basins import measured, states, with_basin_measure
from vibrojax.studies.basins_along import matched
from vibrojax.studies.bifurcation import DIRECTIONS, increasing, sweep, with_jumps
from vibrojax.studies.coexistence import of_map, with_coexistence
from vibrojax.studies.draws import Draws
from vibrojax.studies.finding import with_finding
from vibrojax.studies.force_curves import frequency_response, hammer_design
from vibrojax.studies.lyapunov import lyapunov
from vibrojax.studies.peterka import peterka
from vibrojax.studies.section import section

FORMAT = 4
"""Of the settings and variables of a store; one of another format is refused."""


class Study(NamedTuple):
    """How one study is made, and cut."""

    part: Callable[..., xr.Dataset]
    """The study on the axes that it is given."""
    axes: tuple[str, ...]
    """Those of its arguments that hold values along axes."""
    points: int = 1024
    """Operating points in a tile, unless the job says otherwise."""
    whole: Callable[[xr.Dataset], xr.Dataset] = lambda data: data
    """What can only be said of all tiles together."""
    after: Callable[[Model, xr.Dataset], xr.Dataset] = lambda model, data: data
    """What needs the model once more when the whole is known."""
    is_sweep: bool = False
    rises: bool = False
    """Whether `values` must increase; those of a sweep must."""
    threads: bool = True
    """Whether `part` takes a number of threads."""
    of_draws: Mapping[str, Any] = {}
    """Further arguments where draws are compared, which then have their axes in common."""


STUDIES = {
    "response": Study(frequency_response, ("gap", "frequency_hz"), after=with_coexistence),
    "bifurcation": Study(sweep, ("direction", "values"), 16, with_jumps, with_coexistence, is_sweep=True, threads=False),
    "peterka": Study(peterka, ("clearance", "ratio"), 40_000, after=of_map),
    "section": Study(section, (), after=with_coexistence, threads=False, of_draws={"even": True}),
    "basins": Study(states, ("v0", "u0"), whole=measured, after=with_finding),
    "basins_along": Study(states, ("values", "v0", "u0"), whole=with_basin_measure, after=matched, rises=True),
    "lyapunov": Study(lyapunov, ("values",)),
    "design": Study(hammer_design, ("frequency_hz", "mass_ratio")),
}
"""By the name of the command."""


class Tile(NamedTuple):
    """One block of a study."""

    number: int
    draw: int | None
    parts: dict[str, slice]
    """Along each axis, by the argument that holds its values."""
    after: int | None
    """Number of the tile in whose last state it begins."""


@dataclasses.dataclass(frozen=True, kw_only=True)
class Job:
    """Everything that the answer of a study depends on.

    Attributes:
        study: a key of `STUDIES`.
        model: the rig.
        axes: values by argument, for each of the study's axes; "direction" of a sweep may be left out.
        settings: its other arguments.
        draws: sets of parameter values, each of which makes the study once; None for the model's own.
        points: operating points in a tile; by default the study's own.

    Example:
        >>> from vibrojax.contact import Newton
        >>> from vibrojax.suspension import Linear
        >>> rig = Model(mass=1.0, suspension=Linear(0.02, 4.0), law=Newton(0.8))
        >>> job = Job(study="peterka", model=rig, axes={"clearance": [0.0, 1.0], "ratio": [1.0, 2.0, 3.0]}, settings={}, points=2)
        >>> [tile.parts["ratio"].indices(3)[:2] for tile in tiles(job)]
        [(0, 2), (2, 3), (0, 2), (2, 3)]
    """

    study: str
    model: Model
    axes: Mapping[str, Any]
    settings: Mapping[str, Any]
    draws: Draws | None = None
    points: int | None = None

    def __post_init__(self) -> None:
        given = dict(self.axes)
        if self.kind.is_sweep or self.kind.rises:
            increasing(self.settings["parameter"], given["values"])
        if self.kind.is_sweep:
            given.setdefault("direction", DIRECTIONS)
        if self.points is not None and self.points < 1:
            raise InputError(f"{self.points} operating points in a tile: expected at least 1; correct it")
        arrays = {name: np.atleast_1d(np.asarray(given[name])) for name in self.kind.axes}
        object.__setattr__(self, "axes", arrays)

    @property
    def kind(self) -> Study:
        """How the study is made, and cut."""
        return STUDIES[self.study]

    def dim(self, axis: str) -> str:
        """Name in the data set of the axis whose values an argument holds."""
        return self.settings["parameter"] if axis == "values" else axis

    @property
    def lanes(self) -> int:
        """Operating points in all, over all draws."""
        return math.prod(len(values) for values in self.axes.values()) * (1 if self.draws is None else len(self.draws.values))

    def size(self, tile: Tile) -> int:
        """Operating points of a tile."""
        return math.prod(len(self.axes[name][part]) for name, part in tile.parts.items())

    def blocks(self) -> dict[str, int]:
        """Length of a tile along each axis: the last axis as long as it may be, then the one before."""
        room, found = self.points or self.kind.points, {}
        for name, values in list(self.axes.items())[::-1]:
            found[name] = 1 if name == "direction" else min(len(values), max(room, 1))
            room //= found[name]
        return {name: found[name] for name in self.axes}

    def document(self) -> dict[str, Any]:
        """The job as JSON can hold it; two jobs with the same document have the same answer."""
        settings = {name: dataclasses.asdict(value) if dataclasses.is_dataclass(value) else value for name, value in self.settings.items()}  # type: ignore[arg-type]
        precision = "float64" if jax.config.jax_enable_x64 else "float32"  # type: ignore[attr-defined]
        return {
            "format": FORMAT,
            "study": self.study,
            "model": {name: part for name, part in model_document(self.model).items() if name != "provenance"},
            "axes": {name: values.tolist() for name, values in self.axes.items()},
            "settings": settings,
            "draws": None if self.draws is None else self.draws.document(),
            "tile": self.blocks(),
            "versions": {"vibrojax": __version__, "jax": jax.__version__, "precision": precision},
        }


def tiles(job: Job) -> list[Tile]:
    """The tiles of a job, each behind the one that it needs."""
    blocks = job.blocks()
    along = [
        [slice(i, min(i + blocks[name], len(values))) for i in range(0, len(values), blocks[name])] for name, values in job.axes.items()
    ]
    found: list[Tile] = []
    for draw in [None] if job.draws is None else range(len(job.draws.values)):
        if not job.kind.is_sweep:
            found += [
                Tile(len(found) + i, draw, dict(zip(job.axes, parts, strict=True)), None)
                for i, parts in enumerate(itertools.product(*along))
            ]
            continue
        for way, direction in zip(along[0], job.axes["direction"], strict=True):
            stretches = along[1] if direction == "up" else along[1][::-1]
            for i, part in enumerate(stretches):
                found.append(Tile(len(found), draw, {"direction": way, "values": part}, len(found) - 1 if i else None))
    return found


def evaluate(job: Job, tile: Tile, *, before: np.ndarray | None = None, threads: int | None = None) -> xr.Dataset:
    """One tile.

    Arguments:
        job: the study.
        tile: of it.
        before: of a sweep, its `state` at the value that was met before.
        threads: chunks of lanes at a time; by default one a core.
    """
    model = job.model if job.draws is None or tile.draw is None else job.draws.model(job.model, tile.draw)
    parts = {name: values[tile.parts[name]] for name, values in job.axes.items()}
    if job.kind.is_sweep:
        parts |= {"direction": tuple(parts["direction"].tolist()), "before": before}
    more = ({"threads": threads} if job.kind.threads else {}) | ({} if job.draws is None else dict(job.kind.of_draws))
    return job.kind.part(model, **parts, **job.settings, **more)


def everything(job: Job, draw: int | None) -> xr.Dataset:
    """The whole study of one draw at once."""
    return evaluate(job, Tile(0, draw, {name: slice(None) for name in job.axes}, None))
