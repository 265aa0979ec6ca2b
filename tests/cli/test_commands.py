"""The commands as a user meets them: help, arguments handed on, errors in one line, exit status."""

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from identification.experiment import ExperimentError
from vibrojax.cli import fit, main
from vibrojax.errors import InputError, NoConvergenceError


@pytest.fixture
def jobs(monkeypatch, tmp_path):
    """Stands in for the computation: records what it was asked for, writes one file, raises what it is told to."""
    module = ModuleType("identification.run")
    module.calls, module.error = [], None

    def job(*nouns, progress=None, **options):
        (nouns[-1] / "fit.json").write_text("{}")
        module.calls.append((nouns, options))
        if progress is not None:
            progress("working")
        if module.error is not None:
            raise module.error

    module.run_fit = module.run_simulate = job
    monkeypatch.setitem(sys.modules, "identification.run", module)
    monkeypatch.setattr("vibrojax.cli.fit.prepare_jax", lambda: None)
    monkeypatch.setattr("vibrojax.cli.simulate.prepare_jax", lambda: None)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.chdir(tmp_path)
    return module


def call(monkeypatch, entry, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["command", *arguments])
    with pytest.raises(SystemExit) as ended:
        entry()
    return ended.value.code


def experiment_file(folder: Path, name: str = "rig-B, March") -> Path:
    folder.mkdir()
    (folder / "experiment.toml").write_text(f'schema = 1\n[experiment]\nname = "{name}"\n')
    return folder


def test_options_are_handed_on(jobs, monkeypatch, capsys):
    status = call(
        monkeypatch, fit.main, "rig", "--out", "results", "--law", "hertz", "--reference", "known.json", "--starts", "4", "--seed", "7"
    )
    assert status == 0
    ((nouns, options),) = jobs.calls
    assert nouns[0] == Path("rig")
    assert options == {"law": "hertz", "reference": Path("known.json"), "starts": 4, "seed": 7}
    assert Path("results/fit.json").read_text() == "{}"
    captured = capsys.readouterr()
    assert "working" in captured.err
    assert "results/report.html" in captured.out


def test_results_are_named_after_the_experiment(jobs, monkeypatch, tmp_path):
    folder = experiment_file(tmp_path / "rig")
    assert call(monkeypatch, fit.main, str(folder / "experiment.toml"), "--quiet") == 0
    assert (tmp_path / "fit-rig-B-March" / "fit.json").is_file()


@pytest.mark.parametrize("text", ["not toml [", "schema = 1", "[experiment]\nname = '../..'", "experiment = 3"])
def test_an_odd_name_still_gives_a_folder_here(jobs, monkeypatch, tmp_path, text):
    folder = experiment_file(tmp_path / "rig")
    (folder / "experiment.toml").write_text(text)
    assert call(monkeypatch, fit.main, str(folder)) == 0
    assert [path.name for path in tmp_path.iterdir() if path.name.startswith("fit-")] in (["fit-rig"], ["fit-experiment"])


def test_vibrojax_fit_is_the_same_command(jobs, monkeypatch):
    assert call(monkeypatch, main.main, "fit", "rig", "--out", "results") == 0
    assert jobs.calls[0][0][0] == Path("rig")


def test_simulate_hands_on_its_files(jobs, monkeypatch):
    assert call(monkeypatch, main.main, "simulate", "--model", "model.json", "--experiment", "e.toml", "--out", "results") == 0
    assert jobs.calls[0][0][:2] == (Path("model.json"), Path("e.toml"))
    assert Path("results").is_dir()


def test_quiet_says_nothing(jobs, monkeypatch, capsys):
    assert call(monkeypatch, fit.main, "rig", "--out", "results", "--quiet") == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (InputError("gap is -1;\nexpected >= 0"), 2),
        (ExperimentError("gap is -1; expected >= 0"), 2),
        (NoConvergenceError("gap is -1; expected\n>= 0"), 3),
    ],
)
def test_expected_errors_are_one_line_and_leave_nothing(jobs, monkeypatch, capsys, tmp_path, error, status):
    jobs.error = error
    assert call(monkeypatch, fit.main, "rig", "--out", "results", "--quiet") == status
    assert capsys.readouterr() == ("", "error: gap is -1; expected >= 0\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("error", [ValueError("shapes differ"), RuntimeError("bug")])
def test_unexpected_errors_keep_their_traceback(jobs, monkeypatch, error):
    jobs.error = error
    monkeypatch.setattr(sys, "argv", ["fit-parameters", "rig", "--out", "results"])
    with pytest.raises(type(error), match=str(error)):
        fit.main()


@pytest.mark.parametrize("arguments", [["--starts", "0"], ["--nonsense"], ["one", "two"]])
def test_usage_errors_exit_with_2(jobs, monkeypatch, capsys, arguments):
    assert call(monkeypatch, fit.main, *arguments) == 2
    assert "Usage" in capsys.readouterr().err
    assert jobs.calls == []


COMMANDS = ("fit", "diagnose", "simulate", "report", "inspect", "new", "datasets", "continue", "presets")


@pytest.mark.parametrize(("module", "arguments"), [("fit", []), ("main", []), *(("main", [name]) for name in COMMANDS)], ids=str)
def test_help_shows_an_example_and_needs_no_jax(module, arguments):
    code = f"import sys\nfrom vibrojax.cli.{module} import main\ntry: main()\nfinally: assert not {{'jax', 'numpy'}} & set(sys.modules)"
    done = subprocess.run([sys.executable, "-c", code, *arguments, "--help"], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert "Example:" in done.stdout


def test_version(monkeypatch, capsys):
    from vibrojax import __version__

    assert call(monkeypatch, main.main, "--version") == 0
    assert capsys.readouterr().out == f"vibrojax {__version__}\n"
