"""TDMS, universal files, MDF 4 and workbooks: what their own libraries write comes back, in SI; what is broken gives one clear line."""

import re
import sys

import numpy as np
import pytest

from identification.experiment import ExperimentError, load_experiment
from identification.experiment.readers import read_columns, read_here
from tests.identification.experiment.recorder_files import (
    RATE,
    SAMPLES,
    TIME,
    UNITS,
    values,
    write_excel,
    write_mdf4,
    write_tdms,
    write_uff,
)

LIBRARIES = {".tdms": "nptdms", ".uff": "pyuff", ".unv": "pyuff", ".mf4": "asammdf", ".xlsx": "python_calamine"}
WRITERS = {".tdms": write_tdms, ".uff": write_uff, ".unv": write_uff, ".mf4": write_mdf4, ".xlsx": write_excel}
each_suffix = pytest.mark.parametrize("suffix", LIBRARIES)
EXPERIMENT = """\
schema = 1
[hammer]
mass = 0.5
[suspension]
kind = "linear"
[sensors.hammer_displacement]
noise = 1.0e-5
[sensors.impact_force]
noise = 1.0
[[record]]
file = "run{suffix}"
kind = "drop-test"
gap = 0.0
columns = {{ hammer_displacement = "hammer", impact_force = "load cell" }}
"""


def write(path, channels=None, units=UNITS, **options):
    pytest.importorskip(LIBRARIES[path.suffix])
    WRITERS[path.suffix](path, values() if channels is None else channels, units, **options)
    return path


def read(path, *wanted):
    return read_columns(path, frozenset(wanted), path.name)


def experiment(folder, suffix, change=lambda text: text, **options):
    write(folder / f"run{suffix}", **options)
    (folder / "experiment.toml").write_text(change(EXPERIMENT.format(suffix=suffix)))
    return load_experiment(folder)


@each_suffix
def test_channels_units_and_time_come_back(suffix, tmp_path):
    found = read(write(tmp_path / f"a{suffix}"), "time", "hammer", "load cell", "not there")
    assert found.names == ("time", "hammer", "load cell")
    assert found.units == {"time": "s", **UNITS}
    for name, column in values().items():
        np.testing.assert_allclose(found.values[name], column, rtol=1e-11)
    np.testing.assert_allclose(found.values["time"], TIME, rtol=2e-6)  # a universal file writes its step with six digits


@each_suffix
def test_numbers_become_si_by_the_units_of_the_file(suffix, tmp_path):
    (record,) = experiment(tmp_path, suffix).records
    np.testing.assert_allclose(record.channels["hammer_displacement"], 1e-3 * values()["hammer"], rtol=1e-11)
    np.testing.assert_allclose(record.channels["impact_force"], 1e3 * values()["load cell"], rtol=1e-11)
    np.testing.assert_allclose(record.time, TIME, rtol=2e-6)
    assert record.notices == (("Of 2 sheets with numbers, 'S2' is read, which has the most.",) if suffix == ".xlsx" else ())


@each_suffix
def test_a_channel_may_bear_its_name_in_the_file(suffix, tmp_path):
    columns = dict(zip(("hammer_displacement", "impact_force"), values().values(), strict=True))
    units = {"hammer_displacement": "mm", "impact_force": "kN"}
    (record,) = experiment(tmp_path, suffix, lambda text: text.partition("columns")[0], channels=columns, units=units).records
    np.testing.assert_allclose(record.channels["impact_force"], 1e3 * values()["load cell"], rtol=1e-11)


@each_suffix
def test_a_declared_unit_serves_where_the_file_is_silent(suffix, tmp_path):
    def declare(text):
        return text.replace("noise = 1.0e-5", 'unit = "um"').replace("noise = 1.0\n", 'unit = "N"\n')

    (record,) = experiment(tmp_path, suffix, declare, units={}).records
    np.testing.assert_allclose(record.channels["hammer_displacement"], 1e-6 * values()["hammer"], rtol=1e-11)


@each_suffix
def test_units_of_the_record_overrule_the_file(suffix, tmp_path):
    (record,) = experiment(
        tmp_path, suffix, lambda text: text + 'units = { hammer_displacement = "cm" }\n', units={"hammer": "Volts", "load cell": "kN"}
    ).records
    np.testing.assert_allclose(record.channels["hammer_displacement"], 1e-2 * values()["hammer"], rtol=1e-11)


