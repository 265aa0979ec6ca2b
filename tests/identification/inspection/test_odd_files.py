"""Files with a recorder's or a spreadsheet's own ways: what is meant is read, and what was concluded or left out is said."""

import io
import re

import numpy as np
import pytest
from rich.console import Console

from identification.experiment import load_experiment
from identification.inspection import inspect_path, propose, summary

TIME = np.arange(1000) / 2000.0


def swing() -> np.ndarray:
    """mm: a decay, with noise."""
    return 5.0 * np.exp(-2.0 * TIME) * np.cos(30.0 * TIME) + np.random.default_rng(3).normal(0.0, 1e-3, TIME.size)


def push() -> np.ndarray:
    """N: three impacts, with noise."""
    pulses = sum(40.0 * np.exp(-(((TIME - at) / 2e-3) ** 2)) for at in (0.1, 0.25, 0.4))
    return pulses + np.random.default_rng(4).normal(0.0, 0.1, TIME.size)


def rows(*columns: np.ndarray, time: np.ndarray = TIME, digits: int = 6) -> list[str]:
    table = zip(*columns, strict=True)
    return [",".join([f"{t:.{digits}f}", *(f"{value:.6f}" for value in row)]) for t, row in zip(time, table, strict=True)]


def written(folder, *lines: str):
    (folder / "a.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def said(folder) -> str:
    text = io.StringIO()
    Console(file=text, width=2000).print(summary(inspect_path(folder)))
    return text.getvalue()


def loaded(folder):
    """The record as proposed, with the operator's part."""
    text = propose(inspect_path(folder), folder).replace("# mass = 0.4", "mass = 0.4").replace("# gap = 0.0", "gap = 0.001")
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    return load_experiment(folder).records[0]


def test_inch_and_lbs_are_units(tmp_path):
    written(tmp_path, "Time (sec),Displacement (inch),Force (lbs)", *rows(swing() / 25.4, push() / 4.4482216))
    channels = loaded(tmp_path).channels
    np.testing.assert_allclose(channels["hammer_displacement"], 1e-3 * swing(), atol=2e-8)
    np.testing.assert_allclose(channels["impact_force"], push(), atol=5e-6)


def test_an_oscilloscopes_channels_are_numbers_above_a_row_of_units(tmp_path):
    written(tmp_path, "x-axis,1,2", "second,Volt,Volt", *rows(0.5 * swing(), 0.01 * push()))
    (one,) = inspect_path(tmp_path).files
    assert (one.found.time.name, one.found.time_unit) == ("x-axis", "s")
    assert [(column.name, column.unit) for column in one.found.columns] == [("1", "Volt"), ("2", "Volt")]
    proposed = propose(inspect_path(tmp_path), tmp_path)
    assert 'give the sensitivity of each sensor, such as "11.2 mV/N", for 1 in Volt, 2 in Volt' in proposed


@pytest.mark.parametrize("sign", ["∞", "-∞", "\u2212∞", "+∞"])
def test_the_sign_of_infinity_is_an_overload(sign, tmp_path):
    lines = rows(swing(), push())
    for place in (200, 201, 500):
        lines[place] = lines[place].rpartition(",")[0] + "," + sign
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *lines)
    notice = "Column 'Load cell (N)' is infinite, as in an overload, at 3 samples, from sample 201 to 501, left out."
    assert notice in said(tmp_path)
    record = loaded(tmp_path)
    assert notice in record.notices
    assert np.flatnonzero(np.isnan(record.channels["impact_force"])).tolist() == [200, 201, 500]


@pytest.mark.parametrize("stamps", ["s", "time of day"])
@pytest.mark.parametrize("footer", [("Max,0.4,40.1", "Min,-5.0,-0.3"), ("", "Mean,-1.0"), ("End of file",)], ids=lambda lines: lines[-1])
def test_a_footer_is_left_out(footer, stamps, tmp_path):
    lines = rows(swing(), push())
    if stamps == "time of day":
        lines = [f"10:11:{12.0 + t:09.6f},{line.partition(',')[2]}" for t, line in zip(TIME, lines, strict=True)]
    written(tmp_path, "Time,Laser (mm),Load cell (N)", *lines, *footer)
    first = next(at for at, line in enumerate(footer) if line)
    notice = f"What stands below the samples, from line {TIME.size + 2 + first} on ('{footer[first]}'), is left out."
    assert notice in said(tmp_path)
    record = loaded(tmp_path)
    assert notice in record.notices
    np.testing.assert_allclose(record.time, TIME, atol=1e-9)
    np.testing.assert_allclose(record.channels["impact_force"], push(), atol=5e-6)


