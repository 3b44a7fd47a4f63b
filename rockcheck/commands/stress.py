"""`rockcheck stress`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Annotated, cast, get_args

import typer
from rich.console import Console
from rich.table import Table

from rockcheck.commands import OUT, JobsOption, OutOption, answer, console, progress, tell_missing, usable_folder
from rockcheck.scenes.errors import NotInstalled, unknown_name

if TYPE_CHECKING:
    from rockcheck.validation.stress.results import Stress
    from rockcheck.validation.stress.stability import Stability


WhatArgument = Annotated[str, typer.Argument(metavar="[WHAT]", help="all, runs (random scenes) or maps (where engines break).")]


def run(
    what: WhatArgument = "all",
    out: OutOption = OUT / "stress",
    quick: Annotated[bool, typer.Option("--quick", help="Some thousand runs, below a minute.")] = False,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the random scenes; scene k of a seed is always the same.")] = 1,
    runs: Annotated[int | None, typer.Option("--runs", min=1, help="Runs of each model (100,000 of event-based ones, else 2,000).")] = None,
    model: Annotated[list[str] | None, typer.Option("--model", help="Only this model; repeatable.")] = None,
    jobs: JobsOption = None,
) -> None:
    """Numerical stability: where the models break.

    Random scenes over all that can be written, held against invariants, and the steps at which engines break. Writes a page, the
    tables as CSV, a summary in Markdown, and of failures the smallest scene files that show them.
    Exit 1 where an event-based model breaks an invariant.
    """
    from rockcheck.validation.execute.models import not_installed
    from rockcheck.validation.stress import study, tables
    from rockcheck.validation.stress.players import PLAYERS

    if what not in get_args(study.What):
        raise unknown_name("stress", what, get_args(study.What))
    for name in model or ():
        if name not in PLAYERS:
            raise unknown_name("model", name, PLAYERS)
        if not study.installed(name):
            raise NotInstalled(not_installed(name), name)
    folder = usable_folder(out)
    tell_missing()
    with progress("stress") as on_progress:
        found = study.run_stress(
            cast("study.What", what), seed=seed, quick=quick, runs=runs, jobs=jobs, models=model, folder=folder, on_progress=on_progress
        )
    tables.save(found, folder)
    from rockcheck.reports.studies.stress import write_stress

    index = write_stress(found, folder)
    show(found, console())
    console().print(f"report: {index}", soft_wrap=True)
    answer(tables.as_data(found) | {"report": index})
    if not found.complete:
        raise KeyboardInterrupt
    raise typer.Exit(int(bool(found.broken)))


def show(found: Stress, out: Console) -> None:
    """For each model runs, failures by invariant and the worst figures; then the failures with their files."""
    from rockcheck.validation.stress.tables import summary_rows

    if found.stability is not None:
        out.print(stable_table(found.stability))
        out.print(still_table(found.stability))
    if not found.batches:
        return
    table = Table(box=None, pad_edge=False)
    for column in ("model", "invariant"):
        table.add_column(column)
    for column in ("runs", "failures", "worst", "in run", "bound"):
        table.add_column(column, justify="right")
    last = ""
    for row in summary_rows(found):
        figures = str(row["runs"]), str(row["failures"]), f"{row['worst']:.1e}", str(row["in run"]), f"{row['bound']:g}"
        table.add_row(row["model"] if row["model"] != last else "", row["invariant"], *figures, style="red" if row["failures"] else None)
        last = row["model"]
    out.print(table)
    for failure in [one for one in found.failures if one.file]:
        out.print(f"{failure.model}, {failure.invariant}, run {failure.number}: {failure.file} {failure.words}", soft_wrap=True)
    for line in _remarks(found):
        out.print(line, soft_wrap=True)
    runs = sum(batch.runs for batch in found.batches.values())
    broken = len(found.broken)
    verdict = "no failure of an event-based model" if not broken else f"failures of event-based models: {broken}"
    out.print(f"seed {found.seed}: {runs} runs, {verdict}; {found.wall_seconds:.0f} s with {found.jobs} processes")


def _remarks(found: Stress) -> Iterator[str]:
    """What is known of a model: impacts that add energy, modelling choices, and what could not be judged."""
    from rockcheck.validation.stress.tables import rules_text

    for label, batch in found.batches.items():
        if batch.gaining:
            yield f"{label}: an impact adds energy in {batch.gaining} runs, at most {100.0 * batch.largest_gain:.2g} %, by its law"
        if batch.rules:
            yield f"{label}: modelling choices made: {rules_text(batch)}"
        for name, count in batch.unjudged.items():
            yield f"{label}: {name} could not be judged in {count} of {count + batch.looked_at[name]} runs"


def stable_table(found: Stability) -> Table:
    """A row a model with settings, a column an axis: the least of the largest stable steps along it, and what comes beyond."""
    from rockcheck.validation.stress.stability import AXIS_WORDS

    table = Table(box=None, pad_edge=False, title="largest stable step, sqrt(R/g): least of an axis", title_justify="left")
    table.add_column("model")
    for words in AXIS_WORDS.values():
        table.add_column(words)
    for label in dict.fromkeys(one.line for one in found.stable):
        least = [min((s for s in found.stable if (s.line, s.axis) == (label, axis)), key=lambda s: s.step) for axis in AXIS_WORDS]
        table.add_row(label, *(f"{one.step:g}" + (f" ({one.fault} at {one.value:g})" if one.fault else "") for one in least))
    return table


def still_table(found: Stability) -> Table:
    """A row a case and model: what moves of a block that should stand."""
    from rockcheck.validation.stress.tables import MOVES

    table = Table(box=None, pad_edge=False)
    for column in ("block", "model", "for, s", *MOVES):
        table.add_column(column, justify="left" if column in ("block", "model") else "right")
    for one in found.still:
        table.add_row(one.case, one.line, f"{one.simulated:g}", *(f"{getattr(one, name):.0e}" for name in MOVES), one.fault)
    return table
