"""`rockcheck stress`."""

from __future__ import annotations

from typing import Annotated, get_args

import typer

from rockcheck.commands import (
    OUT,
    Played,
    one_of,
    studied,
    tell_missing,
)
from rockcheck.scenes.errors import NotInstalled

WhatArgument = Annotated[
    str,
    typer.Argument(
        metavar="[WHAT]", help="all, runs (random scenes) or maps (where engines break)."
    ),
]


def run(
    what: WhatArgument = "all",
    played: Played = Played(OUT / "stress"),
    quick: Annotated[
        bool, typer.Option("--quick", help="Some thousand runs, below a minute.")
    ] = False,
    seed: Annotated[
        int,
        typer.Option(
            "--seed", min=0, help="Of the random scenes; scene k of a seed is always the same."
        ),
    ] = 1,
    runs: Annotated[
        int | None,
        typer.Option(
            "--runs", min=1, help="Runs of each model (100,000 of event-based ones, else 2,000)."
        ),
    ] = None,
    model: Annotated[
        list[str] | None, typer.Option("--model", help="Only this model; repeatable.")
    ] = None,
) -> None:
    """Numerical stability: where the models break.

    Random scenes over all allowed settings, checked for invariants, and the steps at which
    engines break. Writes a page, tables, and of failures the smallest scene files that show them.
    An interrupted run resumes where it ended.
    Exit 1 where an event-based model breaks an invariant.
    """
    from rockcheck.validation.execute.models import not_installed
    from rockcheck.validation.studies.stress.players import PLAYERS
    from rockcheck.validation.studies.stress.study import Stress, What

    part: What = one_of("stress", what, get_args(What))
    for name in model or ():
        if missing := not_installed(one_of("model", name, PLAYERS).split()[0]):
            raise NotInstalled(missing, name)
    tell_missing()
    study = Stress(part, seed, quick, runs, tuple(model or ()))
    studied(study, played)
