"""What the pages of all studies share."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rockcheck.reports.site import Site
from rockcheck.reports.style import LOOKS, looks
from rockcheck.validation.execute.study import Study


def write_study(found: Study, folder: Path, template: str, **context: Any) -> Path:
    """Writes `index.html` from a template that extends `study.html`; returns it. A report in the
    folder above is linked."""
    above = (("Report", "../index.html"),) if (folder.parent / "index.html").exists() else ()
    site = Site(folder, f"rockcheck: {found.suite}", above)
    site.assets()
    return site.page("index.html", template, run=found, looks=looks(LOOKS), **context)
