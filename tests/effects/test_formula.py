"""Forces of the user as formulas: what is read, what is refused, and that they act as what they say."""

import dataclasses
import json
import math
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects.rig import LAW, SUSPENSION, Reference, assert_same, simulate
from tests.effects.scales import NOTHING, SCALES
from vibrojax.effects import CoulombFriction, Motion, PowerLawDamping, QuadraticDrag
from vibrojax.effects.formula import Formula, terms
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.model_file import model_document, read_model, write_model

POINTS = np.random.default_rng(3).uniform(-1.0, 1.0, (5, 40))
MOTION = Motion(*map(jnp.asarray, POINTS), in_contact=jnp.zeros(40, bool))
T, U, V, DELTA, RATE = POINTS
NO_STATES = jnp.zeros((40, 0))


@pytest.mark.parametrize(
    ("formula", "values", "extra"),
    [
        ("-a*u_dot*abs(u_dot)", {"p1": 3.0}, lambda t, u, v, z: -3.0 * v * abs(v)),
        ("-(a + b*u**2)*u_dot", {"p1": 0.2, "p2": 4e4}, lambda t, u, v, z: -(0.2 + 4e4 * u * u) * v),
        ("a*max(delta, 0)**1.5 + F*sin(2*pi*f*t)", {"p1": -1e6, "p2": 0.3, "p3": 20.0}, None),
    ],
)
def test_agrees_with_an_independent_integration(formula, values, extra):
    """The sign: towards the stop, on which the reference pushes with `extra`."""

    def of_the_stop(t, u, v, z):
        return -1e6 * max(u - 1e-3, 0.0) ** 1.5 + 0.3 * math.sin(2 * math.pi * 20.0 * t)

    readings, _ = simulate(Formula(formula, **values))
    assert_same(readings, Reference(extra=extra or of_the_stop))


@pytest.mark.parametrize(
    ("formula", "expected"),
    [
        ("a*t*2", 2 * T),
        ("+a*(u - 3.5e-1)/4", (U - 0.35) / 4),
        ("a*abs(delta)**0.5", np.abs(DELTA) ** 0.5),
        ("a*sqrt(abs(u))*exp(-u)*log(abs(u) + 1)", np.sqrt(np.abs(U)) * np.exp(-U) * np.log(np.abs(U) + 1)),
        ("a*(sin(u) + cos(t) - tanh(delta_dot))", np.sin(U) + np.cos(T) - np.tanh(RATE)),
        ("a*min(u, t, 0.1)*max(delta, u_dot)", np.minimum(np.minimum(U, T), 0.1) * np.maximum(DELTA, V)),
        ("a*sign(u)*pi**2", np.sign(U) * np.pi**2),
        ("a*u**-(1 - 3)", U**2),
        ("a*sign(u_dot)", np.tanh(V / 5e-4)),
    ],
)
def test_operations_are_those_of_mathematics(formula, expected):
    np.testing.assert_allclose(Formula(formula, p1=1.0).force(MOTION, NO_STATES), expected, rtol=1e-12, atol=1e-15)


@pytest.mark.parametrize(
    ("formula", "listed"),
    [
        ("-a*u_dot*abs(u_dot)", QuadraticDrag(2.0)),
        ("-a*sign(u_dot)", CoulombFriction(2.0)),
        ("-a*abs(u_dot)**p*sign(u_dot)", PowerLawDamping(2.0, 1.5)),
    ],
)
def test_a_formula_acts_as_the_listed_effect_of_its_law(formula, listed):
    mine = Formula(formula, p1=2.0, p2=1.5)
    np.testing.assert_allclose(mine.force(MOTION, NO_STATES), listed.force(MOTION, NO_STATES), atol=2e-5)
    off, double = (mine.scaled(factor).force(MOTION, NO_STATES) for factor in (0.0, 2.0))
    assert not off.any() and np.allclose(double, 2.0 * mine.force(MOTION, NO_STATES), rtol=1e-12)
    assert (mine.switch_speed is None) == ("sign" not in formula)


@pytest.mark.parametrize("formula", ["a*abs(u)**p", "a*sqrt(abs(u))", "a*abs(u)**0.3*sign(u)", "a*max(delta, 0)**p", "a*u**2"])
def test_derivatives_are_finite_where_the_hammer_rests(formula):
    def force(u, p):
        motion = Motion(*(jnp.asarray([0.0]), u, u, u, u), in_contact=jnp.zeros(1, bool))
        return Formula(formula, p1=1.0, p2=p).force(motion, jnp.zeros((1, 0))).sum()

    for slopes in (jax.grad(force, (0, 1))(jnp.zeros(1), jnp.asarray(0.5)), jax.grad(force, (0, 1))(jnp.full(1, 0.04), jnp.asarray(0.5))):
        assert np.isfinite(slopes[0]).all() and np.isfinite(slopes[1])
    assert slopes[0].any()


