"""The jobs behind the commands: what they refuse to write, and why."""

import dataclasses
import gzip
import json
from pathlib import Path

import numpy as np
import pytest

from identification.commands.run import run_fit, run_simulate
from identification.experiment import load_experiment
from tests.identification.made_result import made_result
from vibrojax.data_files import data_path
from vibrojax.effects import GainError
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.model_file import read_model, write_model


def test_a_fit_that_did_not_converge_says_what_to_do_and_writes_nothing(monkeypatch, tmp_path):
    result = dataclasses.replace(made_result(samples=600), converged=False, warnings=("the iteration stopped after 40 steps",))
    monkeypatch.setattr("identification.commands.run.fit_experiment", lambda *nouns, **options: result)
    with pytest.raises(NoConvergenceError, match=r"stopped after 40 steps; check units, signs, mass and gaps, or ask `vibrojax diagnose`"):
        run_fit(data_path("example"), tmp_path)
    assert not list(tmp_path.iterdir())


def test_numbers_are_shown_before_anything_is_drawn(monkeypatch, tmp_path):
    monkeypatch.setattr("identification.commands.run.fit_experiment", lambda *nouns, **options: made_result(samples=600))
    said = []
    run_fit(data_path("example"), tmp_path, progress=said.append, show=lambda summary: said.append("the numbers"))
    assert said.index("the numbers") < said.index("drawing the report")
    assert said[-1].endswith(" figures") and (tmp_path / "report.html").exists()


@pytest.mark.parametrize(("unit", "message"), [("N/m", "stopped here"), ("N/mm", "k")])
def test_a_reference_may_name_what_follows_from_the_fit_and_is_refused_before_it(monkeypatch, tmp_path, unit, message):
    """The stiffness follows from mass and natural frequency."""

    def fitting(*nouns, **options):
        raise NoConvergenceError("stopped here")

    monkeypatch.setattr("identification.commands.run.fit_experiment", fitting)
    row = f'[[value]]\nname = "k"\nsymbol = "k"\nvalue = 700.0\nunit = "{unit}"\nsource = "scales"\n'
    (tmp_path / "table.toml").write_text(f'schema = 1\ntitle = "table"\n{row}', encoding="utf-8")
    with pytest.raises(NoConvergenceError if unit == "N/m" else InputError, match=message):
        run_fit(data_path("example"), tmp_path, reference=tmp_path / "table.toml")


def test_a_fit_becomes_files_from_which_a_simulation_runs(tmp_path):
    """Nothing stands in for anything: folder in, results, tables out; a recorder's fault shows only as recorded."""
    rig, done, plain, faulty = (tmp_path / name for name in ("rig", "fit", "plain", "faulty"))
    for folder in (rig, done, plain, faulty):
        folder.mkdir()
    source = data_path("example")
    lines = gzip.decompress((source / "drop.csv.gz").read_bytes()).decode().splitlines(keepends=True)
    (rig / "drop.csv").write_text("".join(lines[:2001]))
    head, first, *_ = (source / "experiment.toml").read_text(encoding="utf-8").split("[[record]]")
    (rig / "experiment.toml").write_text(head + "[[record]]" + first.replace("drop.csv.gz", "drop.csv"), encoding="utf-8")
    run_fit(rig, done)
    assert {"fit.json", "model.json", "result.nc", "report.html"} <= {path.name for path in done.iterdir()}
    fitted = json.loads((done / "fit.json").read_text(encoding="utf-8"))["parameters"]
    model = read_model(done / "model.json")
    assert {name: float(value) for name, value in model.values().items()} == pytest.approx({n: p["value"] for n, p in fitted.items()})
    write_model(
        dataclasses.replace(model, effects=(GainError(factor=1.1, of_channel="impact_force"),)), done / "faulty.json", provenance={}
    )
    run_simulate(done / "faulty.json", rig, plain)
    run_simulate(done / "faulty.json", rig, faulty, as_recorded=True)
    tables = [np.genfromtxt(folder / "drop.csv", delimiter=",", names=True) for folder in (plain, faulty)]
    assert tables[0].dtype.names[:2] == ("time", "hammer_displacement")
    assert np.array_equal(tables[0]["time"], load_experiment(rig).records[0].time)
    push = tables[0]["impact_force"]
    assert push.max() > 1.0
    np.testing.assert_allclose(tables[1]["impact_force"][push > 1.0] / push[push > 1.0], 1.1, rtol=1e-6)


def test_a_simulation_keeps_the_time_stamps_of_a_clock_that_began_at_midnight(monkeypatch, small, tmp_path):
    record = small.records[0]
    time = 86400.0 + np.arange(len(record.time)) / 51200.0
    shifted = dataclasses.replace(small, records=(dataclasses.replace(record, time=time),))
    monkeypatch.setattr("identification.commands.run.load_experiment", lambda path, need_files: shifted)
    monkeypatch.setattr("identification.commands.run.read_model", lambda path: None)
    monkeypatch.setattr(
        "identification.commands.run.simulate_record", lambda *nouns, **options: {"time": time, "hammer_displacement": 0.0 * time}
    )
    run_simulate(Path("model.json"), Path("experiment.toml"), tmp_path)
    (table,) = tmp_path.iterdir()
    assert np.array_equal(np.loadtxt(table, delimiter=",", skiprows=1)[:, 0], time)


def test_a_simulation_does_not_take_the_place_of_the_records(monkeypatch, small, tmp_path):
    (tmp_path / "drop.csv").write_text("time\n", encoding="utf-8")
    record = dataclasses.replace(small.records[0], file="drop.csv")
    measured = dataclasses.replace(small, folder=tmp_path, records=(record,))
    monkeypatch.setattr("identification.commands.run.load_experiment", lambda path, need_files: measured)
    monkeypatch.setattr("identification.commands.run.read_model", lambda path: None)
    with pytest.raises(InputError, match=r"the tables would replace the records drop.csv: expected another folder"):
        run_simulate(Path("model.json"), tmp_path, tmp_path / "staged", out=tmp_path)
    assert (tmp_path / "drop.csv").read_text() == "time\n"
