"""Figures and pages of a finished run; see `reports.site.write_site`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rockcheck.scenes.progress import OnProgress, unheard


def write_site(
    folder: str | Path,
    *,
    jobs: int = 1,
    afresh: bool = True,
    wanted: Sequence[str] = (),
    on_progress: OnProgress = unheard,
) -> Path:
    """Write `index.html` and a page a scene for the finished run in `folder` (`run.json`,
    `histories/`); returns the index.

    The pages open from the file system and ask nothing of any other place. They are drawn in up to
    `jobs` processes, and unless `afresh` only where they would show something else. In a run of
    more than 200 scenes those that are not within tolerance or nearest to a limit have a page, and
    those that are `wanted`. Raises `InputError` where there is no run, or a wanted scene is not of
    it.
    """
    from rockcheck.reports.site import write_site as write

    return write(Path(folder), jobs=jobs, afresh=afresh, wanted=wanted, on_progress=on_progress)


__all__ = ["write_site"]
