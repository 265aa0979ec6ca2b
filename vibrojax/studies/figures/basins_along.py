"""Shares of the attractors along a parameter, stacked."""

import json

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from vibrojax.drawing import new_figure
from vibrojax.studies.figures.base import label, setting
from vibrojax.studies.figures.basins import colours_of

_FAINT = "#606060"


def draw(data: xr.Dataset) -> Figure:
    """A band for each attractor, as high as its share of the initial states, in the order in which they appear."""
    parameter = setting(data, "parameter")
    table = json.loads(data.attrs["attractors"])
    shares = np.nan_to_num(data["share"].values)
    p, q = data["attractor_impacts"].values, data["attractor_period"].values
    best = shares.argmax(axis=0)
    motions = [
        (int(p[place, number]), int(q[place, number]), _motion(one)) for number, (place, one) in enumerate(zip(best, table, strict=True))
    ]
    figure = new_figure(3.8, layout="constrained")
    axes = figure.subplots()
    values = data[parameter].values
    names = [" then ".join(list(dict.fromkeys(one["motions"]))[:3]) for one in table]
    axes.stackplot(values, *(100 * shares.T), colors=colours_of(motions), labels=names, edgecolor=_FAINT, lw=0.4, step="mid")
    axes.set(xlabel=label(data, parameter), ylabel="share of the initial states (%)", ylim=(0, 100), xlim=(values[0], values[-1]))
    axes.grid(False)
    figure.legend(loc="outside lower center", ncols=3, handlelength=1.2)
    return figure


def _motion(one: dict) -> str:
    """What an attractor is for most of its way."""
    return max(one["motions"], key=one["motions"].count)
