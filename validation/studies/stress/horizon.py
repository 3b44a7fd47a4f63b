"""The horizon of predictability: up to where two histories of one scene can be compared.

In: a model, a `Motion` and another scene or model. Out: how far apart they turn. Called by
`checks`.
"""

import math
from collections.abc import Iterable
from contextlib import suppress
from functools import cached_property

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import (
    Excitation,
    Floats,
    History,
    InputError,
    ModelFailure,
    Record,
    Scene,
)
from rockcheck.validation.studies.stress.motion import SLIPS, Motion

#: The horizon of predictability of a run is the first of three times: a relative disturbance of the
#: scene's data by DISTURBANCE turns the block by SEEN rad (half the bound of the invariants that
#: end there); answers at tolerances finer than EXACT, a hundred times apart, differ by a tenth of
#: SEEN; friction near Painleve's limit lets a difference of EXACT grow to SEEN (`_amplified`).
DISTURBANCE, SEEN, DISTURBED, EXACT = 1e-7, 5e-7, 6, 1e-10


class Horizon:
    """Compares histories of a scene within its horizon of predictability.

    That is the time at which a small disturbance of the scene's data shows; it is computed only if
    needed.
    """

    def __init__(self, model: EventBasedModel, motion: Motion, seed: int) -> None:
        self.model, self.motion, self.seed = model, motion, seed
        #: Whether the horizon had to be computed, and why runs failed.
        self.is_computed, self.failure = False, ""

    def largest_difference(self, scene: Scene, model: EventBasedModel | None = None) -> float:
        """Largest |difference of theta| in rad within the horizon.

        Infinite where the other run fails.
        """
        other_model, history = model or self.model, self.motion.history
        if other_model.friction == "bouc-wen" and scene.block.radius != self.motion.radius:
            size = other_model.yield_displacement * scene.block.radius / self.motion.radius
            other_model = other_model.model_copy(update={"yield_displacement": size})
        try:
            other = other_model.simulate(scene)
        except ModelFailure as error:
            self.failure = f"{self.failure}; {error}".strip("; ")
            return math.inf
        difference = _differences(history, other)
        if len(history.channels["t"]) != len(other.channels["t"]) or np.any(difference > SEEN):
            difference = difference[: self.row]
        return float(np.max(difference, initial=0.0))

    @cached_property
    def row(self) -> int:
        """The first row beyond the horizon of predictability (see `DISTURBANCE`)."""
        self.is_computed = True
        scene, history = self.motion.scene, self.motion.history
        compared: list[tuple[History, History, float]] = []
        # The horizon belongs to the scene, however coarse the model is. Rounding is a disturbance,
        # too: finer tolerances must agree on the answer.
        for finer in (10.0, 100.0):
            with suppress(ModelFailure):
                a, b = (
                    self.model.model_copy(update={"tolerance": EXACT / times}).simulate(scene)
                    for times in (finer, 100.0 * finer)
                )
                compared.append((a, b, 0.1 * SEEN))
        for changed in disturbed(scene, self.seed):
            with suppress(ModelFailure):
                compared.append((history, self.model.simulate(changed), SEEN))
        # the rows, from the first on, in which theta differs by no more than is seen, rad
        rows = [
            int(np.argmax(np.append(_differences(a, b) > seen, True))) for a, b, seen in compared
        ]
        grown = np.flatnonzero(_amplified(self.motion) > math.log(SEEN / EXACT))
        return min([len(history.channels["t"]), *rows, *map(int, grown[:1])])


def _amplified(motion: Motion) -> Floats:
    """Logarithm, by row, of how much sliding friction has amplified a small rate difference.

    The rate is that of rotation, w. With P = N/D a slipping pivot has theta'' = -(s + k c)/I N/D,
    in which N falls with w^2: near Painleve's limit, where D is small, a difference of w grows or
    decays faster than all else. A disturbance of the scene's data may have decayed before, and then
    does not show this growth; a rounding error of the moment grows all the same. So the sum starts
    anew wherever it is negative.
    """
    theta, slip, step = motion.channels["theta"], motion.slip, 1e-4
    slides = motion.within("slide-rock") & (theta != 0.0) & (np.abs(slip) > SLIPS)
    rate = np.zeros(len(theta))
    direction = np.sign(motion.sign * slip)
    faster, slower = (
        motion.forces(slides, direction, faster=change)[1] for change in (step, -step)
    )
    rate[slides] = (faster - slower) / (2.0 * step)
    grown, times = np.zeros(len(theta)), np.diff(motion.channels["t"]) / motion.unit
    for k in np.flatnonzero(slides[1:]).tolist():
        grown[k + 1] = max(0.0, grown[k] + 0.5 * (rate[k] + rate[k + 1]) * times[k])
    return grown


def _differences(a: History, b: History) -> Floats:
    rows = min(len(a.channels["t"]), len(b.channels["t"]))
    return np.abs(a.channels["theta"][:rows] - b.channels["theta"][:rows])


def disturbed(scene: Scene, seed: int) -> Iterable[Scene]:
    """The scene with all its data changed at random, by up to a relative `DISTURBANCE`.

    Each sample of a record is changed by itself: else nothing would add energy to a block that
    bounces without loss. Every other scene is changed to the other side: a scene at a limit is to
    be seen on both.
    """

    def by(value: float) -> float:
        return value * (
            1.0 + side * DISTURBANCE * float(r.choice([-1.0, 1.0])) * float(r.uniform(0.5, 1.0))
        )

    def shaken(base: Excitation) -> Excitation:
        if isinstance(base, Record):
            return base.replace(unscaled=tuple(map(by, base.unscaled)))
        return base if base.kind == "rest" else base.scaled(by(1.0))

    block, floor = scene.block, scene.floor
    for number in range(DISTURBED):
        r, side = np.random.default_rng([seed, 2, number // 2]), (-1.0) ** number
        kinetic = by(floor.friction)
        static = None if floor.static_friction is None else max(by(floor.static_friction), kinetic)
        bounce = min(by(floor.restitution), 1.0)
        with suppress(InputError):  # a value at its limit is past it now
            change: dict[str, object] = {
                "block": block.replace(
                    half_width=by(block.half_width),
                    centre_of_mass=block.centre_of_mass and tuple(map(by, block.offset)),
                    moment_of_inertia=block.moment_of_inertia and by(block.moment_of_inertia),
                ),
                "floor": floor.replace(
                    friction=kinetic, static_friction=static, restitution=bounce
                ),
                "walls": tuple(
                    wall.replace(gap=by(wall.gap), restitution=min(by(wall.restitution), 1.0))
                    for wall in scene.walls
                ),
                "excitation": shaken(scene.excitation),
                "vertical": shaken(scene.vertical),
                **{
                    name: by(getattr(scene, name))
                    for name in ("initial_angular_velocity", "initial_velocity", "initial_height")
                },
            }
            try:
                yield scene.replace(**change, initial_rotation=by(scene.initial_rotation))
            except InputError:  # it would start inside a wall
                yield scene.replace(
                    **change, initial_rotation=scene.initial_rotation * (1.0 - DISTURBANCE)
                )
