import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects import rig
from tests.effects.scales import SCALES
from tests.effects.sensor import shown
from vibrojax.effects import EFFECTS, Motion
from vibrojax.effects.free_form import FreeForm, factors
from vibrojax.errors import InputError
from vibrojax.model import Model
from vibrojax.model_file import model_document, read_model, write_model

FORCE = FreeForm(
    terms=("u^3", "|u'| u'", "sine_1", "delta^2"), scales=(1e5, 1.0, 0.1, 1e6), c1=-2e5, c2=-0.7, c3=0.2, c4=3e6, f1_hz=6.0, p1=0.4
)
NEAR = FreeForm(terms=("near", "t settled u", "sign(u') contact"), c1=0.3, c2=-50.0, c3=0.1, d=8e-4, tau=0.1)
READING = FreeForm(terms=("1", "settled"), of_channel="hammer_displacement", c1=1e-5, c2=1.5e-4, tau=0.2)


def model(*effects):
    return Model(mass=rig.M, suspension=rig.SUSPENSION, law=rig.LAW, effects=effects)


def test_is_no_listed_effect():
    assert FreeForm.name not in EFFECTS and FORCE.probe.candidates(SCALES) == ()


def test_force_on_the_hammer():
    readings, _ = rig.simulate(FORCE)

    def extra(t, u, v, z):
        contact = 3e6 * max(u - rig.GAP, 0.0) ** 2
        return -2e5 * u**3 - 0.7 * abs(v) * v + 0.2 * np.sin(2 * np.pi * 6.0 * t + 0.4) + contact

    rig.assert_same(readings, rig.Reference(extra=extra))


def test_what_acts_close_to_the_stop_and_what_settles():
    readings, _ = rig.simulate(NEAR)

    def extra(t, u, v, z):
        near = 0.3 / (1 + max(rig.GAP - u, 0.0) / 8e-4) ** 2
        return near - 50.0 * t * (1 - np.exp(-t / 0.1)) * u + (0.1 * np.tanh(v / 1e-3) if u > rig.GAP else 0.0)

    rig.assert_same(readings, rig.Reference(extra=extra), within=1e-4)


def test_addition_to_a_channel():
    reading, value, ts = shown(READING)
    np.testing.assert_allclose(reading - value, 1e-5 + 1.5e-4 * (1 - np.exp(-ts / 0.2)), rtol=1e-9)
    assert READING.channel == "hammer_displacement" and FORCE.channel is None


def test_off_is_off_and_derivatives_are_finite():
    zero = jnp.asarray(0.0)
    motion = Motion(t=zero + 0.1, u=zero, v=zero, indentation=zero - 1e-3, indentation_rate=zero, in_contact=jnp.asarray(False))
    for effect in (FORCE, NEAR):
        assert float(effect.scaled(0.0).force(motion, jnp.zeros(0))) == 0.0
        leaves = jax.tree.map(jnp.asarray, effect)
        slopes = jax.grad(lambda e: e.force(motion, jnp.zeros(0)))(leaves)
        assert all(np.isfinite(leaf) for leaf in jax.tree.leaves(slopes))


def test_parameters_are_those_of_its_terms():
    assert [(p.name, p.unit) for p in FORCE.parameters] == [
        ("c1", "N/m^3"),
        ("c2", "N s^2/m^2"),
        ("c3", "N"),
        ("c4", "N/m^2"),
        ("f1_hz", "Hz"),
        ("p1", "rad"),
    ]
    assert [(p.name, p.unit) for p in NEAR.parameters] == [("c1", "N"), ("c2", "N/(m s)"), ("c3", "N"), ("d", "m"), ("tau", "s")]
    assert [p.unit for p in READING.parameters] == ["m", "m", "s"]
    assert [p.name for p in model(FORCE).record_parameters] == ["free_form.p1"]
    assert model(FORCE).replace({"free_form.c2": 2.0}).values()["free_form.c2"] == 2.0
    assert FORCE.equation == "force = c1 u^3 + c2 |u'| u' + c3 sine_1 + c4 delta^2"
    assert FORCE.fastest_hz == 6.0 and NEAR.fastest_hz == 0.0


@pytest.mark.parametrize("effect", [FORCE, NEAR, READING], ids=["force", "near", "reading"])
def test_is_kept_in_a_file(effect, tmp_path):
    path = tmp_path / "model.json"
    write_model(model(effect), path)
    again = read_model(path)
    assert model_document(again) == model_document(model(effect))
    (found,) = again.effects
    assert isinstance(found, FreeForm) and found.terms == effect.terms and found.of_channel == effect.of_channel


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"terms": ["u^3", "w"]}, r"terms are .*factor 'w' is not known: expected one of 1, t, u"),
        ({"terms": []}, "expected a list of 1 to 6 texts in quotes"),
        ({"terms": "u^3"}, "expected a list of 1 to 6 texts in quotes"),
        ({"terms": ["u^3", "u^3"]}, "a term is given twice"),
        ({"terms": ["u^3", "t"]}, "'c2' is missing"),
        ({"c9": 1.0}, "unknown key 'c9'"),
        ({"channel": "elsewhere"}, "unknown channel 'elsewhere'"),
    ],
)
def test_refuses_a_file_that_makes_no_sense(change, message, tmp_path):
    document = model_document(model(FreeForm(terms=("u^3",), c1=-1e5)))
    document["effects"][0] |= change
    path = tmp_path / "model.json"
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=message):
        read_model(path)


@pytest.mark.parametrize("term", ["", "u^0", "sine_3", "u*v"])
def test_refuses_terms_that_it_cannot_read(term):
    with pytest.raises(ValueError, match="is not known|is empty"):
        factors(term)


def test_holds_six_terms_at_most():
    with pytest.raises(ValueError, match="7 terms: expected 1 to 6"):
        FreeForm(terms=tuple(f"u^{k}" for k in range(2, 9)))
