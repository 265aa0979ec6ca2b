"""Files with a recorder's or a spreadsheet's own ways: what is meant is read, and what was concluded or left out is said."""

import io
import re
import tomllib

import numpy as np
import pytest
from rich.console import Console

from identification.experiment import ExperimentError, load_experiment
from identification.experiment.settings import read_record_settings
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


def loaded(folder, instead=None):
    """The record as proposed, with the operator's part, and other lines `instead` of some."""
    text = propose(inspect_path(folder), folder).replace("# mass = 0.4", "mass = 0.4").replace("# gap = 0.0", "gap = 0.001")
    for proposed, other in (instead or {}).items():
        assert proposed in text
        text = text.replace(proposed, other)
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    return load_experiment(folder).records[0]


def declared_as(folder, lines: str, sensors: str = ""):
    """The record of a file that bears the channels' names, with lines in its table."""
    channels = "".join(f'[sensors.{name}]\nunit = "{unit}"\n' for name, unit in (("hammer_displacement", "m"), ("impact_force", "N")))
    head = f'schema = 1\n[hammer]\nmass = 0.4\n[suspension]\nkind = "linear"\n{channels}{sensors}'
    (folder / "experiment.toml").write_text(f'{head}[[record]]\nfile = "a.csv"\nkind = "drop-test"\ngap = 0.001\n{lines}\n')
    return load_experiment(folder).records[0]


def test_inch_and_lbs_are_units(tmp_path):
    written(tmp_path, "Time (sec),Displacement (inch),Force (lbs)", *rows(swing() / 25.4, push() / 4.4482216))
    channels = loaded(tmp_path).channels
    np.testing.assert_allclose(channels["hammer_displacement"], 1e-3 * swing(), atol=2e-8)
    np.testing.assert_allclose(channels["impact_force"], push(), atol=5e-6)


@pytest.mark.parametrize(
    ("above", "names"),
    [
        ((), "Zeit / s,Laser / um,Kraft in mN"),
        ((), "t_s,laser_um,force_mN"),
        ((), "Time {s},Laser {\u03bcm},Load cell <mN>"),
        (("# units: s, um, mN",), "time,hammer_displacement,impact_force"),
        (("Units,s,um,mN",), "time,hammer_displacement,impact_force"),
        (("Horizontal Units,s", "Vertical Units,um,mN"), "TIME,hammer_displacement,impact_force"),
    ],
    ids=["behind a stroke", "behind an underscore", "in braces", "in a comment", "in a line above", "as an oscilloscope"],
)
def test_a_unit_may_stand_anywhere_above_the_samples(above, names, tmp_path):
    written(tmp_path, *above, names, *rows(1e3 * swing(), 1e3 * push()))
    channels = loaded(tmp_path).channels
    np.testing.assert_allclose(channels["hammer_displacement"], 1e-3 * swing(), atol=2e-9)
    np.testing.assert_allclose(channels["impact_force"], push(), atol=5e-6)


def test_an_unknown_unit_is_to_be_filled_in_and_never_si(tmp_path):
    written(tmp_path, "Time (s),Laser (ligne),Load cell (N)", *rows(swing() / 2.256, push()))
    proposed = propose(inspect_path(tmp_path), tmp_path)
    assert "# unit = \"mm\" # TO FILL IN: the unit of the numbers in a.csv, for 'ligne' is no known unit of displacement" in proposed
    with pytest.raises(ExperimentError, match=r"unit is missing in \[sensors.hammer_displacement\]"):
        loaded(tmp_path)


