"""Scenes as the compiled code takes them: in natural units, packed into records, a row a run.

Lengths are in R, accelerations in g, times in sqrt(R/g). Of a block that is not homogeneous R is
that of its weaker pivot, and the compiled code follows its mass's centre, not the box's.

Here is also the event loop that plays the rows. `EventBasedModel`, which plays a history by this,
is known here by its settings only.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm.core import march
from rockcheck.ebm.core.block import LEAST_FRICTION, SETTING, SIDE
from rockcheck.ebm.core.ground import ground_of
from rockcheck.ebm.core.names import LAWS, Keep, Shape
from rockcheck.ebm.core.state import GIVEN, STATE, Base, Rows
from rockcheck.scenes import Excitation, Floats, Record, Scene, Side, kinematics, progress
from rockcheck.scenes.compiled import for_types_of, interpreted, is_ready
from rockcheck.scenes.named_record import filled

#: The event loops that are compiled, by a model's friction.
_READY: dict[str, Callable[..., None]] = {}


def time_unit(scene: Scene) -> float:
    """sqrt(R/g), s."""
    return math.sqrt(scene.block.radius / scene.gravity)


def setting_of(scene: Scene, model: Any) -> np.record:
    """Block, floor and walls of a scene in natural units, as the model's settings have them."""
    radius = scene.block.radius
    return filled(
        SETTING,
        left=side_of(scene, "left"),
        right=side_of(scene, "right"),
        height=math.cos(scene.block.alpha),
        top=_top_of(scene),
        spin=3.0 if scene.block.homogeneous else radius**2 / scene.block.gyration_squared,
        mu_s=max(scene.floor.mu_s, LEAST_FRICTION),
        mu_k=scene.floor.friction,
        e_floor=scene.floor.restitution,
        walls=bool(scene.walls),
        no_slip=model.friction == "no-slip",
        unilateral=model.pivot == "unilateral",
        energy_cap=model.energy_cap,
        law=LAWS.index(model.impacts),
        yields=model.yield_displacement / radius,
    )


def _top_of(scene: Scene) -> float:
    """Height of the box's top over the mass's centre, in R."""
    block = scene.block
    if block.homogeneous:
        return math.cos(block.alpha)
    return (block.half_height - block.offset[1]) / block.radius


def side_of(scene: Scene, side: Side) -> np.record:
    """One side of a block and the wall there, lengths in R of its weaker pivot."""
    block, unit, wall = scene.block, scene.block.radius, scene.wall(side)
    alpha = block.alpha
    there = {
        "gap": wall.gap / unit if wall else math.inf,
        "e": wall.restitution if wall else 0.0,
    }
    if block.homogeneous:
        sine, cosine = math.sin(2.0 * alpha), math.cos(2.0 * alpha)
        stands = {"arm": math.sin(alpha), "height": math.cos(alpha)}
        turns = {"tip_sin": sine, "tip_cos": cosine, "far_sin": sine, "far_cos": cosine}
        corners = {"alpha": alpha, "radius": 1.0, "top_alpha": alpha, "top_radius": 1.0}
        return filled(SIDE, **corners, **turns, **there, **stands, share=0.75)
    pivot, other = block.pivot(side), block.pivot("right" if side == "left" else "left")
    top, radius = 2.0 * block.half_height - pivot.height, pivot.radius / unit
    square = pivot.radius**2
    return filled(
        SIDE,
        alpha=pivot.alpha,
        radius=radius,
        # As gaps have it: flush with a wall they are 0 to the bit.
        arm=radius * math.sin(pivot.alpha),
        height=radius * math.cos(pivot.alpha),
        top_alpha=math.atan2(pivot.arm, top),
        top_radius=math.hypot(pivot.arm, top) / unit,
        tip_sin=pivot.arm * (pivot.height + top) / square,
        tip_cos=(pivot.height * top - pivot.arm**2) / square,
        far_sin=pivot.height * (pivot.arm + other.arm) / square,
        far_cos=(pivot.height**2 - pivot.arm * other.arm) / square,
        share=pivot.share * (unit / pivot.radius) ** 2,
        **there,
    )


def base_of(scene: Scene) -> Base:
    """Horizontal and vertical ground motion in natural units."""
    both = scene.excitation, scene.vertical
    return Base(*(ground_of(one, scene.gravity, time_unit(scene)) for one in both))


def state_of(scene: Scene) -> Floats:
    """The initial state in natural units, on its contacts to the rounding of the compiled code."""
    block, radius, unit = scene.block, scene.block.radius, time_unit(scene)
    x, y, theta, vx, vy, w = kinematics.of_mass(block, scene.initial_state)
    x -= block.offset[0]
    lean = theta if theta != 0.0 else w
    pivot = block.weaker_pivot if lean == 0.0 else block.pivot("left" if lean > 0.0 else "right")
    alpha, own = pivot.alpha, pivot.radius / radius
    state = np.array(
        [x / radius, y / radius, theta, vx * unit / radius, vy * unit / radius, w * unit]
    )
    if scene.initial_height == 0.0:
        state[1] = own * math.cos(alpha - abs(theta))
    if scene.initial_velocity == 0.0:
        state[3] = -own * math.cos(alpha - abs(theta)) * state[5]
    return state


