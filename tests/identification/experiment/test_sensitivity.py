"""Sensors whose output was recorded: their sensitivities, and files that state volts."""

import re

import numpy as np
import pytest
from scipy.constants import g

from identification.experiment import ExperimentError, load_experiment
from identification.experiment.channels import read_sensitivity
from tests.identification.experiment.malformed import columns, edit, write_valid

CART = "[sensors.cart_displacement]"


@pytest.mark.parametrize(
    ("text", "dimension", "unit", "si"),
    [
        ("11.2 mV/N", "force", "V", 1e3 / 11.2),
        ("11.2mV/N", "force", "mV", 1.0 / 11.2),
        ("100 mV / g", "acceleration", "V", 10.0 * g),
        ("10.2 mV/(m/s^2)", "acceleration", "mV", 1.0 / 10.2),
        ("10.2 mV/m/s²", "acceleration", "mV", 1.0 / 10.2),
        ("0.8 V/mm", "displacement", "V", 1e-3 / 0.8),
        ("1.6e0 mA/mm", "displacement", "mA", 1e-3 / 1.6),
        ("2 µV/kN", "force", "uV", 500.0),
        ("10.2 mV/(m/(s^2))", "acceleration", "mV", 1.0 / 10.2),
    ],
)
def test_one_unit_of_the_output_is_worth(text, dimension, unit, si):
    assert read_sensitivity(text, dimension, "").factor(unit, "") == pytest.approx(si, rel=1e-12)


@pytest.mark.parametrize(
    "text",
    ["11.2", "mV/N", "0 mV/N", "-3 mV/N", "nan mV/N", "11.2 N/mV", "11.2 mV", "11,2 mV/N", "1e999 mV/N", "1_000 mV/N", ""],
)
def test_what_is_no_sensitivity(text):
    expected = r"is '.*': expected a number above 0 with one of .*mV.* over a unit of force; write it as \"11.2 mV/N\""
    with pytest.raises(ExperimentError, match=expected):
        read_sensitivity(text, "force", CART)


def test_a_rated_output_is_no_sensitivity():
    with pytest.raises(ExperimentError, match=r"is '2 mV/V', a rated output over its supply: expected .* write \"0.04 mV/N\""):
        read_sensitivity("2 mV/V", "force", CART)


def test_no_sensor_has_such_a_sensitivity():
    with pytest.raises(ExperimentError, match=r"is '1e300 V/um': expected one that a sensor can have"):
        read_sensitivity("1e300 V/um", "displacement", CART)


def test_what_it_measures_must_be_a_unit_of_the_channel():
    with pytest.raises(ExperimentError, match=r"unit 'mm' in the sensitivity of \[s\] is a unit of displacement: expected one of force"):
        read_sensitivity("11.2 mV/mm", "force", "[s]")


@pytest.fixture
def folder(tmp_path):
    """A cart whose sensor gives 0.5 V/mm, in a file of volts."""
    write_valid(tmp_path)
    edit(f'{CART}\nunit = "mm"', f'{CART}\nsensitivity = "500 mV/mm"\nunit = "V"')(tmp_path)
    return tmp_path


def rename(folder, name):
    """Head the cart's column in both files so."""
    for file in ("drop.csv", "cart1.csv"):
        path = folder / file
        path.write_text(path.read_text().replace("cart_displacement", name, 1))
    toml = folder / "experiment.toml"
    toml.write_text(toml.read_text().replace("[[record]]", f'[[record]]\ncolumns = {{ cart_displacement = "{name}" }}'))


def read(folder):
    return load_experiment(folder).records[1].channels["cart_displacement"]


def test_volts_are_read_through_the_sensitivity(folder):
    np.testing.assert_allclose(read(folder), columns()["cart_displacement"] / 500.0, rtol=1e-6)
    edit('unit = "V"', "")(folder)  # the unit is then that of the sensitivity, mV
    np.testing.assert_allclose(read(folder), columns()["cart_displacement"] / 500e3, rtol=1e-6)


def test_brackets_behind_the_name_state_the_unit(folder):
    edit('unit = "V"', "")(folder)
    rename(folder, "Laser 2 (V)")
    np.testing.assert_allclose(read(folder), columns()["cart_displacement"] / 500.0, rtol=1e-6)


