"""Figures of one history: its peak rotation, where it ends, its impacts, hops and penetration.

In: a `WindowedHistory`. Out: a number for each of `FIGURES`, or a number and a remark;
`Unavailable` is raised where the history lacks a column. `measures` lists them for `describe`.
"""

import math
from functools import partial

import numpy as np

from rockcheck.scenes import kinematics
from rockcheck.validation.discrepancy import impacts
from rockcheck.validation.discrepancy.figures import (
    Measure,
    Value,
    WindowedHistory,
    by_name,
    last_slip_of,
)


def _peak_rotation(motion: WindowedHistory) -> Value:
    peak = motion.extremes.peak_rotation / motion.block.alpha
    fall = motion.history.overturned_at
    if fall is None or fall > motion.until:
        return peak, ""
    return peak, f"the block overturned at {fall:.3g} s"


def _last_slip(motion: WindowedHistory) -> float:
    motion.channel("slip")  # raises where the history has no such column
    return last_slip_of(motion.history) if motion.is_whole else motion.at_end("slip")


def _highest_hop(motion: WindowedHistory) -> float:
    motion.channel("y")  # raises where the history has no such column
    return motion.extremes.hop if motion.block else math.nan


def _deepest(motion: WindowedHistory) -> float:
    distances = [motion.heights()]
    if motion.scene is not None:
        x, theta = motion.channel("x"), motion.channel("theta")
        distances += [
            kinematics.clearance(motion.scene.block, wall.side, wall.gap, x, theta)
            for wall in motion.scene.walls
        ]
    deepest = np.max([-np.min(distance) for distance in distances])
    return float(np.maximum(deepest, 0.0))


def _impacts(motion: WindowedHistory, kind: str) -> tuple[float, str]:
    if motion.silent:
        return math.nan, f"{motion.history.model} has no events"
    return float(sum(impacts.strong(motion.events(kind)))), ""


#: A figure without an ideal value is judged by its expected value.
_quantity = partial(Measure, ideal=None)
FIGURES = by_name(
    _quantity(
        "peak_rotation",
        "peak rotation",
        "angle",
        "max |theta|, in alpha; of a block that has overturned it is no peak, and a note says so.",
        _peak_rotation,
    ),
    _quantity(
        "last_rotation",
        "last rotation",
        "angle",
        "theta at the window's end, in alpha: sees a shift in time that a peak does not.",
        lambda motion: motion.at_end("theta") / motion.block.alpha,
    ),
    _quantity(
        "last_x",
        "last x",
        "m",
        "The centroid's x at the window's end, m.",
        lambda motion: motion.at_end("x"),
    ),
    _quantity(
        "last_slip",
        "last slip",
        "m",
        "Where the pivot corner stands along the floor at the window's end, m from its first"
        " place.",
        _last_slip,
    ),
    _quantity(
        "end_time",
        "end of motion",
        "s",
        "End of the window or the run, s; where the block overturned, when it did.",
        lambda motion: motion.end,
    ),
    _quantity(
        "floor_impacts",
        "floor impacts",
        "1",
        "Number of floor impacts stronger than 1 % of the strongest.",
        partial(_impacts, kind="floor impact"),
        resolution=0.0,
    ),
    _quantity(
        "wall_impacts",
        "wall impacts",
        "1",
        "Number of wall impacts stronger than 1 % of the strongest.",
        partial(_impacts, kind="wall impact"),
        resolution=0.0,
    ),
    _quantity(
        "highest_hop",
        "highest hop",
        "m",
        "Largest height of the lowest corner above the floor, m; 0 for a model without free"
        " flight.",
        _highest_hop,
    ),
    Measure(
        "deepest_penetration",
        "deepest penetration",
        "m",
        "Largest depth of a corner below the floor or behind a wall (walls where the scene is"
        " known) in a row, m.",
        _deepest,
    ),
    Measure(
        "energy_gain",
        "largest energy gain at an impact",
        "1",
        "Most kinetic energy that the impact law added at one impact, relative to that before"
        " it (`Cost.largest_energy_gain`).",
        lambda motion: motion.history.cost.largest_energy_gain,
    ),
)
