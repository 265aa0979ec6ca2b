"""`vibrojax diagnose` as a user meets it: arguments handed on, files all at once or not at all, errors in one line, Ctrl-C in silence."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from identification.experiment import ExperimentError
from tests.identification.diagnosis.made_diagnosis import made_diagnosis
from tests.identification.made_result import made_result
from vibrojax.cli import main
from vibrojax.data_files import data_path
from vibrojax.effects import EFFECTS
from vibrojax.errors import NoConvergenceError
from vibrojax.model_file import read_model


@pytest.fixture
def engine(monkeypatch, tmp_path):
    """Stands in for the search: records what it was asked for, returns a diagnosis made by hand or raises what it is told to."""
    module = SimpleNamespace(calls=[], error=None, verdict="missing")

    def diagnose_experiment(experiment, *, among=EFFECTS, terms=(), budget_minutes=5.0, progress=lambda stage: None):
        module.calls.append((experiment.name, budget_minutes))
        module.among, module.terms = among, terms
        progress("scoring all candidates")
        if module.error is not None:
            raise module.error
        return made_diagnosis(made_result(samples=700), module.verdict)

    monkeypatch.setattr("identification.commands.run.diagnose_experiment", diagnose_experiment)
    monkeypatch.setattr("vibrojax.cli.source.prepare_jax", lambda: None)
    monkeypatch.setenv("COLUMNS", "120")
    monkeypatch.chdir(tmp_path)
    return module


def call(monkeypatch, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["vibrojax", "diagnose", *arguments])
    with pytest.raises(SystemExit) as ended:
        main.main()
    return ended.value.code


def test_everything_is_written_and_reported(engine, monkeypatch, capsys, tmp_path):
    assert call(monkeypatch, str(data_path("example")), "--out", "results", "--budget-minutes", "0.5") == 0
    assert engine.calls == [("example rig", 0.5)]
    folder = tmp_path / "results"
    assert {"diagnosis.json", "nominal.json", "model.json", "report.html", "missing.png"} <= {path.name for path in folder.iterdir()}
    document = json.loads((folder / "diagnosis.json").read_text(encoding="utf-8"))
    assert (document["verdict"], document["effects"][0]["name"]) == ("missing", "coulomb_friction")
    assert read_model(folder / "nominal.json").effects == ()
    assert [effect.name for effect in read_model(folder / "model.json").effects] == ["coulomb_friction"]
    captured = capsys.readouterr()
    assert "scoring all candidates" in captured.err
    assert captured.out.startswith("Missing: dry friction in the suspension\n")
    assert "results/report.html" in captured.out


@pytest.mark.parametrize(
    ("arguments", "among"),
    [
        ((), tuple(EFFECTS)),
        (("--only", "hysteresis", "--only", "coulomb_friction"), ("coulomb_friction", "hysteresis")),
        (("--without", "hysteresis"), tuple(name for name in EFFECTS if name != "hysteresis")),
    ],
)
def test_the_search_is_limited_on_request(engine, monkeypatch, arguments, among):
    assert call(monkeypatch, str(data_path("example")), "--out", "results", *arguments) == 0
    assert engine.among == among


def test_a_force_of_the_users_own_is_handed_on(engine, monkeypatch):
    options = ("--term", "loss=-a*abs(u_dot)**p*sign(u_dot)", "--term", "-b*u**3", "--start", "p=1.5", "--without", "cubic_stiffness")
    assert call(monkeypatch, str(data_path("example")), "--out", "results", *options) == 0
    assert [(term.name, term.starts) for term in engine.terms] == [("loss", (("p", 1.5),)), ("-b*u**3", ())]
    assert engine.among == (*(name for name in EFFECTS if name != "cubic_stiffness"), "loss", "-b*u**3")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--term", "-a*foo(u)"), r"formula '-a\*foo\(u\)', character 4 \('foo\(u\)'\): no function is called foo; expected one of abs"),
        (("--term", "a*u_dot**1.5"), r"formula .* is no finite number at u_dot = -0\.1: expected one wherever the hammer moves; guard it"),
        (("--term", "-a*u", "--start", "p"), r"--start is 'p': expected NAME=VALUE, a number in SI; write, for example, p=1\.5"),
        (("--term", "-a*u", "--start", "p=1", "--start", "p=2"), r"--start is 'p=2': expected NAME=VALUE, each name once"),
        (("--start", "p=1"), r"--start p=\.\.\. is given without a term: expected --term beside it"),
    ],
)
def test_a_formula_that_cannot_be_used_is_one_line_before_any_record_is_read(engine, monkeypatch, capsys, tmp_path, options, message):
    assert call(monkeypatch, str(data_path("example")), "--out", "results", *options) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("error")]
    assert re.match(f"error: {message}", line)
    assert not engine.calls and not (tmp_path / "results").exists()


def test_an_unknown_effect_is_refused_before_any_record_is_read(engine, monkeypatch, capsys, tmp_path):
    assert call(monkeypatch, str(data_path("example")), "--out", "results", "--only", "coulomb_frction") == 2
    assert capsys.readouterr().err.splitlines()[-1] == "error: no effect is called 'coulomb_frction': did you mean 'coulomb_friction'?"
    assert engine.calls == [] and not (tmp_path / "results").exists()


def test_without_an_experiment_the_example_is_taken_and_names_the_folder(engine, monkeypatch, capsys, tmp_path):
    engine.verdict = "adequate"
    assert call(monkeypatch, "--quiet") == 0
    assert engine.calls == [("example rig", 5.0)]
    assert (tmp_path / "diagnose-example-rig" / "report.html").is_file()
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("error", "status"), [(ExperimentError("gap is -1;\nexpected >= 0"), 2), (NoConvergenceError("gap is -1; expected\n>= 0"), 3)]
)
def test_expected_errors_are_one_line_and_leave_nothing(engine, monkeypatch, capsys, tmp_path, error, status):
    engine.error = error
    assert call(monkeypatch, "--out", "results", "--quiet") == status
    assert capsys.readouterr() == ("", "error: gap is -1; expected >= 0\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", [["--budget-minutes", "0"], ["--budget-minutes", "nan"], ["one", "two"]])
def test_usage_errors_exit_with_2(engine, monkeypatch, capsys, arguments):
    assert call(monkeypatch, *arguments) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and error.endswith(" diagnose --help\n") and error.count("\n") == 1
    assert engine.calls == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere"], "nowhere"),
        (["--recipe", "silverbox"], "--recipe silverbox needs the folder of its recordings: add --data DIR"),
        (["rig", "--recipe", "silverbox", "--data", "."], "both rig and --recipe silverbox are given"),
    ],
)
def test_bad_sources_are_one_line(engine, monkeypatch, capsys, tmp_path, arguments, message):
    assert call(monkeypatch, *arguments, "--quiet") == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ") and message in error
    assert error.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


SLOW = """
import signal, sys, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell that starts the tests in the background has it ignored
def at_work(experiment, **options):
    options["progress"]("at work")
    time.sleep(600.0)  # until the test has asked it to end
