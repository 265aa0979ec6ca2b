"""No figure leaves a curve out, joins points of chaos, or loses a region in grey; on data sets made by hand."""

import itertools
import json
import re

import numpy as np
import pytest
import xarray as xr
from PIL import Image

from vibrojax.drawing import COLOURS, new_figure, style
from vibrojax.figure_style import FIGURE_STYLES
from vibrojax.studies.base import APERIODIC
from vibrojax.studies.figures import FIGURES, UNCERTAIN, maps
from vibrojax.studies.figures.maps import Region, lightness, motion_colours
from vibrojax.studies.quantiles import LEVELS
from vibrojax.studies.write import write_study

RIG = (
    '{"mass": 1.0, "suspension": {"kind": "linear", "natural_frequency_hz": 5.0}, "law": {"name": "hertz"}, '
    '"units": {"suspension": {"natural_frequency_hz": "Hz"}}}'
)
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
    variables |= {each: (tuple(along), np.ones((curves, 5), dtype=int)) for each in ("kind", "impacts", "period")}
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


def test_points_of_chaos_are_never_joined():
    data = made("response", 1)
    data["kind"][0, 2:] = APERIODIC
    with style():
        line, points = FIGURES["response"](data).axes[0].lines
    assert line.get_linestyle() == "-" and points.get_linestyle() == "None"
    x, y = line.get_xdata(), line.get_ydata()
    assert np.isfinite(y[x <= 1.25]).all() and not np.isfinite(y[x > 1.3]).any()
    np.testing.assert_allclose(points.get_xdata(), [1.5, 1.75, 2.0])


def test_a_line_breaks_where_the_motion_changes():
    data = made("response", 1)
    data["period"][0, 3:] = 2
    with style():
        y = FIGURES["response"](data).axes[0].lines[0].get_ydata()
    assert np.isnan(y).tolist() == [False, False, False, True, False, False]


def test_curves_differ_without_colour():
    with style():
        lines = FIGURES["response"](made("response", len(COLOURS))).axes[0].lines
    assert len({str(line._dash_pattern) for line in lines}) == len(COLOURS)


def test_regions_of_a_map_differ_in_grey():
    """In CIE lightness, of which 2 is just seen; what an image viewer makes of the colours as grey differs too."""
    others = (maps.COLOUR_NO_IMPACT, maps.COLOUR_OTHER, maps.COLOUR_UNSETTLED, maps.COLOUR_NOT_INTEGRATED, maps.COLOUR_CHAOS)
    colours = [*motion_colours([(5, k) for k in range(1, 7)]), *others]
    assert len(set(colours)) == 11
    grey = [Image.new("RGB", (1, 1), colour).convert("L").getpixel((0, 0)) for colour in colours]
    assert min(abs(a - b) for a, b in itertools.combinations(grey, 2)) >= 8
    assert min(abs(lightness(a) - lightness(b)) for a, b in itertools.combinations(colours, 2)) >= 7


def test_a_usual_motion_has_the_same_colour_in_every_map():
    assert motion_colours([(1, 2), (1, 1), (7, 3)])[:2] == motion_colours([(3, 1), (1, 1), (1, 2)])[:0:-1]


def test_a_region_is_named_where_it_has_room():
    cells = np.zeros((40, 40), dtype=bool)
    cells[5:25, 10:30] = True
    thin = np.zeros((40, 40), dtype=bool)
    thin[30, :] = True
    shown = [Region(name=text, colour="#0058b0", cells=part, inside=text) for text, part in (("1/1", cells), ("1/2", thin))]
    with style():
        axes = new_figure(3.0).subplots()
        maps.draw_regions(axes, np.arange(40.0), np.arange(40.0), shown)
    assert [text.get_text() for text in axes.texts] == ["1/1"]
    column, row = axes.texts[0].get_position()
    assert cells[int(row), int(column)]


@pytest.mark.parametrize("look", FIGURE_STYLES)
def test_a_figure_has_the_width_of_its_style_and_a_caption(look, tmp_path):
    data = made("design", 2).assign_attrs(
        title="hammer design", settings='{"gap": 1e-3, "base_amplitude": 2e-3}', vibrojax="0", engine="none", model=RIG
    )
    paths = write_study("design", data, tmp_path, look=FIGURE_STYLES[look])
    assert [path.name for path in paths] == [f"design.{suffix}" for suffix in ("nc", "png", "pdf", "svg", "md")]
    width = 25.4 * FIGURE_STYLES[look].column
    svg = (tmp_path / "design.svg").read_text()
    assert float(re.search(r'width="([\d.]+)pt"', svg)[1]) / 72 * 25.4 == pytest.approx(width, abs=0.1)
    with Image.open(tmp_path / "design.png") as image:
        assert image.width / FIGURE_STYLES[look].dpi * 25.4 == pytest.approx(width, abs=0.2)
    assert (tmp_path / "design.pdf").read_bytes().startswith(b"%PDF")
    text = (tmp_path / "design.md").read_text()
    for words in ("m = 1 kg", "omega = 5 Hz", "- gap: 1 mm", "- A0: 2 mm", "Omega 0.001, 0.002 Hz", "z = 1/1 from 1 to 2"):
        assert words in text


def test_basins_of_one_colour_show_how_long_the_motion_takes_to_settle():
    """In words as well: which motion it is, and the speed of its impacts."""
    attractor = {"name": "z = 1/1", "impacts": 1, "period": 1, "share": 1.0, "section": {"u": [0.0], "v": [0.0]}}
    cycles = np.arange(12.0).reshape(3, 4)
    plane = ("v0", "u0")
    variables = {"attractor": (plane, np.zeros((3, 4), int)), "cycles": (plane, cycles), "impact_speed": (plane, np.full((3, 4), 0.25))}
    attrs = {"attractors": json.dumps([attractor]), "settings": '{"frequency_hz": 5.0}'}
    with style():
        figure = FIGURES["basins"](xr.Dataset(variables, {"v0": np.arange(3.0), "u0": np.arange(4.0)}, attrs))
    axes, bar = figure.axes
    np.testing.assert_array_equal(axes.collections[0].get_array(), cycles)
    assert axes.get_title("left") == "every start ends in z = 1/1, impact speed 0.25 m/s"
    assert bar.get_ylabel() == "cycles until the orbit has closed"


def test_motions_beside_a_response_are_open_marks():
    data = made("response", 1)
    data["other_force"] = (("gap", "frequency_hz", "other"), np.full((1, 5, 1), 7.0))
    data["asked"] = (("gap", "frequency_hz"), np.ones((1, 5), int))
    with style():
        line, beside, named = FIGURES["response"](data).axes[0].lines
    assert line.get_linestyle() == "-" and beside.get_markerfacecolor() == "none" and named.get_label() == "coexists"
    np.testing.assert_allclose(beside.get_ydata(), 7.0)
