"""The GPU kernel: run as ordinary operations it gives what XLA gives, and Pallas lowers it for every contact law."""

import inspect
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.sharding import AbstractMesh, AxisType

from tests.batch.rigs import model, points
from vibrojax.batch import ExactFlight, Span, integrate, packed
from vibrojax.batch.kernel import BLOCK, in_one_kernel
from vibrojax.batch.points import lanes_of
from vibrojax.contact import LAWS, AbstractContactLaw, HuntCrossley, Newton

FREQUENCIES = np.linspace(3.0, 9.0, 2 * BLOCK)


def arguments(law: AbstractContactLaw, cycles: int, recorded: int) -> tuple[Any, ...]:
    lanes, state = lanes_of(model(law), points(FREQUENCIES))
    leaves, form = jax.tree.flatten(lanes)
    return ExactFlight(), form, cycles, recorded, np.stack([np.asarray(leaf) for leaf in leaves]), packed(state)


@pytest.mark.parametrize("law", [HuntCrossley(1e6, 1.5, 0.3), Newton(0.8)], ids=["compliant", "rigid"])
@pytest.mark.parametrize("recorded", [3, 4])
def test_the_kernel_does_what_the_loops_over_all_lanes_do(law, recorded):
    *static, rigs, state = arguments(law, 6, recorded)
    after, what = in_one_kernel(*static, jnp.asarray(rigs), jnp.asarray(state), interpret=True)
    found = integrate(model(law), points(FREQUENCIES), span=Span(transient=6 - recorded, recorded=recorded, closed=None), chunk=BLOCK)
    np.testing.assert_allclose(np.asarray(what.u)[:recorded].T, found.u, rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(np.asarray(what.impacts)[:recorded].T, found.impacts)
    np.testing.assert_allclose(np.asarray(what.peak_force)[:recorded].T, found.peak_force, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(what.u_max, found.u_max, rtol=1e-9)
    np.testing.assert_array_equal(after[5], 6.0)


@pytest.mark.parametrize("name", [name for name, law in LAWS.items() if name != "none"])
def test_pallas_lowers_every_law(name):
    """For an H100, without one. A law that fails here is integrated by loops of many kernels instead."""
    law = LAWS[name](*(parameter.start for parameter in LAWS[name].parameters))
    *static, rigs, state = arguments(law, 6, 4)
    with on_an_h100():
        call = jax.jit(lambda rigs, state: in_one_kernel(*static, rigs, state))
        text = call.trace(rigs, state).lower(lowering_platforms=("cuda",)).as_text()
    assert "triton" in text


def on_an_h100():
    sharding = pytest.importorskip("jax.sharding")
    if not hasattr(sharding, "AbstractDevice") or "abstract_device" not in inspect.signature(AbstractMesh).parameters:
        pytest.skip("this version of JAX lowers for a GPU only where there is one")
    device = sharding.AbstractDevice(device_kind="NVIDIA H100 80GB HBM3", num_cores=132, platform="cuda")
    return sharding.use_abstract_mesh(AbstractMesh((1,), ("x",), (AxisType.Explicit,), abstract_device=device))
