"""Either way of compiling gives the same numbers, with or without the options of the compiler."""

import importlib

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from vibrojax import compiling


@pytest.mark.parametrize("way", ["soon_compiled", "compiled_for_long_runs"])
@pytest.mark.parametrize("version", [(0, 10, 2), (99, 0, 0)], ids=["tried", "unknown"])
def test_options_are_asked_for_where_jax_is_known_to_have_them(monkeypatch, version, way):
    monkeypatch.setattr(jax, "__version_info__", version)
    fresh = importlib.reload(compiling)
    assert bool(fresh._SOON) is bool(fresh.LONG) is (version[0] == 0)
    traced = []

    @getattr(fresh, way)
    def cubed(x, name):
        traced.append(name)
        return jnp.sin(x) ** 3

    x = jnp.linspace(0.0, 2.0, 11)
    np.testing.assert_allclose(cubed(x, "first"), np.sin(x) ** 3, rtol=1e-14, atol=1e-300)
    np.testing.assert_allclose(cubed(2.0 * x, "first"), np.sin(2.0 * x) ** 3, rtol=1e-12)
    assert traced == ["first"], "compiled once"


def test_a_loop_as_one_function_gives_the_same_numbers():
    """With an argument that the loop has no use for, and one that only its end needs."""

    def halved(x, unused, y, number):
        return jax.lax.while_loop(lambda loop: jnp.max(loop[0]) > 1.0, lambda loop: (0.5 * loop[0], loop[1] + 1), (x, number))[0] + y

    x = jnp.linspace(0.0, 9.0, 13)
    given = x, 3.0 * x, jnp.sqrt(x), jnp.asarray(0)
    program = jax.jit(compiling.as_one_function(halved))
    assert ("xla_cpu_small_call" in program.lower(*given).as_text()) is bool(compiling._ONE)
    np.testing.assert_array_equal(program(*given), jax.jit(halved)(*given))
    with compiling.in_kernel():
        assert "xla_cpu_small_call" not in jax.jit(compiling.as_one_function(halved)).lower(*given).as_text()


@pytest.fixture(autouse=True)
def as_installed():
    """The module as the rest of the suite has it."""
    yield
    importlib.reload(compiling)
