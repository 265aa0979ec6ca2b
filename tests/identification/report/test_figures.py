import dataclasses
import io

import matplotlib
import numpy as np
import pytest
from PIL import Image

from identification.report.base import SCREEN, rendered
from identification.report.contact import loops
from identification.report.decay import ring_downs
from identification.report.page import FIGURES
from identification.report.records import overlay
from identification.result.result import Added, impacts, measured_displacement, notable
from identification.result.ring_down import RingDowns
from identification.trajectory.innovations import autocorrelation
from tests.identification.made_result import RING_DOWNS, made_result
from vibrojax.drawing import png, style

EXPECTED = {
    "force-indentation",
    "restitution",
    "phase-plane",
    "damping-and-frequency",
    "record-01-overlay",
    "record-02-overlay",
    "record-01-impacts",
    "record-02-impacts",
    "residuals",
}


def draw(result):
    with style():
        return [picture for drawer in FIGURES for picture in drawer(result, SCREEN)]


def test_every_kind_is_drawn_described_in_words_and_a_readable_image(good):
    said = []
    images = rendered(FIGURES, good, lambda picture: picture.name, SCREEN, said.append)
    assert {image.picture.name for image in images} == EXPECTED
    assert said[1:] == [f"drawing the report: {number} of {len(EXPECTED)} figures" for number in range(1, len(EXPECTED) + 1)]
    for image in images:
        assert len(image.picture.alt) > 30
        with Image.open(io.BytesIO(image.files["png"])) as opened:
            assert abs(opened.size[0] - 2 * image.width) <= 1 and image.width > 300
            assert len(np.unique(np.asarray(opened.convert("L")))) > 5, f"{image.picture.name} is blank"
            assert opened.convert("RGB").getpixel((1, 1)) == (255, 255, 255)


def test_matplotlib_is_left_as_it_was(good):
    before = dict(matplotlib.rcParams)
    draw(good)
    assert dict(matplotlib.rcParams) == before
    assert "matplotlib.pyplot" not in vars(matplotlib) or not matplotlib.pyplot.get_fignums()


@pytest.mark.parametrize(
    "channels", [("hammer_displacement",), ("hammer_acceleration",), ("impact_force",), ("cart_displacement", "impact_force")]
)
def test_any_channel_may_be_missing(channels):
    names = {image.name for image in draw(made_result(channels=channels, samples=600))}
    assert {"phase-plane", "record-01-overlay", "record-02-impacts"} <= names


def test_records_without_contact_and_without_starts(good):
    free = tuple(dataclasses.replace(r, in_contact=np.zeros_like(r.in_contact)) for r in good.records)
    alone = dataclasses.replace(good, records=free, correlated=("n",), correlation=np.eye(1))
    assert {image.name for image in draw(alone)} == {
        "phase-plane",
        "damping-and-frequency",
        "record-01-overlay",
        "record-02-overlay",
        "residuals",
    }


def test_gaps_in_a_record_are_drawn_as_gaps(good):
    first = good.records[0]
    holes = {name: np.where(np.arange(len(values)) % 7 < 3, np.nan, values) for name, values in first.measured.items()}
    holed = dataclasses.replace(first, measured=holes)
    assert len(draw(dataclasses.replace(good, records=(holed,)))) == len(EXPECTED) - 2


def test_a_channel_without_a_usable_sample_is_drawn_empty(good):
    dead = dataclasses.replace(good.records[0], measured=good.records[0].measured | {"impact_force": np.full(1500, np.nan)})
    assert len(draw(dataclasses.replace(good, records=(dead, good.records[1])))) == len(EXPECTED)


def test_of_many_records_the_worst_are_drawn(good):
    many = tuple(dataclasses.replace(good.records[1], file=f"cart{i}.csv", chi2_reduced={"impact_force": float(i)}) for i in range(12))
    with style():
        overlays = [p.record for p in overlay(dataclasses.replace(good, records=many), SCREEN)]
    assert overlays == [f"cart{i}.csv" for i in range(4, 12)]


def test_impacts_are_found_in_order_and_short_gaps_do_not_part_them(good):
    contact = np.zeros(1500, dtype=bool)
    contact[[10, 11, 13, 14, 40, 41]] = True
    found = impacts(dataclasses.replace(good.records[0], in_contact=contact))
    assert [(i.first, i.end) for i in found] == [(10, 15), (40, 42)]
    first, second = notable(good.records[0])
    assert first.first < second.first


def test_the_measured_motion_is_relative_to_the_cart(good):
    record = good.records[1]
    assert np.abs(measured_displacement(record) - record.relative_displacement).max() < 1e-4


def test_autocorrelation_of_noise_is_small_and_of_a_slow_wave_is_not():
    noise = np.random.default_rng(0).standard_normal(20_000)
    assert np.abs(autocorrelation([noise], 20)[1:]).max() < 0.03
    assert autocorrelation([np.sin(np.arange(2000) / 100)], 5)[5] > 0.99


def test_a_channel_that_stands_still_has_no_autocorrelation_and_no_warning():
    assert np.isnan(autocorrelation([np.zeros(50)], 3)).all()


def test_the_same_figure_gives_the_same_bytes(good):
    with style():
        once, again = (png(next(loops(good, SCREEN)).figure) for _ in range(2))
    assert once == again


def test_damping_is_drawn_over_amplitude_with_its_errors_and_the_model(good):
    with style():
        picture = next(iter(ring_downs(good, SCREEN)))
        above, below = picture.figure.axes
        (model,) = [line for line in above.lines if line.get_label() == "nominal model"]
        np.testing.assert_allclose(model.get_xdata(), 1e3 * np.array(RING_DOWNS.measured[0].amplitude))
        np.testing.assert_allclose(model.get_ydata(), 1.0)
        assert above.get_ylim()[0] <= 0.0, "level damping looks level"
        assert [text.get_text() for text in above.get_legend().get_texts()] == ["nominal model", "measured"]
        assert (below.get_xlabel(), below.get_ylabel()) == ("amplitude of u (mm)", "frequency f (Hz)")
        assert not list(ring_downs(dataclasses.replace(good, ring_downs=RingDowns(left_out=RING_DOWNS.left_out)), SCREEN))


def test_effects_on_request_have_a_line_by_their_name(good):
    added = Added(names=("coulomb_friction",), places=("",), gain=9.0, chance=1e-4, bic=-3.0, held_back=None)
    models = RING_DOWNS.models | {"augmented": RING_DOWNS.measured}
    with style():
        picture = next(
            iter(ring_downs(dataclasses.replace(good, added=added, ring_downs=dataclasses.replace(RING_DOWNS, models=models)), SCREEN))
        )
        legend = picture.figure.axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["nominal model", "with coulomb friction", "measured"]


def test_a_point_that_is_hardly_known_does_not_widen_the_axes(good):
    vague = dataclasses.replace(RING_DOWNS.measured[0], file="b.csv", amplitude=(1e-6,) * 8, damping=(0.9,) * 8, damping_stderr=(0.5,) * 8)
    found = dataclasses.replace(RING_DOWNS, measured=(*RING_DOWNS.measured, *RING_DOWNS.measured, vague))
    with style():
        above, _ = next(iter(ring_downs(dataclasses.replace(good, ring_downs=found), SCREEN))).figure.axes
        assert above.get_ylim()[1] < 5.0
        assert above.get_xlim()[0] > 0.1