@pytest.mark.parametrize(
    ("units", "change", "message"),
    [
        (
            {"hammer": "furlong"},
            None,
            r"unit 'furlong' in the file of record 'run.*' for hammer_displacement is not a known unit: .* overrules",
        ),
        ({"hammer": "kN"}, None, r"unit 'kN' .* is a unit of force: expected one of displacement"),
        ({}, None, r"unit is missing in \[sensors\.hammer_displacement\], and the file of record 'run.*' states none"),
        ({"hammer": "mm"}, "m", r"states hammer_displacement in 'mm' and \[sensors\.hammer_displacement\] in 'm': expected one unit"),
        ({"hammer": "V"}, "m", r"states hammer_displacement in 'V' and"),
    ],
)
@each_suffix
def test_a_unit_that_cannot_be_right(suffix, units, change, message, tmp_path):
    def declare(text):
        return text if change is None else text.replace("noise = 1.0e-5", f'unit = "{change}"')

    with pytest.raises(ExperimentError, match=message):
        experiment(tmp_path, suffix, declare, units={"load cell": "kN"} | units)


@each_suffix
def test_a_missing_channel_is_named_beside_those_that_are_there(suffix, tmp_path):
    with pytest.raises(ExperimentError, match=r"has no column 'hammer' for hammer_displacement: expected it among .*load cell"):
        experiment(tmp_path, suffix, channels={"load cell": values()["load cell"], "knob": TIME})


@pytest.mark.parametrize("share", [0.0, 0.01, 0.2, 0.4, 0.9, 0.999])
@each_suffix
def test_a_truncated_file_is_one_clear_line(suffix, share, tmp_path, capsys):
    path = write(tmp_path / f"a{suffix}")
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(ExperimentError, match=r"record 'a\.\w+'.*(expected|export it again)") as caught:
        read(path, "time", "hammer", "load cell")
    assert "\n" not in str(caught.value)
    assert capsys.readouterr() == ("", "")


@each_suffix
def test_another_file_under_the_suffix_is_one_clear_line(suffix, tmp_path, capsys):
    pytest.importorskip(LIBRARIES[suffix])
    (tmp_path / f"a{suffix}").write_bytes(b"time,hammer\n0,1\n" * 30)
    with pytest.raises(ExperimentError, match=r"record 'a\.\w+'.*expected|cannot be read as"):
        read(tmp_path / f"a{suffix}", "time", "hammer")
    assert capsys.readouterr() == ("", "")


@each_suffix
def test_without_the_library_the_extra_is_named(suffix, tmp_path, monkeypatch):
    (tmp_path / f"a{suffix}").write_bytes(b"whatever")
    monkeypatch.setitem(sys.modules, LIBRARIES[suffix], None)
    with pytest.raises(ExperimentError, match=re.escape('run pip install "vibrojax[labdata]", or export')):
        read_here(tmp_path / f"a{suffix}", frozenset({"time"}), f"a{suffix}")


