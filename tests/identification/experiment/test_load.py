import hashlib
import subprocess
import sys

import numpy as np
import pytest

import identification.experiment.load as load
from identification.experiment import ExperimentError, ParameterOption, Sensor, Suspension, load_experiment
from tests.identification.experiment.malformed import SAMPLES, add, columns, csv_lines, edit, write_valid


@pytest.fixture
def folder(tmp_path):
    write_valid(tmp_path)
    return tmp_path


def rewrite(folder, change, name="cart1.csv"):
    values = columns()
    change(values)
    rows = zip(*values.values(), strict=True)
    (folder / name).write_text("\n".join([",".join(values), *(",".join(map(repr, map(float, row))) for row in rows)]))


def cart(folder, **options):
    return load_experiment(folder, **options).records[1]


def test_what_is_written_is_what_is_read(folder):
    experiment = load_experiment(folder)
    assert (experiment.name, experiment.mass, experiment.mass_is_known) == ("valid", 0.5, True)
    assert experiment.suspension == Suspension(kind="linear")
    assert experiment.sensors["cart_displacement"] == Sensor(unit="mm", noise=1e-5)
    drop, cart1 = experiment.records
    assert (drop.kind, drop.gap, drop.excitation_frequency, drop.base) == ("drop-test", 0.0, None, "sine")
    assert (cart1.stem, cart1.gap, cart1.excitation_frequency) == ("cart1", 0.001, 6.25)
    assert cart1.sha256 == hashlib.sha256((folder / "cart1.csv").read_bytes()).hexdigest()
    assert experiment.sha256 == hashlib.sha256((folder / "experiment.toml").read_bytes()).hexdigest()
    np.testing.assert_allclose(cart1.channels["cart_displacement"], 1e-3 * columns()["cart_displacement"], rtol=1e-6)
    assert cart1.noise == {"hammer_displacement": 1e-5, "cart_displacement": 1e-5, "impact_force": 0.15}
    assert cart1.noise_estimated == frozenset()


def test_pauses_do_not_make_samples_too_few_for_the_drive(folder):
    def pause(values):
        values["time"] = np.where(np.arange(len(values["time"])) < 5, values["time"], np.asarray(values["time"]) + 100.0)

    rewrite(folder, pause)
    assert cart(folder).excitation_frequency == 6.25
    assert "sampling is irregular" in " ".join(cart(folder).notices)


def test_a_drive_at_half_the_sampling_is_seen(folder):
    edit("excitation_frequency = 6.25", "excitation_frequency = 2000")(folder)
    rewrite(folder, lambda values: values.pop("cart_displacement"))
    assert cart(folder).excitation_frequency == pytest.approx(2000.0)


def test_a_drop_test_with_a_measured_cart_may_name_its_drive(folder):
    edit('kind = "drop-test"', 'kind = "drop-test"\nbase = "measured"\nexcitation_frequency = 6.25')(folder)
    assert load_experiment(folder).records[0].excitation_frequency == 6.25


def test_a_simulation_may_be_asked_for_few_samples(folder):
    edit("excitation_frequency = 6.25", "excitation_frequency = 6250")(folder)
    assert cart(folder, need_files=False).excitation_frequency == 6250.0


def test_folder_and_file_are_the_same(folder):
    assert load_experiment(str(folder / "experiment.toml")).sha256 == load_experiment(folder).sha256


def test_extensions_of_the_format(folder):
    edit('"linear"', '"pendulum"\nlength = 0.09')(folder)
    edit("mass = 0.5", "mass = 0.5\nestimate_mass = true")(folder)
    edit("[hammer]", '[contact]\nlaw = "hertz"\n[parameters.n]\nstart = 1.5\nfixed = true\n[hammer]')(folder)
    edit('name = "valid"\n', "")(folder)
    experiment = load_experiment(folder)
    assert experiment.suspension == Suspension(kind="pendulum", length=0.09)
    assert not experiment.mass_is_known
    assert experiment.law == "hertz"
    assert experiment.parameters == {"n": ParameterOption(start=1.5, fixed=True)}
    assert experiment.name == folder.name


