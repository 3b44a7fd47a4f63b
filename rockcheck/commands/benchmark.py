"""`rockcheck benchmark`."""

from __future__ import annotations

from typing import Annotated, get_args

import typer

from rockcheck.commands import OUT, JobsOption, OutOption, Played, one_of, studied, tell_missing

#: Nothing begins later than this; what was left out begins with the next run.
MINUTES = 25.0

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
) -> None:
    """Run time against error, for every model.

    Work and precision, compiled batches, what a scene does not need, and what engines converge to.
    """
    from rockcheck.validation.studies.work_precision.study import What, WorkPrecision

    part: What = one_of("benchmark", what, get_args(What))
    tell_missing()
    studied(WorkPrecision(part, quick), Played(out, jobs), minutes=MINUTES)
