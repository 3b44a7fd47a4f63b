"""Storeys of random buildings, and what must hold of their motions.

In: a scene whose base is the ground, a seed and a number. Out: the scene on a storey, and what does
not hold of that storey's motion. Called by the player of storeys.
"""

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from rockcheck.scenes import Floats, InputError, Record, Scene
from rockcheck.scenes.buildings import (
    Building,
    Modal,
    Mode,
    Regular,
    storey_motion,
)
from rockcheck.scenes.files import QUIET_SHARE

#: Storeys, first period (of the block's time 1/p) and damping of a random building.
STOREYS, PERIOD, DAMPING = (1, 6), (0.3, 3.0), (0.01, 0.4)
#: A motion that is computed in other steps may differ by this part of its peak.
ROUNDING = 1e-10


def random_building(scene: Scene, seed: int, number: int) -> Building:
    """A building for the scene's block to stand in: regular, or every third time by its modes."""
    r = np.random.default_rng([seed, number, 77])
    longest = math.exp(r.uniform(*np.log(PERIOD))) / scene.frequency_parameter
    damping = math.exp(r.uniform(*np.log(DAMPING)))
    storeys = int(r.integers(*STOREYS, endpoint=True))
    if number % 3:
        storey = int(r.integers(1, storeys, endpoint=True))
        return Regular(storeys=storeys, storey=storey, period=longest, damping=damping)
    return Modal(
        modes=tuple(
            Mode(
                period=longest / float(r.uniform(1.0, 8.0)),
                damping=damping,
                participation=float(r.normal()),
            )
            for _ in range(storeys)
        )
    )


def stood(building: Building, scene: Scene) -> Scene:
    """The scene on the storey; as it is where the building would vibrate for too long."""
    try:
        motion = storey_motion(building, scene.excitation, _quiet_below(scene))
    except InputError:
        return scene
    return scene.replace(excitation=motion)


def faults(building: Building, scene: Scene) -> Iterator[str]:
    """What does not hold of the storey's motion under the scene's base motion, in words."""
    ground, quiet = scene.excitation, _quiet_below(scene)
    rigid = Modal(modes=(Mode(period=0.0, damping=0.1, participation=1.3),))
    if storey_motion(rigid, ground, quiet) != ground:
        yield "a rigid building does not move with the ground"
    if isinstance(building, Regular):
        base = building.replace(storey=0)
        if storey_motion(base, ground, quiet) != ground:
            yield "storey 0 does not move with the ground"
    moved = partial(storey_motion, building)
    try:
        motion = moved(ground, quiet)
    except InputError:
        return
    if motion == ground:
        return
    assert isinstance(motion, Record), "of a storey that does not move with the ground"
    if not _is(moved(ground.scaled(2.0), 2.0 * quiet), 2.0 * motion.samples):
        yield "under twice the ground's motion it is not twice as large"
    if not _is(moved(ground.scaled(-1.0), quiet), -motion.samples):
        yield "under the mirror image it is no mirror image"
    if isinstance(ground, Record):
        finer = moved(_written_finer(ground), quiet)
        yield from _change_with_steps(motion, finer, ground.time_step)


def _quiet_below(scene: Scene) -> float:
    return QUIET_SHARE * scene.moving_acceleration


def _is(motion: object, samples: Floats) -> bool:
    """Whether a motion has these samples to the bit."""
    return isinstance(motion, Record) and np.array_equal(motion.samples, samples)


def _written_finer(ground: Record) -> Record:
    """The same motion with a sample more on each line."""
    halves = np.arange(2 * len(ground.samples) - 1) / 2.0
    samples = np.interp(halves, np.arange(len(ground.samples)), ground.samples)
    return Record.from_samples(samples, 0.5 * ground.time_step)


def _change_with_steps(motion: Record, other: object, step: float) -> Iterator[str]:
    """Whether motions under the same ground, written in other steps, differ every `step` (s)."""
    assert isinstance(other, Record), "of the same storey"
    one, finer = (found.samples[:: round(step / found.time_step)] for found in (motion, other))
    count = min(len(one), len(finer))
    differs = np.max(np.abs(one[:count] - finer[:count]))
    largest = float(differs / np.max(np.abs(motion.samples)))
    if not largest <= ROUNDING:
        yield f"with the ground's lines written finer it changes by {largest:.1e} of its peak"