@pytest.mark.parametrize(
    ("formula", "units", "strengths"),
    [
        ("-a*u_dot*abs(u_dot)", {"a": "N s^2/m^2"}, ("a",)),
        ("-(a + b*u**2)*u_dot", {"a": "N s/m", "b": "N s/m^3"}, ("a", "b")),
        ("-F*tanh((u_dot - v1)/v0)", {"F": "N", "v1": "m/s", "v0": "m/s"}, ("F",)),
        ("-a*abs(u_dot)**p*sign(u_dot)", {"a": "SI", "p": "1"}, ("a",)),
        ("-k*max(delta - d0, 0)**1.5", {"k": "N/m^1.5", "d0": "m"}, ("k",)),
        ("a*sin(2*pi*f*t) + b*cos(2*pi*f*t)", {"a": "N", "f": "1/s", "b": "N"}, ("a", "b")),
        ("a*exp(-t/tau)*u*t", {"a": "N/(m s)", "tau": "s"}, ("a",)),
        ("a*(u + u_dot)", {"a": "SI"}, ("a",)),
        ("a*log(abs(u) + 1e-3)", {"a": "SI"}, ("a",)),
    ],
)
def test_units_and_strengths_follow_from_the_formula(formula, units, strengths):
    effect = Formula(formula)
    assert {p.name: p.unit for p in effect.parameters} == units
    assert effect.strengths == strengths


@pytest.mark.parametrize(
    ("formula", "message"),
    [
        ("", r"formula '' has 0 characters: expected 1 to 300"),
        ("a*u+" * 80 + "a*u", r"has 323 characters: expected 1 to 300; shorten it"),
        ("-a*", r"character 4 \(''\): the formula breaks off or cannot be read; expected an expression such as"),
        ("(a*u", r"character 1 \('\(a\*u'\): the formula breaks off"),
        ("2a*u", r"cannot be read"),
        ("a*u\N{MIDDLE DOT}u", r"character 4 .*: a character that no formula has"),
        ("a*u # drag", r"character 5 \('# drag'\): a comment"),
        ("-a*foo(u)", r"character 4 \('foo\(u\)'\): no function is called foo; expected one of abs, sign"),
        ("-a*tahn(u)", r"character 4 .*: no function is called tahn; did you mean tanh\?"),
        ("a*u^2", r"character 4 \('\^2'\): \^ is no operation of a formula; expected \*\* for a power"),
        ("a*sin(u, t)", r"character 3 .*: sin has 2 arguments; expected one"),
        ("a*min(u)", r"min has 1 arguments; expected two or more"),
        ("a*abs", r"abs is a function; expected abs\(\.\.\.\)"),
        ("a*v", r"character 3 \('v'\): v is no name of a parameter; expected another name, or one of u, u_dot, t, delta, delta_dot"),
        ("a*u_ddot", r"u_ddot is no name of a parameter"),
        ("k_i*u", r"k_i is no name of a parameter"),
        ("a", r"nothing of the motion is in it; .*the effect constant_force"),
        ("u**3", r"no parameter switches all of it off at zero; expected a strength in front of every part"),
        ("a*u + u**3", r"no parameter switches all of it off at zero"),
        ("+".join(f"a{k}*u**{k}" for k in range(1, 10)), r"it has 9 parameters; expected at most 8"),
        ("-" * 60 + "a*u", r"more than 40 operations inside one another"),
        ("a*1e400*u", r"the number is too large"),
        *(
            (text, r"this cannot stand in a formula; expected numbers, parameters, u, u_dot, t")
            for text in (
                "a*u.real",
                "a*[u]",
                "a*u if u else 0",
                "lambda: u",
                "a*True*u",
                "a*'x'*u",
                "a*1j*u",
                "a*...*u",
                "a*u < 1",
                "a*(u, t)",
            )
        ),
        ("a*abs(*u)", "abs has 1 arguments"),
        ("a*abs(x=u)", "abs has an argument with a name; expected values alone"),
    ],
)
def test_what_is_no_formula_is_refused_with_its_place(formula, message):
    with pytest.raises(InputError, match=message) as caught:
        Formula(formula)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "formula",
    [
        "__import__('os').mkdir('made')*u",
        "a*u*open('made', 'w').write('')",
        "(lambda: a)()*u",
        "a*u*().__class__.__base__",
        "[a for a in u]",
    ],
)
def test_nothing_is_executed(formula, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError):
        terms([formula])
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("texts", "starts", "message"),
    [
        (["a*u**1.5"], {}, r"'a\*u\*\*1\.5' is no finite number at u = -0\.001: .*guard it, as in abs\(u_dot\)\*\*p"),
        (["a/u"], {}, r"is no finite number at u = 0"),
        (["a*9**9**9*u"], {}, "is no finite number"),
        (["a*b*u"], {}, r"no motion tells a and b apart; .*give a number in place of one"),
        (["a/b**2*u"], {}, r"no motion tells a and b apart"),
        (["hysteresis=a*u"], {}, "'hysteresis' is the name of a listed effect"),
        (["my-term=a*u"], {}, "'my-term' is no name of a term"),
        (["=a*u"], {}, "has no name before ="),
        (["a*u", "a*u"], {}, r"two terms are called 'a\*u': expected a name of its own for each"),
        (["-a*u_dot"], {"p": 1.0}, "start of p: no term has such a parameter; expected one of none"),
        (["-a*abs(u_dot)**p"], {"q": 1.0}, "start of q: no term has such a parameter; expected one of p"),
        (["-a*abs(u_dot)**p"], {"a": 1.0}, "start of a: it multiplies the term, and its first value comes from the records"),
        (["-a*abs(u_dot)**p"], {"p": 9.0}, r"start of p is 9: expected a number from 0\.05 to 6"),
        ("-a*u", {}, "is one text: expected a list of formulas"),
    ],
)
def test_what_cannot_be_estimated_is_refused_before_any_record_is_read(texts, starts, message):
    with pytest.raises(InputError, match=message):
        terms(texts, starts)


