"""What holds for every listed effect: names, candidates, off means off, finite derivatives."""

import dataclasses
import functools
import math
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.effects import rig
from tests.effects.scales import NOTHING, SCALES
from tests.effects.start import at_start
from vibrojax.channels import CHANNELS, channels
from vibrojax.contact import Newton, NoContact
from vibrojax.effects import EFFECTS, CoulombFriction, FallingRestitution, MissingStop
from vibrojax.effects.free_form import FreeForm
from vibrojax.integrate import Landing

CONTRACT = """
    coulomb_friction quadratic_drag cubic_stiffness constant_force hysteresis stop_compliance contact_adhesion back_stop base_harmonics
    cart_recoil frequency_drift gap_drift gap_step second_mode force_lag force_clipping mains_hum missing_stop gain_error time_offset
    quintic_stiffness power_law_damping sensor_high_pass recorder_low_pass nonlinear_reading reading_tone clock_drift
""".split()
TS = jnp.arange(0.0, 0.2, 1e-3)
each_effect = pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)


def law(effect):
    """Nominal law beside which the effect acts."""
    return {MissingStop: NoContact(), FallingRestitution: Newton(0.7)}.get(effect, rig.LAW)


def candidates(effect):
    return effect.probe.candidates(dataclasses.replace(SCALES, law=law(effect)))


def readings(effects, law, flight_step=5e-4):
    system = rig.system(*effects, law=law)
    integrator = Landing(contact_steps=40.0, flight_step=flight_step, most_steps=6000)
    return channels(system, integrator(system, TS, jnp.asarray(rig.START)))


@functools.cache
def nominal(law, flight_step):
    return jax.jit(lambda: readings((), law, flight_step))()


def test_all_of_the_contract_are_listed_in_its_order_and_then_others():
    assert list(EFFECTS)[: len(CONTRACT)] == CONTRACT
    assert FreeForm.name not in EFFECTS


@each_effect
def test_says_what_it_is(effect):
    assert re.fullmatch("[a-z]+(_[a-z]+)*", effect.name)
    assert effect.summary[0] in "am" or effect.summary.startswith(("dry", "drag", "impacts"))
    assert not effect.summary.endswith(".") and effect.equation and effect.source
    assert [p.field for p in effect.parameters] == [f.name for f in dataclasses.fields(effect) if not f.metadata.get("static")]
    assert len({p.name for p in effect.parameters}) == len(effect.parameters)
    for p in effect.parameters:
        assert p.lower <= p.start <= p.upper and p.scale > 0
        assert p.meaning and p.symbol and p.unit
        assert not p.logarithmic or p.lower > 0
    own = at_start(effect).own_states
    assert len({state.name for state in own}) == len(own) and all(state.unit and state.scale >= 0 for state in own)


@each_effect
def test_says_how_it_is_searched_for(effect):
    probe = effect.probe
    assert probe.tried(SCALES, 10) == (24010 if probe.is_line else 10)
    assert set(probe.parts) <= {p.name for p in effect.parameters if p.name == p.field}
    assert len(probe.parts) != 1


@each_effect
def test_candidates_are_its_own_kind_and_finite(effect):
    found = candidates(effect)
    assert found and all(found)
    for candidate in found:
        for member in candidate:
            assert type(member) is effect
            assert all(isinstance(getattr(member, p.field), float) and np.isfinite(getattr(member, p.field)) for p in effect.parameters)
            assert all(p.lower <= getattr(member, p.field) <= p.upper for p in effect.parameters)
            assert member.record is None or member.record in SCALES.gaps
            assert member.channel is None or member.channel in SCALES.channels


@each_effect
@pytest.mark.parametrize("scales", [NOTHING, dataclasses.replace(NOTHING, law=NoContact()), dataclasses.replace(SCALES, law=Newton(0.7))])
def test_records_that_show_nothing_ask_for_nothing_impossible(effect, scales):
    for candidate in effect.probe.candidates(scales):
        leaves = [getattr(member, p.field) for member in candidate for p in effect.parameters]
        assert np.isfinite(leaves).all()


