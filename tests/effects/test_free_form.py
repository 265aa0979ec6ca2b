import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.effects import rig
from tests.effects.scales import SCALES
from tests.effects.sensor import shown, unheard
from vibrojax.effects import EFFECTS, Motion
from vibrojax.effects.free_form import COORDINATES, FreeForm, hats
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.model_file import model_document, read_model, write_model

PLACE = FreeForm(coordinate="displacement", knots=(-4e-3, -1e-3, 0.0, 1e-3), c1=0.3, c2=-0.2, c3=0.1, c4=0.4)
SPEED = FreeForm(coordinate="velocity", knots=(-0.1, 0.02, 0.1), scales=(0.1, 0.2, 0.3), c1=0.3, c2=-0.05, c3=-0.2)
DEPTH = FreeForm(coordinate="indentation", knots=(-4e-4, 1e-4), c1=-0.5, c2=2.0)
CLOCK = FreeForm(coordinate="time", knots=(0.05, 0.1, 0.2), c1=0.2, c2=-0.3, c3=0.1)
LOOP = FreeForm(coordinate="displacement", knots=(-2e-3, 1e-3), by_direction=True, c1=-0.2, c2=0.3, c3=-0.1, c4=0.4)
READING = FreeForm(coordinate="reading", knots=(-1e-3, 0.0, 2e-3), of_channel="hammer_displacement", c1=-2e-5, c2=1e-5, c3=4e-5)
FORCES = {
    "displacement": (PLACE, lambda t, u, v: np.interp(u, PLACE.knots, [0.3, -0.2, 0.1, 0.4])),
    "velocity": (SPEED, lambda t, u, v: np.interp(v, SPEED.knots, [0.3, -0.05, -0.2])),
    "indentation": (DEPTH, lambda t, u, v: np.interp(u - rig.GAP, [-9e-4, -4e-4, 1e-4], [0.0, -0.5, 2.0])),
    "time": (CLOCK, lambda t, u, v: np.interp(t, CLOCK.knots, [0.2, -0.3, 0.1])),
    "direction": (
        LOOP,
        lambda t, u, v: (
            np.interp(u, LOOP.knots, [-0.2, -0.1]) * (1 + np.tanh(v / 1e-3)) / 2
            + np.interp(u, LOOP.knots, [0.3, 0.4]) * (1 - np.tanh(v / 1e-3)) / 2
        ),
    ),
}
"""Forces, and the same tabulated once more."""
NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False)


def model(*effects):
    return Model(mass=rig.M, suspension=rig.SUSPENSION, law=rig.LAW, effects=effects)


def motion(t, u, v):
    t, u, v = (jnp.asarray(one, jnp.float64) for one in (t, u, v))
    return Motion(t=t, u=u, v=v, indentation=u - rig.GAP, indentation_rate=v, in_contact=u > rig.GAP)


@st.composite
def arguments_of_any(draw):
    """Arguments, not the effect: checks of types draw at random, which strategies must not."""
    by_direction, of_channel = draw(st.booleans()), draw(st.sampled_from(["", "impact_force"]))
    start, steps = draw(st.floats(-1.0, 1.0)), draw(st.lists(st.floats(1e-6, 1.0), min_size=1, max_size=7 if by_direction else 15))
    knots = tuple(np.cumsum([start, *steps]).tolist())
    values = draw(st.lists(NUMBERS, min_size=16, max_size=16))[: len(knots) * (1 + by_direction)]
    coordinate = draw(st.sampled_from(COORDINATES if of_channel else COORDINATES[:-1]))
    coefficients = {f"c{k}": value for k, value in enumerate(values, start=1)}
    return {"coordinate": coordinate, "knots": knots, "of_channel": of_channel, "by_direction": by_direction, **coefficients}


def test_is_no_listed_effect():
    assert FreeForm.name not in EFFECTS and PLACE.probe.candidates(SCALES) == ()


@given(arguments_of_any(), st.lists(NUMBERS, min_size=8, max_size=8), st.booleans())
def test_hats_are_the_broken_lines_that_interpolate(arguments, values, vanishing):
    knots, values = np.array(arguments["knots"]), np.array([*values, *arguments["knots"][:2]])
    found = hats(values, arguments["knots"], vanishing_below=vanishing)
    below = [2 * knots[0] - knots[1]] if vanishing else []
    for hat, unit in zip(found, np.eye(len(knots)), strict=True):
        np.testing.assert_allclose(hat, np.interp(values, [*below, *knots], [*np.zeros(len(below)), *unit]), atol=1e-9)
    alike = hats(jnp.asarray(values), arguments["knots"], vanishing_below=vanishing)
    assert isinstance(found, np.ndarray) and isinstance(alike, jax.Array)
    np.testing.assert_allclose(alike, found, atol=1e-12)


