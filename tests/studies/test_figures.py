"""No figure leaves a curve out; on data sets made by hand."""

import numpy as np
import pytest
import xarray as xr

from vibrojax.drawing import COLOURS, style
from vibrojax.studies.figures import FIGURES, UNCERTAIN
from vibrojax.studies.quantiles import LEVELS

UNITS = {"gap": "m", "frequency_hz": "Hz", "mass_ratio": "1"}
AXES = {"response": ("gap", "frequency_hz"), "design": ("frequency_hz", "mass_ratio")}


def made(name: str, curves: int, *, uncertain: bool = False) -> xr.Dataset:
    """A study of so many curves."""
    along = dict(zip(AXES[name], (np.linspace(1e-3, 2e-3, curves), np.linspace(1.0, 2.0, 5)), strict=True))
    sizes = {axis: len(values) for axis, values in along.items()}
    force = np.add.outer(np.arange(1.0, curves + 1.0), np.linspace(0.0, 0.5, 5))
    if uncertain:
        sizes, force = {"quantile": len(LEVELS)} | sizes, np.add.outer(np.linspace(-0.1, 0.1, len(LEVELS)), force)
    variables = {each: (tuple(sizes), force) for each in ("impact_force", "force_over_weight")}
    variables["probability_1_1"] = (tuple(along), np.full((curves, 5), 0.5))
    data = xr.Dataset(variables, along, {"draws": 100})
    for axis in along:
        data[axis].attrs.update(units=UNITS[axis], long_name=axis)
    return data


@pytest.mark.parametrize("uncertain", [False, True])
@pytest.mark.parametrize("count", [1, len(COLOURS), len(COLOURS) + 1, 30])
@pytest.mark.parametrize("name", AXES)
def test_every_curve_is_drawn_in_its_own_colour_and_explained(name, count, uncertain):
    data = made(name, count, uncertain=uncertain)
    with style():
        figure = (UNCERTAIN if uncertain else FIGURES)[name](data)
        figure.canvas.draw()
    top = figure.axes[0]
    assert len(top.lines) == count
    assert len({str(line.get_color()) for line in top.lines}) == count
    drawn = sorted(float(line.get_ydata()[0]) for line in top.lines)
    np.testing.assert_allclose(drawn, np.arange(1.0, count + 1.0))
    legend, bars = top.get_legend(), [axes for axes in figure.axes if f"{count} curves" in axes.get_ylabel()]
    if count <= len(COLOURS):
        assert len(legend.get_texts()) == count and not bars
    else:
        assert legend is None and len(bars) == 1


@pytest.mark.parametrize(("spread", "width"), [(1e-12, 0.02), (1e-3, 1.1)])
def test_a_section_no_wider_than_rounding_is_drawn_as_a_point(spread, width):
    """Its axes hold a fiftieth of the phase plane at least; those of a cloud are as wide as that."""
    t = np.linspace(0.0, 1.0, 101)
    strobes = spread * np.linspace(-0.5, 0.5, 11)
    along = {"u": 0.5e-3 * np.sin(2.0 * np.pi * t), "v": 0.5 * np.cos(2.0 * np.pi * t)} | dict.fromkeys(
        ("impact_force", "hammer_acceleration"), np.zeros(101)
    )
    variables = {name: (("time",), values) for name, values in along.items()} | {
        name: (("strobe",), strobes) for name in ("displacement", "velocity")
    }
    data = xr.Dataset(variables, {"time": t}, {"settings": '{"gap": 1e-3}'})
    with style():
        section = FIGURES["section"](data).axes[0]
    low, high = section.get_xlim()
    assert high - low == pytest.approx(width, rel=1e-6)
