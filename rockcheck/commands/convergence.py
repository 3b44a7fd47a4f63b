"""`rockcheck convergence`."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.table import Table

from rockcheck.commands import OUT, JobsOption, OutOption, answer, console, progress, tell_missing, usable_folder

if TYPE_CHECKING:
    from rockcheck.validation.bench.convergence import Convergence


def run(
    out: OutOption = OUT / "convergence",
    quick: Annotated[bool, typer.Option("--quick", help="Three scenes without the finest steps, below a minute.")] = False,
    jobs: JobsOption = None,
) -> None:
    """What engines and CM converge to beside a wall.

    As their steps fall they tend to the unilateral event-based model, not to the paper's.

    Writes a page with a diagram and tables, and the tables as CSV.
    """
    from rockcheck.validation.bench import convergence

    folder = usable_folder(out)
    tell_missing()
    with progress("convergence") as on_progress:
        found = convergence.run_convergence(quick=quick, jobs=jobs, on_progress=on_progress)
        convergence.save(found, folder)
        from rockcheck.reports.studies.convergence import write_convergence

        index = write_convergence(found, folder)
    show(found, console())
    console().print(f"report: {index}", soft_wrap=True)
    answer(asdict(found) | {"report": index})


def show(found: Convergence, out: Console) -> None:
    """Errors by model and step against both references, the observed orders, and the runs that do not converge."""
    from rockcheck.validation.bench.convergence import LEVEL, REFERENCES

    out.print(f"RMS error of theta, alpha: median (largest) of {len(found.cases)} scenes")
    table = Table(box=None, pad_edge=False)
    table.add_column("model")
    for column in ("step, s", *(f"against {reference}" for reference in REFERENCES), f"within {LEVEL:g}"):
        table.add_column(column, justify="right")
    for level in found.levels:
        if level.reference == REFERENCES[0]:
            other = found.level(level.model, REFERENCES[1], level.value)
            errors = (f"{one.median:.1e} ({one.largest:.1e})" for one in (level, other))
            table.add_row(level.model, f"{level.step:.1e}", *errors, f"{level.within} of {level.runs}")
    out.print(table)
    for model in dict.fromkeys(level.model for level in found.levels):
        orders = ", ".join(f"{found.order(model, reference):.2f} against {reference}" for reference in REFERENCES)
        out.print(f"order of {model}: {orders}", soft_wrap=True)
    out.print(f"ebm against ebm-unilateral: {found.model_form:.1e} (median)")
    for line in found.exceptions:
        out.print(f"does not converge: {line}", soft_wrap=True)
    out.print(f"{', '.join(found.hardware.values())}; {found.wall_seconds:.0f} s", soft_wrap=True)
