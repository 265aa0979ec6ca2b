"""Less optimisation by the compiler, for tests of which compiling takes nearly all of the time."""

from collections.abc import Iterator

import jax
import pytest

_OPTION = "jax_disable_most_optimizations"


@pytest.fixture(scope="module", autouse=True)
def quick_compiling() -> Iterator[None]:
    """Switch most optimisations off for the tests of a module. Processes that a test starts compile as usual."""
    before = jax.config.values[_OPTION]
    jax.config.update(_OPTION, True)
    yield
    jax.config.update(_OPTION, before)
