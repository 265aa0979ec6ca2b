import dataclasses
import json
import math

import jax.numpy as jnp
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vibrojax.contact import LAWS, HuntCrossley
from vibrojax.effects import EFFECTS, CoulombFriction, GainError, GapStep, MainsHum
from vibrojax.effects.free_form import FreeForm, TonalForce
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.model_file import model_document, read_model, write_model
from vibrojax.suspension import Free, Linear, Pendulum

LAW = HuntCrossley(impact_stiffness=2.1e8, impact_exponent=1.6, impact_damping=0.6)
MODEL = Model(mass=0.1 + 0.2, suspension=Linear(damping_ratio=1 / 3, natural_frequency_hz=math.pi), law=LAW)
PENDULUM = Pendulum(damping_ratio=0.0, natural_frequency_hz=1.7, length=0.09)

HUM = MainsHum(frequency_hz=50.0, sine=0.0, cosine=-1e-5, of_channel="hammer_acceleration")
STEP = GapStep(gap_jump=-1e-4, instant=0.7, in_file="cart2.csv")
WITH_EFFECTS = Model(mass=2.0, suspension=Free(), law=LAW, effects=(STEP, CoulombFriction(1 / 3), HUM))


@pytest.mark.parametrize("suspension", [MODEL.suspension, PENDULUM, Free()])
@pytest.mark.parametrize("law", sorted(LAWS))
def test_every_model_comes_back_exactly(suspension, law, tmp_path):
    parameters = {p.field: p.start * (1 + 1e-15) for p in LAWS[law].parameters}
    model = Model(mass=MODEL.mass, suspension=suspension, law=LAWS[law](**parameters))
    write_model(model, tmp_path / "model.json", provenance={"seed": 3})
    assert read_model(tmp_path / "model.json") == model


@given(st.floats(min_value=1e-300, max_value=1e300))
def test_numbers_keep_every_digit(tmp_path_factory, number):
    path = tmp_path_factory.getbasetemp() / "digits.json"
    write_model(MODEL.replace({"k_i": number, "m": number}), path)
    again = read_model(path)
    assert (again.values()["k_i"], again.mass) == (number, number)


def test_array_leaves_are_written_as_numbers_and_units_stand_beside_them():
    document = model_document(MODEL.replace({"n": jnp.asarray(1.5)}))
    assert document["law"] == {"name": "hunt-crossley", "k_i": 2.1e8, "n": 1.5, "lambda_i": 0.6}
    assert document["units"]["law"] == {"k_i": "N/m^n", "n": "1", "lambda_i": "s/m"}


