"""A run in plain values, for `--json`.

In: a finished run. Out: a dict that JSON can hold. The command and the plugin call it.
"""

from typing import Any

from rockcheck.validation.suite import results, tolerances
from rockcheck.validation.suite.reasons import improvements, verdict_lines


def outcome_row(cell: results.Cell, reference: str) -> dict[str, Any]:
    """The result of a cell in plain values; `peak_rotation_alpha` is None for a block that fell."""
    return {
        "scene": cell.scene,
        "model": cell.model,
        "status": cell.status,
        "outcome": cell.outcome or None,
        "overturned_at_s": cell.overturned_at,
        "peak_rotation_alpha": None
        if cell.outcome.startswith("overturned")
        else results.value_of(cell.figures, "peak_rotation"),
        "apart_alpha": results.value_of(cell.figures, "theta_rms", reference, tolerances.HORIZON),
        "wall_seconds": cell.cost.wall_seconds,
    }


def summary(run: results.Run) -> dict[str, Any]:
    """The verdicts of the run and its cells in plain values, with the reasons of each non-pass.

    Where nothing is judged, the outcome of each cell.
    """
    common = {
        "suite": run.suite,
        "exit_code": run.exit_code,
        "reasons": list(verdict_lines(run)),
    }
    if not run.judged:
        return common | {
            "judged": False,
            "reference": run.reference,
            "cells": [outcome_row(cell, run.reference) for cell in run.cells],
        }
    return common | {
        "verdict": run.verdict,
        "wall_seconds": run.wall_seconds,
        "cells": [
            {
                "scene": cell.scene,
                "model": cell.model,
                "outcome": cell.outcome,
                "overturned_at_s": cell.overturned_at,
                "checks": len(cell.checks),
                "verdict": cell.verdict if cell.checks or cell.status != "done" else None,
                "converged": cell.converged,
                "impact_law": cell.impact_law.law if cell.impact_law else None,
                "explanations": [
                    f"{e.quantity} against {e.against}: {e.verdict}" for e in cell.explanations
                ],
            }
            for cell in run.cells
        ],
        "better": list(improvements(run)),
    }