import identification.commands.run
identification.commands.run.diagnose_experiment = identification.commands.run.fit_experiment = at_work
from vibrojax.cli.main import main
main()
"""


@pytest.mark.parametrize("command", ["diagnose", "fit"])
@pytest.mark.parametrize("request_to_end", [signal.SIGINT, signal.SIGTERM])
def test_a_request_to_end_leaves_no_traceback_and_nothing_else(tmp_path, request_to_end, command):
    job = subprocess.Popen(
        [sys.executable, "-c", SLOW, command, "--out", "results"],
        cwd=tmp_path,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": "1"},
    )
    assert job.stderr is not None
    try:
        said = ""
        while "at work" not in said:
            line = job.stderr.readline()
            assert line, said
            said += line
        job.send_signal(request_to_end)
        out, error = job.communicate()
    finally:
        job.kill()
    assert (job.returncode, out, error) == (130, "", "")
    assert list(tmp_path.iterdir()) == []


def test_help_shows_an_example_and_needs_no_jax():
    code = "import sys\nfrom vibrojax.cli.main import main\ntry: main()\nfinally: assert not {'jax', 'numpy'} & set(sys.modules)"
    done = subprocess.run([sys.executable, "-c", code, "diagnose", "--help"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "Example:" in done.stdout


def test_the_path_is_handed_on(engine, monkeypatch):
    assert call(monkeypatch, str(Path(data_path("example")) / "experiment.toml"), "--out", "results", "--quiet") == 0
    assert len(engine.calls) == 1
