"""What every test runs under: double precision, no silent promotion, nothing timed; types and shapes checked unless that is disabled."""

import os
from collections.abc import Iterator
from importlib.metadata import version
from pathlib import Path

import jaxtyping

# Before either package is imported: a module that is already loaded stays unchecked.
# JAXTYPING_DISABLE=1 leaves the checks out, which make a function slower to trace (`make test` has them in one pass of its own).
if not jaxtyping.config.jaxtyping_disable:
    jaxtyping.install_import_hook(["vibrojax", "identification"], "beartype.beartype")

# Most of a cold run is compiling, which the older emitter of XLA does sooner. Notebooks and commands that tests start inherit it.
if version("jax").startswith("0.10."):  # XLA refuses to start with a flag that it does not know
    os.environ.setdefault("XLA_FLAGS", "--xla_cpu_use_fusion_emitters=false")

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in the commands: many small products beside JAX's own threads

import jax  # noqa: E402
import psutil  # noqa: E402
import pytest  # noqa: E402
from hypothesis import HealthCheck, settings  # noqa: E402

ROOT = Path(__file__).resolve().parent.parent
_MEMORY = 3 * 2**30
"""Bytes."""

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# A slow or busy machine is no error, so no example has a deadline. `--hypothesis-profile` and HYPOTHESIS_PROFILE choose another profile.
untimed = settings(deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("local", untimed)
settings.register_profile("ci", untimed, derandomize=True, print_blob=True)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE") or ("ci" if os.environ.get("CI") else "local"))


def pytest_configure(config: pytest.Config) -> None:
    """Compiled programs outlive the run, and processes that tests start share them: a second run of the suite compiles nothing."""
    folder = str(config.cache.mkdir("jax"))
    os.environ["VIBROJAX_CACHE"] = folder
    jax.config.update("jax_compilation_cache_dir", folder)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


@pytest.fixture(scope="module", autouse=True)
def room() -> Iterator[None]:
    """Compiled programs are let go when they fill the memory: the system maps only so many of them, and they come back from disk."""
    yield
    if psutil.Process().memory_info().rss > _MEMORY:
        jax.clear_caches()


@pytest.fixture(scope="session")
def root() -> Path:
    """The repository."""
    return ROOT


@pytest.fixture(scope="session")
def shared() -> Path:
    """The folder of recordings and development cases beside the repository; the test is skipped without it."""
    folder = ROOT.parent / "shared"
    if not folder.is_dir():
        pytest.skip("needs the folder of shared recordings beside the repository")
    return folder
