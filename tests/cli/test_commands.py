"""The commands as a user meets them: help, arguments handed on, errors in one line, exit status."""

import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from typer.main import get_command

from identification.experiment import ExperimentError
from identification.report.base import PRINT
from vibrojax.cli import fit, main
from vibrojax.errors import InputError, NoConvergenceError


@pytest.fixture
def jobs(monkeypatch, tmp_path):
    """Stands in for the computation: records what it was asked for, writes one file, raises what it is told to."""
    module = ModuleType("identification.commands.run")
    module.calls, module.error = [], None

    def job(*nouns, progress=None, show=None, **options):
        (nouns[-1] / "fit.json").write_text("{}")
        module.calls.append((nouns, options))
        if progress is not None:
            progress("working")
        if module.error is not None:
            raise module.error
        if show is not None:
            show("the numbers")
            (nouns[1] / "report.html").write_text("drawn afterwards")

    module.run_fit = module.run_simulate = job
    monkeypatch.setitem(sys.modules, "identification.commands.run", module)
    monkeypatch.setattr("vibrojax.cli.source.prepare_jax", lambda: None)
    monkeypatch.setattr("vibrojax.cli.experiments.prepare_jax", lambda: None)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.chdir(tmp_path)
    experiment_file(tmp_path / "rig")
    return module


def call(monkeypatch, entry, *arguments: str) -> int:
    monkeypatch.setattr(sys, "argv", ["command", *arguments])
    with pytest.raises(SystemExit) as ended:
        entry()
    return ended.value.code


def experiment_file(folder: Path, name: str = "rig-B, March") -> Path:
    folder.mkdir(exist_ok=True)
    (folder / "experiment.toml").write_text(f'schema = 1\n[experiment]\nname = "{name}"\n')
    return folder


def test_options_are_handed_on(jobs, monkeypatch, capsys, tmp_path):
    (tmp_path / "known.json").touch()
    chosen = ("--law", "hertz", "--reference", "known.json", "--seed", "7", "--style", "print", "--with", "hysteresis")
    chosen += ("--term", "-a*abs(u_dot)**p*sign(u_dot)", "--start", "p=1.5")
    status = call(monkeypatch, fit.main, "rig", "--out", "results", *chosen)
    assert status == 0
    ((nouns, options),) = jobs.calls
    assert nouns[0] == Path("rig")
    expected = {"law": "hertz", "effects": ["hysteresis"], "reference": Path("known.json"), "seed": 7, "style": PRINT}
    expected |= {"terms": ["-a*abs(u_dot)**p*sign(u_dot)"], "starts": {"p": 1.5}}
    assert options == expected | {"smoothing": None, "draws": None, "with_profiles": False, "compare": [], "earlier": None}
    assert Path("results/fit.json").read_text() == "{}"
    captured = capsys.readouterr()
    assert "working" in captured.err
    assert captured.out == "the numbers\nresults in results; start with results/report.html\n"


def test_laws_to_compare_are_listed_or_repeated_and_a_fit_may_begin_at_an_earlier_one(jobs, monkeypatch, tmp_path):
    (tmp_path / "before").mkdir()
    (tmp_path / "before" / "fit.json").touch()
    given = ("--compare", "hertz,flores", "--compare", "kelvin-voigt", "--from", "before")
    assert call(monkeypatch, fit.main, "rig", *given) == 0
    ((_, options),) = jobs.calls
    assert (options["compare"], options["earlier"]) == (["hertz", "flores", "kelvin-voigt"], Path("before"))


@pytest.mark.parametrize("beside", [("--law", "hertz"), ("--reference", "known.json"), ("--posterior",), ("--profiles",)])
def test_what_does_not_go_with_a_comparison_is_refused(jobs, monkeypatch, capsys, beside):
    assert call(monkeypatch, fit.main, "rig", "--compare", "hertz,flores", *beside) == 2
    assert f"{beside[0]} is given beside --compare: expected one of the two; fit the best law again" in capsys.readouterr().err
    assert not jobs.calls