def test_the_derivative_at_a_knot_is_the_mean_of_those_on_either_side():
    slope = jax.grad(lambda q: jnp.array([1.0, 2.0, 8.0]) @ hats(q, (0.0, 1.0, 3.0), vanishing_below=False))
    assert [float(slope(jnp.asarray(q))) for q in (-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 4.0)] == [0.0, 0.5, 1.0, 2.0, 3.0, 1.5, 0.0]


@pytest.mark.parametrize("kind", FORCES)
def test_force_on_the_hammer(kind):
    effect, force = FORCES[kind]
    readings, _ = rig.simulate(effect)
    rig.assert_same(readings, rig.Reference(extra=lambda t, u, v, z: force(t, u, v)), within=1e-4)


def test_nothing_acts_far_from_the_stop():
    at = motion(np.zeros(3), rig.GAP + np.array([-1.0, -9e-4, 1.0]), np.zeros(3))
    assert DEPTH.force(at, jnp.zeros((3, 0))).tolist() == [0.0, 0.0, 2.0]


def test_addition_to_a_channel_over_its_own_value():
    reading, value, _ = shown(READING)
    np.testing.assert_allclose(reading - value, np.interp(value, READING.knots, [-2e-5, 1e-5, 4e-5]), rtol=1e-9, atol=1e-17)
    assert unheard(READING) and READING.channel == "hammer_displacement" and PLACE.channel is None


