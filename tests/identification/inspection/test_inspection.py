"""What recorded files hold is reported as it is, and the proposed experiment file loads once mass and gaps are filled in."""

import io
import re
import shutil
import tomllib

import numpy as np
import pytest
from rich.console import Console

from identification.experiment import ExperimentError, load_experiment
from identification.experiment.signals import fit_sine
from identification.experiment.toml_file import Table
from identification.inspection import inspect_path, propose, summary
from identification.inspection.inspect import time_sentence
from tests.identification.experiment.recorder_files import write_mdf4, write_tdms, write_uff
from vibrojax.data_files import data_path

TEMPLATE = data_path("template.toml").read_text(encoding="utf-8")

RATE = 2048.0
TIME = np.arange(2048) / RATE
RNG = np.random.default_rng(5)


@pytest.fixture(autouse=True)
def seeded():
    """The same noise in a test whichever ran before it."""
    RNG.bit_generator.state = np.random.default_rng(5).bit_generator.state


def noisy(values, noise):
    return values + RNG.normal(0.0, noise, TIME.size)


def impacts():
    """N: three short pulses."""
    return sum(40.0 * np.exp(-(((TIME - at) / 2e-3) ** 2)) for at in (0.2, 0.5, 0.7))


def write_csv(path, columns, time=TIME):
    rows = np.column_stack([time, *columns.values()])
    np.savetxt(path, rows, delimiter=",", header=",".join(["time", *columns]), comments="")


def channels(kind):
    """One second of a record of a kind, SI."""
    moving = 2e-3 * np.sin(2 * np.pi * 6.25 * TIME + 0.3) if kind == "cart-excitation" else 0.0 * TIME
    found = {
        "hammer_displacement": noisy(3e-3 * np.exp(-2.0 * TIME) * np.cos(30.0 * TIME), 1e-5),
        "cart_displacement": noisy(moving, 1e-5),
        "impact_force": noisy(0.0 * TIME if kind in ("free-decay", "forced") else impacts(), 0.1),
    }
    return found | ({"applied_force": noisy(2.0 * np.sin(40.0 * TIME), 0.05)} if kind == "forced" else {})


def filled(text):
    """The operator's part."""
    return text.replace("# mass = 0.4", "mass = 0.431").replace("# gap = 0.0", "gap = 0.0005")


def loaded(folder):
    file = folder / "experiment.toml"
    file.write_text(filled(propose(inspect_path(folder), folder)))
    return load_experiment(folder)


def test_the_embedded_example_is_proposed_as_it_was_declared(tmp_path):
    for file in data_path("example").glob("*.gz"):
        shutil.copy(file, tmp_path)
    found, true = loaded(tmp_path), load_experiment(data_path("example"))
    by_file = {record.file: record for record in true.records}
    assert {record.file for record in found.records} == set(by_file)
    for record in found.records:
        assert (record.kind, record.excitation_frequency) == (by_file[record.file].kind, by_file[record.file].excitation_frequency)
        for channel in ("hammer_displacement", "cart_displacement", "impact_force", "hammer_acceleration"):
            np.testing.assert_array_equal(record.channels[channel], by_file[record.file].channels[channel])


@pytest.mark.parametrize("kind", ["drop-test", "cart-excitation", "free-decay", "forced"])
def test_the_kind_is_guessed_and_marked(kind, tmp_path):
    write_csv(tmp_path / "a.csv", channels(kind))
    assert re.search(rf'^kind = "{kind}" # guess: ', propose(inspect_path(tmp_path / "a.csv"), tmp_path), re.MULTILINE)
    (record,) = loaded(tmp_path).records
    assert record.excitation_frequency == (6.25 if kind == "cart-excitation" else None)


@pytest.mark.parametrize("channel", ["x [mm]", "relative_displacement", "theta"])
def test_a_displacement_alone_is_a_free_decay_without_a_stop(channel, tmp_path):
    write_csv(tmp_path / "a.csv", {channel: channels("free-decay")["hammer_displacement"]})
    text = propose(inspect_path(tmp_path), tmp_path)
    assert 'kind = "free-decay" # guess: no motion of a cart is recorded and no channel shows whether impacts occur' in text
    assert 'law = "none" # guess' in text and "# gap" not in text


