"""A fit that starts from the values of an earlier one."""

import dataclasses
import hashlib
import io
import json
import sys

import pytest
from rich.console import Console

from identification.commands.run import run_fit
from identification.estimation.estimate import fit_experiment
from identification.experiment import ParameterOption
from identification.report import fit_summary
from identification.result.files import fit_json
from identification.trajectory.start import problem_of
from tests.identification.conftest import cropped
from tests.identification.made_result import F_N, K_I, LAMBDA_I, ZETA, N, made_result
from vibrojax.cli import fit
from vibrojax.data_files import data_path
from vibrojax.errors import InputError
from vibrojax.json_file import write_json

FOUND = {"k_i": K_I, "n": N, "lambda_i": LAMBDA_I, "zeta": ZETA, "f_n": F_N}


@pytest.mark.parametrize(
    ("law", "expected"),
    [("hunt-crossley", FOUND), ("hertz", {"k_i", "n", "zeta", "f_n"}), ("kelvin-voigt", {"zeta", "f_n"}), ("none", {"zeta", "f_n"})],
)
@pytest.mark.parametrize("file", ["", "fit.json"])
def test_values_whose_name_and_unit_the_model_has_are_taken(monkeypatch, tmp_path, law, expected, file):
    """The stiffness of a linear stop is in N/m, that of the others in N/m^n."""
    write_json(fit_json(made_result(samples=600)), tmp_path / "fit.json")
    starts = []

    def fitting(*nouns, earlier, **options):
        starts.append(earlier)
        return made_result(samples=600)

    monkeypatch.setattr("identification.commands.run.fit_experiment", fitting)
    monkeypatch.setattr("identification.commands.run.write_fit", lambda *nouns: None)
    run_fit(data_path("example"), tmp_path, law=law, earlier=tmp_path / file)
    assert starts == [{name: FOUND[name] for name in expected}]


def test_a_start_is_the_experiments_else_the_earlier_fits_else_a_first_guess(small):
    plain = problem_of(small)
    experiment = dataclasses.replace(small, parameters={"n": ParameterOption(start=1.7), "f_n": ParameterOption(bounds=(5.0, 5.5))})
    problem = problem_of(experiment, earlier={"n": 1.4, "k_i": 4e6, "f_n": 7.0, "e": 0.5})
    values, guesses = problem.values(problem.start), plain.values(plain.start)
    assert values == pytest.approx({"n": 1.7, "k_i": 4e6, "f_n": 5.5, "lambda_i": values["lambda_i"], "zeta": guesses["zeta"]})
    assert float(problem.model.law.impact_stiffness) == pytest.approx(4e6)


def test_a_start_outside_the_bounds_is_moved_with_a_warning(example):
    result = fit_experiment(cropped(example, 500, (0,)), earlier={"n": 9.0, "k_i": 2e6})
    initial = {p.spec.name: p.initial for p in result.parameters}
    assert (initial["n"], initial["k_i"]) == (4.0, pytest.approx(2e6))
    assert [line for line in result.warnings if "earlier" in line] == [
        "n = 9 of the earlier fit lies outside 0.8 to 4: the fit starts at the edge"
    ]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, r"fit\.json cannot be read \(No such file or directory\): expected the fit\.json of an earlier fit, or its folder"),
        ("{", r"fit\.json is not valid JSON"),
        ("[]", r"fit\.json: a list where an object"),
        ('{"schema": 1}', r"fit\.json: 'parameters' is missing; expected the fit\.json of an earlier fit, or its folder"),
        ('{"parameters": {"n": 1.5}}', r"fit\.json, parameters, n: a float where an object"),
        ('{"parameters": {"n": {"value": "1.5", "unit": "1"}}}', r"fit\.json, parameters, n: value is '1\.5': expected a finite number"),
        ('{"parameters": {"n": {"value": 1.5}}}', r"fit\.json, parameters, n: 'unit' is missing"),
    ],
)
def test_what_is_no_result_is_refused_before_anything_is_read(tmp_path, content, message):
    if content is not None:
        (tmp_path / "fit.json").write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=message) as caught:
        run_fit(tmp_path / "no such rig", tmp_path, earlier=tmp_path)
    assert "\n" not in str(caught.value)


