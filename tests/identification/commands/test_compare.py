"""Several contact laws fitted to the same records, and ranked."""

import csv
import dataclasses
import gzip
import io
import json

import numpy as np
import pytest
from rich.console import Console

from identification.commands.run import run_fit
from identification.experiment import ExperimentError, ParameterOption
from identification.guesses.declared_model import check_compared_wishes
from identification.report.laws import law_scores, law_summary, write_laws
from identification.report.verdict import judge
from identification.result.result import Likelihood
from tests.identification.made_result import MODEL, made_result
from vibrojax.contact import LAWS
from vibrojax.data_files import data_path
from vibrojax.errors import InputError, NoConvergenceError


def of_law(name: str, deviance: float, *, samples: int = 4000, held_back: float | None = None):
    """A result of a law, as likely as is said."""
    result = made_result(samples=600)
    law = LAWS[name](**{p.field: p.start for p in LAWS[name].parameters})
    return dataclasses.replace(
        result,
        model=dataclasses.replace(MODEL, law=law),
        held_back=() if held_back is None else result.records[1:],
        likelihood=Likelihood(deviance=deviance, samples=samples, held_back=held_back),
    )


def printed(results, refused=None) -> str:
    stream = io.StringIO()
    Console(file=stream, width=140, force_terminal=False).print(law_summary(law_scores(results), refused or {}))
    return stream.getvalue()