@pytest.mark.parametrize(("given", "hertz"), [('"375 rpm"', 6.25), ("6.25", 6.25), ('"0.00625 kHz"', 6.25)])
def test_a_drive_is_given_in_any_unit_of_frequency(given, hertz, tmp_path):
    written(tmp_path, "time,hammer_displacement", *rows(1e-3 * swing()))
    drive = f'base = "measured"\nexcitation_frequency = {given}\n'
    with pytest.raises(ExperimentError, match="expected a number above 0|expected a finite number above 0"):
        declared_as(tmp_path, drive.replace(given, "-1.0"))
    with pytest.raises(ExperimentError, match="has base = 'measured' and no recorded cart motion"):
        declared_as(tmp_path, drive)
    settings = read_record_settings({"file": "a.csv", "kind": "cart-excitation", "gap": 0.0, **tomllib.loads(drive)}, 1)
    assert settings.record.excitation_frequency == pytest.approx(hertz, rel=1e-12)


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
    notice = "Column 'Load cell (N)' is infinite, as in an overload, at 3 samples, from sample 201 (0.1 s) to 501 (0.25 s): left out."
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
    notice = f"Column 'hammer_displacement' is {mark:g}, a mark for no reading, at 24 samples, from sample 301 (0.15 s) to 324 (0.1615 s)"
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
    notice = "The time stamps lack digits: 2 samples share each. They are taken to come evenly, at 2000 Hz; the stamps scatter"
    assert notice in said(tmp_path)
    record = loaded(tmp_path)
    if dropped:
        text = (tmp_path / "experiment.toml").read_text()
        (tmp_path / "experiment.toml").write_text(text.replace('kind = "drop-test"', 'kind = "drop-test"\ndrop_bad_time = true\n#'))
        (record,) = load_experiment(tmp_path).records
    assert notice in " ".join(record.notices)
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    np.testing.assert_allclose(record.channels["impact_force"], push(), atol=5e-6)


@pytest.mark.parametrize("written_twice", [False, True])
def test_samples_that_are_repeated_are_refused(written_twice, tmp_path):
    lines = rows(swing(), push())
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *np.repeat(lines, 2 if written_twice else np.where(TIME == 0.1, 2, 1)))
    assert "a fit would refuse it: time of the record does not grow" in said(tmp_path)


@pytest.mark.parametrize("back", [0.01, 0.0102])
def test_a_clock_that_steps_back_parts_a_record_in_two_stretches(back, tmp_path):
    stamps = np.where(TIME < 0.3, TIME, TIME - back)
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *rows(swing(), push(), time=stamps))
    assert "The clock steps back and parts 2 stretches; used is stretch 1, sample 1 (0 s) to 600 (0.2995 s)." in said(tmp_path)
    assert "stretch = 1 # guess" in propose(inspect_path(tmp_path), tmp_path)
    for stretch, part in ((1, slice(0, 600)), (2, slice(600, None))):
        record = loaded(tmp_path, {"stretch = 1": f"stretch = {stretch}"})
        np.testing.assert_allclose(record.time, stamps[part], atol=1e-9)
        np.testing.assert_allclose(record.channels["impact_force"], push()[part], atol=5e-6)
    remedy = rf"split at 0.2995 s, where the clock steps back by {back} s and parts 2 stretches: choose one with stretch = 1 \(0 to"
    with pytest.raises(ExperimentError, match=remedy):
        loaded(tmp_path, {"stretch = 1": "#"})
    for wrong, message in (("stretch = 3", "is 3 and its clock has 2 stretches"), ("stretch = 0", "expected a whole number from 1 on")):
        with pytest.raises(ExperimentError, match=message):
            loaded(tmp_path, {"stretch = 1": wrong})


def test_a_clock_that_never_steps_back_has_no_stretches(tmp_path):
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *rows(swing(), push()))
    with pytest.raises(ExperimentError, match="stretch of record 'a.csv' is 1 and its clock never steps back"):
        loaded(tmp_path, {"[[record]]": "[[record]]\nstretch = 1"})


def test_stamps_that_only_jitter_and_look_like_lost_samples_give_way_to_a_sampling_frequency(tmp_path):
    """As the message says: without a column of time."""
    stamps = TIME + np.interp(TIME, [0.2, 0.2005, 0.35, 0.5], [0.0, 2e-3, 2e-3, 0.0])
    written(tmp_path, "t,Laser (mm),Load cell (N)", *rows(swing(), push(), time=stamps))
    with pytest.raises(ExperimentError, match=r"only jitter, give its sampling_frequency \(about \d+ Hz\) without a column of time"):
        loaded(tmp_path, {"[[record]]": "[[record]]\nrebuild_time = true"})
    record = loaded(tmp_path, {"[[record]]": "[[record]]\nsampling_frequency = 2000.0", ', time = "t"': ""})
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)