def test_relative_displacement_is_a_channel(folder):
    edit("[sensors.hammer_displacement]", "[sensors.relative_displacement]")(folder)
    edit("gap = ", 'columns = { relative_displacement = "hammer_displacement" }\ngap = ')(folder)
    assert "relative_displacement" in cart(folder).channels


def test_columns_and_units(folder):
    lines = csv_lines()
    text = "\n".join(["t,LVDT 2 [mm],cart_displacement,impact_force", *lines[1:]])
    (folder / "cart1.csv").write_text(text)
    add('columns = { hammer_displacement = "LVDT 2 [mm]", time = "t" }\ntime_unit = "ms"')(folder)
    record = cart(folder)
    np.testing.assert_allclose(record.time, 1e-3 * columns()["time"], rtol=1e-6)
    np.testing.assert_allclose(record.channels["hammer_displacement"], columns()["hammer_displacement"], rtol=1e-6)


def test_an_initial_state_is_passed_on(folder):
    add("base_amplitude = 1e-3\nbase_phase = 0.5\ninitial_displacement = -1e-3\ninitial_velocity = 0.1")(folder)
    add("duration = 2\nsampling_frequency = 50")(folder)
    record = cart(folder)
    assert (record.base_amplitude, record.base_phase, record.duration, record.sampling_frequency) == (1e-3, 0.5, 2.0, 50.0)
    assert (record.initial_displacement, record.initial_velocity) == (-1e-3, 0.1)


def test_a_missing_channel_is_reported(folder):
    rewrite(folder, lambda values: values.pop("impact_force"))
    assert cart(folder).notices == ("impact_force is not recorded here.",)
    assert "impact_force" not in cart(folder).channels
    assert "impact_force" not in cart(folder).noise


def test_unused_columns_are_reported(folder):
    rewrite(folder, lambda values: values.update(temperature=values["time"], hammer_acceleration=values["time"]))
    assert cart(folder).notices == (
        "Columns without a table in [sensors] are not used: hammer_acceleration.",
        "Columns that are no channel are not used: temperature.",
    )


def test_lost_samples_are_reported(folder):
    def lose(values):
        values["impact_force"][[3, 4, 5, 20]] = np.nan
        values["cart_displacement"][10] = -np.inf

    rewrite(folder, lose)
    record = cart(folder)
    assert np.flatnonzero(np.isnan(record.channels["impact_force"])).tolist() == [3, 4, 5, 20]
    assert np.isnan(record.channels["cart_displacement"][10])
    assert record.notices == (
        "Column 'cart_displacement' is infinite, as in an overload, at sample 11 (0.0025 s): left out.",
        "cart_displacement: 1 sample is missing (NaN, infinite, beyond 3e+145 or empty), left out, in one stretch from 0.0025 s to "
        "0.0025 s (0 s long).",
        "impact_force: 4 samples are missing (NaN, infinite, beyond 3e+145 or empty), left out, in 2 stretches between 0.00075 s and "
        "0.005 s, the longest 3 samples from 0.00075 s.",
    )


def test_a_channel_without_a_sample_counts_as_not_recorded(folder):
    rewrite(folder, lambda values: values.update(impact_force=np.full(SAMPLES, np.nan)))
    assert cart(folder).notices == ("impact_force: no sample is usable; the channel counts as not recorded.",)
    assert "impact_force" not in cart(folder).channels


def test_irregular_sampling_is_reported(folder):
    def pause(values):
        values["time"][40:] += 0.002

    rewrite(folder, pause)
    assert cart(folder).notices == (
        "The sampling is irregular: steps of 0.00025 to 0.00225 s, median 0.00025; the longest follows 0.00975 s.",
    )


def test_stamps_that_are_merely_rounded_are_not_irregular(folder):
    rewrite(folder, lambda values: values.update(time=np.round(np.arange(SAMPLES) / 4096.0, 7)))
    assert cart(folder).notices == ()


