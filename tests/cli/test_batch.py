"""Every experiment below a folder: one that fails, one that has changed, and a batch that is killed and called again."""

import csv
import dataclasses
import fcntl
import gzip
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from identification.commands import run
from identification.result.files import fit_json, state_files
from tests.identification.made_result import made_result
from vibrojax.cli import batch, fit
from vibrojax.cli.batch import FitJob
from vibrojax.data_files import data_path
from vibrojax.errors import InputError, NoConvergenceError
from vibrojax.json_file import write_json

RIG = """schema = 1
[experiment]
name = "{name}"
[hammer]
mass = 0.5
[suspension]
kind = "linear"
[[record]]
file = "drop.csv"
kind = "drop-test"
gap = 0.0
"""
NAMES = ["monday/a", "monday/b", "monday/c & d", "tuesday"]


def made_rig(folder: Path) -> None:
    folder.mkdir(parents=True)
    (folder / "experiment.toml").write_text(RIG.format(name=folder.name), encoding="utf-8")
    (folder / "drop.csv").write_text("time,hammer_displacement\n0,0\n", encoding="utf-8")


@pytest.fixture
def week(monkeypatch, tmp_path) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in NAMES:
        made_rig(tmp_path / "week" / name)
    made_rig(tmp_path / "week" / ".trash" / "old")
    return tmp_path / "week"


@pytest.fixture
def fitted(monkeypatch) -> list[str]:
    """Stands in for the fit, as files of a made result, and for the batch's picture: which experiments it was asked for."""
    asked = []

    def fitting(source, folder, **options):
        asked.append(source.name)
        if (source / "error").exists():
            raise NoConvergenceError("it stopped\nafter 40 steps")
        result = dataclasses.replace(made_result(samples=600), chi2_reduced=1.0 + len(source.name) / 100)
        write_json(fit_json(result), folder / "fit.json")
        (folder / "report.html").write_text("page", encoding="utf-8")
        state_files(folder / "fit.json", folder)
        return result

    monkeypatch.setattr(run, "run_fit", fitting)
    monkeypatch.setattr("identification.report.batch._parameters", lambda rows, style: iter(()))
    return asked


def call(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["fit-parameters", *arguments])
    with pytest.raises(SystemExit) as ended:
        fit.main()
    return ended.value.code


def table(out: Path) -> dict[str, dict[str, str]]:
    with (out / "batch.csv").open(encoding="utf-8", newline="") as file:
        return {row.pop("experiment"): row for row in csv.DictReader(file) if row.pop("seconds")}


def test_all_are_fitted_into_one_table_and_one_page(week, fitted, monkeypatch, capsys):
    monkeypatch.delenv("COLUMNS", raising=False)
    assert call(monkeypatch, "--batch", "week", "--out", "fits") == 0
    found = table(Path("fits"))
    assert list(found) == NAMES and fitted == [name.split("/")[-1] for name in NAMES]
    expected = made_result(samples=600).parameters[0]
    row = found["tuesday"]
    assert (float(row["k_i"]), float(row["k_i_stderr"]), row["k_i_status"]) == (expected.value, expected.stderr, "ok")
    assert (row["chi2_reduced"], row["failure"], row["law"]) == ("1.07", "", "hunt-crossley")
    assert row["headline"].startswith("The model ")
    page = Path("fits/batch.html").read_text(encoding="utf-8")
    assert '<a href="monday/c%20%26%20d/report.html">monday/c &amp; d</a>' in page
    assert Path("fits/monday/c & d/report.html").read_text(encoding="utf-8") == "page"
    out, err = capsys.readouterr()
    assert "4 of 4 experiments fitted" in out and "(2.0000±0.0020)e6" in out
    assert [line.split(" s  ")[1].split(",")[0] for line in err.splitlines()] == [f"{number} of 4 experiments" for number in (1, 2, 3, 4)]


def test_one_that_fails_is_a_row_and_stops_no_other(week, fitted, monkeypatch, capsys):
    (week / "monday" / "b" / "error").touch()
    assert call(monkeypatch, "--batch", "week", "--out", "fits") == 3
    found = table(Path("fits"))
    assert [row["failure"] for row in found.values()] == ["", "it stopped after 40 steps", "", ""]
    assert (found["monday/b"]["status"], found["monday/b"]["k_i"]) == ("no convergence", "")
    assert not Path("fits/monday/b").exists() and len(fitted) == 4
    assert "<li>monday/b: it stopped after 40 steps</li>" in Path("fits/batch.html").read_text(encoding="utf-8")
    err = capsys.readouterr().err.splitlines()
    assert err[-1].startswith("error: 1 of 4 experiments could not be fitted, the first of them monday/b; fits/batch.csv has the reasons")
    assert not any(line.startswith("Traceback") for line in err)