SHORT = {"hammer": values()["hammer"], "load cell": values()["load cell"][: SAMPLES // 2]}
DIFFERENT = r"channels 'hammer' \(200 samples from 0 at steps of 0\.000244141\) and 'load cell' \(100 samples .*\) are sampled differently"


def test_channels_of_different_length_are_refused(tmp_path):
    for suffix, options in {".tdms": {}, ".unv": {}, ".mf4": {"apart": True}}.items():
        path = write(tmp_path / f"a{suffix}", SHORT, **options)
        with pytest.raises(ExperimentError, match=DIFFERENT):
            read(path, "time", "hammer", "load cell")
        assert read(path, "time", "load cell").values["time"].size == SAMPLES // 2


def test_channels_at_different_rates_are_refused(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    steps = {"hammer": 1.0 / RATE, "load cell": 2.0 / RATE}
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(
            [nptdms.ChannelObject("run", name, column, {"wf_increment": steps[name]}) for name, column in values().items()]
        )
    with pytest.raises(ExperimentError, match=r"sampled differently: expected one time axis for all channels"):
        read(tmp_path / "a.tdms", "time", "hammer", "load cell")


@pytest.mark.parametrize(("kind", "message"), [("text", "holds"), ("complex", "holds complex")])
def test_what_holds_no_real_numbers_is_refused(kind, message, tmp_path):
    column = np.array(["a"] * SAMPLES) if kind == "text" else np.exp(1j * TIME)
    writers = {".tdms": {}, ".mf4": {}} if kind == "text" else {".tdms": {}, ".uff": {"ord_data_type": 6}}
    for suffix, options in writers.items():
        column = column.astype(object) if (suffix, kind) == (".tdms", "text") else column
        column = np.array([b"a"] * SAMPLES) if (suffix, kind) == (".mf4", "text") else column
        path = write(tmp_path / f"a{suffix}", {"hammer": column}, **options)
        with pytest.raises(ExperimentError, match=f"'hammer' {message}"):
            read(path, "time", "hammer")


# TDMS


def test_tdms_start_offset_and_start_time_place_the_samples(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    began = {"hammer": np.datetime64("2026-03-01T10:00:00.000000"), "load cell": np.datetime64("2026-03-01T10:00:00.500000")}
    objects = [
        nptdms.ChannelObject("run", name, column, {"wf_increment": 1 / RATE, "wf_start_offset": 0.25, "wf_start_time": began[name]})
        for name, column in values().items()
    ]
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(objects)
    np.testing.assert_allclose(read(tmp_path / "a.tdms", "time", "load cell").values["time"], 0.25 + TIME, rtol=1e-15)
    with pytest.raises(ExperimentError, match=r"\(200 samples from 0\.25 .*\) and 'load cell' \(200 samples from 0\.75 "):
        read(tmp_path / "a.tdms", "time", "hammer", "load cell")


def test_tdms_takes_the_time_from_a_channel_of_numbers_or_of_stamps(tmp_path):
    stamps = np.datetime64("2026-03-01T10:00:00.000000") + (1e6 * TIME).astype("timedelta64[us]")
    path = write(tmp_path / "a.tdms", {"time": TIME, "clock": stamps, **values()}, wf_increment=None)
    found = read(path, "time", "clock", "hammer")
    assert found.names == ("time", "clock", "hammer", "load cell")
    np.testing.assert_array_equal(found.values["time"], TIME)
    np.testing.assert_allclose(found.values["clock"], TIME, atol=2e-6)  # written in microseconds


@pytest.mark.parametrize(
    ("increment", "message"),
    [(None, r"has no time axis: expected the sampling step"), (0.0, r"wf_increment .* is 0\.0: expected a time step")],
)
def test_tdms_without_a_step(increment, message, tmp_path):
    with pytest.raises(ExperimentError, match=message):
        read(write(tmp_path / "a.tdms", wf_increment=increment), "time", "hammer")


def test_tdms_names_the_group_where_a_name_repeats(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    with nptdms.TdmsWriter(tmp_path / "a.tdms") as writer:
        objects = [nptdms.ChannelObject(group, "x", TIME + shift, {"wf_increment": 1 / RATE}) for shift, group in enumerate(("one", "two"))]
        writer.write_segment([*objects, nptdms.ChannelObject("two", "F", TIME)])
        writer.write_segment(objects)
    found = read(tmp_path / "a.tdms", "two/x")
    assert found.names == ("time", "one/x", "two/x", "F")
    np.testing.assert_array_equal(found.values["two/x"], np.concatenate((TIME, TIME)) + 1.0)


def test_tdms_applies_the_scaling_that_the_file_declares(tmp_path):
    scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.5}
    scale |= {"NI_Scale[0]_Linear_Y_Intercept": 3.0, "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF}
    raw = np.arange(SAMPLES, dtype=np.int16)
    found = read(write(tmp_path / "a.tdms", {"hammer": raw}, **scale), "hammer")
    np.testing.assert_array_equal(found.values["hammer"], 3.0 + 0.5 * raw)


# universal files


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("even", [False, True])
def test_universal_files_of_every_kind_come_back(even, binary, tmp_path):
    time = TIME if even else np.round(TIME + 1e-5 * np.sin(TIME * 900.0), 7)
    found = read(write(tmp_path / "a.uff", time=time, even=even, binary=binary), "time", "hammer")
    np.testing.assert_allclose(found.values["hammer"], values()["hammer"], rtol=1e-11)
    np.testing.assert_allclose(found.values["time"], time, rtol=1e-5)


def test_universal_time_in_milliseconds(tmp_path):
    (record,) = experiment(tmp_path, ".unv", time=1e3 * TIME, abscissa_axis_units_lab="ms").records
    np.testing.assert_allclose(record.time, TIME, rtol=1e-5)


def test_universal_names_come_from_node_and_direction_where_the_text_repeats(tmp_path):
    path = write(tmp_path / "a.unv", id1="Time Response")
    assert read(path).names == ("time", "1+Z", "2+Z")
    (tmp_path / "b.unv").write_bytes(b"")
    (tmp_path / "b.unv").unlink()
    assert read(write(tmp_path / "b.unv", id1="NONE", rsp_node=7)).names == ("time", "dataset 1", "dataset 2")


@pytest.mark.parametrize("fields", [{"func_type": 4}, {"abscissa_spec_data_type": 18}])
def test_a_frequency_response_is_no_record(fields, tmp_path):
    with pytest.raises(ExperimentError, match=r"data set 'hammer' is of function type .* expected a time response"):
        read(write(tmp_path / "a.unv", **fields), "time", "hammer")


def test_a_universal_file_whose_data_set_is_short(tmp_path):
    path = write(tmp_path / "a.unv")
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:20] + lines[30:]))
    with pytest.raises(ExperimentError, match=r"data set 'hammer' holds 160 samples and announces 200"):
        read(path, "time", "hammer")


# MDF 4


def test_mdf_groups_on_one_time_axis_are_one_record(tmp_path):
    found = read(write(tmp_path / "a.mf4", apart=True), "time", "hammer", "load cell")
    np.testing.assert_array_equal(found.values["time"], TIME)


def test_mdf_names_the_group_where_a_name_repeats(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        for group in ("fast", "slow"):
            file.append([asammdf.Signal(TIME, TIME, name="x", unit="mm"), asammdf.Signal(TIME, TIME, name=group)], acq_name=group)
        file.save(tmp_path / "a.mf4", overwrite=True)
    assert read(tmp_path / "a.mf4").names == ("time", "fast/x", "fast", "slow/x", "slow")


def test_mdf_samples_marked_invalid_are_missing(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    invalid = np.zeros(SAMPLES, dtype=bool)
    invalid[7:9] = True
    signal = asammdf.Signal(np.arange(SAMPLES, dtype=np.int32), TIME, name="hammer", unit="mm", invalidation_bits=invalid)
    with asammdf.MDF(version="4.10") as file:
        file.append([signal])
        file.save(tmp_path / "a.mf4", overwrite=True)
    assert np.flatnonzero(np.isnan(read(tmp_path / "a.mf4", "time", "hammer").values["hammer"])).tolist() == [7, 8]


def test_mdf_over_an_angle_is_no_record(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(TIME, TIME, name="hammer", master_metadata=("crank", 2))])
        file.save(tmp_path / "a.mf4", overwrite=True)
    with pytest.raises(ExperimentError, match=r"channel 'hammer' is recorded over 'crank', which is no time"):
        read(tmp_path / "a.mf4", "time", "hammer")


def with_formula(path, formula):
    """A channel behind an algebraic conversion."""
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.arange(SAMPLES), TIME, name="hammer", conversion={"formula": formula})])
        file.save(path, overwrite=True)
    return path


