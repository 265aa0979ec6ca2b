import gc
import io
import itertools
import logging

import matplotlib
import numpy as np
import pytest
from matplotlib.colors import to_rgb
from PIL import Image

from vibrojax import drawing
from vibrojax.drawing import COLOURS, drawable, envelope, few_ticks, footnote, literal, new_figure, pdf, png, save, style


def _lines():
    figure = new_figure(2.0, 3.0)
    axes = figure.subplots()
    for step in range(3):
        axes.plot([0, 1], [0, step])
    return figure


def test_the_look_ends_with_the_block_even_when_drawing_fails():
    before, collecting = dict(matplotlib.rcParams), gc.isenabled()
    with pytest.raises(ZeroDivisionError), style():
        assert dict(matplotlib.rcParams) != before
        raise ZeroDivisionError
    assert dict(matplotlib.rcParams) == before
    assert gc.isenabled() is collecting


def test_curves_without_a_colour_take_the_first_ones():
    with style():
        assert [line.get_color() for line in _lines().axes[0].lines] == list(COLOURS[:3])


def test_colours_differ_without_red_from_green():
    """Machado's matrix for a viewer without the cones for green, on linear light."""
    matrix = np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]])
    seen = [matrix @ np.array(to_rgb(colour)) ** 2.2 for colour in COLOURS]
    assert min(np.linalg.norm(one - other) for one, other in itertools.combinations(seen, 2)) > 0.06


def test_few_colours_leave_paper_white():
    with style(), Image.open(io.BytesIO(png(_lines()))) as image:
        assert len(image.convert("RGB").getcolors()) <= 64
        assert image.convert("RGB").getpixel((0, 0)) == (255, 255, 255)


@pytest.mark.parametrize(("suffix", "start"), [(".png", b"\x89PNG"), (".svg", b"<?xml")])
def test_the_suffix_says_which_kind_of_file(tmp_path, suffix, start):
    with style():
        save(_lines(), tmp_path / f"lines{suffix}")
    assert (tmp_path / f"lines{suffix}").read_bytes().startswith(start)


def test_a_power_of_ten_stands_left_of_the_axes_where_titles_begin():
    figure = new_figure(4.0, 2.0)
    axes = figure.subplots()
    axes.plot([0.0, 1.0], [-1e7, 1e7])
    few_ticks(axes)
    png(figure)
    power = axes.yaxis.get_offset_text()
    assert power.get_text() == "1e7"
    assert power.get_window_extent().x1 <= axes.get_window_extent().x0


def test_a_footnote_adds_height_and_changes_no_panel():
    with style():
        figure = _lines()
        before, height = figure.axes[0].get_window_extent().size, figure.get_figheight()
        footnote(figure, "a rig with $odd$ letters; " * 8)
        png(figure)
    (note,) = figure.texts
    assert figure.get_figheight() > height + 0.3
    assert np.allclose(figure.axes[0].get_window_extent().size, before)
    assert note.get_text().count("\n") >= 3 and "$odd$" in note.get_text()
    assert note.get_window_extent().x1 <= figure.bbox.x1
    assert note.get_window_extent().y1 <= figure.axes[0].get_tightbbox().y0


@pytest.fixture
def only_dejavu(monkeypatch):
    """As on a machine without further fonts."""
    monkeypatch.setattr(drawing, "FAMILIES", ["DejaVu Sans"])
    monkeypatch.setitem(drawing.STYLE, "font.family", ["DejaVu Sans"])
    for remembered in (drawing._has_glyph, drawing._warn_of_letters):
        remembered.cache_clear()
    yield
    for remembered in (drawing._has_glyph, drawing._warn_of_letters):
        remembered.cache_clear()


def test_letters_without_a_glyph_are_written_as_codes_and_the_log_says_so_once(only_dejavu, caplog):
    """Matplotlib would warn, which is an error here, and draw boxes."""
    with caplog.at_level(logging.WARNING), style():
        figure = _lines()
        figure.axes[0].set_title(literal("试-$1.csv"))
        footnote(figure, "Prüfstand 测 \U0001f9ea")
        assert png(figure) and pdf(figure)
    assert figure.axes[0].get_title() == r"\u8bd5-\$1.csv"
    assert figure.texts[0].get_text() == r"Prüfstand \u6d4b \U0001f9ea"
    assert [record.message.partition(":")[0] for record in caplog.records] == ["no installed font has all letters of the names"]


def test_arabic_and_accents_are_drawn(only_dejavu, caplog):
    assert drawable("منصة Prüfstand ŝ\n") == "منصة Prüfstand ŝ\n"
    assert not caplog.records


def test_further_fonts_are_installed_ones():
    """Matplotlib warns of a family that it does not find."""
    installed = {font.name for font in matplotlib.font_manager.fontManager.ttflist}
    assert drawing.FAMILIES[0] == "DejaVu Sans" and set(drawing.FAMILIES) <= installed


def test_the_envelope_keeps_every_peak_and_every_gap():
    t = np.arange(40_000.0)
    y = np.sin(t / 500)
    y[12345], y[20_000:20_400] = 9.0, np.nan
    across, up = envelope(t, y, columns=500)
    assert len(across) == len(up) <= 1000
    assert (np.nanmax(up), np.nanmin(up)) == (9.0, np.nanmin(y))
    assert np.isnan(up).any()
    assert (np.diff(across) >= 0).all()
