"""`rockcheck stress`."""

from __future__ import annotations

from scenes import InputError


def run() -> None:
    """Numerical stability: where the models break."""
    raise InputError("stress is not available yet")
