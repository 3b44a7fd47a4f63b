"""Runs of a scene as rows of a table of numbers: draws times gaps times factors.

In: scenes of one motion (the scene as it is, then its draws), and for each row which of them it is.
Out: a table for the compiled batch. Called by the tasks.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.table import RunTable
from rockcheck.scenes import Floats, Scene, Side


def table_of(
    scenes: Sequence[Scene],
    which: NDArray[np.int64],
    *,
    gaps: tuple[Side, Floats | float] | None = None,
    restitution: float = 0.0,
    factor: Floats | float = 1.0,
    vertical_factor: Floats | float = 1.0,
) -> RunTable:
    """A row a run of `scenes[which]`, with other gaps (m; infinite: no wall) on one side.

    `factor` multiplies the horizontal motion, `vertical_factor` the vertical one. `restitution` is
    that of a wall that a scene has not.
    """
    motions: dict[tuple[int, int], int] = {}
    of_scene = [
        motions.setdefault((id(scene.excitation), id(scene.vertical)), len(motions))
        for scene in scenes
    ]
    known = {of_scene[k]: (scene.excitation, scene.vertical) for k, scene in enumerate(scenes)}
    count = len(which)
    unchanged = np.full(count, np.nan)
    side, values = gaps if gaps is not None else ("left", unchanged)
    column: dict[str, Any] = {"gap_left": unchanged, "gap_right": unchanged}
    column[f"gap_{side}"] = np.broadcast_to(np.asarray(values, dtype=float), count)
    return RunTable(
        scenes=scenes,
        motions=[known[k] for k in range(len(motions))],
        scene=which,
        motion=np.array(of_scene, dtype=np.int64)[which],
        factor=np.broadcast_to(np.asarray(factor, dtype=float), count),
        vertical_factor=np.broadcast_to(np.asarray(vertical_factor, dtype=float), count),
        restitution=restitution,
        **column,
    )
