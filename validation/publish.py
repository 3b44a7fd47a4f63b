"""Writes a finished run into its folder: run.json, tables, and the report's pages."""

from __future__ import annotations

import hashlib
from importlib import resources
from pathlib import Path

from filelock import FileLock

from validation import provenance
from validation.results import Run, write_whole
from validation.tables import checks_csv, figures_csv
from validation.verdicts import junit, markdown

LOCK, STAMP = ".lock", ".rendered"


def keep(run: Run, folder: Path) -> Path:
    """Write run.json, its schema and the tables (the histories are there already); returns run.json. Two runs take turns."""
    with FileLock(folder / LOCK):
        write_whole(folder / "checks.csv", checks_csv(run))
        write_whole(folder / "figures.csv", figures_csv(run))
        write_whole(folder / "junit.xml", junit(run))
        write_whole(folder / "summary.md", markdown(run))
        return run.save(folder)


def publish(run: Run, folder: Path) -> Path:
    """Render the pages of a run that was kept, if anything that they show has changed; returns the page to open."""
    with FileLock(folder / LOCK):
        cells = tuple(cell.model_copy(update={"read_back": False}) for cell in run.cells)
        same = run.model_copy(update={"created": "", "wall_seconds": 0.0, "cells": cells})
        stamp = provenance.digest(same.model_dump_json() + provenance.code_digest("reports") + _looks())
        index, stamped = folder / "index.html", folder / STAMP
        if index.exists() and stamped.exists() and stamped.read_text(encoding="utf-8") == stamp:
            return index
        stamped.unlink(missing_ok=True)
        index = render(folder)
        write_whole(stamped, stamp)
        return index


def _looks() -> str:
    """Hash of the pages' templates, scripts and styles."""
    files = sorted(path for path in (resources.files("reports") / "data").rglob("*") if path.is_file())  # type: ignore[attr-defined]
    return provenance.digest("".join(f"{path.name} {hashlib.sha256(path.read_bytes()).hexdigest()}\n" for path in files))


def render(folder: Path) -> Path:
    """Write the pages of the finished run in `folder`; returns the page to open."""
    import reports

    return Path(reports.write_site(folder))