def test_a_cart_that_moves_otherwise_drives_the_model_as_measured(tmp_path):
    shock = 2e-3 * np.exp(-(((TIME - 0.5) / 0.01) ** 2))
    write_csv(tmp_path / "a.csv", channels("drop-test") | {"cart_displacement": noisy(shock, 1e-6)})
    (record,) = loaded(tmp_path).records
    assert (record.kind, record.base) == ("cart-excitation", "measured")


@pytest.mark.parametrize("offset", [0.42, 0.0])
def test_a_free_motion_about_a_reading_far_from_zero_gets_a_zero_that_is_estimated(offset, tmp_path):
    swing = noisy(0.05 * np.exp(-TIME) * np.cos(30.0 * TIME), 1e-5)
    write_csv(
        tmp_path / "a.csv", {"position": offset + swing, "velocity": np.gradient(swing, TIME), "acceleration": noisy(-900 * swing, 0.1)}
    )
    (record,) = loaded(tmp_path).records
    proposed = tomllib.loads((tmp_path / "experiment.toml").read_text())
    assert proposed["record"][0].get("detrend") == ({"hammer_displacement": "constant"} if offset else None)
    assert proposed["sensors"]["hammer_displacement"].get("zero") == (pytest.approx(np.std(swing), rel=0.1) if offset else None)
    np.testing.assert_allclose(record.channels["hammer_displacement"], swing - (swing.mean() if offset else 0.0), atol=1e-12)


def write_nameless(path, *columns):
    np.savetxt(path, np.column_stack(columns), delimiter=",")


def test_the_only_column_beside_the_time_asks_for_its_unit_alone(tmp_path):
    swing = channels("free-decay")["hammer_displacement"]
    write_nameless(tmp_path / "a.csv", TIME, 1e2 * swing)
    text = filled(propose(inspect_path(tmp_path), tmp_path))
    assert len(re.findall(r"^# .* = .*# TO FILL IN", text, re.M)) == 1
    write_nameless(tmp_path / "b.csv", TIME, 40.0 + 1e2 * swing)
    assert "# zero = " not in text and "# zero = 0.1" in propose(inspect_path(tmp_path / "b.csv"), tmp_path)
    (tmp_path / "experiment.toml").write_text(text)
    with pytest.raises(ExperimentError, match=r"unit is missing in \[sensors.hammer_displacement\]"):
        load_experiment(tmp_path)
    (tmp_path / "experiment.toml").write_text(re.sub('^# unit = "m+"', 'unit = "cm"', text, flags=re.M))
    (record,) = load_experiment(tmp_path).records
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    np.testing.assert_allclose(record.channels["hammer_displacement"], swing, atol=1e-12)


def test_columns_that_nothing_names_get_a_line_each_beside_the_time(tmp_path):
    """The time, in whole ms, steps back once."""
    stamps = np.rint(24.0 * np.arange(TIME.size)) - 50.0 * (np.arange(TIME.size) > 1800)
    values = channels("drop-test")
    write_nameless(tmp_path / "a.csv", stamps, values["hammer_displacement"], values["impact_force"])
    text = filled(propose(inspect_path(tmp_path), tmp_path))
    (tmp_path / "experiment.toml").write_text(text)
    with pytest.raises(ExperimentError, match="no channel is declared for record 'a.csv', which has column 1, column 2, column 3"):
        load_experiment(tmp_path)
    for line in ("columns.hammer_displacement", "[sensors.hammer_displacement]", 'unit = "m"'):
        text = text.replace(f"# {line}", line, 1)
    (tmp_path / "experiment.toml").write_text(text)
    (record,) = load_experiment(tmp_path).records
    np.testing.assert_allclose(record.time, 1e-3 * stamps[:1801], atol=1e-9)
    np.testing.assert_allclose(record.channels["hammer_displacement"], values["hammer_displacement"][:1801], atol=1e-12)


def test_names_and_units_in_a_header_are_understood(tmp_path):
    named = dict(zip(("Hammer LVDT [mm]", "cart pos (um)", "Load cell [kN]"), channels("cart-excitation").values(), strict=True))
    factors = (1e3, 1e6, 1e-3)
    rows = np.column_stack([1e3 * TIME, *(factor * column for factor, column in zip(factors, named.values(), strict=True))])
    np.savetxt(
        tmp_path / "a.csv",
        rows,
        delimiter=";",
        header=";".join(
            [
                "t [ms]",
                *named,
            ]
        ),
        comments="",
    )
    (record,) = loaded(tmp_path).records
    np.testing.assert_allclose(record.time, TIME, rtol=1e-12)
    for channel, column in zip(("hammer_displacement", "cart_displacement", "impact_force"), named.values(), strict=True):
        np.testing.assert_allclose(record.channels[channel], column, rtol=1e-12, atol=1e-18)


