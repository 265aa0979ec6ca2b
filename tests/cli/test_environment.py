"""JAX as a command sets it, and where compiled programs are kept."""

import subprocess
import sys

import pytest

from vibrojax.cli.environment import compilation_cache

REPORT = """
from vibrojax.cli.environment import prepare_jax
prepare_jax()
import jax, jax.numpy as jnp
jax.jit(lambda a: a * 3)(jnp.ones(5)).block_until_ready()
print(jnp.ones(1).dtype, jax.config.jax_compilation_cache_dir)
"""


@pytest.fixture
def bare(monkeypatch, tmp_path):
    for name in ("VIBROJAX_CACHE", "XDG_CACHE_HOME", "JAX_COMPILATION_CACHE_DIR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path))
    return monkeypatch


def report() -> list[str]:
    done = subprocess.run([sys.executable, "-W", "error", "-c", REPORT], capture_output=True, text=True)
    assert done.stderr == ""
    return done.stdout.split()


def test_double_precision_and_even_the_quickest_program_is_kept(bare, tmp_path):
    cache = tmp_path / "programs"
    bare.setenv("VIBROJAX_CACHE", str(cache))
    assert report() == ["float64", str(cache)]
    assert any(cache.iterdir())


def test_the_user_s_own_setting_stays(bare, tmp_path):
    bare.setenv("JAX_COMPILATION_CACHE_DIR", str(tmp_path / "own"))
    assert report() == ["float64", str(tmp_path / "own")]


def test_default_place(bare, tmp_path):
    assert compilation_cache() == tmp_path / ".cache" / "vibrojax"
    bare.setenv("XDG_CACHE_HOME", str(tmp_path / "xdg"))
    assert compilation_cache() == tmp_path / "xdg" / "vibrojax"
    bare.setenv("XDG_CACHE_HOME", "relative")
    assert compilation_cache() == tmp_path / ".cache" / "vibrojax"


def test_switched_off_or_impossible(bare, tmp_path):
    bare.setenv("VIBROJAX_CACHE", "")
    assert compilation_cache() is None
    (tmp_path / "file").write_text("")
    bare.setenv("VIBROJAX_CACHE", str(tmp_path / "file" / "below"))
    assert compilation_cache() is None