@pytest.mark.parametrize("formula", ["9**9**9**9", "2*X+1"])
def test_an_mdf_formula_is_refused_and_not_evaluated(formula, tmp_path):
    message = re.escape(f"channel 'hammer' is converted by the formula {formula!r}, which is not evaluated")
    with pytest.raises(ExperimentError, match=message):
        read(with_formula(tmp_path / "a.mf4", formula), "time", "hammer")


@pytest.mark.parametrize("conversion", [{"a": 2.0, "b": 1.0}, {"P1": 0, "P2": 2, "P3": 1, "P4": 0, "P5": 0, "P6": 1}])
def test_mdf_linear_and_rational_conversions_are_applied(conversion, tmp_path):
    asammdf = pytest.importorskip("asammdf")
    raw = np.arange(SAMPLES, dtype=np.int32)
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(raw, TIME, name="hammer", conversion=conversion)])
        file.save(tmp_path / "a.mf4", overwrite=True)
    np.testing.assert_array_equal(read(tmp_path / "a.mf4", "hammer").values["hammer"], 2.0 * raw + 1.0)


def test_mdf_text_is_refused(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    table = {"val_0": 0, "text_0": "low", "val_1": 1, "text_1": "high"}
    with asammdf.MDF(version="4.10") as file:
        file.append([asammdf.Signal(np.arange(SAMPLES) % 2, TIME, name="hammer", conversion=table)])
        file.save(tmp_path / "a.mf4", overwrite=True)
    with pytest.raises(ExperimentError, match="channel 'hammer' is converted to text"):
        read(tmp_path / "a.mf4", "hammer")


def test_an_mdf_file_that_was_never_finished(tmp_path):
    path = write(tmp_path / "a.mf4")
    path.write_bytes(b"UnFinMF " + path.read_bytes()[8:])
    with pytest.raises(ExperimentError, match="the recorder did not finish the file"):
        read(path, "time")


@each_suffix
def test_flipped_bytes_are_an_error_or_numbers_and_no_crash(suffix, tmp_path, capsys):
    whole = write(tmp_path / f"a{suffix}").read_bytes()
    draws = np.random.default_rng(11)
    for case in range(12):
        damaged = bytearray(whole)
        for place in draws.integers(0, min(len(whole), 1500) if case % 2 else len(whole), 3):
            damaged[place] = draws.integers(0, 256)
        path = tmp_path / f"{case}{suffix}"
        path.write_bytes(damaged)
        try:
            found = read(path, "time", "hammer")
        except ExperimentError as error:
            assert "\n" not in str(error)
        else:
            assert all(column.dtype == np.float64 and column.ndim == 1 for column in found.values.values())
    assert capsys.readouterr() == ("", "")