@pytest.mark.parametrize(
    ("stamps", "unit"),
    [
        (TIME, ""),  # short enough for s, so that nothing is asked
        (np.arange(2048) / 15.0, "s"),  # of a camera
        (2.5 * np.arange(2048), "s"),  # read off by hand
        (5.0 * np.arange(2048), "ms"),
        (100.0 * np.arange(2048), "ms"),
        (np.rint(1e6 * TIME), "us"),
        (1e6 * TIME, "us"),
    ],
)
def test_a_time_without_a_unit_is_in_seconds_unless_it_counts(stamps, unit, tmp_path):
    write_csv(tmp_path / "a.csv", channels("free-decay"), stamps)
    (record,) = loaded(tmp_path).records
    np.testing.assert_allclose(record.time, stamps * {"": 1.0, "s": 1.0, "ms": 1e-3, "us": 1e-6}[unit], rtol=1e-3)
    proposed = (tmp_path / "experiment.toml").read_text()
    assert re.findall(r'^time_unit = "(\w+)" # guess: the file states none, .* Hz right\?$', proposed, re.M) == ([unit] if unit else [])


def test_a_stated_time_unit_is_taken(tmp_path):
    columns = {"time [s]": 1e3 * TIME, **channels("drop-test")}
    np.savetxt(tmp_path / "a.csv", np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    (record,) = loaded(tmp_path).records
    np.testing.assert_allclose(record.time, 1e3 * TIME, rtol=1e-9)


@pytest.mark.parametrize(("suffix", "write"), [(".tdms", write_tdms), (".unv", write_uff), (".mf4", write_mdf4)])
def test_recorders_files_bring_their_units(suffix, write, tmp_path):
    pytest.importorskip({".tdms": "nptdms", ".unv": "pyuff", ".mf4": "asammdf"}[suffix])
    units = {"hammer_displacement": "mm", "impact_force": "Newtons"}
    stored = {"hammer_displacement": channels("drop-test")["hammer_displacement"] * 1e3, "impact_force": impacts()}
    axis = {} if suffix == ".tdms" else {"time": TIME}
    write(tmp_path / f"a{suffix}", stored, units, **axis)
    (record,) = loaded(tmp_path).records
    assert record.kind == "drop-test"
    np.testing.assert_allclose(record.channels["hammer_displacement"], 1e-3 * stored["hammer_displacement"], rtol=1e-10)


def test_a_unit_that_is_not_known_is_to_be_filled_in(tmp_path):
    pytest.importorskip("nptdms")
    write_tdms(tmp_path / "a.tdms", {"hammer_displacement": TIME, "impact_force": impacts()}, {"hammer_displacement": "furlong"})
    text = propose(inspect_path(tmp_path), tmp_path)
    assert "# unit = \"mm\" # TO FILL IN: the unit of the numbers in a.tdms, for 'furlong' is no known unit of displacement" in text
    with pytest.raises(ExperimentError, match="unit 'furlong' in the file of record 'a.tdms' for hammer_displacement is not a known unit"):
        loaded(tmp_path)
    filled = text.replace('# units = { hammer_displacement = "m" }', 'units = { hammer_displacement = "mm" }')
    (tmp_path / "experiment.toml").write_text(filled.replace("# mass = 0.4", "mass = 0.4").replace("# gap = 0.0", "gap = 0.0"))
    assert load_experiment(tmp_path).records[0].channels["hammer_displacement"][-1] == pytest.approx(1e-3 * TIME[-1])


@pytest.mark.parametrize("what", ["glitch", "offset"])
def test_a_turned_load_cell_with_a_glitch_or_an_offset_is_turned(what, tmp_path):
    values = channels("cart-excitation")
    force = -values["impact_force"]
    if what == "glitch":
        force[100] = -1.2 * force.min()
    else:
        force -= 0.6 * force.min()
    write_csv(tmp_path / "run.csv", values | {"impact_force": force})
    assert "sign = -1" in propose(inspect_path(tmp_path), tmp_path)


@pytest.mark.parametrize("kind", ["drop-test", "cart-excitation"])
def test_a_load_cell_that_reads_impacts_as_pulls_is_turned(kind, tmp_path):
    values = channels(kind)
    write_csv(tmp_path / "run.csv", values | {"impact_force": 0.5 - values["impact_force"]})
    proposed = propose(inspect_path(tmp_path), tmp_path)
    assert f'kind = "{kind}"' in proposed
    assert proposed.count("sign = -1 # guess: it falls in impacts") == 1
    (record,) = loaded(tmp_path).records
    np.testing.assert_allclose(record.channels["impact_force"], values["impact_force"] - 0.5, atol=1e-9)
    write_csv(tmp_path / "run.csv", values)
    assert "sign" not in propose(inspect_path(tmp_path), tmp_path)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_weak_impacts_are_impacts(sign, tmp_path):
    """Of fourteen times the load cell's noise."""
    values = channels("drop-test")
    force = noisy(sign * 1.4 * impacts() / impacts().max(), 0.1)
    write_csv(tmp_path / "drop.csv", values | {"impact_force": force})
    proposed = propose(inspect_path(tmp_path), tmp_path)
    assert 'kind = "drop-test" # guess: the cart is at rest and impacts occur' in proposed
    assert ("sign = -1" in proposed) == (sign < 0)


@pytest.mark.parametrize("what", ["glitch", "hum", "preload"])
def test_a_load_cell_that_is_right_is_not_turned(what, tmp_path):
    values = channels("cart-excitation")
    force = values["impact_force"].copy()
    if what == "glitch":
        force[100] = -10.0 * force.max()
    elif what == "hum":
        force -= 0.5 * force.max() * np.exp(-TIME / 0.1) * np.maximum(np.sin(2.0 * np.pi * 34.0 * TIME), 0.0)
    else:
        force = np.where(np.arange(force.size) % 500 < 20, 0.0, 8.0) + 0.01 * force
    write_csv(tmp_path / "run.csv", values | {"impact_force": force})
    assert "sign" not in propose(inspect_path(tmp_path), tmp_path)


def printed(folder) -> str:
    """The tables of a folder, as a wide terminal shows them."""
    console = Console(width=400, record=True, file=io.StringIO(), force_terminal=False)
    console.print(summary(inspect_path(folder)))
    return console.export_text()


def test_what_a_fit_would_refuse_or_doubt_is_said_with_the_same_words(tmp_path):
    """Impacts that read as pulls, and a scaled displacement in place of an acceleration."""
    values = channels("drop-test")
    write_csv(tmp_path / "run.csv", values)
    assert "a fit would refuse it" not in printed(tmp_path) and "odd: " not in printed(tmp_path)
    write_csv(tmp_path / "run.csv", values | {"impact_force": -values["impact_force"]})
    found = re.search(r"a fit would refuse it: (impact_force of record 'run.csv' falls in 3 impacts, .*)", printed(tmp_path))
    (tmp_path / "experiment.toml").write_text(filled(propose(inspect_path(tmp_path), tmp_path)).replace("sign = -1", "sign = 1"))
    with pytest.raises(ExperimentError) as refused:
        load_experiment(tmp_path)
    assert found is not None and str(refused.value) == found.group(1).strip()
    driven = channels("cart-excitation")
    slipped = {"cart_acceleration [m/s^2]": -1e-3 * (2 * np.pi * 6.25) ** 2 * driven["cart_displacement"]}
    write_csv(tmp_path / "run.csv", driven | slipped)
    said = printed(tmp_path)
    assert "a fit would refuse it: cart_displacement is 1e+03 times what cart_acceleration gives for it in record 'run.csv'" in said
    assert "odd: cart_acceleration: computed from cart_displacement" in said


def test_files_of_voltages_ask_for_the_sensitivities(tmp_path):
    values = channels("cart-excitation")
    volts = {"Laser (V)": 800.0 * values["hammer_displacement"], "Cart LVDT (V)": 500.0 * values["cart_displacement"]}
    write_csv(tmp_path / "cart1.csv", volts | {"Load cell (mV)": 11.2 * values["impact_force"]})
    proposed = filled(propose(inspect_path(tmp_path), tmp_path))
    assert proposed.count("# sensitivity = ") == 3 and "# noise" not in proposed
    assert '# sensitivity = "11.2 mV/N" # TO FILL IN: from its calibration sheet, for cart1.csv is in mV' in proposed
    file = tmp_path / "experiment.toml"
    file.write_text(proposed)
    with pytest.raises(ExperimentError, match=r"states hammer_displacement in 'V': expected the sensitivity of the sensor"):
        load_experiment(tmp_path)
    first, second = proposed.replace("# sensitivity", "sensitivity").split("[sensors.cart_displacement]")
    file.write_text(first + "[sensors.cart_displacement]" + second.replace("0.8 V/mm", "0.5 V/mm", 1))
    (record,) = load_experiment(tmp_path).records
    for channel in values:
        np.testing.assert_allclose(record.channels[channel], values[channel], rtol=1e-6, atol=1e-12)


def test_files_in_different_units_make_one_experiment(tmp_path):
    for name, unit, factor in (("a", "mm", 1e3), ("b", "um", 1e6)):
        columns = channels("free-decay") | {"hammer_displacement": factor * TIME}
        renamed = {key.replace("hammer_displacement", f"hammer pos [{unit}]"): value for key, value in columns.items()}
        write_csv(tmp_path / f"{name}.csv", renamed)
    for record in loaded(tmp_path).records:
        np.testing.assert_allclose(record.channels["hammer_displacement"], TIME, rtol=1e-12)


def test_a_channel_at_another_rate_is_marked_as_unusable(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        fast = nptdms.ChannelObject("run", "impact_force", impacts(), {"wf_increment": 1 / RATE, "unit_string": "N"})
        slow = nptdms.ChannelObject("run", "hammer_displacement", TIME[::4], {"wf_increment": 4 / RATE, "unit_string": "m"})
        writer.write_segment([fast, slow])
    (one,) = inspect_path(tmp_path).files
    assert one.found.unusable == {
        "hammer_displacement": "512 samples on another time axis: resample it to that of the others and export again"
    }
    assert one.found.rate == pytest.approx(RATE)


def test_time_stamps_are_counted_honestly(tmp_path):
    time = TIME.copy()
    time[1000:] += 0.25
    time[50] = time[49]
    time[1500] = time[1400]
    write_csv(tmp_path / "a.csv", channels("drop-test"), time)
    (one,) = inspect_path(tmp_path / "a.csv").files
    said = time_sentence(one.found)
    assert said.startswith("2048 samples in ")
    assert "; 3 gaps, the longest 0.2505 s; 1 repeated time stamp; time runs backwards 1 time" in said  # a pause, and two jumps back
    assert one.found.rate == pytest.approx(RATE)
    assert "does not grow at sample 51" in one.found.problem
    assert "# a.csv is left out: time of the record does not grow" in propose(inspect_path(tmp_path), tmp_path)


def test_jitter_is_that_of_the_steps(tmp_path):
    shift = RNG.normal(0.0, 1e-2 / RATE, TIME.size)
    write_csv(tmp_path / "a.csv", channels("drop-test"), TIME + shift)
    (one,) = inspect_path(tmp_path).files
    jitter = float(re.search(r"steps vary by (\S+) %", time_sentence(one.found)).group(1))
    assert jitter == pytest.approx(np.sqrt(2.0), rel=0.1)


def test_missing_samples_noise_range_and_saturation(tmp_path):
    force = np.minimum(channels("drop-test")["impact_force"], 25.0)
    force[7] = np.nan
    write_csv(tmp_path / "a.csv", channels("drop-test") | {"impact_force": force})
    (one,) = inspect_path(tmp_path).files
    column = next(column for column in one.found.columns if column.name == "impact_force")
    assert (np.isnan(column.values).sum(), column.limits[1]) == (1, 25.0)
    assert column.noise == pytest.approx(0.1, rel=0.1)
    assert [found.level for found in column.saturation] == [25.0]
    assert "# range = [-25, 25] # N" in propose(inspect_path(tmp_path), tmp_path)


@pytest.mark.parametrize("limit", [1.0, 0.02])
def test_coarse_steps_with_means_between_them_are_no_saturation(limit, tmp_path):
    """In cm, of a recorder that prints the mean of two samples at times; a sensor of finer steps that is cut off is one all the same."""
    swing = 0.04 * np.sin(2 * np.pi * np.arange(200) / 43.0) - 0.007
    values = np.round(swing, 2) if limit == 1.0 else np.minimum(np.round(swing, 4), limit)
    values[[60, 141]] = 8.4e-4, -1.8e-4
    name = "Velocity (m/s) Run #1"
    write_csv(tmp_path / "a.csv", {"Position (m) Run #1": values, name: np.gradient(swing, 0.02)}, 0.02 * np.arange(200))
    position, velocity = inspect_path(tmp_path).files[0].found.columns
    assert [found.level for found in position.saturation] == ([] if limit == 1.0 else [limit])
    assert (velocity.name, velocity.unit) == (name, "m/s")


def test_a_column_of_text_spoils_no_other(tmp_path):
    lines = [f"{t},{x},start" for t, x in zip(TIME, channels("drop-test")["hammer_displacement"], strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["time,hammer_displacement,note", *lines]))
    (one,) = inspect_path(tmp_path / "a.csv").files
    assert [column.name for column in one.found.columns] == ["hammer_displacement"]
    assert "'start' is not a number" in one.found.unusable["note"]


def test_columns_that_no_channel_was_found_for_are_named_in_the_proposal(tmp_path):
    lines = [f"{t},{x},{x}" for t, x in zip(TIME, channels("drop-test")["hammer_displacement"], strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["time,hammer_displacement,LVDT 2", *lines]))
    assert '# not taken for a channel: "LVDT 2"; name what is one in columns' in propose(inspect_path(tmp_path), tmp_path)


def test_a_folder_goes_on_where_one_file_is_broken(tmp_path):
    write_csv(tmp_path / "a.csv", channels("drop-test"))
    (tmp_path / "b.h5").write_bytes(b"nothing")
    (tmp_path / "notes.txt").write_text("no table")
    shutil.copy(tmp_path / "a.csv", tmp_path / "c.csv")
    (tmp_path / "c.csv").write_bytes((tmp_path / "c.csv").read_bytes())
    shutil.copy(tmp_path / "a.csv", tmp_path / "a.tsv")
    found = inspect_path(tmp_path)
    assert list(found.failed) == ["b.h5", "notes.txt"]
    assert [record.file for record in loaded(tmp_path).records] == ["a.csv", "c.csv"]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.doc", b"x", r"unknown suffix"),
        ("a.csv", b"", r"holds no text"),
        ("a.csv", b"x|y\n1|2\n1|2\n", r"has one column only"),
        ("a.csv", b"time,note\n1,b\n2,c\n", r"no usable column beside the time \(note: line 2"),
        ("a.npz", b"nothing", r"cannot be read as NumPy archive"),
    ],
)
def test_an_unreadable_file_is_one_clear_line(name, content, message, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ExperimentError, match=message):
        inspect_path(tmp_path / name)