@pytest.mark.parametrize(("given", "width"), [((), 1e-6), (("--smoothing", "3e-5"), 3e-5)])
def test_the_smoothed_integrator_has_a_width(jobs, monkeypatch, given, width):
    assert call(monkeypatch, fit.main, "rig", "--integrator", "smoothed", *given) == 0
    ((_, options),) = jobs.calls
    assert options["smoothing"] == width


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (("--smoothing", "1e-6"), "--smoothing 1e-06 is given for the landing integrator: expected --integrator smoothed beside it"),
        (("--integrator", "smoothed", "--smoothing", "0"), "--smoothing is 0 m: expected a length above 0"),
        (("--integrator", "smooth"), "'smooth' is no integrator; expected landing|smoothed"),
    ],
)
def test_an_integrator_that_cannot_be_used_is_refused(jobs, monkeypatch, capsys, given, message):
    assert call(monkeypatch, fit.main, "rig", *given) == 2
    assert message in capsys.readouterr().err
    assert not jobs.calls


def test_the_posterior_is_sampled_on_request(jobs, monkeypatch):
    assert call(monkeypatch, fit.main, "rig", "--posterior", "--draws", "50") == 0
    ((_, options),) = jobs.calls
    assert options["draws"] == 50


def test_draws_without_a_posterior_are_refused(jobs, monkeypatch, capsys):
    assert call(monkeypatch, fit.main, "rig", "--draws", "50") == 2
    assert "--draws 50 is given without a posterior: expected --posterior beside it" in capsys.readouterr().err
    assert not jobs.calls


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


def test_simulate_hands_on_its_files(jobs, monkeypatch, tmp_path):
    for name in ("model.json", "e.toml"):
        (tmp_path / name).touch()
    assert call(monkeypatch, main.main, "simulate", "--model", "model.json", "--experiment", "e.toml", "--out", "results") == 0
    assert jobs.calls[0][0][:2] == (Path("model.json"), Path("e.toml"))
    assert Path("results").is_dir()


@pytest.mark.parametrize(("more", "told"), [((), "1 table in results\n"), (("--quiet",), "")])
def test_simulate_says_what_it_wrote(more, told, jobs, monkeypatch, capsys, tmp_path):
    for name in ("model.json", "e.toml"):
        (tmp_path / name).touch()
    assert call(monkeypatch, main.main, "simulate", "--model", "model.json", "--experiment", "e.toml", "--out", "results", *more) == 0
    assert capsys.readouterr() == (told, "")


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
    assert [path.name for path in tmp_path.iterdir()] == ["rig"]


def test_a_message_is_printable_and_short_enough_to_read(jobs, monkeypatch, capsys):
    jobs.error = InputError("\x1b[31mred\u202e " + "x" * 10_000 + "; correct it")
    assert call(monkeypatch, fit.main, "rig", "--out", "results", "--quiet") == 2
    told = capsys.readouterr().err
    assert told.startswith("error: \\x1b[31mred\\u202e xxx") and told.endswith("; correct it\n") and len(told) < 1100


@pytest.mark.parametrize("error", [ValueError("shapes differ"), RuntimeError("bug")])
def test_unexpected_errors_keep_their_traceback(jobs, monkeypatch, error):
    jobs.error = error
    monkeypatch.setattr(sys, "argv", ["fit-parameters", "rig", "--out", "results"])
    with pytest.raises(type(error), match=str(error)):
        fit.main()


USAGE = [
    (["--seed", "-1"], "Invalid value for '--seed': "),
    (["--seed", "few"], "Invalid value for '--seed': "),
    (["--nonsense"], "No such option: --nonsense"),
    (["--out"], "Option '--out' requires an argument; see "),
    (["rig", "two"], "Got unexpected extra argument"),
]