def to_si(scene: Scene, states: Floats) -> Floats:
    """States of the mass's centre in natural units as states of the box's centre in SI.

    `states` is n x 6: x, y, theta and their rates.
    """
    radius, unit = scene.block.radius, time_unit(scene)
    found = states * np.array([radius, radius, 1.0, radius / unit, radius / unit, 1.0 / unit])
    if scene.block.centre_of_mass is not None:
        found[:, 0] += scene.block.offset[0]
    return np.asarray(kinematics.of_box(scene.block, found))


class SampleStore:
    """The samples of base motions; a record's are stored once, whatever its scale and its units."""

    def __init__(self) -> None:
        self._parts: list[Floats] = [np.empty(0)]
        self._count = 0
        self._records: dict[tuple[float, ...], tuple[np.record, float, float]] = {}

    @property
    def samples(self) -> Floats:
        """All samples, one motion's after the other's."""
        return np.concatenate(self._parts)

    def form_of(self, motion: Excitation, gravity: float, time: float) -> np.record:
        """The FORM of a motion in units of `gravity` (m/s^2) and `time` (s)."""
        if not isinstance(motion, Record) or motion.scale == 0.0:
            return self._stored(motion, gravity, time)
        if motion.unscaled not in self._records:
            first = self._stored(motion, gravity, time)
            self._records[motion.unscaled] = first, motion.scale, gravity
        stored, scale, gravity_then = self._records[motion.unscaled]
        form: np.record = stored.copy()
        form["scale"] = motion.scale / scale * (gravity_then / gravity)
        form["step"], form["quiet"] = motion.time_step / time, motion.quiet_after / time
        return form

    def _stored(self, motion: Excitation, gravity: float, time: float) -> np.record:
        """The FORM of a motion whose samples are stored now."""
        ground = ground_of(motion, gravity, time)
        ground.form["first"] = self._count
        self._count += len(ground.samples)
        self._parts.append(ground.samples)
        return ground.form


def pack(scenes: Sequence[Scene], model: Any) -> Rows:
    """Packs a list of scenes; raises `InputError` where the model cannot play one of them."""
    for scene in scenes:
        model.check(scene)
    store = SampleStore()
    forms = [
        [
            store.form_of(motion, scene.gravity, time_unit(scene))
            for motion in (scene.excitation, scene.vertical)
        ]
        for scene in scenes
    ]
    given = [
        (
            setting_of(scene, model),
            *both,
            tuple(state_of(scene).tolist()),
            scene.duration / time_unit(scene),
            scene.output_step / time_unit(scene),
        )
        for scene, both in zip(scenes, forms, strict=True)
    ]
    return Rows(np.array(given, GIVEN), store.samples)


def pack_pulses(scene: Scene, model: Any, amplitudes: Floats, periods: Floats) -> Rows:
    """Packs one scene under many pulses of its own kind.

    `amplitudes` (m/s^2) and `periods` (s) are 1-D arrays of one length.
    """
    pulse = scene.excitation.model_copy(update={"amplitude": 1.0, "period": 1.0})
    one, samples = pack([scene.replace(excitation=pulse)], model)
    given = np.repeat(one, len(periods))
    # A pulse of amplitude a and period T is a times the unit pulse at time t/T.
    horizontal, ratio = given["horizontal"], 1.0 / periods
    bell = horizontal["kind"][0] == Shape.GAUSSIAN
    for power in range(4):
        horizontal[f"c{power}"] *= amplitudes * ratio**power
    horizontal["rate"] *= ratio**2 if bell else ratio
    horizontal["centre"] *= periods
    horizontal["quiet"] *= periods
    return Rows(given, samples)


def state_for(
    model: Any, most_steps: int, until_decided: bool = False, keeps: Keep = Keep.NOTHING
) -> NDArray[np.void]:
    """An array of one state, with what the model's settings ask of a run."""
    states = np.zeros(1, STATE)
    control = states["control"]
    control["tolerance"], control["most_steps"] = model.tolerance, most_steps
    control["most_events"] = model.most_events
    control["until_decided"], control["keeps"] = until_decided, keeps
    return states


def loop_of(model: Any, *given: Any) -> Callable[..., None]:
    """The machine code of the event loop with the model's friction, loaded or compiled.

    It is specialised to the types of `given`, which are always the same.
    """
    if model.friction not in _READY:
        _READY[model.friction] = for_types_of(march.LOOPS[model.friction], *given)
    return _READY[model.friction]


def interpreted_loop(model: Any, *given: Any) -> Callable[..., None] | None:
    """The event loop for a single run that need not wait for the compiler; None where it must.

    It need not if the loop is not compiled yet. Bouc-Wen friction, which is stiff, takes too many
    steps.
    """
    loop = march.LOOPS[model.friction]
    if not progress.ONE_RUN.get() or model.friction == "bouc-wen" or is_ready(loop, *given):
        return None
    progress.announce(
        f"{model.name} is not compiled for this machine yet: a short run is interpreted, with the"
        " same figures (`rockcheck warm` compiles)"
    )
    return interpreted(loop)
