"""How an engine's steps follow each other: all of one length, or as long as the events allow."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from rockcheck.engines.adaptive import adaptive_march
from rockcheck.engines.base_motion import BaseMotion
from rockcheck.engines.marching import Marched, march_fixed
from rockcheck.engines.world import World
from rockcheck.scenes import Scene


@dataclass(frozen=True)
class FixedStep:
    """Steps of `largest` s, each."""

    largest: float
    #: The settings of an engine that say so; the first is its largest step.
    knobs: ClassVar[tuple[str, ...]] = ("time_step",)

    def settings(self) -> dict[str, Any]:
        """The settings of an engine that steps so."""
        return {"time_step": self.largest}

    def ready(self, world: World, scene: Scene, base: BaseMotion) -> Callable[[], Marched]:
        """The march of a world through a scene, which is still to be called."""
        count = math.ceil(scene.output_times[-1] / self.largest - 1e-9)
        times = self.largest * np.arange(count + 1)
        return partial(march_fixed, world, scene, times, base.felt_acceleration(times))


@dataclass(frozen=True)
class AdaptiveStep:
    """Steps that end at the events and are at most `largest` s long.

    Steps at impacts and just after events are `short` times their usual length.
    """

    largest: float = 5e-4
    short: float = 1.0
    knobs: ClassVar[tuple[str, ...]] = ("largest_step", "short_steps")

    def settings(self) -> dict[str, Any]:
        """The settings of an engine that steps so."""
        knobs = zip(self.knobs, (self.largest, self.short), strict=True)
        return {"time_step": "adaptive", **dict(knobs)}

    def ready(self, world: World, scene: Scene, base: BaseMotion) -> Callable[[], Marched]:
        """The march of a world through a scene, which is still to be called."""
        return adaptive_march(scene, base, world.push, self.largest, self.short)
