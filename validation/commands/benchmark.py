"""`rockcheck benchmark`."""

from __future__ import annotations

from scenes import InputError


def run() -> None:
    """Run time against error, for every model."""
    raise InputError("benchmark is not available yet")
