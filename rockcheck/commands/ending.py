"""How a command ends: its finding as text, page and JSON, and its exit code.

In: a finding, or a study to run. Out: `typer.Exit`. Each command's last line calls it.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NoReturn

import typer

from rockcheck.commands.checks import usable_folder
from rockcheck.commands.console import answer, console, tell_wrong
from rockcheck.commands.options import Played
from rockcheck.commands.progress_bar import progress
from rockcheck.validation.finding import Finding
from rockcheck.validation.study import Study, run


def run_study(study: Study, options: Played, **how: Any) -> NoReturn:
    """Run a study with progress, write its page, print its finding; ends with its exit code."""
    finding = played_study(study, options, **how)
    finish_command(finding, options.out)


def played_study(study: Study, options: Played, **how: Any) -> Finding:
    """The finding of a study, played with progress."""
    folder = usable_folder(options.out)
    with progress(study.name) as on_progress:
        return run(
            study,
            folder,
            jobs=options.jobs,
            scheduler=options.scheduler,
            on_progress=on_progress,
            **how,
        )


def finish_command(
    found: Finding,
    folder: Path | None = None,
    said: Iterable[tuple[str, Path]] = (),
    value: Any = None,
) -> NoReturn:
    """Print a finding, and where what was written lies; end with the finding's exit code.

    Its page is written first if it has a `folder`; else `said` has the files, each with its kind.
    As JSON it is its `value`, by default all that it holds.
    """
    from rockcheck.reports.table_text import failure_lines
    from rockcheck.reports.terminal import show

    page = None
    if folder:
        from rockcheck.reports.document import publish  # with its templates

        page = publish(found, folder)
    show(found, console())
    tell_wrong(
        [
            *([found.answer] if found.exit_code and found.answer else []),
            *(f"failed: {line}" for line in failure_lines(found.failures)),
        ]
    )
    for kind, path in [("report", page)] if page else said:
        console().print(f"{kind}: {path}", soft_wrap=True)
    answer(value or found.as_dict() | {"report": page})
    raise typer.Exit(found.exit_code)