@pytest.mark.parametrize(("arguments", "message"), USAGE)
def test_bad_usage_is_one_line_that_says_where_to_read_on(jobs, monkeypatch, capsys, arguments, message):
    """Of both entry points."""
    for entry, command in ((fit.main, ()), (main.main, ("fit",))):
        assert call(monkeypatch, entry, *command, *arguments) == 2
        out, error = capsys.readouterr()
        assert error.startswith(f"error: {message}") and error.endswith(" --help\n")
        assert (out, error.count("\n"), jobs.calls) == ("", 1, [])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["diagnos"], "No such command 'diagnos'. Did you mean 'diagnose'"),
        (["simulate", "--model", "m.json"], "Missing option '--experiment'; expected EXPERIMENT.toml (The experiment whose records are"),
        (["report"], "Missing argument 'DIR'; expected DIR (Folder that"),
        (["continue", "--at", "low"], "Invalid value for '--at': "),
    ],
)
def test_what_a_command_lacks_is_one_line(jobs, monkeypatch, capsys, arguments, message):
    assert call(monkeypatch, main.main, *arguments) == 2
    out, error = capsys.readouterr()
    assert error.startswith(f"error: {message}") and error.endswith(" --help\n")
    assert (out, error.count("\n")) == ("", 1)


def test_without_a_command_there_is_the_help(monkeypatch, capsys):
    assert call(monkeypatch, main.main) == 2
    out, error = capsys.readouterr()
    assert "Commands" in out + error and "error" not in error


def test_every_argument_and_option_says_what_it_is():
    """Errors quote it."""

    def commands(command):
        yield command
        for below in getattr(command, "commands", {}).values():
            yield from commands(below)

    parameters = [parameter for one in commands(get_command(main.app)) for parameter in one.params]
    assert len(parameters) > 50
    assert all(parameter.help for parameter in parameters)


ABSENT = [
    (["fit", "nowhere"], "nowhere does not exist: expected an experiment's folder"),
    (["fit", "."], "the folder . holds no experiment.toml: expected"),
    (["fit", "rig", "--reference", "known.toml"], "known.toml cannot be read (no such file): expected a table of reference values"),
    (["diagnose", "nowhere"], "nowhere does not exist: expected an experiment's folder"),
    (["simulate", "--model", "m.json", "--experiment", "rig", "--out", "o"], "m.json cannot be read (no such file): expected the model"),
    (["simulate", "--model", "rig", "--experiment", "rig", "--out", "o"], "rig cannot be read (a folder): expected the model.json"),
    (["continue", "--model", "m.json", "--sweep", "1:2", "--out", "o"], "m.json cannot be read"),
    (["section", "--model", "m.json", *"--base-amplitude 1e-3 --gap 0 --frequency 5 --out o".split()], "m.json cannot be read"),
    (["section", "--fit", "rig", *"--base-amplitude 1e-3 --gap 0 --frequency 5 --out o".split()], "rig/model.json cannot be read"),
]


@pytest.mark.parametrize(("arguments", "message"), ABSENT)
def test_what_is_not_there_is_found_before_jax_is_loaded(jobs, monkeypatch, capsys, tmp_path, arguments, message):
    for module in ("source", "experiments", "continuation", "study"):
        monkeypatch.setattr(f"vibrojax.cli.{module}.prepare_jax", lambda: pytest.fail("JAX was loaded"))
    assert call(monkeypatch, main.main, *arguments) == 2
    out, error = capsys.readouterr()
    assert error.startswith(f"error: {message}")
    assert (out, error.count("\n"), [path.name for path in tmp_path.iterdir()]) == ("", 1, ["rig"])


def test_a_path_that_is_not_there_needs_no_jax(tmp_path):
    code = "import sys\nfrom vibrojax.cli.fit import main\ntry: main()\nfinally: assert 'jax' not in sys.modules"
    done = subprocess.run([sys.executable, "-c", code, "nowhere"], capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr


COMMANDS = ("fit", "diagnose", "simulate", "report", "inspect", "new", "datasets", "continue", "presets")


@pytest.mark.parametrize(("module", "arguments"), [("fit", []), ("main", []), *(("main", [name]) for name in COMMANDS)], ids=str)
def test_help_shows_an_example_and_needs_no_jax(module, arguments):
    code = f"import sys\nfrom vibrojax.cli.{module} import main\ntry: main()\nfinally: assert not {{'jax', 'numpy'}} & set(sys.modules)"
    done = subprocess.run([sys.executable, "-c", code, *arguments, "--help"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "Example:" in done.stdout


def test_version(monkeypatch, capsys):
    from vibrojax import __version__

    assert call(monkeypatch, main.main, "--version") == 0
    assert capsys.readouterr().out == f"vibrojax {__version__}\n"
