"""Forward mode against central differences of the oracle, over at most four impacts, the jump of a discontinuous force included."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from tests.integrate import rigs
from vibrojax.contact import HuntCrossley, KelvinVoigt, LankaraniNikravesh, Newton
from vibrojax.excitation import at_rest
from vibrojax.integrate import Landing, Smoothed, Switch
from vibrojax.suspension import Free
from vibrojax.system import System

TS = np.array([0.0, 0.15, 0.33, 0.42, 0.51])
MEASURED = slice(1, None)
RIGS = {
    "harmonic base": (rigs.RIG | rigs.STATE, ("zeta", "f_n", "u0", "v0", "gap", "base_amplitude", "base_phase", "applied")),
    "drop test": (rigs.DROP | rigs.DROP_STATE, ("zeta", "f_n", "u0", "v0", "gap")),
}
SIZE = dict(u0=1e-3, v0=0.1, gap=1e-3, applied=0.3)
"""What a relative change of a quantity that may be zero is relative to."""


def central_differences(p, law, names):
    columns = []
    for name in names:
        size = 2e-5 * SIZE.get(name, p[name])
        ahead, behind = (rigs.oracle_motion(p | {name: p[name] + sign * size}, law, TS, longest_step=2e-2) for sign in (1, -1))
        assert len(ahead.impacts) == len(behind.impacts) <= 4
        columns.append((ahead.u - behind.u)[MEASURED] / 4e-5)
    return np.stack(columns, axis=1)


def forward_mode(integrator, p, law, names):
    def u(scaled):
        values = p | {name: p[name] + SIZE.get(name, p[name]) * scaled[i] for i, name in enumerate(names)}
        return integrator(rigs.system(values, law), jnp.asarray(TS), jnp.stack([jnp.asarray(values["u0"]), jnp.asarray(values["v0"])])).u

    return np.asarray(jax.jit(jax.jacfwd(u))(jnp.zeros(len(names))))[MEASURED]


@pytest.mark.parametrize("law", ["hunt-crossley", "kelvin-voigt", "lankarani-nikravesh", "newton"])
@pytest.mark.parametrize("rig", RIGS)
def test_forward_mode_is_the_central_difference(rig, law):
    p, names = RIGS[rig]
    p, names = p | rigs.LAWS[law][0], names + tuple(rigs.LAWS[law][0])
    truth = central_differences(p, law, names)
    size = np.abs(truth).max(axis=0)
    assert (size > 1e-9).all()
    assert (np.abs(forward_mode(Switch(), p, law, names) - truth) / size).max() < 2e-5
    fine = Landing(contact_steps=200.0, most_steps=50_000)
    assert (np.abs(forward_mode(fine, p, law, names) - truth) / size).max() < 2e-3


def test_smoothed_gradient_converges():
    p, names = RIGS["harmonic base"]
    p, names = p | rigs.LAWS["hunt-crossley"][0], (*names, "k_i", "n", "lambda_i")
    truth = forward_mode(Switch(), p, "hunt-crossley", names)
    smoothed = forward_mode(Smoothed(smoothing=1e-6, rtol=1e-11, atol=1e-14), p, "hunt-crossley", names)
    assert (np.abs(smoothed - truth) / np.abs(truth).max(axis=0)).max() < 1e-5


def test_reverse_mode_is_forward_mode():
    import diffrax

    p = rigs.RIG | rigs.STATE | rigs.LAWS["hunt-crossley"][0]

    def u_end(scale, adjoint):
        system = rigs.system(p | dict(k_i=p["k_i"] * scale[0], f_n=p["f_n"] * scale[1]), "hunt-crossley")
        return Smoothed(smoothing=1e-5, adjoint=adjoint, max_steps=1000)(system, jnp.asarray(TS), jnp.array([p["u0"], p["v0"]])).u[-1]

    forward = jax.jacfwd(lambda scale: u_end(scale, diffrax.ForwardMode()))(jnp.ones(2))
    reverse = jax.grad(lambda scale: u_end(scale, diffrax.RecursiveCheckpointAdjoint()))(jnp.ones(2))
    assert np.allclose(forward, reverse, rtol=1e-7)


LAWS = {
    "hunt-crossley": HuntCrossley(1e6, 1.5, 0.3),
    "kelvin-voigt": KelvinVoigt(1e6, 2e-4),
    "lankarani-nikravesh": LankaraniNikravesh(1e6, 1.5, 0.7),
    "newton": Newton(0.7),
}


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("integrator", [Landing(), Switch(), Smoothed(smoothing=1e-6)], ids=["landing", "switch", "smoothed"])
def test_grazing_is_finite(integrator, law):
    if isinstance(integrator, Smoothed) and law == "newton":
        pytest.skip("a rigid stop has no force to smooth")
    ts = jnp.linspace(0.0, 0.1, 41)
    pull = -2.0
    grazing_speed = np.sqrt(2 * 2.0 * 1e-3)  # thrown against a constant pull, the hammer turns at the stop itself

    def final(v0):
        system = System(mass=1.0, suspension=Free(), law=LAWS[law], gap=1e-3, base=at_rest(), applied=rigs.ConstantForce(jnp.asarray(pull)))
        motion = integrator(system, ts, jnp.stack([jnp.asarray(0.0), v0]))
        return motion.u[-1], (motion.u, motion.v, motion.result)

    value_and_slope = jax.jit(lambda v0: jax.jvp(final, (v0,), (jnp.ones(()),)))
    for change in (-1e-3, -1e-8, -1e-12, -1e-15, 0.0, 1e-15, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2):
        (_, (u, v, result)), (slope, (du, dv, _)) = value_and_slope(jnp.asarray(grazing_speed * (1 + change)))
        assert int(result) == 0
        assert all(np.isfinite(x).all() for x in (u, v, du, dv, slope))
        assert float(u.max()) < 1e-3 + 1e-4