@pytest.mark.parametrize("path", ["nowhere", "empty", "zero\0byte"])
def test_a_path_without_files(path, tmp_path):
    (tmp_path / "empty").mkdir()
    with pytest.raises(ExperimentError, match=r"does not exist|holds no recorded file|cannot be opened"):
        inspect_path(tmp_path / path)


@pytest.mark.parametrize("frequency", [0.7, 6.25, 11.437, 180.0])
def test_the_frequency_of_a_sine_is_found_within_its_error(frequency):
    values = noisy(np.sin(2 * np.pi * frequency * TIME + 1.0) + 4.0, 0.02)
    sine = fit_sine(TIME, values)
    assert abs(sine.frequency - frequency) < 4.0 * sine.stderr
    bound = np.sqrt(6.0) * 0.02 / (np.pi * np.sqrt(TIME.size))  # Cramér and Rao's, for 1 s of a unit sine of many periods
    assert sine.stderr == pytest.approx(bound, rel=0.1 if frequency > 5.0 else 1.0)
    assert fit_sine(TIME, np.ones(TIME.size)) is None


def settings_on(text):
    """The template with every setting switched on, and of two lines for one key the second."""
    switched = re.sub(r"^#(?=[^ ])", "", text, flags=re.MULTILINE)
    return switched.replace('kind = "linear" # spring', '# kind = "linear" # spring')


