"""The benchmark: run time against error, the speed of compiled batches, and what each unneeded thing would cost."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.writing import json_text, records_text, write_whole
from rockcheck.validation.execute.study import Study, header

if TYPE_CHECKING:
    from rockcheck.validation.bench.ebm import EbmSpeed
    from rockcheck.validation.bench.models import WorkPrecision
    from rockcheck.validation.bench.skipping import Saving

What = Literal["all", "ebm", "models", "skipping"]
#: Minutes that a benchmark may take, whole and quick; see `work_precision` for what happens then.
MINUTES, QUICK_MINUTES = 25.0, 2.0
#: Share of the time within which the last run must have begun: it may take a while, and pages are written after it.
LAST_BEGINS = 0.92


@dataclass(frozen=True, kw_only=True)
class Benchmark(Study):
    """What was measured; parts that were not asked for are None."""

    ebm: EbmSpeed | None = None
    models: WorkPrecision | None = None
    savings: tuple[Saving, ...] | None = None


def run_benchmark(
    what: What = "all",
    *,
    quick: bool = False,
    jobs: int | None = None,
    minutes: float | None = None,
    on_progress: OnProgress = unheard,
) -> Benchmark:
    """Measures `what`. `jobs` processes (default: one a core) play the longest runs side by side, all else runs alone; batches
    by size run on one thread and on `jobs`.

    `minutes` (default 25, quick 2): runs that have not begun shortly before are left out and listed.
    """
    began, jobs = time.monotonic(), jobs or os.cpu_count() or 1
    deadline = began + 60.0 * LAST_BEGINS * (minutes or (QUICK_MINUTES if quick else MINUTES))
    parts: dict[str, Any] = {}
    if what in ("all", "ebm"):
        from rockcheck.validation.bench.ebm import ebm_speed

        parts["ebm"] = ebm_speed(quick=quick, jobs=jobs, on_progress=on_progress)
    if what in ("all", "skipping"):
        from rockcheck.validation.bench.skipping import skipping

        parts["savings"] = skipping(quick=quick, on_progress=on_progress)
    if what in ("all", "models"):
        from rockcheck.validation.bench.models import work_precision

        parts["models"] = work_precision(quick=quick, jobs=jobs, deadline=deadline, on_progress=on_progress)
    return Benchmark(**header(f"benchmark {what}", quick=quick, jobs=jobs, began=began), **parts)


def save(found: Benchmark, folder: Path) -> None:
    """Writes run.json and the tables as CSV into a folder."""
    write_whole(folder / "run.json", json_text(asdict(found)) + "\n")
    tables: dict[str, Sequence[Any]] = {}
    if found.models is not None:
        tables |= {
            "runs": found.models.samples,
            "work-precision": found.models.points,
            "orders-and-ratios": found.models.trends,
            "engines": found.models.pooled,
        }
    if found.ebm is not None:
        tables |= {"batches": found.ebm.times, "batch-sizes": found.ebm.sizes, "cold-starts": found.ebm.cold_starts}
    if found.savings is not None:
        tables |= {"savings": found.savings}
    for name, rows in tables.items():
        write_whole(folder / f"{name}.csv", records_text(type(rows[0]), rows) if rows else "")