def in_blocks(seed: int = 7) -> np.ndarray:
    """s: stamps of blocks of 20 samples, each taken up to 2 ms late."""
    late = np.random.default_rng(seed).uniform(0.0, 2e-3, TIME.size // 20)
    return np.repeat(TIME[::20] + late, 20)


@pytest.mark.parametrize("rate", [None, 2000.0])
def test_stamps_of_blocks_are_rebuilt_evenly_with_their_jitter(rate, tmp_path):
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *rows(swing(), push(), time=in_blocks()))
    assert "Time was rebuilt evenly, at 20" in said(tmp_path)
    beside = "" if rate is None else f"\nsampling_frequency = {rate}"
    record = loaded(tmp_path, {"rebuild_time = true": f"rebuild_time = true{beside}"})
    np.testing.assert_allclose(np.diff(record.time), np.diff(record.time)[0], rtol=1e-9)
    np.testing.assert_allclose(np.diff(record.time)[0], 1.0 / 2000.0, rtol=1e-12 if rate else 5e-3)
    jitter = re.search(r"scatter about it by (\S+) s", " ".join(record.notices))
    assert jitter is not None
    assert float(jitter.group(1)) == pytest.approx(np.std(in_blocks() - TIME), rel=0.05)
    with pytest.raises(
        ExperimentError, match="leave repeated ones out with drop_bad_time = true in the record, or, where .* rebuild_time = true"
    ):
        loaded(tmp_path, {"rebuild_time = true": "#"})


def test_stamps_that_jitter_may_be_rebuilt(tmp_path):
    stamps = TIME + np.random.default_rng(8).uniform(0.0, 1e-4, TIME.size)
    written(tmp_path, "Time (s),Laser (mm),Load cell (N)", *rows(swing(), push(), time=stamps))
    assert "# rebuild_time = true # steps vary by" in propose(inspect_path(tmp_path), tmp_path)
    record = loaded(tmp_path, {"# rebuild_time = true": "rebuild_time = true"})
    np.testing.assert_allclose(np.diff(record.time), 5e-4, rtol=1e-3)


@pytest.mark.parametrize(
    ("stamps", "declared", "message"),
    [
        (
            np.where(TIME < 0.2, TIME, TIME + 0.03),
            "rebuild_time = true",
            "its stamps stay 0.03 s late after 0.1995 s: .* some seem to be lost",
        ),
        (TIME + 5e-3 * (TIME >= 0.15) + 5e-3 * (TIME >= 0.35), "rebuild_time = true", "late after 0.1495 s: .* some seem to be lost"),
        (np.repeat(TIME[::8] + 6e-3 * (TIME[::8] >= 0.2), 8), "rebuild_time = true", "late after 0.196 s: .* some seem to be lost"),
        (TIME, "rebuild_time = true\nsampling_frequency = 1000.0", "is 1000 Hz, and its time stamps come at 2000 Hz: expected one rate"),
        (np.where(TIME < 0.2, TIME, TIME - 0.03), "rebuild_time = true", "its clock steps back at 0.1995 s: .* stretch = 1 or 2"),
        (TIME, "rebuild_time = true\ndrop_bad_time = true", "both drop_bad_time and rebuild_time: expected one of the two"),
    ],
    ids=["lost samples", "lost twice", "lost between blocks", "another rate", "a step back", "two ways"],
)
def test_time_that_cannot_be_rebuilt_is_refused(stamps, declared, message, tmp_path):
    written(tmp_path, "time,hammer_displacement", *rows(1e-3 * swing(), time=stamps))
    with pytest.raises(ExperimentError, match=message):
        declared_as(tmp_path, declared)


@pytest.mark.parametrize(
    ("header", "stamp"),
    [
        ("time", lambda t: f"{1732780000.0 + t:.6f}"),
        ("Time (ms)", lambda t: f"{1e3 * (1732780000.0 + t):.3f}"),
        ("Time", lambda t: f"2024-11-28T07:46:{40.0 + t:09.6f}+01:00"),
        ("Time", lambda t: f"11/28/2024 07:46:{40.0 + t:09.6f} AM"),
        ("Time (s)", lambda t: f"{np.round(t, 4):.4f}"),
    ],
    ids=["epoch in s", "epoch in ms", "date with zone", "clock of twelve hours", "four digits at 3 kHz"],
)
def test_stamps_of_any_clock_become_even_time_from_the_first(header, stamp, tmp_path):
    time = np.arange(1000) / 3000.0
    text = [f"{stamp(t)},{value:.6f}" for t, value in zip(time, 5.0 * np.cos(30.0 * time), strict=True)]
    written(tmp_path, f"{header},Laser (mm)", *text)
    record = loaded(tmp_path)
    np.testing.assert_allclose(record.time - record.time[0], time, atol=6e-7)
    assert not [notice for notice in record.notices if "irregular" in notice]


