"""`rockcheck benchmark`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, get_args

import typer
from rich.console import Console
from rich.table import Table

from rockcheck.commands import OUT, JobsOption, OutOption, answer, console, progress, tell_missing, usable_folder
from rockcheck.scenes.errors import unknown_name
from rockcheck.scenes.writing import write_whole

if TYPE_CHECKING:
    from rockcheck.validation.bench.ebm import EbmSpeed
    from rockcheck.validation.bench.models import WorkPrecision
    from rockcheck.validation.bench.study import Benchmark

WhatArgument = Annotated[str, typer.Argument(metavar="[WHAT]", help="all, ebm (batches), models (work and precision) or skipping.")]


def run(
    what: WhatArgument = "all",
    out: OutOption = OUT / "benchmark",
    quick: Annotated[bool, typer.Option("--quick", help="Fewer scenes and settings, at most 2 minutes.")] = False,
    jobs: JobsOption = None,
    minutes: Annotated[float | None, typer.Option("--minutes", min=0.1, help="Start nothing later than this (25; --quick 2).")] = None,
) -> None:
    """Run time against error, for every model.

    Writes a page with diagrams and tables, the tables as CSV, and a summary in Markdown. Whatever is left out is listed.
    """
    from rockcheck.validation.bench import study as benchmark

    if what not in get_args(benchmark.What):
        raise unknown_name("benchmark", what, get_args(benchmark.What))
    folder = usable_folder(out)
    tell_missing()
    with progress("benchmark") as on_progress:
        found = benchmark.run_benchmark(what, quick=quick, jobs=jobs, minutes=minutes, on_progress=on_progress)  # type: ignore[arg-type]
        from rockcheck.reports.studies.benchmark import write_benchmark
        from rockcheck.validation.bench.tables import markdown

        benchmark.save(found, folder)
        write_whole(folder / "summary.md", markdown(found))
        index = write_benchmark(found, folder)
    show(found, console())
    console().print(f"report: {index}", soft_wrap=True)
    answer({"report": index, "tables": sorted(folder.glob("*.csv")), "data": sorted(folder.glob("*.json"))})


def show(found: Benchmark, out: Console) -> None:
    """The tables that fit a terminal."""
    if found.ebm is not None:
        out.print(batch_table(found.ebm))
        for start in found.ebm.cold_starts:
            out.print(f"cold start, compile cache {start.cache}: import {start.importing:.2f} s, first run {start.first_simulation:.2f} s")
    if found.savings is not None:
        table = _table("model", "not needed", "with", "without", "unit", "times")
        for saving in found.savings:
            cost = f"{saving.cost_with:.3g}", f"{saving.cost_without:.3g}"
            table.add_row(saving.model, saving.thing, *cost, saving.unit, f"{saving.ratio:.2f}")
        out.print(table)
    if found.models is not None:
        out.print(ratio_table(found.models))
        for line in found.models.left_out:
            out.print(f"left out: {line}", soft_wrap=True)
    out.print(", ".join(f"{name} {version}" for name, version in found.versions.items()), soft_wrap=True)
    out.print(f"{', '.join(found.hardware.values())}; {found.wall_seconds:.0f} s", soft_wrap=True)


def batch_table(speed: EbmSpeed) -> Table:
    """A row a batch, at the cheapest tolerance that is right to 1e-8 (p95 of the peak, rad)."""
    from rockcheck.validation.bench.ebm import CASES

    table = _table("batch, one core", "tolerance", "μs a run", "right-hand sides", "p95 error", "wrong")
    for case in CASES:
        row = speed.at_level(case.name)
        if row is not None:
            cost = f"{1e6 * row.cpu:.1f}", f"{row.evaluations:.0f}", f"{row.error_95:.1e}"
            table.add_row(case.name, f"{row.tolerance:g}", *cost, f"{row.wrong} of {row.runs}")
    table.caption = f"one right-hand side: {1e9 * speed.right_hand_side:.1f} ns"
    return table


def ratio_table(found: WorkPrecision) -> Table:
    """A row a line: fitted order and ratio of run times to the EBM's at an error of 1e-3 alpha, scenes from least to most."""
    from rockcheck.validation.bench.models import LINES

    table = _table("model", "order", "run time / ebm's at 1e-3 alpha", "reached in")
    for label in LINES:
        trends = [trend for trend in found.trends if trend.line == label]
        orders = sorted(trend.order for trend in trends if math.isfinite(trend.order))
        ratios = sorted(trend.ratio for trend in trends if math.isfinite(trend.ratio))
        order = f"{orders[len(orders) // 2]:.2f}" if orders else "-"
        spread = f"{ratios[0]:.3g} to {ratios[-1]:.3g}" if ratios else "-"
        table.add_row(label, order, spread, f"{len(ratios)} of {len(trends)} scenes")
    return table


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False)
    for column in columns:
        table.add_column(column, justify="left" if column in (columns[0], "unit", "not needed") else "right")
    return table
