"""Figures and pages of a finished run; see `reports.site.write_site`."""

from __future__ import annotations

from pathlib import Path

from rockcheck.scenes.progress import OnProgress, unheard


def write_site(folder: str | Path, *, jobs: int = 1, afresh: bool = True, on_progress: OnProgress = unheard) -> Path:
    """Write `index.html` and a page a scene for the finished run in `folder` (`run.json`, `histories/`); returns the index.

    The pages open from the file system and ask nothing of any other place. They are drawn in up to `jobs` processes, and
    unless `afresh` only where they would show something else. Raises `InputError` where there is no run.
    """
    from rockcheck.reports.site import write_site as write

    return write(Path(folder), jobs=jobs, afresh=afresh, on_progress=on_progress)


__all__ = ["write_site"]
