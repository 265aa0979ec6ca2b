"""What computes: JAX in this process, as a command sets it, and the workers of a Dask cluster, made ready as this process is."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from vibrojax.errors import InputError


def prepare_jax() -> None:
    """Switch JAX to float64 and keep compiled programs on disk. Call before anything that makes an array is imported.

    A cache folder already set in JAX (`JAX_COMPILATION_CACHE_DIR`) stays as it is. NumPy's linear algebra is kept to one thread, unless
    `OPENBLAS_NUM_THREADS` says otherwise: it is asked for many small products while JAX's own threads keep every core busy.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    import jax

    jax.config.update("jax_enable_x64", True)
    if jax.config.values["jax_compilation_cache_dir"] is None and (folder := compilation_cache()) is not None:
        jax.config.update("jax_compilation_cache_dir", str(folder))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
        jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


_COMPILING = ("/jax/core/compile/jaxpr_to_mlir_module_duration", "/jax/core/compile/backend_compile_duration")
_SPENT: list[float] = []


def seconds_compiling() -> float:
    """Seconds that JAX has compiled in this process since this was first asked, programs that were read from disk included."""
    if not _SPENT:
        from jax import monitoring

        def noted(event: str, duration_secs: float, **_: Any) -> None:
            if event in _COMPILING:
                _SPENT.append(duration_secs)

        monitoring.register_event_duration_secs_listener(noted)
        _SPENT.append(0.0)
    return sum(_SPENT)


def compilation_cache() -> Path | None:
    """Folder for compiled programs, created when absent; None when switched off or not writable.

    `VIBROJAX_CACHE` names it, and switches the cache off when empty. Otherwise it is `vibrojax` in the user's cache
    folder (`XDG_CACHE_HOME`, or `~/.cache`).
    """
    named = os.environ.get("VIBROJAX_CACHE")
    if named == "":
        return None
    try:
        folder = Path(named).expanduser() if named else _user_cache() / "vibrojax"
        folder = folder.absolute()
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, RuntimeError):  # RuntimeError: the user has no home folder
        return None
    return folder if os.access(folder, os.W_OK | os.X_OK) else None


def _user_cache() -> Path:
    """The XDG rule: a relative XDG_CACHE_HOME is ignored."""
    given = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return given if given.is_absolute() else Path.home() / ".cache"


_PATIENCE = 15
"""s"""


def check_extra(*, cluster: bool) -> None:
    """Refuse a store or a cluster that the installation has no libraries for.

    Raises:
        InputError: Zarr or Dask is not installed.
    """
    try:
        import dask.array  # noqa: F401
        import zarr  # noqa: F401

        if cluster:
            import dask.distributed  # noqa: F401
    except ImportError as error:
        raise InputError(
            f"--store and --cluster need {error.name}, which is not installed: add it with pip install 'vibrojax[cluster]'"
        ) from error


@contextmanager
def connected(address: str | None) -> Iterator[Any]:
    """A client of the scheduler at an address, whose workers compute in double precision; None for no address.

    Raises:
        InputError: nobody answers there.
    """
    if address is None:
        yield None
        return
    from dask.distributed import Client

    try:
        client = Client(address, timeout=_PATIENCE)
    except (OSError, ValueError) as error:
        raise InputError(
            f"no Dask scheduler answers at {address!r}: expected the address that `dask scheduler` prints, such as tcp://host:8786"
        ) from error
    with client:
        client.register_plugin(_prepared())
        yield client


def _prepared() -> Any:
    """What makes every worker ready, those that come later too."""
    from dask.distributed import WorkerPlugin

    class Prepared(WorkerPlugin):
        name = "vibrojax"

        def setup(self, worker: Any) -> None:
            from vibrojax.cli.environment import prepare_jax

            prepare_jax()

    return Prepared()
