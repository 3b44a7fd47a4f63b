"""The benchmark: run time against error, the speed of compiled batches, and what each unneeded thing would cost."""

from __future__ import annotations

import csv
import io
import json
import math
import os
import time
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rockcheck.scenes.progress import OnProgress, unheard
from rockcheck.scenes.writing import write_whole
from rockcheck.validation.execute import provenance

if TYPE_CHECKING:
    from rockcheck.validation.bench.ebm import EbmSpeed
    from rockcheck.validation.bench.models import WorkPrecision
    from rockcheck.validation.bench.skipping import Saving

What = Literal["all", "ebm", "models", "skipping"]
#: Minutes that a benchmark may take, whole and quick; see `work_precision` for what happens then.
MINUTES, QUICK_MINUTES = 25.0, 2.0
#: Share of the time within which the last run must have begun: it may take a while, and pages are written after it.
LAST_BEGINS = 0.92


@dataclass(frozen=True)
class Benchmark:
    """What was measured, when, with what, on what; parts that were not asked for are None."""

    suite: str
    created: str
    quick: bool
    jobs: int
    wall_seconds: float
    versions: dict[str, str]
    hardware: dict[str, str]
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
    """Measures `what`. `jobs` processes (default: one a core) play the longest runs side by side, all else runs alone.

    `minutes` (default 25, quick 2): runs that have not begun shortly before are left out and listed.
    """
    began, jobs = time.monotonic(), jobs or os.cpu_count() or 1
    deadline = began + 60.0 * LAST_BEGINS * (minutes or (QUICK_MINUTES if quick else MINUTES))
    parts: dict[str, Any] = {}
    if what in ("all", "ebm"):
        from rockcheck.validation.bench.ebm import ebm_speed

        parts["ebm"] = ebm_speed(quick=quick, on_progress=on_progress)
    if what in ("all", "skipping"):
        from rockcheck.validation.bench.skipping import skipping

        parts["savings"] = skipping(quick=quick, on_progress=on_progress)
    if what in ("all", "models"):
        from rockcheck.validation.bench.models import work_precision

        parts["models"] = work_precision(quick=quick, jobs=jobs, deadline=deadline, on_progress=on_progress)
    return Benchmark(
        suite=f"benchmark {what}{', quick' if quick else ''}",
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        quick=quick,
        jobs=jobs,
        wall_seconds=time.monotonic() - began,
        versions=provenance.versions(),
        hardware=provenance.hardware(),
        **parts,
    )


def save(found: Benchmark, folder: Path) -> None:
    """Writes run.json and the tables as CSV into a folder."""
    write_whole(folder / "run.json", json.dumps(_plain(asdict(found)), indent=1) + "\n")
    tables: dict[str, Sequence[Any]] = {}
    if found.models is not None:
        tables |= {
            "runs": found.models.samples,
            "work-precision": found.models.points,
            "orders-and-ratios": found.models.trends,
            "engines": found.models.pooled,
        }
    if found.ebm is not None:
        tables |= {"batches": found.ebm.times, "cold-starts": found.ebm.cold_starts}
    if found.savings is not None:
        tables |= {"savings": found.savings}
    for name, rows in tables.items():
        write_whole(folder / f"{name}.csv", _csv([asdict(row) for row in rows]))


def _plain(value: Any) -> Any:
    """For JSON, which has no NaN."""
    if isinstance(value, dict):
        return {key: _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _csv(rows: Iterable[dict[str, Any]]) -> str:
    rows = list(rows)
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else [], lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: f"{value:.6g}" if isinstance(value, float) else value for key, value in row.items()} for row in rows)
    return text.getvalue()