def rows(path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_laws_are_ranked_on_records_that_one_of_them_made(tmp_path):
    """The example's stop is Hunt-Crossley's; a rigid one cannot be compared with its load cell, and the others go on."""
    rig, done = tmp_path / "rig", tmp_path / "fit"
    for folder in (rig, done):
        folder.mkdir()
    source = data_path("example")
    lines = gzip.decompress((source / "drop.csv.gz").read_bytes()).decode().splitlines(keepends=True)
    (rig / "drop.csv").write_text("".join(lines[:1001]))
    head, first, *_ = (source / "experiment.toml").read_text(encoding="utf-8").split("[[record]]")
    (rig / "experiment.toml").write_text(head + "[[record]]" + first.replace("drop.csv.gz", "drop.csv"), encoding="utf-8")
    said = []
    run_fit(rig, done, compare=("newton", "hertz", "hunt-crossley"), progress=said.append)
    best, second, refused = rows(done / "comparison.csv")
    assert [one["law"] for one in (best, second, refused)] == ["hunt-crossley", "hertz", "newton"]
    assert (float(best["log_likelihood_twice_difference"]), float(best["bic_difference"])) == (0.0, 0.0)
    assert float(second["log_likelihood_twice_difference"]) < -50.0
    assert (best["contact_parameters"], second["contact_parameters"], second["lambda_i"]) == ("3", "2", "")
    assert abs(float(best["n"]) - 1.5) < 5.0 * float(best["n_stderr"])
    assert "pushes for no time" in refused["reason"] and not refused["chi2_reduced"]
    fitted = json.loads((done / "fit.json").read_text(encoding="utf-8"))
    assert fitted["law"] == "hunt-crossley" and "comparison.csv" in fitted["files"]
    assert fitted["parameters"]["n"]["value"] == float(best["n"])
    assert any(line.startswith("hertz: fitting, round 1") for line in said)


def test_a_parameter_has_to_pay_for_itself():
    """An exponent more gains 3 in twice the log-likelihood, and costs log(4000) = 8.3."""
    names = ("hunt-crossley-separate", "hunt-crossley")
    more, fewer = (of_law(name, deviance) for name, deviance in zip(names, (97.0, 100.0), strict=True))
    extra = dataclasses.replace(more.parameters[0], spec=LAWS[names[0]].parameters[-1])
    scores = law_scores(dict(zip(names, (dataclasses.replace(more, parameters=(*more.parameters, extra)), fewer), strict=True)))
    assert [(one.law, one.count, one.gain) for one in scores] == [(names[1], 3, 0.0), (names[0], 4, 3.0)]
    assert scores[1].bic == pytest.approx(np.log(4000.0) - 3.0)


def test_a_law_that_was_fitted_to_fewer_samples_comes_last_without_a_likelihood(tmp_path):
    results = {"none": of_law("none", -5000.0, samples=900), "hunt-crossley": of_law("hunt-crossley", 100.0)}
    best, last = law_scores(results)
    assert (best.law, last.law, last.gain, last.bic) == ("hunt-crossley", "none", None, None)
    text = printed(results)
    assert "none: fitted to 900 samples, hunt-crossley to 4000: likelihoods cannot be compared" in " ".join(text.split())
    head, *_ = [line.split() for line in text.splitlines() if "ΔBIC" in line]
    counts = [line.split() for line in text.splitlines() if line.strip().startswith(("Hunt", "no contact"))]
    assert "samples" in head and ["4000" in counts[0], "900" in counts[-1]] == [True, True]
    write_laws(law_scores(results), {}, tmp_path / "comparison.csv")
    assert [one["samples"] for one in rows(tmp_path / "comparison.csv")] == ["4000", "900"]


def test_the_best_laws_fit_is_judged_as_a_fit_by_itself():
    results = {"hertz": of_law("hertz", 400.0), "hunt-crossley": of_law("hunt-crossley", 100.0)}
    text = " ".join(printed(results).split())
    assert text.startswith(f"Best: Hunt–Crossley (1975). {judge(results['hunt-crossley']).sentence}")


def test_a_wish_in_another_unit_is_refused_before_any_fit(monkeypatch, tmp_path, example):
    """A stiffness in N/m^n says nothing of a linear stop, in N/m; a parameter that only its own law has goes on."""
    monkeypatch.setattr("identification.commands.run.fit_experiment", lambda *nouns, **more: pytest.fail("fitted"))
    for option in (ParameterOption(start=3e6, fixed=True), ParameterOption(bounds=(1e5, 1e8))):
        wishing = dataclasses.replace(example, parameters={"k_i": option})
        monkeypatch.setattr("identification.commands.run.load_experiment", lambda path, one=wishing: one)
        message = r"\[parameters\.k_i\] is in N/m\^n for hertz, and kelvin-voigt has k_i in N/m: expected laws of one unit; leave kelvin"
        with pytest.raises(ExperimentError, match=message):
            run_fit(tmp_path, tmp_path, compare=("hertz", "kelvin-voigt"))
    check_compared_wishes(wishing, ("hertz", "flores"))
    check_compared_wishes(dataclasses.replace(example, parameters={"n": ParameterOption(start=1.5)}), ("hertz", "kelvin-voigt"))


def test_errors_on_records_held_back_are_in_the_table_where_there_are_some():
    likely, unlikely = of_law("hunt-crossley", 100.0, held_back=50.0), of_law("hertz", 400.0, held_back=75.0)
    scores = law_scores({"hertz": unlikely, "hunt-crossley": likely})
    assert [one.density_gain for one in scores] == [0.0, -25.0] and all(one.nrmse is not None for one in scores)
    text = printed({"hertz": unlikely, "hunt-crossley": likely}, {"newton": ValueError("it is rigid")})
    assert text.index("Hunt–Crossley (1975)") < text.index("Hertz (1882)") < text.index("newton cannot be fitted: it is rigid")
    for piece in ("NRMSE", "−25.0", "−300", "kᵢ = (2.0000 ± 0.0020)e6 N/mⁿ", "λᵢ = 0.40000 ± 0.00040 s/m"):
        assert piece in text
    assert "NRMSE" not in printed({"hertz": of_law("hertz", 1.0)})


@pytest.mark.parametrize(
    ("laws", "message"),
    [
        (("hertz", "hook"), r"unknown contact law 'hook': expected one of hunt-crossley, "),
        (("hertz", ""), r"unknown contact law '': expected one of hunt-crossley, "),
        (("hertz", "hertz"), r"hertz, hertz is one contact law: expected two or more to compare, of hunt-crossley, "),
    ],
)
def test_what_cannot_be_compared_is_refused_before_anything_is_read(tmp_path, laws, message):
    with pytest.raises(ExperimentError, match=message):
        run_fit(tmp_path / "no such rig", tmp_path, compare=laws)


@pytest.mark.parametrize(
    ("raised", "seen"),
    [(NoConvergenceError, NoConvergenceError), (np.linalg.LinAlgError, NoConvergenceError), (ExperimentError, InputError)],
)
def test_where_no_law_can_be_fitted_all_reasons_are_one_error_and_nothing_is_written(monkeypatch, tmp_path, raised, seen):
    def fitting(*nouns, law, **options):
        raise raised(f"{law} stopped")

    monkeypatch.setattr("identification.commands.run.fit_experiment", fitting)
    with pytest.raises(seen, match="hertz cannot be fitted: hertz stopped; flores cannot be fitted: flores stopped"):
        run_fit(data_path("example"), tmp_path, compare=("hertz", "flores"))
    assert not list(tmp_path.iterdir())
