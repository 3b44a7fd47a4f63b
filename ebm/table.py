"""Many runs as rows of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Excitation, Floats, InputError, Scene


@dataclass(frozen=True, kw_only=True)
class RunTable:
    """Runs as rows of numbers, all columns 1-D arrays of one length.

    `scenes` give block, floor, walls and start; their excitations and durations are not used.
    `motions` are pairs of a horizontal and a vertical motion of the base. `scene` and `motion` say
    by number which of these a row has. `factor` and `vertical_factor` multiply the acceleration.
    `gap_left` and `gap_right`, m: NaN keeps the scene's own wall, or none; inf: no wall there. A
    wall that the scene does not have there rebounds with `restitution`. Raises `InputError`.
    """

    scenes: Sequence[Scene]
    motions: Sequence[tuple[Excitation, Excitation]]
    scene: NDArray[np.intp]
    motion: NDArray[np.intp]
    factor: Floats
    vertical_factor: Floats
    gap_left: Floats
    gap_right: Floats
    restitution: float = 0.0

    def __post_init__(self) -> None:
        """Checks the columns."""
        count = len(self.scene)
        for name in ("motion", "factor", "vertical_factor", "gap_left", "gap_right"):
            if len(getattr(self, name)) != count:
                raise InputError(f"{len(getattr(self, name))} rows; scene has {count}", name)
        for name in ("scene", "motion"):
            numbers, most = np.asarray(getattr(self, name)), len(getattr(self, f"{name}s"))
            if np.any((numbers < 0) | (numbers >= most)):
                raise InputError(f"a number is not allowed: from 0 to {most - 1}", name)
        for name in ("factor", "vertical_factor"):
            if not np.all(np.isfinite(getattr(self, name))):
                raise InputError("finite numbers are asked for", name)
        for name in ("gap_left", "gap_right"):
            if np.any(getattr(self, name) < 0.0):
                raise InputError("a gap is not allowed to be below 0", name)
        if not 0.0 <= self.restitution <= 1.0:
            raise InputError(f"{self.restitution:g} is not allowed: from 0 to 1", "restitution")


def table_of(*scenes: Scene) -> RunTable:
    """A row a scene, each under its own motion."""
    rows, ones = np.arange(len(scenes)), np.ones(len(scenes))
    as_it_is = np.full(len(scenes), np.nan)
    return RunTable(
        scenes=scenes,
        motions=[(scene.excitation, scene.vertical) for scene in scenes],
        scene=rows,
        motion=rows,
        factor=ones,
        vertical_factor=ones,
        gap_left=as_it_is,
        gap_right=as_it_is,
    )
