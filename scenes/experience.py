"""Bias and scatter of the models in the suites, and the scenes that the suites cover.

The data, data/experience.json, are written by docs/site_tools/experience.py from finished runs
(`validation.suite.across`).
"""

import math
from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from rockcheck.scenes.base import DATA, Frozen
from rockcheck.scenes.excitations import Rest
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
    """The suites that were run, each model's `Trust` by figure, and the domain of the scenes.

    `settings` are those that each model had in them: by name, the values.
    """

    suites: tuple[str, ...] = ()
    trust: Mapping[str, Mapping[str, Trust]] = {}
    settings: Mapping[str, Mapping[str, tuple[Any, ...]]] = {}
    domain: Mapping[str, Range] = {}


class Expected(NamedTuple):
    """A figure corrected by the model's bias, and its 95 % interval."""

    value: float
    low: float
    high: float


@cache
def known() -> Experience:
    """The experience that comes with the package; empty if its file is missing."""
    path = DATA / "experience.json"
    return (
        Experience.model_validate_json(path.read_text(encoding="utf-8"))
        if path.is_file()
        else Experience()
    )


def trust_of(model: str, settings: Mapping[str, Any]) -> Mapping[str, Trust]:
    """A model's `Trust` by figure; empty with settings that it had in no suite.

    Steps and tolerances may be finer than there.
    """
    found = known()
    held = all(
        any(_within(settings[name], value) for value in values)
        for name, values in found.settings.get(model, {}).items()
        if name in settings
    )
    return found.trust.get(model, {}) if held else {}


def _within(own: object, value: object) -> bool:
    """Whether a setting is this value, or a number below it."""
    return own == value or (
        isinstance(own, float) and isinstance(value, float) and own <= value * (1.0 + 1e-9)
    )


def expected(trust: Trust, value: float) -> Expected:
    """A model's figure M corrected by its bias delta: M/delta, and 1.96 sigma to either side."""
    best, width = value / trust.bias, WIDTH * trust.scatter
    return Expected(best, best * (1.0 - width), best * (1.0 + width))


def axes_of(scene: Scene) -> dict[str, list[float]]:
    """The values of a scene on the axes of the domain.

    alpha (rad), R (m), mu, and for each wall e and gap/R; and the intensity, peak base acceleration
    over g tan alpha. An axis without a value is left out.
    """
    block, base = scene.block, scene.excitation
    step = 1.0 if isinstance(base, Rest) else base.sample_step  # no peak lies in between
    times = np.arange(0.0, min(scene.duration, base.quiet_after) + step, step)
    peak = np.max(np.abs(base.acceleration(np.minimum(times, scene.duration))))
    found = {
        "alpha": [block.alpha],
        "R": [block.radius],
        "friction": [scene.floor.friction],
        "wall restitution": [wall.restitution for wall in scene.walls],
        "gap / R": [wall.gap / block.radius for wall in scene.walls],
        "peak acceleration / (g tan alpha)": (
            [float(peak) / (scene.gravity * math.tan(block.alpha))] if base.kind != "rest" else []
        ),
    }
    return {axis: values for axis, values in found.items() if values}


def outside(scene: Scene, domain: Mapping[str, Range] | None = None) -> list[str]:
    """The axes on which a scene lies outside the domain of the suites, a line each.

    Empty if it lies inside, or where nothing is known of the suites.
    """
    domain = known().domain if domain is None else domain
    return [
        f"{axis} is {value:.3g}; the suites cover "
        + (f"{domain[axis].low:.3g} to {domain[axis].high:.3g}" if axis in domain else "nothing")
        for axis, values in axes_of(scene).items()
        for value in values
        if domain and not (axis in domain and domain[axis].low <= value <= domain[axis].high)
    ]
