"""Writes a finished run into its folder: run.json, tables, and the report's pages."""

from __future__ import annotations

import os
from pathlib import Path

from filelock import FileLock

from rockcheck.scenes.writing import write_whole
from rockcheck.validation.suite.results import Run
from rockcheck.validation.suite.tables import checks_csv, figures_csv
from rockcheck.validation.suite.verdicts import junit, markdown

LOCK = ".lock"


def keep(run: Run, folder: Path) -> Path:
    """Write run.json, its schema and the tables (the histories are there already); returns run.json. Two runs take turns."""
    with FileLock(folder / LOCK):
        write_whole(folder / "checks.csv", checks_csv(run))
        write_whole(folder / "figures.csv", figures_csv(run))
        write_whole(folder / "junit.xml", junit(run))
        write_whole(folder / "summary.md", markdown(run))
        return run.save(folder)


def publish(folder: Path, *, jobs: int | None = None, afresh: bool = False) -> Path:
    """Write the pages of the run that was kept in `folder`; returns the page to open.

    Unless `afresh`, only those that would show something else than they do. `jobs` processes draw, by default one a core.
    """
    from rockcheck import reports

    with FileLock(folder / LOCK):
        return Path(reports.write_site(folder, jobs=jobs or os.cpu_count() or 1, afresh=afresh))
