"""Faults found in trials, as small inputs beside the repository: what each is read as. Skipped where the folder is missing."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from identification.estimation.estimate import fit_experiment
from identification.experiment import load_experiment
from identification.inspection import inspect_path, propose

FAULTS = Path(__file__).resolve().parents[3] / "shared" / "faults"
pytestmark = pytest.mark.skipif(not FAULTS.is_dir(), reason="the inputs of the trials lie beside the repository and are not there")


def proposed(name, folder, file="drop.csv"):
    """The proposal for one file, with the operator's part, and its record."""
    shutil.copy(FAULTS / name / file, folder / file)
    text = propose(inspect_path(folder), folder).replace("# mass = 0.4", "mass = 0.62").replace("# gap = 0.0", "gap = 0.0")
    (folder / "experiment.toml").write_text(text, encoding="utf-8")
    (record,) = load_experiment(folder).records
    return text, record


def written(name, file="drop.csv"):
    """Numbers of a file, NaN for what is none."""
    return np.genfromtxt(FAULTS / name / file, delimiter=",", skip_header=1)


def test_04_inch_and_lbs(tmp_path):
    text, record = proposed("04-inch-lbs", tmp_path)
    _, inches, pounds = written("04-inch-lbs").T
    assert 'unit = "in" # as' in text and 'unit = "lbf" # as' in text
    np.testing.assert_allclose(record.channels["hammer_displacement"], 0.0254 * inches, rtol=1e-12)
    np.testing.assert_allclose(record.channels["impact_force"], 4.4482216152605 * pounds, rtol=1e-12)


@pytest.mark.parametrize(("file", "kind"), [("drop.csv", "drop-test"), ("cart.csv", "cart-excitation")])
def test_05_marks_for_no_reading(file, kind, tmp_path):
    text, record = proposed("05-sentinel", tmp_path, file)
    assert f'kind = "{kind}"' in text
    assert ("excitation_frequency = 7.4 " in text) == (kind == "cart-excitation")
    marked = np.isin(written("05-sentinel", file)[:, 1:], (-9.999, -9999.0))
    assert marked.any()
    for channel, places in zip(record.channels.values(), marked.T, strict=True):
        np.testing.assert_array_equal(np.isnan(channel), places)


def test_06_two_samples_for_each_stamp(tmp_path):
    _, record = proposed("06-two-samples-per-stamp", tmp_path)
    np.testing.assert_allclose(np.diff(record.time), 1.0 / 2000.0, rtol=1e-9)
    assert "They are taken to come evenly, at 2000 Hz; the stamps scatter about that by" in " ".join(record.notices)


def test_07_a_row_of_units_below_numbered_channels():
    (one,) = inspect_path(FAULTS / "07-unit-row-scope" / "drop.csv").files
    assert (one.found.time.name, one.found.time_unit) == ("x-axis", "s")
    assert [(column.name, column.unit) for column in one.found.columns] == [("1", "Volt"), ("2", "Volt")]


def test_08_a_clock_that_steps_back(tmp_path):
    pytest.importorskip("asammdf")
    text, record = proposed("08-clock-step-back", tmp_path, "drop.mf4")
    assert "stretch = 2 # guess" in text
    assert "sample 1001 (0.49 s) to 2001" in " ".join(record.notices)
    assert (record.time.size, record.time[0]) == (1001, pytest.approx(0.49))


def test_09_overloads(tmp_path):
    _, record = proposed("09-overload-sign", tmp_path)
    assert int(np.isnan(record.channels["impact_force"]).sum()) == 11
    assert "is infinite, as in an overload, at 11 samples, from sample 131 (-0.035 s) to 658" in " ".join(record.notices)


def test_10_rows_below_the_samples(tmp_path):
    _, record = proposed("10-footer", tmp_path)
    assert record.time.size == 2001
    assert "from line 2004 on ('Max,0.4,40.1'), is left out" in " ".join(record.notices)


@pytest.mark.thorough
def test_03_the_recorders_filter_declared(tmp_path):
    """The stop and the frequency; the hammer's suspension has dry friction there, so the damping ratio is not that of the rig."""
    shutil.copytree(FAULTS / "03-recorder-lowpass", tmp_path / "rig", copy_function=shutil.copyfile)
    (tmp_path / "rig").chmod(0o755)
    declared = '\n[recorder]\nlowpass = { type = "butterworth", order = 4, corner = 1100.0 }\n'
    text = (FAULTS / "03-recorder-lowpass" / "experiment.toml").read_text() + declared
    (tmp_path / "rig" / "experiment.toml").write_text(text)
    result = fit_experiment(load_experiment(tmp_path / "rig"))
    found = {p.spec.name: (p.value, p.stderr) for p in result.parameters}
    for name, true in {"k_i": 1.1e7, "n": 1.62, "lambda_i": 0.48, "f_n": 4.1}.items():
        value, stderr = found[name]
        assert abs(value - true) < 3.0 * stderr, name
