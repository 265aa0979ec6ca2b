"""The workers of a Dask cluster, made ready to compute as this process does."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from vibrojax.errors import InputError

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
