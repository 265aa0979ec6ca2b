"""What the draws of a fit leave of a study: quantiles of its numbers, probabilities of its kinds of motion."""

import json
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from vibrojax.integrate.base import SUCCESS
from vibrojax.studies.base import APERIODIC, CHAOS, NO_IMPACT, PERIODIC
from vibrojax.studies.job import Job

LEVELS = (0.025, 0.25, 0.5, 0.75, 0.975)
"""Quantiles: median, and the middle 50 % and 95 %."""


class Share(NamedTuple):
    """A question whose answer is yes or no at every point of every draw."""

    name: str
    meaning: str
    holds: Callable[[xr.Dataset], xr.DataArray]


class Summary(NamedTuple):
    """What is kept of a study."""

    quantiles: tuple[str, ...]
    """Variables, over all draws that were integrated."""
    shares: tuple[Share, ...] = ()
    only: Callable[[xr.Dataset], xr.DataArray] | None = None
    """Where quantiles are taken; None: wherever the integration went through."""
    prepared: Callable[[xr.Dataset], xr.Dataset] = lambda data: data
    """Before all else: what has no quantiles is made into what has."""


def _is_first(data: xr.Dataset) -> xr.DataArray:
    return (data["kind"] == PERIODIC) & (data["impacts"] == 1) & (data["period"] == 1)


def _is_chaotic(data: xr.Dataset) -> xr.DataArray:
    return (data["kind"] == APERIODIC) & (data["lyapunov"].fillna(0.0) > CHAOS)


def _envelope(data: xr.Dataset) -> xr.Dataset:
    """Of a sweep in each draw: lowest and highest section point, largest force, and jumps."""
    named = {"lowest": data["displacement"].min("cycle"), "highest": data["displacement"].max("cycle")}
    parts = {f"displacement_{name}": part.assign_attrs(units="m", long_name=f"{name} section point") for name, part in named.items()}
    force = data["impact_force"].max("cycle").assign_attrs(units="N", long_name="largest impact force")
    return data[["jump", "result", "kind"]].assign(parts | {"impact_force": force})


def _shares_of_initial_states(data: xr.Dataset) -> xr.Dataset:
    """The basin's measure in each draw."""
    share = data["impacting"].where(data["impacting"] >= 0).mean(["u0", "v0"])
    return data.assign(basin_measure=share.assign_attrs(units="1", long_name="share of the initial states that keeps impacting"))


_IMPACT = Share("probability_impact", "probability of a motion with impacts", lambda data: data["kind"] != NO_IMPACT)
_FIRST = Share("probability_1_1", "probability of z = 1/1", _is_first)
_FORCE = ("impact_force", "force_over_weight")
SUMMARIES = {
    "response": Summary((*_FORCE, "displacement"), (_IMPACT, _FIRST)),
    "bifurcation": Summary(
        ("displacement_lowest", "displacement_highest", "impact_force"),
        (Share("probability_jump", "probability of a jump on the way to this value", lambda data: data["jump"] == 1),),
        prepared=_envelope,
    ),
    "peterka": Summary(_FORCE, (_FIRST, _IMPACT, Share("probability_chaos", "probability of chaos", _is_chaotic)), only=_is_first),
    "section": Summary(("u", "v", "impact_force", "hammer_acceleration")),
    "basins": Summary(
        ("basin_measure",),
        (Share("probability_impacting", "probability that the motion keeps impacting", lambda data: data["impacting"] == 1),),
        prepared=_shares_of_initial_states,
    ),
    "lyapunov": Summary(("exponent",), (Share("probability_chaos", "probability of chaos", lambda data: data["exponent"] > CHAOS),)),
    "design": Summary(("impact_force",), (_IMPACT, _FIRST)),
}
"""By study."""


def summary(job: Job, data: xr.Dataset) -> xr.Dataset:
    """Reduce the axis `draw`.

    Arguments:
        job: the study, with draws.
        data: of all draws, on the axis `draw` and the study's own.

    Returns:
        Its numbers on the axis `quantile` and the study's own axes, its probabilities on the latter, and the drawn parameter values
        `drawn` on the axes (`draw`, `parameter`). Draws that could not be integrated at a point do not count there; a Peterka map's
        forces are those of z = 1/1 alone, as in its figure, NaN where no draw has that.
    """
    assert job.draws is not None
    how = SUMMARIES[job.study]
    if job.kind.is_sweep:  # what can only be said of all tiles together is said draw by draw
        data = stacked([job.kind.whole(data.isel(draw=number)).expand_dims("draw") for number in range(data.sizes["draw"])])
    data = how.prepared(data)
    through = data["result"] == SUCCESS if "result" in data else xr.DataArray(np.ones(data.sizes["draw"], bool), dims="draw")
    counted = through if how.only is None else how.only(data) & through
    found: dict[str, xr.DataArray] = {}
    for name in how.quantiles:
        part = data[name]
        found[name] = _quantiles(part.where(counted) if set(counted.dims) <= set(part.dims) else part).assign_attrs(part.attrs)
    for share in how.shares:
        found[share.name] = share.holds(data).astype(float).where(through).mean("draw").assign_attrs(units="1", long_name=share.meaning)
    drawn = xr.DataArray(job.draws.values, dims=("draw", "drawn_parameter"), attrs={"units": "SI", "long_name": "drawn parameter values"})
    attrs = {name: value for name, value in data.attrs.items() if name != "seconds"} | {
        "draws": len(job.draws.values),
        "seed": job.draws.seed,
        "drawn_parameters": json.dumps(job.draws.names),
    }
    attrs["title"] = f"{data.attrs['title']}, {len(job.draws.values)} draws of the fit"
    coords = {name: part for name, part in data.coords.items() if "draw" not in part.dims and name != "draw"}
    result = xr.Dataset(found | {"drawn": drawn}, coords, attrs)
    return result.assign_coords(quantile=("quantile", list(LEVELS), {"units": "1", "long_name": "quantile over the draws"}))


def _quantiles(part: xr.DataArray) -> xr.DataArray:
    """Over the draws; NaN only where no draw counts."""
    missing = part.isnull().all("draw")
    return part.where(~missing, 0.0).quantile(LEVELS, dim="draw", skipna=True).where(~missing)


def stacked(each: list[xr.Dataset]) -> xr.Dataset:
    """Data sets of one draw each, one behind the other; coordinates and attributes are those of the first."""
    how: Any = {"data_vars": "all", "coords": "minimal", "compat": "override", "join": "override", "combine_attrs": "override"}
    return xr.concat(each, "draw", **how)
