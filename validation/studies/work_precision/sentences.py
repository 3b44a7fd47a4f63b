"""The answer of the benchmark in sentences, from its tables."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

from rockcheck.validation.studies.work_precision.curves import LEVEL
from rockcheck.validation.studies.work_precision.points import REFERENCES

#: The rows of tables by their names, as `Table.records` gives them.
Tables = Mapping[str, list[dict[str, Any]]]


def answer(tables: Tables) -> str:
    """What the tables say first: the cheapest engine, the batches, the finest steps."""
    if not tables:
        return "Nothing was measured."
    return " ".join(_sentences(tables))


def _sentences(tables: Tables) -> Iterator[str]:
    standings = tables.get("league", [])
    if standings and math.isfinite(standings[0]["cost"]):
        cheapest = standings[0]
        yield (
            f"The cheapest engine at an error of {LEVEL:g} alpha is {cheapest['line']}:"
            f" {cheapest['cost']:.2g} ms of CPU a simulated second."
        )
    if best := tables.get("batches-at-level"):
        costs = ", ".join(f"{row['case']} {row['evaluations']:.0f}" for row in best)
        yield f"A run of the event-based model costs, in right-hand sides: {costs}."
    if levels := tables.get("levels"):
        # of each model the last row, the finest
        finest = {row["model"]: row[f"median_{REFERENCES[0]}"] for row in levels}
        errors = ", ".join(f"{model} {error:.1e}" for model, error in finest.items())
        yield (
            f"Beside a wall, median errors against {REFERENCES[0]} at the finest setting,"
            f" alpha: {errors}."
        )