def test_the_template_loads_as_it_is_and_with_every_setting_on(tmp_path, monkeypatch):
    (tmp_path / "experiment.toml").write_text(TEMPLATE)
    write_csv(tmp_path / "drop.csv", channels("drop-test"))
    write_csv(tmp_path / "cart1.csv", channels("cart-excitation") | {"impact_force": noisy(0.0 * TIME, 0.1)})
    assert len(load_experiment(tmp_path).records) == 2

    known: dict[str, set[str]] = {}
    allow = Table.allow

    def watched(table, *keys, noun="key"):
        if noun == "key":  # the channels have a test of their own
            known.setdefault(re.sub(r"record '.*'|(?<=sensors\.)\w+", "", table.where), set()).update(keys)
        allow(table, *keys, noun=noun)

    monkeypatch.setattr(Table, "allow", watched)
    text = settings_on(TEMPLATE).replace("decimate = 4", "# decimate = 4").replace("fixed = true", "# fixed = true")  # one of two
    text = text.replace("rebuild_time", "# rebuild_time").replace("stretch = 1", "# stretch = 1")  # of other clocks
    text = text.replace("mask = [[0.8, 0.9]]", "mask = [[0.0008, 0.0009]]")
    text = text.replace("crop = [0.2, 2.5]", "crop = [0.0, 2.5]").replace("resample = 2000.0", "resample = 2048000.0")
    text = text.replace("lowpass = 500.0", "lowpass = 100000.0")  # of records of a millisecond
    (tmp_path / "experiment.toml").write_text(text)
    renamed = (tmp_path / "cart1.csv").read_text().replace("time,hammer_displacement", "t,LVDT 2 [mm]", 1)
    (tmp_path / "cart1.csv").write_text(renamed)
    _, record = load_experiment(tmp_path).records
    assert (record.base, record.held_back, record.time[-1]) == ("measured", True, pytest.approx(1e-3 * TIME[-1]))

    values = tomllib.loads(text)
    written = {f"[{key}]": set(table) for key, table in values.items() if isinstance(table, dict)}
    written |= {
        "": set().union(*values["record"], {"decimate", "rebuild_time", "stretch"}),
        "[sensors.]": set().union(*values["sensors"].values()),
    }
    forms = {"type", "order", "corner", "time_constant"}  # of one filter, of which the template shows two
    written |= {"lowpass of [recorder]": forms, "highpass of [sensors.]": forms, "[recorder]": {"lowpass", "highpass"}}
    written["[sensors.]"] |= {"lowpass"}
    of_n = values["parameters"]["n"]
    written |= {"experiment.toml": set(values), "[parameters.n]": {"fixed", *of_n}, "prior of [parameters.n]": set(of_n["prior"])}
    assert {where: keys - written[where] for where, keys in known.items()} == {where: set() for where in known}