def test_addition_to_a_channel_over_time():
    reading, value, ts = shown(FreeForm(coordinate="time", knots=(0.1, 0.2), of_channel="impact_force", c1=-0.5, c2=1.0))
    np.testing.assert_allclose(reading - value, np.interp(ts, [0.1, 0.2], [-0.5, 1.0]), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("kind", FORCES)
def test_off_is_off_and_derivatives_are_finite_also_at_a_knot(kind):
    effect, _ = FORCES[kind]
    for at in (motion(0.1, 0.0, 0.02), motion(0.05, rig.GAP + 1e-4, 0.0), motion(9.0, -1.0, -9.0)):
        assert float(effect.scaled(0.0).force(at, jnp.zeros(0))) == 0.0
        slopes = jax.grad(lambda pair: pair[0].force(pair[1], jnp.zeros(0)), allow_int=True)((jax.tree.map(jnp.asarray, effect), at))
        assert all(np.isfinite(leaf) for leaf in jax.tree.leaves(slopes) if leaf.dtype == np.float64)


def test_one_value_a_lane():
    lanes = jax.tree.map(lambda leaf: leaf * jnp.array([1.0, 2.0]), PLACE)
    at = motion(np.zeros(2), np.array([-3e-3, 5e-4]), np.zeros(2))
    np.testing.assert_allclose(lanes.force(at, jnp.zeros((2, 0))), PLACE.force(at, jnp.zeros((2, 0))) * jnp.array([1.0, 2.0]))


def test_says_what_its_parameters_are():
    assert [(p.name, p.symbol, p.unit, p.scale) for p in SPEED.parameters] == [
        ("c1", "c_1", "N", 0.1),
        ("c2", "c_2", "N", 0.2),
        ("c3", "c_3", "N", 0.3),
    ]
    assert [p.meaning for p in SPEED.parameters] == ["at velocity -0.1 m/s", "at velocity 0.02 m/s", "at velocity 0.1 m/s"]
    assert [(p.unit, p.scale, p.meaning) for p in READING.parameters][0] == ("m", 1.0, "at reading -0.001 m")
    assert [p.meaning for p in LOOP.parameters][:3] == [
        "at displacement -0.002 m, u' > 0",
        "at displacement -0.002 m, u' <= 0",
        "at displacement 0.001 m, u' > 0",
    ]
    assert model(LOOP).replace({"free_form.c2": 2.0}).values()["free_form.c2"] == 2.0
    assert "free_form.c5" not in model(LOOP).values()


def test_says_what_it_is():
    assert PLACE.equation == "force = f(u), piecewise linear"
    assert LOOP.equation == "force = f(u, sign u'), piecewise linear"
    assert READING.equation == "hammer_displacement = value + f(value), piecewise linear"


def test_switches_where_its_force_changes_with_the_direction():
    on_channel = FreeForm(coordinate="time", knots=(0.0, 1.0), of_channel="impact_force", by_direction=True)
    assert LOOP.switch_speed == 1e-3 and PLACE.switch_speed is None and on_channel.switch_speed is None


@given(arguments_of_any(), st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS), min_size=3, max_size=3))
def test_a_model_that_is_read_back_has_equal_forces_and_readings(tmp_path_factory, arguments, points):
    effect = FreeForm(**arguments)
    path = tmp_path_factory.getbasetemp() / "free_form.json"
    write_model(model(effect), path)
    again = read_model(path)
    assert model_document(again) == model_document(model(effect))
    (found,) = again.effects
    knots = np.array(effect.knots[:2])
    at = motion(*np.concatenate([np.transpose(points), [knots, knots + rig.GAP, knots]], axis=1))
    none, ideal = jnp.zeros((5, 0)), {"impact_force": at.u}
    np.testing.assert_array_equal(found.force(at, none), effect.force(at, none))
    np.testing.assert_array_equal(found.read(ideal, at, none)["impact_force"], effect.read(ideal, at, none)["impact_force"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"coordinate": "speed"}, "unknown coordinate 'speed': expected one of displacement, velocity, indentation, time, reading"),
        ({"coordinate": "velocty"}, "did you mean 'velocity'"),
        ({"coordinate": "reading"}, "a force has no reading: expected a channel .* name it, or take another coordinate"),
        ({"knots": 3.0}, "knots is 3.0: expected a list of at most 16 numbers"),
        ({"knots": [0.0] * 17}, "knots is .*expected a list of at most 16 numbers"),
        ({"knots": [0.0, "1"]}, r"knots\[1\] is '1': expected a finite number"),
        ({"knots": [0.0, True]}, r"knots\[1\] is True: expected a finite number"),
        ({"knots": [0.0, float("nan")]}, r"knots\[1\] is nan: expected a finite number"),
        ({"knots": []}, "0 knots: expected 2 to 16; choose others"),
        ({"knots": [1.0, 0.0]}, r"knots are \(1.0, 0.0\): expected finite numbers, each above the one before; sort them"),
        ({"knots": [0.0, 5e-324]}, "each above the one before"),
        ({"knots": [-1.7e308, 1.7e308]}, "expected finite numbers"),
        ({"knots": [0.0, 1.0, 2.0]}, "'c3' is missing"),
        ({"by_direction": True}, "'c3' is missing"),
        ({"by_direction": True, "knots": list(range(9))}, "9 knots: expected 2 to 8, each with two coefficients"),
        ({"by_direction": 1}, "by_direction is 1: expected true or false"),
        ({"c2": float("inf")}, "c2 is inf: expected a finite number"),
        ({"c3": 1.0}, "unknown key 'c3'"),
        ({"terms": ["u^3"]}, "unknown key 'terms'"),
        ({"channel": "elsewhere"}, "unknown channel 'elsewhere'"),
    ],
)
def test_refuses_a_file_that_makes_no_sense(change, message, tmp_path):
    document = model_document(model(FreeForm(coordinate="displacement", knots=(0.0, 1e-3), c1=-1.0)))
    document["effects"][0] |= change
    path = tmp_path / "model.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=message) as caught:
        read_model(path)
    assert str(caught.value).count(str(path)) == 1 and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"coordinate": "phase"}, "coordinate 'phase' is not known: expected one of displacement, .*, reading"),
        ({"of_channel": "load"}, "channel 'load' is not known: expected one of hammer_displacement, .*, or none for a force"),
        ({"knots": (0.0, float("inf"))}, "expected finite numbers"),
        ({"scales": (1.0,)}, r"scales are \(1.0,\): expected a number above 0 for each of 2 coefficients; or give none"),
        ({"scales": (1.0, 0.0)}, "expected a number above 0 for each of 2 coefficients"),
    ],
)
def test_refuses_what_it_cannot_be(arguments, message):
    with pytest.raises(ValueError, match=message):
        FreeForm(**({"coordinate": "time", "knots": (0.0, 1.0)} | arguments))