def test_words_in_front_of_every_sample_are_no_footer(tmp_path):
    written(tmp_path, "note,Time (s),Laser (mm)", *(f"a,{line}" for line in rows(swing())))
    assert loaded(tmp_path).time.size == TIME.size


@pytest.mark.parametrize("mark", [-9999.0, 9999.0, -9.999, -999.0, 99999.0])
def test_a_recorders_mark_for_nothing_measured_is_left_out(mark, tmp_path):
    cart = 2.0 * np.sin(2.0 * np.pi * 7.4 * TIME) + np.random.default_rng(5).normal(0.0, 1e-3, TIME.size)
    hammer = 1e-3 * swing()
    hammer[300:324] = mark
    written(tmp_path, "time,hammer_displacement,cart_displacement,impact_force", *rows(hammer, 1e-3 * cart, push()))
    notice = f"Column 'hammer_displacement' is {mark:g}, far from all other values, at 24 samples, from sample 301 to 324"
    assert notice in said(tmp_path)
    assert 'kind = "cart-excitation"' in propose(inspect_path(tmp_path), tmp_path)
    record = loaded(tmp_path)
    assert np.flatnonzero(np.isnan(record.channels["hammer_displacement"])).tolist() == list(range(300, 324))
    assert notice in " ".join(record.notices) and "one stretch from 0.15 s to 0.1615 s" in " ".join(record.notices)
    np.testing.assert_allclose(record.channels["cart_displacement"], 1e-3 * cart, atol=1e-6)


def test_nines_that_the_signal_comes_near_are_measured(tmp_path):
    force = np.minimum(1e3 * push() / push().max(), 999.0)
    force[200:] = np.minimum(force[200:], 700.0)
    written(tmp_path, "time,hammer_displacement,impact_force", *rows(1e-3 * swing(), np.round(force, 1)))
    assert np.isfinite(loaded(tmp_path).channels["impact_force"]).all()


@pytest.mark.parametrize("dropped", [False, True])
@pytest.mark.parametrize(("unit", "factor"), [("s", 1.0), ("ms", 1e3)])
def test_samples_that_share_a_stamp_for_want_of_digits_come_evenly(unit, factor, dropped, tmp_path):
    stamps = factor * np.floor(1e3 * TIME + 1e-6) * 1e-3
    written(tmp_path, f"Time ({unit}),Laser (mm),Load cell (N)", *rows(swing(), push(), time=stamps, digits=3))
    notice = "The time stamps lack digits: 2 samples share each. They are taken to come evenly, at 2000 Hz."
    assert notice in said(tmp_path)
    record = loaded(tmp_path)
    if dropped:
        text = (tmp_path / "experiment.toml").read_text()
        (tmp_path / "experiment.toml").write_text(text.replace('kind = "drop-test"', 'kind = "drop-test"\ndrop_bad_time = true\n#'))
        (record,) = load_experiment(tmp_path).records
    assert notice in record.notices
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    np.testing.assert_allclose(record.channels["impact_force"], push(), atol=5e-6)


@pytest.mark.parametrize("written_twice", [False, True])
def test_samples_that_are_repeated_are_refused(written_twice, tmp_path):
    lines = rows(swing(), push())
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *np.repeat(lines, 2 if written_twice else np.where(TIME == 0.1, 2, 1)))
    assert "a fit would refuse it: time of the record does not grow" in said(tmp_path)


@pytest.mark.parametrize("back", [0.01, 0.0102])
def test_a_clock_that_steps_back_parts_a_record(back, tmp_path):
    stamps = np.where(TIME < 0.3, TIME, TIME - back)
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *rows(swing(), push(), time=stamps))
    text = said(tmp_path)
    assert "does not grow at sample 601 (0.2995 s is followed by" in text
    assert f"the clock steps back by {back:.6g} s there and parts 2 stretches: export each as a file of its own" in text
    crop = re.search(r"crop = (\[.*?\])", text)
    assert crop is not None
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *rows(swing(), push()))
    text = propose(inspect_path(tmp_path), tmp_path).replace("# mass = 0.4", "mass = 0.4").replace("# gap = 0.0", "gap = 0.001")
    (tmp_path / "experiment.toml").write_text(text + crop.group())
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *rows(swing(), push(), time=stamps))
    (record,) = load_experiment(tmp_path).records
    kept = TIME[TIME < 0.3 - back]
    np.testing.assert_allclose(record.time, kept, atol=1e-9)
    np.testing.assert_allclose(record.channels["impact_force"], push()[: kept.size], atol=5e-6)
