"""A run as JUnit XML, which continuous integration reads.

In: a finished run. Out: the text of the file. The command and the pages call it.
"""

from collections.abc import Iterator, Mapping
from typing import Any

from rockcheck.scenes import writing
from rockcheck.validation.suite import results, verdict_scale


def junit(run: results.Run) -> str:
    """JUnit XML: a test suite per scene, a test case per check and one for each cell's run.

    A failed run is an error. A figure that changed within its limit, and a model that is not
    installed, are failures only in a strict run; a better figure only if the run is strict both
    ways. A check that is not defined is skipped.
    """
    suites: list[tuple[str, list[writing.Case]]] = [
        (scene, [case for cell in cells.values() for case in _cases(cell, run.strict)])
        for scene, cells in run.by_scene.items()
    ]
    faults: list[writing.Case] = [
        ("tolerances", fault, "failed", fault, "", None) for fault in run.wrong
    ]
    return writing.junit_text(
        f"rockcheck {run.suite}", [*suites, *([("tolerances", faults)] if faults else [])]
    )


def _cases(cell: results.Cell, strict: verdict_scale.Strict) -> Iterator[writing.Case]:
    place = f"{cell.scene}.{cell.model}"
    came: Mapping[str, Any] = {
        "failed": "error",
        "absent": "failed" if strict else "skipped",
        "unavailable": "skipped",
    }
    seconds = 0.0 if cell.read_back else cell.cost.worker_seconds
    yield place, "runs", came.get(cell.status, ""), cell.reason, "", seconds
    if cell.numerical is not None:
        reasons = "; ".join(cell.numerical.reasons)
        yield place, "converged", "" if cell.converged else "skipped", reasons, "", None
    for check in cell.checks:
        wrong = "failed" if check.fails(strict) else ""
        found: Any = "skipped" if check.verdict == "not defined" else wrong
        yield place, check.figure.title, found, check.reason, check.verdict, None
