"""`rockcheck accept`: today's figures become the expected ones."""

from __future__ import annotations

from typing import Annotated

import typer

from rockcheck.commands import (
    AllowCodeOption,
    Played,
    tell_left_out,
    told,
    usable_folder,
)
from rockcheck.commands.validate import SuiteArgument, play, tell_faults
from rockcheck.validation.finding import Finding, Text
from rockcheck.validation.suite.acceptance import accept
from rockcheck.validation.suite.suites import load_suite


def run(
    suite: SuiteArgument = None,
    reason: Annotated[
        str | None,
        typer.Option(
            "--reason",
            help="Why limits are loosened or figures moved; it is written into the file.",
        ),
    ] = None,
    played: Played = Played(),
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Show the changes, write none.")
    ] = False,
    allow_code: AllowCodeOption = None,
) -> None:
    """Make today's figures the expected ones.

    They are written into the suite's tolerances, each change is shown: new, tightened, loosened or
    moved, the last two only with --reason.
    """
    name = suite or "paper"
    folder = usable_folder(played.out)
    loaded = load_suite(name, allow_code=allow_code or ())
    tell_left_out(loaded.left_out)
    finished = play(loaded, folder, played)
    changes, refused = accept(loaded, finished, reason, write=not dry_run)
    tell_faults(finished, folder)
    failed = finished.exit_code if finished.verdict == "error" else 0
    done = "would be written to" if dry_run else "in"
    told(
        Finding(
            "accept",
            loaded.name,
            f"{len(changes)} changes {done} {finished.tolerances_file}",
            [
                Text(items=changes),
                Text(items=[f"not accepted: {line}" for line in refused], verdict="fail"),
            ],
            data={
                "changes": changes,
                "refused": refused,
                "file": finished.tolerances_file,
                "written": not dry_run,
            },
            exit_code=failed or int(bool(refused)),
        )
    )