def test_a_batch_that_broke_off_goes_on_and_ends_with_the_same_table(week, fitted, monkeypatch):
    (week / "monday" / "b" / "error").touch()
    assert call(monkeypatch, "--batch", "week", "--out", "whole", "--quiet") == 3
    in_one_go, whole = run.run_fit, table(Path("whole"))

    def broken_off(source, folder, **options):
        if source.name == "c & d":
            (folder / "fit.json").write_text("half of")
            raise RuntimeError("power is gone")
        return in_one_go(source, folder, **options)

    monkeypatch.setattr(run, "run_fit", broken_off)
    with pytest.raises(RuntimeError, match="power is gone"):
        monkeypatch.setattr(sys, "argv", ["fit-parameters", "--batch", "week", "--out", "fits", "--quiet"])
        fit.main()
    assert Path("fits/monday/a/fit.json").is_file() and not Path("fits/monday/c & d/fit.json").exists()
    fitted.clear()
    monkeypatch.setattr(run, "run_fit", in_one_go)
    assert call(monkeypatch, "--batch", "week", "--out", "fits", "--quiet") == 3
    assert fitted == ["c & d", "tuesday"]
    assert list(table(Path("fits")).items()) == list(whole.items())


CHANGES = {
    "record": (lambda week: (week / "monday" / "b" / "drop.csv").write_text("time\n"), [], ["b"]),
    "settings": (lambda week: (week / "monday" / "b" / "experiment.toml").write_text("schema = 1"), [], ["b"]),
    "result": (lambda week: Path("fits/monday/b/report.html").unlink(), [], ["b"]),
    "other result": (lambda week: Path("fits/tuesday/fit.json").write_text('{"files": {}}'), [], ["tuesday"]),
    "nothing": (lambda week: None, [], []),
    "another file": (lambda week: (week / "tuesday" / "notes.txt").touch(), [], []),
    "option": (lambda week: None, ["--law", "hertz"], ["a", "b", "c & d", "tuesday"]),
}


def test_what_has_changed_is_fitted_again_and_nothing_else(week, fitted, monkeypatch):
    assert call(monkeypatch, "--batch", "week", "--out", "fits", "--quiet") == 0
    for change, (done, options, again) in CHANGES.items():
        fitted.clear()
        done(week)
        assert call(monkeypatch, "--batch", "week", "--out", "fits", "--quiet", *options) == 0
        assert fitted == again, change


def test_one_that_fails_after_a_change_leaves_no_result_of_before(week, fitted, monkeypatch):
    assert call(monkeypatch, "--batch", "week", "--out", "fits", "--quiet") == 0
    (week / "tuesday" / "drop.csv").write_text("time\n")
    (week / "tuesday" / "error").touch()
    Path("fits/tuesday/my notes").touch()
    assert call(monkeypatch, "--batch", "week", "--out", "fits", "--quiet") == 3
    assert [path.name for path in Path("fits/tuesday").iterdir()] == ["my notes"]


def test_one_that_is_gone_leaves_the_table_and_the_folder_may_hold_one_itself(week, fitted, monkeypatch):
    made_rig(week / "monday" / "b" / "inner")
    assert call(monkeypatch, "--batch", "week/monday", "--quiet") == 0
    assert list(table(Path("fit-monday"))) == ["a", "b", "b/inner", "c & d"]
    (week / "monday" / "experiment.toml").write_text(RIG.format(name="all"), encoding="utf-8")
    (week / "monday" / "a" / "experiment.toml").unlink()
    fitted.clear()
    assert call(monkeypatch, "--batch", "week/monday", "--quiet") == 0
    assert list(table(Path("fit-monday"))) == [".", "b", "b/inner", "c & d"] and fitted == ["monday"]
    assert {"fit.json", "batch.csv", "batch.html"} <= {path.name for path in Path("fit-monday").iterdir()}


