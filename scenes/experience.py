"""What is known of the models from the suites (data/experience.json): how far to trust a figure,
and for which scenes.

The file is written by docs/site_tools/experience.py from finished runs
(`validation.suite.across`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import cache
from importlib import resources
from typing import NamedTuple

import numpy as np

from rockcheck.scenes.base import Frozen
from rockcheck.scenes.scene import Scene

#: Standard deviations of a 95 % interval.
WIDTH = 1.96


class Trust(Frozen):
    """A model's bias factor and relative standard deviation for one figure, from `count` scenes."""

    bias: float
    scatter: float
    count: int


class Range(Frozen):
    """The values of one axis that the suites cover."""

    low: float
    high: float


class Experience(Frozen):
    """Which suites were run, what was found by model and figure, and which scenes they cover."""

    suites: tuple[str, ...] = ()
    trust: Mapping[str, Mapping[str, Trust]] = {}
    domain: Mapping[str, Range] = {}


class Expected(NamedTuple):
    """A figure corrected by the model's bias, and its 95 % interval."""

    value: float
    low: float
    high: float


@cache
def known() -> Experience:
    """What comes with the package."""
    path = resources.files("rockcheck.scenes") / "data" / "experience.json"
    return (
        Experience.model_validate_json(path.read_text(encoding="utf-8"))
        if path.is_file()
        else Experience()
    )


def expected(trust: Trust, value: float) -> Expected:
    """A model's figure M as its experience has it: M/delta, and 1.96 sigma to either side."""
    best = value / trust.bias
    return Expected(
        best, best * (1.0 - WIDTH * trust.scatter), best * (1.0 + WIDTH * trust.scatter)
    )


def axes_of(scene: Scene) -> dict[str, list[float]]:
    """A scene on the axes of the domain: one value an axis, none where it has no such part, one a
    wall of its walls.

    alpha (rad), R (m), mu, e and gap/R of walls, and the intensity: peak base acceleration over g
    tan alpha.
    """
    block = scene.block
    found = {"alpha": [block.alpha], "R": [block.radius], "friction": [scene.floor.friction]}
    found["wall restitution"] = [wall.restitution for wall in scene.walls]
    found["gap / R"] = [wall.gap / block.radius for wall in scene.walls]
    if scene.excitation.kind != "rest":
        peak = float(np.max(np.abs(scene.excitation.acceleration(scene.output_times))))
        found["peak acceleration / (g tan alpha)"] = [
            peak / (scene.gravity * math.tan(block.alpha))
        ]
    return {axis: values for axis, values in found.items() if values}


def outside(scene: Scene, domain: Mapping[str, Range] | None = None) -> list[str]:
    """The axes on which a scene lies outside of the domain that the suites cover, a line each;
    empty where it lies inside.
    """
    domain = known().domain if domain is None else domain
    lines = []
    for axis, values in axes_of(scene).items():
        covered = domain.get(axis)
        for value in values:
            if covered is None or not covered.low <= value <= covered.high:
                bounds = (
                    "nothing" if covered is None else f"{covered.low:.3g} to {covered.high:.3g}"
                )
                lines.append(f"{axis} is {value:.3g}; the suites cover {bounds}")
    return lines
