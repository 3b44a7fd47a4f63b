"""Tiles on other machines: a Dask cluster at an address, or one made of local workers."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rockcheck.scenes import InputError
from rockcheck.scenes.errors import printable


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A `distributed.Client` for a scheduler's address ("tcp://host:8786"), or for "local:N", N
    workers of this machine.

    Work of a worker that dies goes to the others. Raises `InputError` where there is no such
    scheduler, or no `distributed`.
    """
    try:
        from distributed import Client, LocalCluster
    except ImportError:
        raise InputError(
            "needs the package distributed: pip install distributed", "--scheduler"
        ) from None
    if address.startswith("local:"):
        count = address.removeprefix("local:")
        if not count.isdecimal() or not 1 <= int(count) <= 256:
            raise InputError(
                f"{printable(address)!r} is not allowed: give local:N with 1 to 256 workers",
                "--scheduler",
            )
        with (
            LocalCluster(
                n_workers=int(count), threads_per_worker=1, dashboard_address=None
            ) as cluster,
            Client(cluster) as client,
        ):
            yield client
        return
    try:
        client = Client(address, timeout=10)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"{printable(address)!r}: no scheduler answers there: {printable(error)}", "--scheduler"
        ) from None
    with client:
        yield client
