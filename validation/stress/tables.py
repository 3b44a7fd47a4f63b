"""A stress run's figures as tables: for the terminal, as CSV, as Markdown, and all of it as JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rockcheck.scenes.writing import json_text, markdown_table, records_text, table_text, write_whole
from rockcheck.validation.stress.invariants import INVARIANTS
from rockcheck.validation.stress.results import Failure, RunTotals, Stress
from rockcheck.validation.stress.stability import AXIS_WORDS, Stability, Stable, Still

#: What is listed of a block that should stand still.
MOVES = ("creep", "sinking", "rotation", "uplift", "jitter")
#: Columns of `summary_rows`.
SUMMARY = ("model", "invariant", "runs", "not judged", "failures", "worst", "in run", "bound")


def summary_rows(found: Stress) -> list[dict[str, Any]]:
    """A row a model and invariant: runs that looked at it and could not judge it, failures, worst figure, its run, and the bound."""
    rows = []
    for label, batch in found.batches.items():
        for name, invariant in INVARIANTS.items():
            looked_at, unjudged, failures = batch.looked_at[name], batch.unjudged[name], batch.failed(name)
            if looked_at or unjudged or failures:
                worst, number = batch.worst.get(name, (math.inf if failures else math.nan, -1))
                rows.append(dict(zip(SUMMARY, (label, name, looked_at, unjudged, failures, worst, number, invariant.bound), strict=True)))
    return rows


def markdown(found: Stress) -> str:
    """What was found as a section for a page of documentation."""
    command = " ".join(["rockcheck stress", *(["--quick"] if found.quick else []), f"--seed {found.seed}"])
    runs = sum(batch.runs for batch in found.batches.values())
    broken = len({(failure.model, failure.number) for failure in found.broken})
    parts = [
        f"## Figures of one {'quick' if found.quick else 'whole'} run",
        f"{found.created[:10]}, `{command}`, rockcheck {found.versions.get('rockcheck', '')}: "
        f"{found.wall_seconds / 60.0:.1f} min with {found.jobs} processes; {', '.join(found.hardware.values())}."
        + (f" {runs:,} runs; event-based models fail in {broken}." if runs else "")
        + ("" if found.complete else " The run was interrupted."),
    ]
    if found.batches:
        parts += [_totals(found), *_rules(found), invariants_markdown(found)]
    if shown := [failure for failure in found.failures if failure.file]:
        rows = [(one.model, one.invariant, str(one.number), f"{one.figure:.2g}", one.words) for one in shown]
        parts.append(markdown_table(("failure of", "invariant", "run", "figure", "in words"), rows))
    if found.stability is not None:
        parts += _maps(found.stability)
    return "\n\n".join(parts) + "\n"


def _totals(found: Stress) -> str:
    """A row a model."""
    columns = ("model", "runs", "failures", "events", "runs with energy gained in an impact (most)", "horizon needed")
    rows = []
    for label, batch in found.batches.items():
        broken = len({failure.number for failure in batch.failures})
        gains = f"{batch.gaining} ({100.0 * batch.largest_gain:.2g} %)" if batch.gaining else "0"
        rows.append((label, str(batch.runs), str(broken), str(batch.events), gains, str(batch.horizons)))
    return markdown_table(columns, rows)


def _rules(found: Stress) -> list[str]:
    """The modelling choices that were made, a row a model, if there were any."""
    rows = [(label, rules_text(batch)) for label, batch in found.batches.items() if batch.rules]
    return [markdown_table(("model", "modelling choices made"), rows)] if rows else []


def rules_text(batch: RunTotals) -> str:
    """The modelling choices that a model made in its runs, the most frequent first."""
    return ", ".join(f"{name} {count:,}" for name, count in batch.rules.most_common())


def invariants_markdown(found: Stress) -> str:
    """A row an invariant, a column a model."""
    rows = [
        (invariant.words, f"{invariant.bound:g}", *(_worst(batch, name) for batch in found.batches.values()))
        for name, invariant in INVARIANTS.items()
    ]
    return markdown_table(("invariant", "bound", *found.batches), rows)


def _worst(batch: RunTotals, invariant: str) -> str:
    failures, unjudged = batch.failed(invariant), batch.unjudged[invariant]
    words = [f"{batch.worst.get(invariant, (math.inf, -1))[0]:.1e}"] if batch.looked_at[invariant] or failures else []
    words += [f"**{failures} fail**"] if failures else []
    words += [f"{unjudged} not judged"] if unjudged else []
    return ", ".join(words)


def _maps(found: Stability) -> Iterator[str]:
    """The largest stable step, a table an axis, and what moves that should stand still."""
    labels = list(dict.fromkeys(one.line for one in found.stable))
    for axis, words in AXIS_WORDS.items():
        values = list(dict.fromkeys(one.value for one in found.stable if one.axis == axis))
        rows = []
        for label in labels:
            here = [found.step(label, axis, value) for value in values]
            rows.append((label, *(f"{one.step:g} {one.fault}".strip() if one else "" for one in here)))
        yield markdown_table((words, *(f"{value:g}" for value in values)), rows)
    rows = []
    for one in found.still:
        figures = [f"{getattr(one, name):.1e}" for name in MOVES] if not one.fault else [one.fault, *[""] * (len(MOVES) - 1)]
        rows.append((one.case, one.line, f"{one.simulated:g}", f"{one.step:.2g}", *figures))
    yield markdown_table(("case", "model", "simulated, s", "step, s", *MOVES), rows)


def save(found: Stress, folder: Path) -> None:
    """Writes invariants.csv, failures.csv, the maps as CSV, summary.md and run.json into a folder."""
    write_whole(folder / "invariants.csv", table_text(SUMMARY, (list(row.values()) for row in summary_rows(found)), digits=6))
    write_whole(folder / "failures.csv", records_text(Failure, found.failures))
    if found.stability is not None:
        write_whole(folder / "stable-steps.csv", records_text(Stable, found.stability.stable))
        write_whole(folder / "stand-still.csv", records_text(Still, found.stability.still))
    write_whole(folder / "summary.md", markdown(found))
    write_whole(folder / "run.json", json_text(as_data(found)) + "\n")


def as_data(found: Stress) -> dict[str, Any]:
    """The whole run as plain data."""
    batches = {label: vars(batch) | {"failures": [asdict(failure) for failure in batch.failures]} for label, batch in found.batches.items()}
    return vars(found) | {"batches": batches, "stability": found.stability and asdict(found.stability)}