def test_a_declared_range_masks_and_an_undeclared_one_is_only_reported(folder):
    def cut(values):
        values["impact_force"] = np.minimum(60.0 * np.sin(800.0 * values["time"]), 40.0)

    rewrite(folder, cut)
    (notice,) = cart(folder).notices
    assert "stretches lie at exactly 40 N, the largest value: the channel saturates; kept as recorded" in notice
    assert not np.isnan(cart(folder).channels["impact_force"]).any()
    edit("noise = 0.15", "noise = 0.15\nrange = [-100, 40]")(folder)
    record = cart(folder)
    (notice,) = record.notices
    assert "at or beyond the declared range, -100 to 40 N: left out, in " in notice
    assert np.isnan(record.channels["impact_force"]).sum() > 8
    assert np.nanmax(record.channels["impact_force"]) < 40.0


@pytest.mark.parametrize("limit", [4.1, 0.3, 7.7])
def test_a_range_masks_what_lies_at_it_in_the_unit_of_the_file(folder, limit):
    """4.1 mm is not the same number as 0.0041 m, to the last digit."""
    rewrite(folder, lambda values: values.update(cart_displacement=np.clip(1e4 * values["cart_displacement"], -limit, limit)))
    edit('unit = "mm"\nnoise = 1.0e-5', f'unit = "mm"\nnoise = 1.0e-5\nrange = [-{limit}e-3, {limit}e-3]')(folder)
    values = cart(folder).channels["cart_displacement"]
    assert np.isnan(values).sum() > 8
    assert not np.any(np.abs(values) > 0.999e-3 * limit)


def test_what_is_fitted_borrows_no_noise_from_what_is_held_back(folder):
    edit('unit = "mm"\nnoise = 1.0e-5', 'unit = "mm"')(folder)
    edit('file = "cart1.csv"', 'file = "cart1.csv"\nheld_back = true')(folder)
    edit('[[record]]\nfile = "drop', '[[record]]\nfile = "other.csv"\nkind = "drop-test"\ngap = 0.0\n[[record]]\nfile = "drop')(folder)
    rewrite(folder, lambda values: values.update(cart_displacement=np.zeros(SAMPLES)), "drop.csv")
    rewrite(folder, lambda values: None, "other.csv")
    noisy = np.random.default_rng(2).normal(0.0, 5.0, SAMPLES)
    rewrite(folder, lambda values: values.update(cart_displacement=noisy))
    noise = {record.stem: record.noise["cart_displacement"] for record in load_experiment(folder).records}
    assert noise["cart1"] > 100.0 * noise["other"]
    assert noise["drop"] == noise["other"]


def test_a_simulation_may_have_nothing_to_fit(folder):
    text = (folder / "experiment.toml").read_text().replace("[[record]]\n", "[[record]]\nheld_back = true\n")
    (folder / "experiment.toml").write_text(text)
    with pytest.raises(ExperimentError, match="every record of experiment.toml is held back: expected at least one to fit"):
        load_experiment(folder)
    assert all(record.held_back for record in load_experiment(folder, need_files=False).records)


def test_undeclared_noise_is_estimated_and_reported(folder):
    edit('unit = "N"\nnoise = 0.15', 'unit = "N"')(folder)
    record = cart(folder)
    assert record.noise_estimated == {"impact_force"}
    assert record.noise["impact_force"] == pytest.approx(0.15, rel=0.5)
    assert record.notices[0].startswith("Noise not declared, estimated as if it were white: impact_force 0.1")


def test_noise_of_a_channel_at_rest_is_borrowed_and_reported(folder):
    edit('unit = "mm"\nnoise = 1.0e-5', 'unit = "mm"')(folder)
    rewrite(folder, lambda values: values.update(cart_displacement=np.zeros(SAMPLES)), "drop.csv")
    drop, cart1 = load_experiment(folder).records
    assert drop.noise["cart_displacement"] == cart1.noise["cart_displacement"] == pytest.approx(1e-5, rel=0.5)
    assert drop.notices[0].endswith("taken from the other records.")
    rewrite(folder, lambda values: values.update(cart_displacement=np.zeros(SAMPLES)))
    drop, cart1 = load_experiment(folder).records
    assert drop.noise["cart_displacement"] == cart1.noise["cart_displacement"] == 1e-5
    assert drop.notices[0].endswith("taken from hammer_displacement.")


