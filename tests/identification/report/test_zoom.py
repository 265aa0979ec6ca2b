import base64
import dataclasses
import json
import zlib

import numpy as np
import pytest

from identification.report.figures.overlay import overlay
from identification.report.figures.zoom import MOST, tracks, zoom_data
from identification.report.page_style import SCREEN
from tests.identification.report.page_reader import unpacked
from vibrojax.drawing import style


def carried(record, good):
    with style():
        (picture,) = overlay(dataclasses.replace(good, records=(record,)), SCREEN)
        return picture


def test_gaps_travel_as_gaps(good):
    first = good.records[0]
    holed = np.where(np.arange(len(first.time)) % 7 < 3, np.nan, first.measured["impact_force"])
    picture = carried(dataclasses.replace(first, measured={"impact_force": holed}, chi2_reduced={"impact_force": 1.0}), good)
    data = zoom_data(picture.panels)
    series = unpacked(json.loads(data["zoom"]), data["samples"])
    assert any(len(one) == len(holed) and np.array_equal(np.isnan(one), np.isnan(holed)) for one in series)


def test_of_a_long_record_the_extremes_travel():
    time = 100.0 + np.arange(100_000) / 51_200.0
    force, model = np.sin(30 * time), np.cos(30 * time)
    force[[1234, 77_777]] = 9.0, -8.0
    shown, (measured, fitted) = tracks(time, (force, model), 0.1)
    assert len(shown.values) == len(measured.values) == len(fitted.values) <= MOST
    assert (measured.values.max(), measured.values.min()) == (9.0, -8.0)
    assert (np.diff(shown.values) > 0).all()
    assert np.isin(fitted.values, model).all()


def test_what_reaches_further_than_can_be_packed_travels_in_coarser_steps():
    time = np.arange(9_000_000) * 1e-4
    shown, (series, still) = tracks(time, (np.sin(time), 0.0 * time), 1e-12)
    for one, error in ((shown, 1e-5), (series, 1e-8), (still, 0.0)):
        zoom = {"tracks": [{"count": len(one.values), "step": one.step, "origin": one.origin}]}
        (found,) = unpacked(zoom, base64.b64encode(zlib.compress(one.packed())))
        assert np.abs(found - one.values).max() <= error


@pytest.mark.parametrize("jitter", [0.0, 1e-5])
def test_time_stamps_keep_to_a_part_of_an_interval(jitter):
    time = 5.0 + np.arange(500) / 1000.0 + jitter * np.random.default_rng(0).standard_normal(500)
    shown, _ = tracks(time, (time,), 1.0)
    zoom = {"tracks": [{"count": 500, "step": shown.step, "origin": shown.origin}]}
    (found,) = unpacked(zoom, base64.b64encode(zlib.compress(shown.packed())))
    assert np.abs(found - time).max() <= 1e-3 / 128 + 1e-12