@pytest.mark.parametrize(
    ("value", "message"),
    [(math.nan, "k_i is nan"), (jnp.asarray(math.inf), "k_i is inf"), (jnp.ones(2), r"k_i has shape \(2,\).*pick one lane")],
)
def test_what_is_no_model_is_not_written(value, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        write_model(MODEL.replace({"k_i": value}), tmp_path / "model.json")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_every_effect_comes_back_exactly(effect, tmp_path):
    places = {"in_file": "cart1.csv", "of_channel": "impact_force"}
    named = {one.name: places[one.name] for one in dataclasses.fields(effect) if one.name in places}
    effects = (effect(**named, **{p.field: p.start * (1 + 1e-15) for p in effect.parameters}), CoulombFriction(0.25))
    model = Model(mass=1.0, suspension=MODEL.suspension, law=LAW, effects=effects)
    write_model(model, tmp_path / "model.json")
    assert read_model(tmp_path / "model.json") == model


def test_effects_say_where_they_act_and_in_which_units():
    document = model_document(WITH_EFFECTS)
    assert document["effects"] == [
        {"name": "gap_step", "record": "cart2.csv", "gap_jump": -1e-4, "instant": 0.7},
        {"name": "coulomb_friction", "friction_force": 1 / 3, "creep_speed": 5e-4},
        {"name": "mains_hum", "channel": "hammer_acceleration", "frequency_hz": 50.0, "sine": 0.0, "cosine": -1e-5},
    ]
    assert document["units"]["effects"] == [
        {"gap_jump": "m", "instant": "s"},
        {"friction_force": "N", "creep_speed": "m/s"},
        {"frequency_hz": "Hz", "sine": "m/s^2", "cosine": "m/s^2"},
    ]
    assert "effects" not in model_document(MODEL)


@pytest.mark.parametrize(
    ("effect", "message"),
    [
        (CoulombFriction(math.nan), "coulomb_friction.friction_force is nan"),
        (GainError(1.1), "gain_error acts on channel ''.*expected one of"),
    ],
)
def test_what_is_no_effect_is_not_written(effect, message, tmp_path):
    with pytest.raises(ValueError, match=message):
        write_model(Model(mass=1.0, suspension=Free(), law=LAW, effects=(effect,)), tmp_path / "model.json")


def changed(model=MODEL, **changes):
    document = json.loads(json.dumps(model_document(model)))
    for place, value in changes.items():
        *tables, key = place.split("__")
        table = document
        for name in tables:
            table = table[int(name) if name.isdigit() else name]
        if value is None:
            del table[key]
        else:
            table[key] = value
    return json.dumps(document)


MALFORMED = [
    ("", "not valid JSON"),
    ("[1]", "a list where an object"),
    ("[" * 100_000, "not valid JSON"),
    ('{"schema": 1, "schema": 1}', "'schema' is given twice"),
    ("\n\n{", "not valid JSON"),
    (changed(schema=2), "schema is 2: expected 1"),
    (changed(schema=True), "schema is True: expected 1"),
    (changed(mass=None), "'mass' is missing"),
    (changed(mass=0), "mass is 0.0: expected a finite number above 0"),
    (changed(mass="2"), "mass is '2': expected a finite number"),
    (changed(mass=True), "mass is True: expected a finite number"),
    (changed(mass=10**400), "mass is inf"),
    (changed(mas=1), "unknown key 'mas': did you mean 'mass'"),
    (changed(suspension=3), "suspension: a int where an object"),
    (changed(suspension__kind="linaer"), "unknown kind 'linaer': did you mean 'linear'"),
    (changed(suspension__kind=["linear"]), "unknown kind"),
    (changed(suspension__kind="pendulum"), "'length' is missing"),
    (changed(suspension__length=0.1), "unknown key 'length': expected one of kind, damping_ratio, natural_frequency_hz"),
    (changed(suspension__damping_ratio=-0.1), "damping_ratio is -0.1: expected a finite number of at least 0"),
    (changed(law__name="hunt-crosley"), "unknown name 'hunt-crosley': did you mean 'hunt-crossley'"),
    (changed(law__name="spring"), "unknown name 'spring': expected one of hunt-crossley, "),
    (changed(law__n=math.nan), "n is nan: expected a finite number above 0"),
    (changed(law__n=0), "n is 0.0"),
    (changed(law__k_1=1.0), "law: unknown key 'k_1': did you mean 'k_i'"),
    (changed(units__mass="g"), "units are .*expected"),
    (changed(effects={}), "effects is a dict: expected a list of objects"),
    (changed(effects=["coulomb_friction"]), r"effects\[0\]: a str where an object"),
    (changed(effects=[{}]), r"effects\[0\]: 'name' is missing"),
    (changed(effects=[{"name": "coulomb_fricton"}]), "unknown name 'coulomb_fricton': did you mean 'coulomb_friction'"),
    (changed(WITH_EFFECTS, effects__1__friction_forc=1.0), r"effects\[1\]: unknown key 'friction_forc': did you mean 'friction_force'"),
    (changed(WITH_EFFECTS, effects__1__friction_force=-1.0), "friction_force is -1.0: expected a finite number of at least 0"),
    (changed(WITH_EFFECTS, effects__1__friction_force=None), "'friction_force' is missing"),
    (changed(WITH_EFFECTS, effects__0__gap_jump=math.inf), "gap_jump is inf: expected a finite number"),
    (changed(WITH_EFFECTS, effects__0__record=2), "record is 2: expected a text in quotes"),
    (changed(WITH_EFFECTS, effects__2__channel="hammer"), "unknown channel 'hammer'"),
    (changed(WITH_EFFECTS, effects__2__frequency_hz=0.0), "frequency_hz is 0.0: expected a finite number above 0"),
    (changed(WITH_EFFECTS, units__effects__2__sine="g"), "units are .*expected"),
    (changed(WITH_EFFECTS, units__effects=None), "units are .*expected"),
]


@pytest.mark.parametrize(("text", "message"), MALFORMED)
def test_a_malformed_file_gives_one_clear_line(text, message, tmp_path):
    path = tmp_path / "model.json"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_model(path)
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_file_that_is_not_there_or_not_text(tmp_path):
    with pytest.raises(InputError, match=r"cannot be read \(No such file"):
        read_model(tmp_path / "model.json")
    with pytest.raises(InputError, match="cannot be read"):
        read_model(tmp_path)
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not valid JSON"):
        read_model(tmp_path / "bytes.json")


def test_units_and_provenance_may_be_left_out(tmp_path):
    path = tmp_path / "model.json"
    path.write_text(changed(units=None, provenance=None))
    assert read_model(path) == MODEL


@pytest.mark.parametrize(
    "effect",
    [
        GainError(factor=1.1, of_channel="reaction_force"),
        FreeForm(coordinate="reading", knots=(0.0, 1.0), of_channel="reaction_force", c1=0.1, c2=-1 / 3),
        TonalForce(frequency_hz=13.2, sine=0.1, cosine=-1 / 3),
    ],
)
def test_what_acts_on_the_gauge_behind_the_stop_or_is_on_no_list_comes_back(effect, tmp_path):
    model = dataclasses.replace(MODEL, effects=(effect,))
    write_model(model, tmp_path / "model.json")
    assert read_model(tmp_path / "model.json") == model


def test_a_restitution_above_one_is_not_possible(tmp_path):
    document = model_document(dataclasses.replace(MODEL, law=LAWS["newton"](restitution=1.5)))
    (tmp_path / "model.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InputError, match=r"e is 1.5: expected a number of at most 1"):
        read_model(tmp_path / "model.json")


@pytest.mark.parametrize(
    ("coordinate", "knots", "message"),
    [
        ("u" * 5_000_000, [0.0, 1.0], "unknown coordinate 'uuu"),
        ("time", [0] * 3_000_000, r"knots is \[0, 0.*expected a list of at most 16 numbers"),
    ],
)
def test_a_free_form_of_megabytes_is_refused_in_a_short_line(coordinate, knots, message, tmp_path):
    effect = {"name": "free_form", "coordinate": coordinate, "knots": knots, "by_direction": False, "c1": 1.0, "c2": 0.0}
    (tmp_path / "model.json").write_text(json.dumps(model_document(MODEL) | {"effects": [effect]}))
    with pytest.raises(InputError, match=message) as caught:
        read_model(tmp_path / "model.json")
    assert len(str(caught.value)) < 1000


def test_an_object_of_very_many_keys_is_read_once(tmp_path):
    """And not once for each of them."""
    (tmp_path / "model.json").write_text("{" + ", ".join(f'"k{number}": 0' for number in range(400_000)) + "}")
    with pytest.raises(InputError, match="'schema' is missing"):
        read_model(tmp_path / "model.json")
