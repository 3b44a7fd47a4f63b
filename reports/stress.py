"""Page of a stress run: invariants by model, failures with their scene files."""

from __future__ import annotations

import math
from pathlib import Path

from reports.site import Site
from reports.style import LOOKS, looks
from validation.stress.invariants import INVARIANTS
from validation.stress.players import PLAYERS
from validation.stress.study import Stress


def write_stress(found: Stress, folder: Path) -> Path:
    """Writes `index.html` into the folder of a stress run; returns the page."""
    above = (("Report", "../index.html"),) if (folder.parent / "index.html").exists() else ()
    site = Site(folder, "rockcheck: stress", above)
    site.assets()
    return site.page(
        "index.html", "stress.html", run=found, looks=looks(LOOKS), invariants=INVARIANTS, players=PLAYERS, finite=math.isfinite
    )