def test_computed_records_are_reported(folder):
    edit('[sensors.hammer_displacement]\nunit = "m"\nnoise = 1.0e-5', '[sensors.hammer_displacement]\nunit = "m"')(folder)
    rewrite(folder, lambda values: values.update(hammer_displacement=1e-2 * np.sin(10.0 * values["time"])))
    assert any("looks computed, not measured" in notice for notice in cart(folder).notices)


def test_without_a_file_the_declared_stamps_serve(folder):
    (folder / "cart1.csv").unlink()
    with pytest.raises(ExperimentError, match="has no file: expected its file, or duration and sampling_frequency"):
        load_experiment(folder, need_files=False)
    add("duration = 0.3\nsampling_frequency = 1000")(folder)
    record = cart(folder, need_files=False)
    np.testing.assert_allclose(record.time, np.arange(301) / 1000.0, rtol=1e-15)
    assert (record.channels, record.sha256) == ({}, None)
    with pytest.raises(ExperimentError, match=r"the file of record 'cart1\.csv' is missing"):
        load_experiment(folder)


def test_with_a_file_its_stamps_serve(folder):
    add("duration = 0.3\nsampling_frequency = 1000")(folder)
    assert cart(folder, need_files=False).time.size == SAMPLES
    rewrite(folder, lambda values: [values.pop(name) for name in list(values)[1:3]])
    assert cart(folder, need_files=False).time.size == SAMPLES


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("duration = 1e-4\nsampling_frequency = 100", "shorter than one sampling step"),
        ("duration = 1e9\nsampling_frequency = 1e9", "claims 1000000000000000001 samples: expected at most 50000000"),
    ],
)
def test_declared_stamps_have_limits(text, message, folder):
    (folder / "cart1.csv").unlink()
    add(text)(folder)
    with pytest.raises(ExperimentError, match=message):
        load_experiment(folder, need_files=False)


def test_a_measured_base_needs_no_frequency_but_a_cart_channel(folder):
    edit("excitation_frequency = 6.25", 'base = "measured"')(folder)
    assert (cart(folder).base, cart(folder).excitation_frequency) == ("measured", None)
    rewrite(folder, lambda values: values.pop("cart_displacement"))
    with pytest.raises(ExperimentError, match="has base = 'measured' and no recorded cart motion"):
        load_experiment(folder)


def test_the_layer_needs_no_jax():
    command = "import sys, identification.experiment; sys.exit(bool({'jax', 'equinox'} & set(sys.modules)))"
    assert subprocess.run([sys.executable, "-c", command]).returncode == 0


def test_records_are_not_compared_with_each_other_one_by_one(folder, monkeypatch):
    """Twice the records, twice the work."""
    asked = []
    whole = load.stem_of
    monkeypatch.setattr(load, "stem_of", lambda file: asked.append(file) or whole(file))
    text = (folder / "experiment.toml").read_text()
    for number in range(50):
        (folder / f"more{number}.csv").write_bytes((folder / "drop.csv").read_bytes())
        text += f'[[record]]\nfile = "more{number}.csv"\nkind = "drop-test"\ngap = 0.0\n'
    (folder / "experiment.toml").write_text(text)
    assert len(load_experiment(folder).records) == 52
    assert len(asked) == 52


def test_a_number_too_large_to_compute_with_counts_as_missing(folder):
    rewrite(folder, lambda values: values["impact_force"].__setitem__([3, 7], [1e200, -1e308]))
    record = cart(folder)
    assert np.flatnonzero(np.isnan(record.channels["impact_force"])).tolist() == [3, 7]
    assert "impact_force: 2 samples are missing (NaN, infinite, beyond 3e+145 or empty)" in record.notices[0]
