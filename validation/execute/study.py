"""What every study says of itself."""

from __future__ import annotations

import time
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any

from rockcheck.validation.execute import provenance


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study's name, when it was made (UTC, ISO 8601), in how many processes and how long (s),
    with what, on what."""

    suite: str
    created: str
    quick: bool
    jobs: int
    wall_seconds: float
    versions: dict[str, str]
    hardware: dict[str, str]


def header(name: str, *, quick: bool, jobs: int, began: float) -> dict[str, Any]:
    """The fields of a `Study` that ends now and `began` at that time (of `time.monotonic`)."""
    return {
        "suite": f"{name}{', quick' if quick else ''}",
        "created": datetime.now(UTC).isoformat(timespec="seconds"),
        "quick": quick,
        "jobs": jobs,
        "wall_seconds": time.monotonic() - began,
        "versions": provenance.versions(),
        "hardware": provenance.hardware(),
    }