def test_a_mask_leaves_stretches_out_of_every_channel(tmp_path):
    written(tmp_path, "time,hammer_displacement,impact_force", *rows(1e-3 * swing(), push()))
    record = declared_as(tmp_path, "mask = [[0.1, 0.11], [0.3, 0.3005]]")
    for values in record.channels.values():
        assert np.flatnonzero(np.isnan(values)).tolist() == [*range(200, 221), 600, 601]
    assert "Prepared as declared: 0.1 to 0.11 s left out, 0.3 to 0.3005 s left out." in record.notices


@pytest.mark.parametrize(
    ("declared", "message"),
    [
        (
            "mask = [0.1, 0.2]",
            r"mask in record 'a.csv' is \[0.1, 0.2\]: expected a list of stretches in s; write mask = \[\[first, last\]\]",
        ),
        ("mask = [[0.2, 0.1]]", "expected the lower number first"),
        ("mask = [[0.9, 1.1]]", "names 0.9 to 1.1 s, where it has no sample: expected a stretch between 0 and 0.4995 s"),
        ("mask = [[-1.0, 1.0]]", "mask of record 'a.csv' leaves 0 samples: expected at least 16"),
        (
            "mask = [[0.0, 0.4]]\nlowpass = 100.0",
            "mask leaves 0 samples of impact_force of record 'a.csv': expected at least 16; mask less",
        ),
        ('missing = "x"', "missing in record 'a.csv' is 'x': expected a finite number"),
    ],
)
def test_a_mask_that_says_nothing_is_refused(declared, message, tmp_path):
    written(tmp_path, "time,hammer_displacement,impact_force", *rows(1e-3 * swing(), np.where(TIME < 0.4, push(), np.nan)))
    with pytest.raises(ExperimentError, match=message):
        declared_as(tmp_path, declared)


def test_a_mark_that_is_also_a_stamp_leaves_the_time_as_it_is(tmp_path):
    force = push()
    force[[40, 300]] = 0.0
    written(tmp_path, "time,hammer_displacement,impact_force", *rows(1e-3 * swing(), force))
    record = declared_as(tmp_path, "missing = 0.0")
    assert np.isfinite(record.time).all() and np.isnan(record.channels["impact_force"][[40, 300]]).all()


def test_stamps_that_several_samples_share_stay_where_they_are(tmp_path):
    stamps = np.floor(1e3 * (0.5 + TIME[::2] / 4.0)) / 1e3  # four samples each
    written(tmp_path, "time,hammer_displacement", *rows(1e-3 * swing()[::2], time=stamps))
    record = declared_as(tmp_path, "")
    assert record.time[0] == pytest.approx(0.5, abs=1e-3)
    assert not any("far from 0" in notice for notice in record.notices)


@pytest.mark.parametrize("mark", [-9999.0, 5.0])
def test_a_value_that_stands_for_no_reading_is_declared(mark, tmp_path):
    force = push()
    force[[40, 300]] = mark
    written(tmp_path, "time,hammer_displacement,impact_force", *rows(1e-3 * swing(), force))
    record = declared_as(tmp_path, f"missing = {mark}" if mark < 0 else f"missing = [-1.0, {mark}]")
    assert np.flatnonzero(np.isnan(record.channels["impact_force"])).tolist() == [40, 300]
    notice = "which the record declares missing," if mark > 0 else "a mark for no reading,"
    assert f"Column 'impact_force' is {mark:g}, {notice} at 2 samples, from sample 41 (0.02 s) to 301 (0.15 s): left out." in record.notices


def test_the_overload_of_instruments_is_a_mark_wherever_it_stands(tmp_path):
    lines = rows(1e-3 * swing(), push())
    for place, sign in ((40, ""), (300, "-")):
        lines[place] = lines[place].rpartition(",")[0] + f",{sign}9.9E37"
    written(tmp_path, "time,hammer_displacement,impact_force", *lines)
    assert np.flatnonzero(np.isnan(loaded(tmp_path).channels["impact_force"])).tolist() == [40, 300]