def test_a_value_that_was_not_finite_keeps_its_first_guess_and_so_does_a_stiffness_in_units_of_it(monkeypatch, tmp_path):
    write_json(fit_json(made_result(samples=600)), tmp_path / "fit.json")
    document = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    document["parameters"]["n"]["value"] = None
    (tmp_path / "fit.json").write_text(json.dumps(document), encoding="utf-8")
    starts = []
    monkeypatch.setattr(
        "identification.commands.run.fit_experiment", lambda *nouns, earlier, **more: starts.append(earlier) or made_result()
    )
    monkeypatch.setattr("identification.commands.run.write_fit", lambda *nouns: None)
    run_fit(data_path("example"), tmp_path, earlier=tmp_path)
    assert starts == [{name: value for name, value in FOUND.items() if name not in ("k_i", "n")}]


def test_gaps_are_read_off_the_records_however_much_an_earlier_fit_knows(small):
    plain = problem_of(small)
    known = problem_of(small, earlier={name: value for name, value in plain.values(plain.start).items()})
    place = plain.unknowns.own.index("gap_error")
    assert plain.start.own[:, place].any()
    assert known.start.own[:, place] == pytest.approx(plain.start.own[:, place])


@pytest.mark.parametrize(
    ("law", "wish", "taken", "left_out"),
    [
        (None, {}, {"k_i", "n", "lambda_i", "zeta", "f_n"}, {}),
        (
            None,
            {"n": 1.3},
            {"lambda_i", "zeta", "f_n"},
            {"k_i": "its n is 1.5 there, and 1.3 in [parameters]", "n": "given in [parameters]"},
        ),
        (None, {"n": N}, {"k_i", "lambda_i", "zeta", "f_n"}, {"n": "given in [parameters]"}),
        (
            "kelvin-voigt",
            {},
            {"zeta", "f_n"},
            {"k_i": "in N/m^n there, N/m here", "lambda_i": "in s/m there, s here"},
        ),
    ],
)
def test_a_stiffness_is_taken_with_its_exponent_or_not_at_all(monkeypatch, tmp_path, example, law, wish, taken, left_out):
    """The result says what was taken, and from which file."""
    write_json(fit_json(made_result(samples=600)), tmp_path / "fit.json")
    wishing = dataclasses.replace(example, parameters={name: ParameterOption(start=value, fixed=True) for name, value in wish.items()})
    kept, said = [], []
    monkeypatch.setattr("identification.commands.run.load_experiment", lambda path: wishing)
    monkeypatch.setattr("identification.commands.run.fit_experiment", lambda *nouns, **more: made_result(samples=600))
    monkeypatch.setattr("identification.commands.run.write_fit", lambda result, *nouns: kept.append(result))
    run_fit(tmp_path, tmp_path, law=law, earlier=tmp_path, progress=said.append)
    begin = kept[0].started_from
    assert begin.taken == {name: FOUND[name] for name in taken} and begin.left_out == left_out
    assert begin.sentence() in said and begin.sentence() in printed(fit_summary(kept[0]))
    stated = fit_json(kept[0])["provenance"]["earlier_fit"]
    assert (stated["file"], stated["taken"]) == (str(tmp_path / "fit.json"), begin.taken)
    assert stated["sha256"] == hashlib.sha256((tmp_path / "fit.json").read_bytes()).hexdigest()


def printed(shown) -> str:
    stream = io.StringIO()
    Console(file=stream, width=1000, force_terminal=False).print(shown)
    return stream.getvalue()


def test_a_wrong_path_is_one_line_before_anything_is_loaded(monkeypatch, capsys, tmp_path):
    monkeypatch.setattr("vibrojax.cli.source.prepare_jax", lambda: pytest.fail("JAX was loaded first"))
    monkeypatch.setattr(sys, "argv", ["fit-parameters", str(data_path("example")), "--from", "nowhere", "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as ended:
        fit.main()
    assert ended.value.code == 2 and not (tmp_path / "out").exists()
    expected = "error: nowhere cannot be read (no such file): expected the fit.json of an earlier fit, or its folder; check the path"
    assert capsys.readouterr().err.splitlines() == [expected]
