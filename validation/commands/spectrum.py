"""`rockcheck spectrum`."""

from __future__ import annotations

from scenes import InputError


def run() -> None:
    """Overturning spectra: the figures of the paper, or your own grid."""
    raise InputError("spectrum is not available yet")
