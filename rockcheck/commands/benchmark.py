"""`rockcheck benchmark`."""

from __future__ import annotations

from typing import Annotated, get_args

import typer

from rockcheck.commands import OUT, JobsOption, OutOption, Played, one_of, studied, tell_missing

WhatArgument = Annotated[
    str,
    typer.Argument(
        metavar="[WHAT]",
        help="all, ebm (batches), models (work and precision), skipping, or convergence.",
    ),
]


def run(
    what: WhatArgument = "all",
    out: OutOption = OUT / "benchmark",
    quick: Annotated[bool, typer.Option("--quick", help="Fewer scenes and settings.")] = False,
    jobs: JobsOption = None,
    minutes: Annotated[
        float, typer.Option("--minutes", min=0.1, help="Start nothing later than this.")
    ] = 25.0,
) -> None:
    """Run time against error, for every model.

    Work and precision, compiled batches, what a scene does not need, and what engines converge to.
    """
    from rockcheck.validation.studies.work_precision.study import What, WorkPrecision

    part: What = one_of("benchmark", what, get_args(What))
    tell_missing()
    studied(WorkPrecision(part, quick), Played(out, jobs), minutes=minutes)
