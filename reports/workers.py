"""Drawing in processes of its own.

In: calls. Out: their results, as they end. Called by whatever draws several figures.
"""

from collections.abc import Iterable, Iterator
from typing import Any

from rockcheck.validation.execute.pool import Call, Pool, cores


def side_by_side(calls: Iterable[Call], jobs: int | None = None, least: int = 4) -> Iterator[Any]:
    """Make these calls, in `jobs` processes (default: one a core) if there are at least `least`.

    Yields their results as they end. A process takes a second to import what draws.
    """
    waiting = list(calls)
    jobs = min(jobs or cores(), len(waiting))
    if jobs < 2 or len(waiting) < least:
        yield from (call.function(*call.arguments) for call in waiting)
        return
    with Pool(jobs) as pool:
        for ended in pool.run(waiting):
            if ended.error is not None:
                raise ended.error
            yield ended.result
