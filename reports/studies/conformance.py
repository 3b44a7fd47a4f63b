"""Page of conformance cards: phenomena by engine, and what each failure means."""

from __future__ import annotations

import math
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from rockcheck.reports.site import Site
from rockcheck.reports.style import LOOKS, looks
from rockcheck.validation.conformance.cards import VERDICTS, Card
from rockcheck.validation.conformance.phenomena import PHENOMENA

#: The sign that goes with a verdict, and the class of its colour.
SIGNS = {"pass": ("✓", "pass"), "fail": ("✕", "fail"), "lacks": ("–", "changed"), "error": ("!", "error"), "reported": ("·", "changed")}


def write_conformance(cards: Sequence[Card], folder: Path) -> Path:
    """Writes `index.html` into the folder of the cards; returns the page."""
    above = (("Report", "../index.html"),) if (folder.parent / "index.html").exists() else ()
    site = Site(folder, "rockcheck: conformance", above)
    site.assets()
    return site.page(
        "index.html",
        "conformance.html",
        cards=cards,
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        phenomena=PHENOMENA,
        verdicts=VERDICTS,
        signs=SIGNS,
        looks=looks(LOOKS),
        finite=math.isfinite,
    )
