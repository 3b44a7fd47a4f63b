"""Instants at which the mechanics of a rigid block has more than one answer: ties.

In: a scene. Out: what ties, from when on the answers part, and the fates on both sides. Called by
the horizon of predictability, by assessments and by the stress study.

A scene on a knife edge (friction equal to tan alpha, a base acceleration that just reaches what
moves the block, a block balanced over its corner, a side that touches a wall) is where two motions
meet. Rigid-body mechanics then names no one of them, and rounding chooses. Such an equality is
looked for to rounding; then the scene is played on both sides of it, the number moved by
`NUDGE`. It is a tie only where the two sides part. Equal gaps tie only where both walls are struck
at one instant: else the sides part where the motion amplifies any small difference.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import get_args

import numpy as np

from rockcheck.ebm.model import EventBasedModel
from rockcheck.ebm.table import table_of
from rockcheck.scenes import Excitation, History, InputError, ModelFailure, Scene, Side
from rockcheck.scenes.history import OUTCOMES

#: Relative difference of two numbers that are equal but for rounding.
EQUAL = 1e-12
#: Relative change of a number to either side of an equality: beyond the zeros of the event-based
#: model, and far below what anybody knows of a block.
NUDGE = 1e-7
#: Rotations (alpha) and slips (alpha R) that differ by more have parted.
PARTED = 1e-3
#: Sides this many times as far from the equality part as soon: within so many rows.
FARTHER, AS_SOON = 10.0, 2


#: What is equal where a block may slide or rock, whatever the size of its base's motion.
FRICTION = "friction equals B/H"


@dataclass(frozen=True)
class Tie:
    """More than one answer: `what` is equal, and from `from_s` (s) on the answers part.

    They are `PARTED` from each other after `apart_s` (s). `fates` are those on both sides of the
    equality, and of the scene as it is if that is another.
    """

    what: str
    from_s: float
    apart_s: float
    fates: tuple[str, ...]


@dataclass(frozen=True)
class Edge:
    """An equality of a scene; `sides` are the scenes that are off it by a relative change.

    `at_once`: where the sides tie they part as soon however far off they are.
    """

    what: str
    sides: Callable[[float], tuple[Scene, ...]]
    at_once: bool = False


@dataclass(frozen=True)
class Parting:
    """Times (s) of the last rows at which two histories are one, and are within `PARTED`."""

    begins_s: float
    apart_s: float


def ties_of(scene: Scene, model: EventBasedModel | None = None) -> tuple[Tie, ...]:
    """The ties of a scene, by an event-based model (default: the unilateral one).

    Empty where there is no equality, where the sides of one do not part, or where the model cannot
    play the scene.
    """
    model = model or EventBasedModel(pivot="unilateral")
    ties = []
    for edge in edges_of(scene):
        try:
            parted = _parted(edge, scene, model)
        except (InputError, ModelFailure):
            continue
        if parted is not None:
            ties.append(parted)
    return tuple(ties)


def edges_of(scene: Scene) -> Iterator[Edge]:
    """The equalities of a scene."""
    yield from _friction_edges(scene)
    yield from _excitation_edges(scene)
    yield from _balance_edges(scene)
    yield from _flush_edges(scene)
    yield from _two_wall_edges(scene)


def _friction_edges(scene: Scene) -> Iterator[Edge]:
    """Friction that equals the slope of a pivot: the block may slide, or rock."""
    slopes = {pivot.arm / pivot.height for pivot in map(scene.block.pivot, get_args(Side))}
    for slope in slopes:
        if _equal(scene.floor.mu_s, slope) or _equal(scene.floor.friction, slope):
            yield Edge(
                FRICTION,
                lambda by: (_with_friction(scene, 1.0 - by), _with_friction(scene, 1.0 + by)),
            )
            return


def _with_friction(scene: Scene, factor: float) -> Scene:
    floor = scene.floor
    static = None if floor.static_friction is None else floor.static_friction * factor
    return scene.replace(
        floor=floor.replace(friction=floor.friction * factor, static_friction=static)
    )


def _excitation_edges(scene: Scene) -> Iterator[Edge]:
    """A base whose largest acceleration just reaches what moves a block at rest."""
    if scene.vertical.kind != "rest" or any(scene.initial_state[2:]) or scene.initial_height:
        return
    largest = largest_accelerations(scene.excitation)
    mu = scene.floor.mu_s * scene.gravity
    for side, reached in largest.items():
        pivot = scene.block.pivot(side)
        names = {
            "acceleration equals g tan(alpha)": scene.gravity * pivot.arm / pivot.height,
            "acceleration equals mu g": mu,
        }
        for what, limit in names.items():
            if _equal(reached, limit):
                yield Edge(what, lambda by: (_shaken(scene, 1.0 - by), _shaken(scene, 1.0 + by)))


def _shaken(scene: Scene, factor: float) -> Scene:
    return scene.replace(excitation=scene.excitation.scaled(factor))


def largest_accelerations(excitation: Excitation) -> dict[Side, float]:
    """The largest acceleration of a base (m/s^2) that tips a block to each side.

    A base that moves to the right tips the block to the left.
    """
    least, largest = excitation.extremes
    return {"left": largest, "right": -least}


def _balance_edges(scene: Scene) -> Iterator[Edge]:
    """A block that starts at rest over its corner."""
    tilt = scene.initial_rotation
    if tilt == 0.0 or scene.initial_angular_velocity or scene.initial_velocity:
        return
    if _equal(abs(tilt), scene.block.pivot("left" if tilt > 0.0 else "right").alpha):
        yield Edge(
            "balanced over its corner",
            lambda by: tuple(
                scene.replace(initial_rotation=tilt * factor) for factor in (1.0 - by, 1.0 + by)
            ),
        )


def _flush_edges(scene: Scene) -> Iterator[Edge]:
    """A side that touches a wall at first: from 0 a gap can only grow."""
    for wall in scene.walls:
        if wall.gap == 0.0:
            yield _flush_edge(scene, wall.side)


def _flush_edge(scene: Scene, side: Side) -> Edge:
    return Edge(
        f"it touches the {side} wall",
        lambda by: (_with_gap(scene, side, by * scene.block.radius),),
    )


def _two_wall_edges(scene: Scene) -> Iterator[Edge]:
    """Walls at equal gaps of a block that both may touch at once."""
    if len(scene.walls) < 2:
        return
    left, right = scene.walls
    if left.gap > 0.0 and _equal(left.gap, right.gap):
        yield Edge(
            "both walls are equally far",
            lambda by: tuple(
                _with_gap(scene, left.side, left.gap * factor) for factor in (1.0 - by, 1.0 + by)
            ),
            at_once=True,
        )


def _with_gap(scene: Scene, side: Side, gap: float) -> Scene:
    """The scene with another gap (m) of the wall on this side."""
    walls = [wall.replace(gap=gap) if wall.side == side else wall for wall in scene.walls]
    return scene.replace(walls=walls)


def _equal(one: float, other: float) -> bool:
    return math.isclose(one, other, rel_tol=EQUAL, abs_tol=0.0)


def _parted(edge: Edge, scene: Scene, model: EventBasedModel) -> Tie | None:
    """The tie of an equality; None where its sides, and the scene, are one motion."""
    near, played = edge.sides(NUDGE), model.simulate(scene)
    fates = tuple(dict.fromkeys(fate_words(each, model) for each in (scene, *near)))
    partings = _partings(near, scene, played, model)
    if edge.at_once and len(fates) == 1:
        farther = _partings(edge.sides(FARTHER * NUDGE), scene, played, model)
        partings = [each for each in partings if _as_soon(each, farther, scene)]
    if not partings and len(fates) == 1:
        return None
    begins = min((parting.begins_s for parting in partings), default=scene.duration)
    apart = min((parting.apart_s for parting in partings), default=scene.duration)
    return Tie(edge.what, begins, apart, fates)


def _partings(
    sides: tuple[Scene, ...], scene: Scene, played: History, model: EventBasedModel
) -> list[Parting]:
    """How the motions on the sides part from that of the scene; without those that do not."""
    compared = (_parting(scene, played, model.simulate(side)) for side in sides)
    return [parting for parting in compared if parting is not None]


def _as_soon(parting: Parting, farther: list[Parting], scene: Scene) -> bool:
    """Whether sides farther off part no sooner: what grows with time from a difference does."""
    room = (AS_SOON + 0.5) * scene.output_step
    return parting.apart_s <= min((other.apart_s for other in farther), default=0.0) + room


def _parting(scene: Scene, one: History, other: History) -> Parting | None:
    """How two histories of a scene part; None if they do not."""
    alpha = scene.block.alpha
    rows = min(len(one.channels["t"]), len(other.channels["t"]))
    times = one.channels["t"][:rows]
    turned = np.abs(one.channels["theta"][:rows] - other.channels["theta"][:rows]) / alpha
    moved = np.abs(one.channels["x"][:rows] - other.channels["x"][:rows])
    difference = np.maximum(turned, moved / (alpha * scene.block.radius))
    apart = difference > PARTED
    if not apart.any():
        return None
    first_apart = int(np.argmax(apart))
    same = np.flatnonzero(difference[:first_apart] <= 10.0 * NUDGE)
    return Parting(
        begins_s=float(times[same[-1]]) if len(same) else 0.0,
        apart_s=float(times[max(first_apart - 1, 0)]),
    )


def fate_words(scene: Scene, model: EventBasedModel) -> str:
    """The fate of a scene, in the words of a history's outcome."""
    from rockcheck.ebm import fates

    outcome = int(fates.play_fates(table_of(scene), model, jobs=1).outcome[0])
    words: dict[int, str] = dict(enumerate(OUTCOMES))
    return words.get(outcome, "undecided" if outcome == fates.UNDECIDED else "failed")