def test_every_setting_of_the_template_is_explained():
    settings = [line for line in TEMPLATE.splitlines() if re.match(r"#?\w+ = ", line)]
    silent = {line.partition(" = ")[0].lstrip("#") for line in settings if " # " not in line}
    assert silent <= {"file", "kind", "gap", "unit", "sign"}  # explained in the remarks above their tables
    assert all(f"# {key}:" in TEMPLATE for key in silent)


def test_the_template_names_every_channel():
    from identification.experiment.channels import CHANNELS, KINDS

    assert set(tomllib.loads(settings_on(TEMPLATE))["sensors"]) == set(CHANNELS)
    assert all(f'"{kind}"' in TEMPLATE for kind in KINDS)


def test_names_with_control_characters_are_shown_escaped_and_proposed_exactly(tmp_path):
    name = "impact\u200f force\u202e [N]"
    write_csv(tmp_path / "a.csv", channels("drop-test") | {name: np.ones(TIME.size)})
    (tmp_path / "b\n[c]\x1b.csv").write_text("no numbers")
    found = inspect_path(tmp_path)
    text = propose(found, tmp_path)
    console = Console(width=400, record=True, file=io.StringIO(), force_terminal=False)
    console.print(summary(found))
    for shown in (text, console.export_text()):
        assert all(each.isprintable() for each in shown.replace("\n", ""))
        assert "b\\n[c]\\x1b.csv" in shown
    assert tomllib.loads(text).keys() <= {"schema", "experiment", "hammer", "suspension", "sensors", "record"}
    assert name in text.encode().decode("unicode_escape")