REFUSED = {
    "no such folder": (["--batch", "nowhere"], "nowhere does not exist: expected a folder with experiments below it"),
    "no experiment": (["--batch", "empty"], "there is no experiment.toml in empty or below it: expected a folder for each experiment"),
    "a file": (["--batch", "week/tuesday/drop.csv"], "week/tuesday/drop.csv is no folder: expected"),
    "one beside many": (["week/tuesday", "--batch", "week"], "EXPERIMENT is given beside --batch week: expected one of the two"),
    "a recipe": (["--batch", "week", "--recipe", "silverbox", "--data", "d"], "--recipe is given beside --batch week"),
    "workers for one": (["week/tuesday", "--workers", "2"], "--workers 2 is given without --batch: expected many experiments"),
    "no workers": (["--batch", "week", "--workers", "0"], "Invalid value for '--workers': "),
    "no law": (["--batch", "week", "--law", "hook"], "unknown contact law 'hook': expected one of hunt-crossley"),
    "no effect": (["--batch", "week", "--with", "magic"], "no effect is called 'magic': expected one of coulomb_friction"),
    "no earlier fit": (["--batch", "week", "--from", "nowhere.json"], "nowhere.json cannot be read"),
    "a file for results": (["--batch", "week", "--out", "week/tuesday/drop.csv"], "cannot write results to"),
    "a damaged state": (["--batch", "week", "--out", "damaged"], "damaged/batch.json is damaged (KeyError): expected the state of a batch"),
    "a batch at work": (["--batch", "week", "--out", "held"], "held is in use by another batch: expected one at a time"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_done_is_one_line_and_nothing_is_fitted(week, fitted, monkeypatch, capsys, case):
    for name in ("empty", "damaged", "held"):
        Path(name).mkdir()
    Path("damaged/batch.json").write_text('{"rows": []}', encoding="utf-8")
    lock = os.open("held", os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    arguments, message = REFUSED[case]
    assert call(monkeypatch, *arguments) == 2
    os.close(lock)
    out, err = capsys.readouterr()
    assert (out, err.count("\n"), fitted) == ("", 1, []) and err.startswith("error: ") and message in err
    assert sorted(path.name for path in Path.cwd().iterdir()) == ["damaged", "empty", "held", "week"]


def test_several_processes_give_the_same_rows(week, monkeypatch, capsys):
    """Of experiments that cannot be fitted, so that nothing is compiled."""
    assert call(monkeypatch, "--batch", "week", "--out", "two", "--workers", "2") == 3
    err = capsys.readouterr().err
    assert call(monkeypatch, "--batch", "week", "--out", "one", "--quiet") == 3
    found = table(Path("two"))
    assert list(found.items()) == list(table(Path("one")).items()) and list(found) == NAMES
    assert {row["status"] for row in found.values()} == {"bad input"} and all(row["failure"] for row in found.values())
    assert "4 of 4 experiments, 0 s left" in err


class Fatal:
    """Ends the process that unpickles it, as the system does where memory is short."""

    def __reduce__(self):
        return os._exit, (9,)


def test_a_worker_that_is_killed_ends_the_batch_with_what_to_do(week, tmp_path):
    jobs = [FitJob(name, week / name, tmp_path / name, "", {"law": Fatal()}) for name in NAMES]
    with pytest.raises(InputError, match=r"a process of --workers 2 was ended from outside.*call the same command again with fewer"):
        list(batch._fitted(jobs, workers=2))


def test_killed_in_the_middle_of_a_real_fit_it_ends_with_what_a_single_fit_writes(tmp_path, monkeypatch):
    """A short drop test between two without a mass; SIGKILL as soon as its fit has begun."""
    source = data_path("example")
    lines = gzip.decompress((source / "drop.csv.gz").read_bytes()).decode().splitlines(keepends=True)
    head, first, *_ = (source / "experiment.toml").read_text(encoding="utf-8").split("[[record]]")
    text = head + "[[record]]" + first.replace("drop.csv.gz", "drop.csv")
    for name in "abc":
        rig = tmp_path / "rigs" / name
        rig.mkdir(parents=True)
        (rig / "drop.csv").write_text("".join(lines[:1001]))
        (rig / "experiment.toml").write_text(text if name == "b" else text.replace("mass =", "#mass ="), encoding="utf-8")
    out, single = tmp_path / "fits", tmp_path / "single"
    arguments = ["--batch", str(tmp_path / "rigs"), "--out", str(out), "--quiet"]
    command = [sys.executable, "-c", "from vibrojax.cli.fit import main; main()", *arguments]
    process = subprocess.Popen(command, stderr=subprocess.DEVNULL)
    while not list(out.glob(".b-unfinished-*")) and process.poll() is None:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    assert process.wait() == -signal.SIGKILL
    assert list(out.glob(".b-unfinished-*")) and not list((out / "b").iterdir()) and not (out / "batch.csv").exists()
    (before,) = json.loads((out / "batch.json").read_text(encoding="utf-8"))["rows"]
    assert call(monkeypatch, *arguments) == 3
    found = table(out)
    assert [row["status"] for row in found.values()] == ["bad input", "good", "bad input"]
    assert json.loads((out / "batch.json").read_text(encoding="utf-8"))["rows"][0] == before, "seconds and all: not fitted again"
    assert not list(out.rglob(".*")), "nothing unfinished stays"
    assert call(monkeypatch, str(tmp_path / "rigs" / "b"), "--out", str(single), "--quiet") == 0
    assert {path.name for path in single.iterdir()} == {path.name for path in (out / "b").iterdir()}
    alone, batched = (json.loads((folder / "fit.json").read_text(encoding="utf-8")) for folder in (single, out / "b"))
    assert alone["parameters"] == batched["parameters"]
    assert float(found["b"]["n"]) == alone["parameters"]["n"]["value"]