def test_a_candidate_pushes_with_a_hundredth_of_the_forces_in_flight():
    (term,) = terms(["-a*u_dot*abs(u_dot)"])
    ((mine,),) = term.probe.candidates(SCALES)
    ((drag,),) = QuadraticDrag.probe.candidates(SCALES)
    assert float(mine.p1) == pytest.approx(float(drag.drag_coefficient)) and term.probe.either_sign
    assert term.probe.candidates(NOTHING) == ()


def test_strengths_are_estimated_together_and_other_numbers_searched():
    (term,) = terms(["-(a + b*abs(u)**p)*u_dot"])
    candidates = term.probe.candidates(SCALES)
    assert [[float(one.p3) for one in members] for members in candidates] == [[p, p] for p in (1.0, 0.5, 1.5, 2.0, 3.0)]
    for members, whole in zip(candidates, term.probe.effects(SCALES), strict=True):
        assert term.probe.joined(members) == whole
        assert [(one.p1 == 0.0, one.p2 == 0.0) for one in members] == [(False, True), (True, False)]
        for one in members:
            motion = Motion(*(jnp.asarray(x) for x in (0.0, SCALES.amplitude, SCALES.speed, 0.0, 0.0)), in_contact=jnp.asarray(False))
            assert abs(float(one.force(motion, jnp.zeros(0)))) == pytest.approx(0.01 * SCALES.flight_force)
    (started,) = terms(["-(a + b*abs(u)**p)*u_dot"], {"p": 1.7})
    assert [float(members[0].p3) for members in started.probe.candidates(SCALES)] == [1.7]
    (wide,) = terms(["-F*tanh(u_dot/v0)"])
    parts = [float(members[0].p2) / SCALES.speed for members in wide.probe.candidates(SCALES)]
    assert parts == pytest.approx([0.3, 0.03, 0.1, 1.0])


def test_a_model_with_a_formula_comes_back_and_moves_as_before(tmp_path):
    effects = (Formula("-a*u_dot*abs(u_dot)", "drag", p1=1 / 3), Formula("-b*abs(u)**p*u_dot", p1=7e2, p2=1.5), CoulombFriction(0.1))
    model = Model(mass=0.5, suspension=SUSPENSION, law=LAW, effects=effects)
    write_model(model, tmp_path / "model.json")
    back = read_model(tmp_path / "model.json")
    assert back == model and [effect.name for effect in back.effects] == ["drag", "-b*abs(u)**p*u_dot", "coulomb_friction"]
    for there, here in zip(effects, back.effects, strict=True):
        np.testing.assert_array_equal(here.force(MOTION, NO_STATES), there.force(MOTION, NO_STATES))
    assert model_document(model)["units"]["effects"][0] == {"a": "N s^2/m^2"}
    assert list(model.values())[-5:-2] == ["drag.a", "-b*abs(u)**p*u_dot.b", "-b*abs(u)**p*u_dot.p"]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"formula": "a*__import__('os')"}, r"effects\[0\].*cannot be used|effects\[0\].*this cannot stand|effects\[0\].*no function"),
        ({"formula": 3}, "formula is 3: expected a text"),
        ({"formula": "-b*u_dot"}, "unknown key 'a'"),
        ({"a": None}, "'a' is missing"),
        ({"a": "1"}, "a is '1': expected a finite number"),
        ({"name": "coulomb_friction"}, "'coulomb_friction' is the name of a listed effect"),
    ],
)
def test_a_damaged_formula_in_a_file_is_refused(tmp_path, changed, message):
    document = model_document(Model(mass=0.5, suspension=SUSPENSION, law=LAW, effects=(Formula("-a*u_dot", "drag", p1=1.0),)))
    document["effects"][0] = {key: value for key, value in (document["effects"][0] | changed).items() if value is not None}
    (tmp_path / "model.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_model(tmp_path / "model.json")


def test_says_what_it_is():
    named, bare = Formula("-a*abs(u)**p", "loss"), Formula("-a*u")
    assert (named.name, named.summary, named.equation) == ("loss", "the force loss = -a*abs(u)**p", "force = -a*abs(u)^p")
    assert (bare.name, bare.summary) == ("-a*u", "the force -a*u")
    assert all(re.search("loss", p.meaning) for p in named.parameters)
    assert dataclasses.replace(named, p1=2.0).p1 == 2.0