@each_effect
def test_members_of_a_candidate_add_up(effect):
    probe, scales = effect.probe, dataclasses.replace(SCALES, law=law(effect))
    for whole, members in zip(probe.effects(scales), probe.candidates(scales), strict=True):
        assert len(members) == max(len(probe.parts), 1)
        assert probe.joined(members) == whole
        for part, member in zip(probe.parts, members, strict=False):
            assert [field for field in probe.parts if getattr(member, field) != 0] == [part]


@each_effect
def test_off_is_off_and_derivatives_are_finite_through_impacts(effect):
    member = candidates(effect)[-1][-1]
    fields = [p.field for p in effect.parameters]
    point = jnp.asarray([getattr(member, field) for field in fields])
    size = jnp.asarray([p.slope(getattr(member, p.field)) for p in effect.parameters])

    flight_step = min(5e-4, 1 / (24 * max(float(member.fastest_hz), 1.0)))

    @jax.jit
    def both(point, factor, direction):
        def simulated(point, factor):
            there = dataclasses.replace(member, **dict(zip(fields, point, strict=True)))
            return readings((there.scaled(factor),), law(effect), flight_step)

        return jax.jvp(simulated, (point, factor), (direction, jnp.zeros_like(factor)))

    ideal = nominal(law(effect), flight_step)
    assert ideal["impact_force"].max() > (10.0 if law(effect) == rig.LAW else -1.0)
    off, _ = both(point, jnp.asarray(0.0), size)
    on, slope = both(point, jnp.asarray(1.0), size)
    for name in CHANNELS:
        np.testing.assert_allclose(off[name], ideal[name], atol=1e-8 * float(np.abs(ideal[name]).max()), err_msg=name)
        assert np.isfinite(on[name]).all() and np.isfinite(slope[name]).all(), name
    assert any((on[name] != ideal[name]).any() for name in CHANNELS)
    assert any(slope[name].any() for name in CHANNELS)


@each_effect
def test_hooks_take_one_instant_or_many(effect):
    member = candidates(effect)[0][0]
    system, count = rig.system(member), len(member.own_states)
    t, u, v = jnp.linspace(0.0, 0.6, 7), jnp.linspace(-6e-3, 1.2e-3, 7), jnp.linspace(-0.2, 0.2, 7)
    own, touching = 1e-4 * jnp.ones((7, count)), u > rig.GAP
    together = system.forces(t, u, v, own, touching, jnp.full(7, 0.1))
    apart = [system.forces(t[i], u[i], v[i], own[i], touching[i], jnp.asarray(0.1)) for i in range(7)]
    for name in together._fields:
        np.testing.assert_allclose(getattr(together, name), np.stack([getattr(one, name) for one in apart]), rtol=1e-12)
    assert np.isfinite(together.acceleration).all()
    assert together.own_rates.shape == (7, count)


def test_every_effect_is_handed_its_own_states():
    """However many each has."""
    members = [candidates(EFFECTS[name])[0][0] for name in ("hysteresis", "coulomb_friction", "second_mode")]
    system = dataclasses.replace(rig.system(members[0]), effects=tuple(members))
    own = jnp.arange(6.0).reshape(2, 3)
    found = {effect.name: part.tolist() for effect, part in system.each(own)}
    assert found == {"hysteresis": [[0.0], [3.0]], "coulomb_friction": [[], []], "second_mode": [[1.0, 2.0], [4.0, 5.0]]}


def test_forces_in_flight_have_a_size_with_or_without_a_spring():
    """k A of an oscillator; and m v^2 / A of a hammer that nothing pulls back, from which friction and drag take their probes."""
    omega = 2.0 * math.pi * SCALES.f_n
    oscillating = dataclasses.replace(SCALES, speed=omega * SCALES.amplitude)
    assert oscillating.flight_force == pytest.approx(SCALES.mass * omega**2 * SCALES.amplitude)
    free = dataclasses.replace(SCALES, f_n=0.0, omega_exc=0.0, drives=())
    ((friction,),) = CoulombFriction.probe.candidates(free)
    assert friction.friction_force == pytest.approx(0.01 * free.mass * free.speed**2 / free.amplitude)
