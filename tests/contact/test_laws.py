"""What holds for every listed law: signs, gradients, lanes, names, and a contact time that integrators can trust."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import jaxtyping
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree

from tests.contact.single_impact import single_impact
from vibrojax.contact import (
    LAWS,
    AbstractCompliantLaw,
    Flores,
    Hertz,
    HuntCrossley,
    HuntCrossleySeparate,
    KelvinVoigt,
    KelvinVoigtClipped,
    LankaraniNikravesh,
    Newton,
    NoContact,
    smoothed_force,
)

EXAMPLES = {
    law.name: law
    for law in (
        HuntCrossley(impact_stiffness=2e6, impact_exponent=1.6, impact_damping=0.6),
        HuntCrossleySeparate(impact_stiffness=2e6, impact_exponent=1.6, impact_damping=0.2, damping_exponent=1.2),
        Hertz(impact_stiffness=2e6, impact_exponent=1.4),
        KelvinVoigt(impact_stiffness=2e5, impact_damping=2e-4),
        KelvinVoigtClipped(impact_stiffness=2e5, impact_damping=2e-4),
        LankaraniNikravesh(impact_stiffness=2e6, impact_exponent=1.6, restitution=0.7),
        Flores(impact_stiffness=2e6, impact_exponent=1.6, restitution=0.7),
    )
}
LISTED = {name: law for name, law in LAWS.items() if issubclass(law, AbstractCompliantLaw) and law is not NoContact}
EXAMPLES = {name: law(**{p.field: p.start for p in law.parameters}) for name, law in LISTED.items()} | EXAMPLES
each_law = pytest.mark.parametrize("law", EXAMPLES.values(), ids=EXAMPLES)
# indentation m, rate m/s, approach speed m/s: away from every kink
GENERIC = [(3e-4, 0.2, 0.4), (3e-4, -0.15, 0.4), (2e-5, 0.39, 0.4), (1.2e-3, -0.3, 0.9)]


def arrays(*numbers):
    return tuple(jnp.asarray(number) for number in numbers)


def flat(law, *motion):
    """A law's parameters and a motion as one vector, and the force as a function of it."""
    vector, restore = ravel_pytree((jax.tree.map(jnp.asarray, law), arrays(*motion)))

    def force(vector):
        law, motion = restore(vector)
        return law.force(*motion)

    return vector, force


def test_every_listed_law_is_tested():
    assert set(EXAMPLES) | {Newton.name, NoContact.name} == set(LAWS)


@pytest.mark.parametrize("name", LAWS)
def test_parameters_describe_the_fields(name):
    parameters = LAWS[name].parameters
    assert [parameter.field for parameter in parameters] == [field.name for field in dataclasses.fields(LAWS[name])]
    assert len({parameter.name for parameter in parameters}) == len(parameters)
    for parameter in parameters:
        assert parameter.lower <= parameter.start <= parameter.upper
        assert parameter.meaning and parameter.symbol and parameter.unit
        assert not parameter.logarithmic or parameter.lower > 0


@each_law
def test_pushes_and_only_the_unclipped_law_pulls(law):
    key = jax.random.key(0)
    indentation = 1e-3 * jax.random.uniform(key, (2000,))
    rate = 20.0 * jax.random.normal(jax.random.fold_in(key, 1), (2000,))
    force = law.force(indentation, rate, jnp.full(2000, 0.5))
    assert (float(force.min()) < 0.0) == (law.name == "kelvin-voigt")
    assert float(law.force(*arrays(1e-4, 0.1, 0.5))) > 0.0


@each_law
@pytest.mark.parametrize("motion", GENERIC)
def test_forward_reverse_and_central_differences_agree(law, motion):
    vector, force = flat(law, *motion)
    forward, reverse = jax.jacfwd(force)(vector), jax.jacrev(force)(vector)
    np.testing.assert_allclose(forward, reverse, rtol=1e-12, atol=0.0)
    steps = jnp.diag(1e-5 * vector)
    central = jax.vmap(lambda step: force(vector + step) - force(vector - step))(steps) / (2e-5 * vector)
    np.testing.assert_allclose(forward, central, rtol=1e-7, atol=1e-9 * float(jnp.abs(force(vector))))


@each_law
@pytest.mark.parametrize("smoothing", [0.0, 1e-5])
def test_force_and_derivatives_are_finite_at_touch_release_and_grazing(law, smoothing):
    depths, rates = jnp.asarray([-1e-3, -1e-6, 0.0, 1e-300, 1e-12, 5e-6, 1e-3]), jnp.asarray([-0.4, 0.0, 1e-300, 0.4])
    motions = jnp.stack([axis.ravel() for axis in jnp.meshgrid(depths, rates, jnp.asarray([0.0, 1e-300, 1e-6, 0.4]))], axis=1)
    parameters, restore = ravel_pytree(jax.tree.map(jnp.asarray, law))

    def inside(parameters, motion):
        return restore(parameters).force(*motion)

    def switched(parameters, motion):
        return smoothed_force(restore(parameters), *motion, smoothing)

    for force in (inside, switched):
        values = jax.vmap(force, in_axes=(None, 0))(parameters, motions)
        jacobians = jax.vmap(jax.jacrev(force, argnums=(0, 1)), in_axes=(None, 0))(parameters, motions)
        forward = jax.vmap(jax.jacfwd(force, argnums=(0, 1)), in_axes=(None, 0))(parameters, motions)
        assert all(bool(jnp.isfinite(leaf).all()) for leaf in jax.tree.leaves((values, jacobians, forward)))
    flight = motions[:, 0] < -smoothing
    np.testing.assert_array_equal(jax.vmap(switched, in_axes=(None, 0))(parameters, motions)[flight], 0.0)


@each_law
def test_plain_jit_vmap_and_lanes_agree(law):
    motion = jnp.asarray(GENERIC).T
    plain = jnp.stack([law.force(*arrays(*point)) for point in GENERIC])
    np.testing.assert_allclose(law.force(*motion), plain, rtol=1e-14)
    np.testing.assert_allclose(eqx.filter_jit(lambda law, motion: law.force(*motion))(law, motion), plain, rtol=1e-14)
    np.testing.assert_allclose(jax.vmap(law.force)(*motion), plain, rtol=1e-14)
    lanes = jax.tree.map(lambda leaf: jnp.full(len(GENERIC), leaf), law)
    np.testing.assert_allclose(jax.vmap(lambda law, motion: law.force(*motion), in_axes=(0, 1))(lanes, motion), plain, rtol=1e-14)


@each_law
def test_lanes_may_be_given_at_construction_if_all_agree(law):
    fields = [field.name for field in dataclasses.fields(law)]
    lanes = type(law)(**{name: jnp.full(3, getattr(law, name)) for name in fields})
    assert lanes.force(*arrays(*GENERIC[0])).shape == (3,)
    with pytest.raises(jaxtyping.TypeCheckError):
        type(law)(**{name: jnp.full(3 + k, getattr(law, name)) for k, name in enumerate(fields)})


@each_law
@pytest.mark.parametrize("speed", [0.01, 0.3, 2.0])
def test_contact_time_is_right_within_a_factor_of_two(law, speed):
    expected = float(law.contact_time(*arrays(0.4, speed)))
    assert 0.5 < expected / single_impact(law, 0.4, speed).duration < 2.0


@each_law
def test_contact_time_has_one_value_a_lane(law):
    assert law.contact_time(jnp.asarray(0.4), jnp.asarray([0.1, 0.2])).shape == (2,)
