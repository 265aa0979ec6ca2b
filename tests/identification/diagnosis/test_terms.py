"""Forces that the user gives as formulas, looked for and fitted like the listed effects."""

import json
import sys

import pytest

from identification.diagnosis.diagnose import diagnose_experiment
from identification.diagnosis.scores import among_effects, known_effects, limit_warning, score_all
from identification.estimation.estimate import fit_experiment, with_effects
from identification.experiment import load_experiment
from identification.result.result import OK
from tests.effects.rig import F_N, K_I, LAMBDA, N_I, ZETA
from tests.identification.made_rig import write_made_rig
from vibrojax.cli import main
from vibrojax.effects import EFFECTS
from vibrojax.effects.formula import Formula, terms
from vibrojax.errors import InputError
from vibrojax.model_file import read_model

DRAG, ON_NO_LIST = 3.0, 4e4
"""N s^2/m^2 and N s/m^3, of what is concealed."""


@pytest.fixture(scope="module")
def dragging(tmp_path_factory):
    """A rig with quadratic drag."""
    folder = tmp_path_factory.mktemp("terms") / "rig"
    write_made_rig(folder, lambda t, u, v, z: -DRAG * v * abs(v))
    return load_experiment(folder)


def test_a_term_is_scored_as_the_listed_effect_of_its_law(scores):
    own = terms(["hard=-a*u**3"])
    found = {one.candidate.name: one for one in score_all(scores.fitted, ["cubic_stiffness", "hard"], own).listed}
    listed, mine = found["cubic_stiffness"], found["hard"]
    assert listed.gain > 0.0 and mine.gain == pytest.approx(listed.gain, rel=1e-6)
    assert mine.strengths == pytest.approx(listed.strengths, rel=1e-6)


def test_a_term_is_fitted_beside_the_nominal_parameters(dragging):
    found = fit_experiment(dragging, terms=terms(["drag=-a*abs(u_dot)**p*sign(u_dot)"], {"p": 1.7}))
    known = {"drag.a": DRAG, "drag.p": 2.0, "zeta": ZETA, "f_n": F_N, "k_i": K_I, "n": N_I, "lambda_i": LAMBDA}
    parameters = {p.spec.name: p for p in found.parameters}
    assert parameters.keys() == known.keys()
    for name, one in parameters.items():
        assert one.status == OK and one.stderr is not None and abs(one.value - known[name]) < 4.0 * one.stderr, name
        assert name != "drag.p" or one.stderr < 0.05
    assert found.converged and found.chi2_reduced == pytest.approx(1.0, abs=0.06)
    assert found.added is not None and found.added.names == ("drag",) and found.added.bic < -100.0
    assert found.model.effects[0].equation == "force = -a*abs(u_dot)^p*sign(u_dot)"


@pytest.mark.thorough
def test_a_term_is_fitted_to_what_the_listed_effect_of_its_law_finds(dragging):
    mine = fit_experiment(dragging, terms=terms(["drag=-a*abs(u_dot)**p*sign(u_dot)"], {"p": 1.5}))
    listed = fit_experiment(dragging, effects=["power_law_damping"])
    found, expected = ({p.spec.name: p for p in one.parameters} for one in (mine, listed))
    for name, other in (("drag.a", "power_law_damping.power_coefficient"), ("drag.p", "power_law_damping.exponent")):
        assert found[name].value == pytest.approx(expected[other].value, rel=1e-3)
        assert found[name].stderr == pytest.approx(expected[other].stderr, rel=0.05)


@pytest.mark.thorough
def test_a_term_is_diagnosed_as_the_listed_effect_of_its_law(dragging):
    own = terms(["drag=-a*u_dot*abs(u_dot)"])
    mine = diagnose_experiment(dragging, among=["drag"], terms=own, budget_minutes=60.0)
    listed = diagnose_experiment(dragging, among=["quadratic_drag"], budget_minutes=60.0)
    one, other = (found.effects[0].parameters[0] for found in (mine, listed))
    assert mine.verdict == listed.verdict == "missing"
    assert one.value == pytest.approx(other.value, rel=1e-3) and one.stderr == pytest.approx(other.stderr, rel=1e-2)


def test_a_force_on_no_list_is_found_where_it_was_concealed(tmp_path):
    """By the command, from the formula to a model that runs."""
    write_made_rig(tmp_path / "rig", lambda t, u, v, z: -ON_NO_LIST * u * u * v)
    options = ["--term", "-a*u**2*u_dot", "--only", "-a*u**2*u_dot", "--only", "coulomb_friction", "--budget-minutes", "inf", "--quiet"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["vibrojax", "diagnose", str(tmp_path / "rig"), "--out", str(tmp_path / "out"), *options])
        with pytest.raises(SystemExit) as ended:
            main.main()
    assert ended.value.code == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text(encoding="utf-8"))
    (effect,) = found["effects"]
    a = effect["parameters"]["a"]
    assert (found["verdict"], effect["name"], a["unit"]) == ("missing", "-a*u**2*u_dot", "N s/m^3")
    assert abs(a["value"] - ON_NO_LIST) < 4.0 * a["stderr"] < 0.02 * ON_NO_LIST
    (back,) = read_model(tmp_path / "out" / "model.json").effects
    assert back == Formula("-a*u**2*u_dot", p1=a["value"])
    assert "the force -a*u**2*u_dot" in (tmp_path / "out" / "report.html").read_text(encoding="utf-8")


def test_terms_are_named_among_the_effects():
    own = terms(["loss=-a*u**2*u_dot"])
    assert among_effects(terms=own) == tuple(known_effects(own)) == (*EFFECTS, "loss")
    assert among_effects(only=["loss"], terms=own) == ("loss",) and among_effects(without=["loss"], terms=own) == tuple(EFFECTS)
    assert limit_warning(among_effects(terms=own)) == ()
    assert limit_warning(["loss"]) == ("limited on request: none of the listed effects could be named",)
    with pytest.raises(InputError, match="no effect is called 'los': did you mean 'loss'"):
        among_effects(only=["los"], terms=own)


def test_what_cannot_act_in_these_records_is_said(scores):
    """A stop that is never reached so deep."""
    with pytest.raises(InputError, match="is zero all over the motion of these records"):
        with_effects(scores.fitted, ["deep"], terms=terms(["deep=-a*max(delta - 1, 0)"]), progress=lambda line: None)