@pytest.mark.parametrize(
    ("written", "name", "message"),
    [
        ('unit = "mm"', "Laser 2 (V)", "states cart_displacement in 'V' and [sensors.cart_displacement] in 'mm': expected one unit; "),
        ('unit = "mm"', "Laser 2 (V)", "or give the sensitivity of the sensor there"),
        (
            "",
            "Laser 2 (V)",
            "states cart_displacement in 'V': expected the sensitivity of the sensor; add a line 'sensitivity = \"0.8 V/mm\"'",
        ),
        (
            "",
            "Laser 2 [mA]",
            "states cart_displacement in 'mA': expected the sensitivity of the sensor; add a line 'sensitivity = \"0.8 mA/mm\"",
        ),
        ('sensitivity = "0.5 V/mm"', "Laser 2 (mm)", "unit 'mm' in the file of record 'drop.csv' for cart_displacement does not suit"),
        (
            'sensitivity = "0.5 V/mm"\nunit = "mm"',
            "Laser 2",
            "does not suit the sensitivity of 0.5 V/mm: expected one of the sensor's output",
        ),
        ('sensitivity = "0.5 V/mm"', "Laser 2 (mm)", 'units = { cart_displacement = "mm" } in the record overrules the file'),
        ('sensitivity = "0.5 V/mm"\nunit = "V"', "Laser 2 (mm)", "in 'mm' and [sensors.cart_displacement] in 'V': expected one unit"),
        ('unit = "mV"', "Laser 2", "unit 'mV' in [sensors.cart_displacement] is a unit of voltage: expected one of displacement"),
        ('unit = "mV"', "Laser 2", "where the numbers are a sensor's output, give its sensitivity"),
    ],
)
def test_statements_that_do_not_agree_are_refused(folder, written, name, message):
    edit('sensitivity = "500 mV/mm"\nunit = "V"', written)(folder)
    rename(folder, name)
    with pytest.raises(ExperimentError, match=re.escape(message)):
        load_experiment(folder)


def test_a_name_that_contradicts_the_table_by_a_factor_is_a_notice(folder):
    edit('sensitivity = "500 mV/mm"\nunit = "V"', 'unit = "m"')(folder)
    rename(folder, "Laser 2 [mm]")
    np.testing.assert_allclose(read(folder), columns()["cart_displacement"], rtol=1e-6)
    assert "The name of column 'Laser 2 [mm]' says mm, the experiment file m, which counts." in load_experiment(folder).records[1].notices


@pytest.mark.parametrize("name", ["Probe (A)", "Probe (1)", "Probe (raw)", "Probe (g)", "Probe (mm)"])
def test_brackets_that_are_no_other_unit_of_the_channel_say_nothing(folder, name):
    edit('sensitivity = "500 mV/mm"\nunit = "V"', 'unit = "mm"')(folder)
    plain = load_experiment(folder).records[1]
    rename(folder, name)
    named = load_experiment(folder).records[1]
    np.testing.assert_array_equal(named.channels["cart_displacement"], plain.channels["cart_displacement"])
    assert named.notices == plain.notices


@pytest.mark.parametrize(
    ("stated", "unit", "says"), [("", "ms", ""), ('time_unit = "ms"', "ms", ""), ('time_unit = "us"', "us", "ms, the experiment file us")]
)
def test_brackets_state_the_unit_of_time_too(folder, stated, unit, says):
    path = folder / "cart1.csv"
    path.write_text(path.read_text().replace("time,", "t [ms],", 1))
    edit('file = "cart1.csv"', f'file = "cart1.csv"\ncolumns = {{ time = "t [ms]" }}\n{stated}')(folder)
    edit("excitation_frequency = 6.25", "excitation_frequency = 6250")(folder)
    record = load_experiment(folder, need_files=False).records[1]
    np.testing.assert_allclose(record.time, columns()["time"] * {"ms": 1e-3, "us": 1e-6}[unit], rtol=1e-6)
    assert says in " ".join(record.notices)
    assert ("which counts" in " ".join(record.notices)) == bool(says)


def test_a_record_may_do_without_the_sensor(folder):
    """One file was written in mm by another logger."""
    toml = folder / "experiment.toml"
    toml.write_text(toml.read_text().replace("[[record]]", '[[record]]\nunits = { cart_displacement = "mm" }'))
    np.testing.assert_allclose(read(folder), 1e-3 * columns()["cart_displacement"], rtol=1e-6)


def test_a_record_overrules_what_its_file_states(folder):
    rename(folder, "Laser 2 (mm)")
    toml = folder / "experiment.toml"
    toml.write_text(toml.read_text().replace("[[record]]", '[[record]]\nunits = { cart_displacement = "mV" }'))
    np.testing.assert_allclose(read(folder), columns()["cart_displacement"] / 500e3, rtol=1e-6)


def test_a_volt_that_stands_for_the_quantity_is_declared_as_the_unit(folder):
    edit('sensitivity = "500 mV/mm"\nunit = "V"', 'unit = "V"')(folder)
    rename(folder, "Laser 2 (V)")
    np.testing.assert_allclose(read(folder), columns()["cart_displacement"], rtol=1e-6)
