"""Scenes on a knife edge of the mechanics, scenes a little away, and what must be said of either.

In: a seed and a number. Out: a scene, and how much of what must be said of it is not. Called by the
player of ties.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.horizon import predictability_horizon
from rockcheck.ebm.ties import NUDGE, Tie, edges_of, ties_of
from rockcheck.scenes import (
    Block,
    Excitation,
    Floats,
    Floor,
    Record,
    Rest,
    Ricker,
    Scene,
    Side,
    Sine,
    Wall,
)
from rockcheck.validation.uncertainty.numerical import numerical_uncertainty

#: Relative distances from an equality: of its two sides, and of a scene that is away from it.
SIDES, AWAY = (3e-8, 3e-7), 1e-3
#: Rotations (alpha) that differ by more have parted, whatever the distance of the sides.
PARTED = 1e-2
#: Two numbers are equal.
EQUAL = 1e-13
#: Slenderness (rad), half diagonal (m) and time (s) of a scene.
ALPHA, RADIUS, LASTS = (0.1, 0.7), (0.2, 5.0), 8.0


@dataclass(frozen=True)
class Equality:
    """What is equal in a scene of this kind, in the words of `ebm.ties`.

    `made` puts a scene onto it. `holds` says whether a scene is on it. `moved` moves it off by a
    relative change. `leaves` are the signs of changes that leave it. `at_once`: sides that tie part
    at the same time however near they are; else they part because the motion amplifies.
    """

    what: str
    made: Callable[[Scene, np.random.Generator], Scene]
    holds: Callable[[Scene], bool]
    moved: Callable[[Scene, float], Scene]
    leaves: Sequence[int] = (-1, 1)
    at_once: bool = False


def _with_friction(scene: Scene, friction: float) -> Scene:
    return scene.replace(floor=Floor(friction=friction))


def _slope(scene: Scene) -> float:
    return scene.block.half_width / scene.block.half_height


def _standing(scene: Scene) -> bool:
    """Whether nothing but the base sets it in motion."""
    start = *scene.initial_state[2:], scene.initial_height
    return not any(start) and scene.vertical.kind == "rest"


def _reaches(scene: Scene) -> bool:
    """Whether the base just reaches what uplifts the block."""
    limit = scene.gravity * _slope(scene)
    return _standing(scene) and any(
        math.isclose(abs(reached), limit, rel_tol=EQUAL) for reached in scene.excitation.extremes
    )


def _reaching(scene: Scene, r: np.random.Generator) -> Scene:
    """The scene under a push that just reaches what uplifts the block, and stays there."""
    samples = float(r.choice([-1.0, 1.0])) * scene.gravity * _slope(scene) * np.ones(401)
    return scene.replace(excitation=Record.from_samples(samples, 0.01))


def _balanced(scene: Scene, r: np.random.Generator) -> Scene:
    tilt = float(r.choice([-1.0, 1.0])) * scene.block.alpha
    return scene.replace(excitation=Rest(), initial_rotation=tilt)


def _is_balanced(scene: Scene) -> bool:
    tilt = abs(scene.initial_rotation)
    still = not (scene.initial_angular_velocity or scene.initial_velocity)
    return still and math.isclose(tilt, scene.block.alpha, rel_tol=EQUAL)


def _flush(scene: Scene, r: np.random.Generator) -> Scene:
    side: Side = "left" if r.random() < 0.5 else "right"
    return scene.replace(walls=[Wall(side=side, gap=0.0, restitution=float(r.choice([0.0, 0.5])))])


def _between(scene: Scene, r: np.random.Generator) -> Scene:
    """The scene between walls that are equally far.

    In half of the draws it turns in the air, and strikes both at one instant.
    """
    sides: tuple[Side, Side] = ("left", "right")
    gap = float(r.uniform(0.02, 0.3)) * scene.block.half_width
    walls = [Wall(side=side, gap=gap, restitution=0.5) for side in sides]
    scene = scene.replace(walls=walls)
    if r.random() < 0.5:
        return scene
    turns = scene.replace(
        excitation=Rest(),
        initial_height=0.3 * scene.block.radius,
        initial_angular_velocity=float(r.uniform(0.5, 2.0)) * scene.frequency_parameter,
    )
    return turns.replace(initial_velocity=-turns.initial_state[3])


def _are_equally_far(scene: Scene) -> bool:
    gaps = [wall.gap for wall in scene.walls]
    return len(gaps) == 2 and min(gaps) > 0.0 and math.isclose(*gaps, rel_tol=EQUAL)


def _one_farther(scene: Scene, change: float) -> Scene:
    first, *others = scene.walls
    gap = first.gap * (1.0 + change) or change * scene.block.radius
    return scene.replace(walls=[first.replace(gap=gap), *others])


EQUALITIES = (
    Equality(
        "friction equals B/H",
        lambda scene, _: _with_friction(scene, _slope(scene)),
        lambda scene: math.isclose(scene.floor.mu_s, _slope(scene), rel_tol=EQUAL),
        lambda scene, change: _with_friction(scene, scene.floor.friction * (1.0 + change)),
    ),
    Equality(
        "acceleration equals g tan(alpha)",
        _reaching,
        _reaches,
        lambda scene, change: scene.replace(excitation=scene.excitation.scaled(1.0 + change)),
    ),
    Equality(
        "balanced over its corner",
        _balanced,
        _is_balanced,
        lambda scene, change: scene.replace(initial_rotation=scene.initial_rotation * (1 + change)),
    ),
    Equality(
        "it touches the {side} wall",
        _flush,
        lambda scene: any(wall.gap == 0.0 for wall in scene.walls),
        _one_farther,
        (1,),
    ),
    Equality("both walls are equally far", _between, _are_equally_far, _one_farther, at_once=True),
)


def equality_of(number: int) -> Equality:
    """The equality of the scene of that number."""
    return EQUALITIES[number % len(EQUALITIES)]


def tie_scene(seed: int, number: int) -> Scene:
    """Scene `number` of the run with this seed: a plain block, and one equality."""
    r = np.random.default_rng([seed, number, 4])
    alpha, radius = float(r.uniform(*ALPHA)), float(r.uniform(*RADIUS))
    block = Block(half_width=radius * math.sin(alpha), half_height=radius * math.cos(alpha))
    period = float(r.uniform(0.5, 2.0)) * 2.0 * math.pi / block.frequency_parameter
    size = float(r.choice([-1.0, 1.0]) * r.uniform(1.1, 3.0)) * 9.81 * block.slope
    pulses: tuple[Excitation, ...] = (
        Ricker(amplitude=size, period=period),
        Sine(amplitude=size, period=period, cycles=1),
    )
    scene = Scene(
        name=f"tie {seed} {number}",
        block=block,
        floor=Floor(friction=float(r.uniform(0.2, 1.2))),
        excitation=pulses[int(r.integers(2))],
        duration=LASTS * math.sqrt(radius),
    )
    return equality_of(number).made(scene, r)


def unsaid(model: EventBasedModel, scene: Scene, number: int) -> list[str]:
    """What must be said of a scene on its equality, and is not; nothing if it is on none."""
    equality = equality_of(number)
    if not equality.holds(scene):
        return []
    return [*_names(equality, scene), *_ties(equality, model, scene)]


def _names(equality: Equality, scene: Scene) -> Iterator[str]:
    """Whether the scene is named, and scenes a little away are not."""
    if not _is_named(equality, scene):
        yield "it is not named"
    if any(_is_named(equality, equality.moved(scene, sign * AWAY)) for sign in equality.leaves):
        yield "a scene off by a thousandth is named"


def _is_named(equality: Equality, scene: Scene) -> bool:
    sides = (wall.side for wall in scene.walls)
    names = {equality.what.format(side=side) for side in (*sides, "")}
    return any(edge.what in names for edge in edges_of(scene))


def _ties(equality: Equality, model: EventBasedModel, scene: Scene) -> Iterator[str]:
    """Whether answers that part are told, with their time, and nothing is called converged."""
    parts_at = _parts_at(equality, model, scene)
    ties = ties_of(scene, model)
    if parts_at is None and not ties:
        return
    if not ties:
        yield f"answers part at {parts_at:.4g} s, and no tie is told"
        return
    horizon = predictability_horizon(scene, model)
    latest = min(tie.apart_s for tie in ties)
    if parts_at is not None:
        latest = min(latest, parts_at)
    if horizon > latest + scene.output_step:
        yield f"answers part at {latest:.4g} s, and the horizon is {horizon:.4g} s"
    if any(tie.from_s > tie.apart_s for tie in ties):
        yield "it begins after it has parted"
    numerical = numerical_uncertainty(model, scene)
    if numerical is not None and any(q.verdict == "converged" for q in numerical.quantities):
        yield "a figure is called converged"
    yield from _sides(equality, model, scene, ties)


def _sides(
    equality: Equality, model: EventBasedModel, scene: Scene, ties: Sequence[Tie]
) -> Iterator[str]:
    """Whether the outcomes that histories of the sides end in are among the fates."""
    told = {fate for tie in ties for fate in tie.fates}
    for sign in equality.leaves:
        history = model.simulate(equality.moved(scene, sign * NUDGE))
        if history.outcome.startswith("overturned") and history.outcome not in told:
            yield f"one side {history.outcome}, which is not told"


def _parts_at(equality: Equality, model: EventBasedModel, scene: Scene) -> float | None:
    """When (s) the sides of an equality have parted, however near they are; None if they do not."""
    rows = []
    for change in SIDES:
        parted = _largest_difference(equality, model, scene, change) > PARTED
        if not parted.any():
            return None
        rows.append(int(np.argmax(parted)))
    if equality.at_once and max(rows) - min(rows) > 1:
        return None
    return float(scene.output_times[max(rows)])


def _largest_difference(
    equality: Equality, model: EventBasedModel, scene: Scene, change: float
) -> Floats:
    """By row the largest difference (alpha) of the sides and the scene itself."""
    played = [scene, *(equality.moved(scene, sign * change) for sign in equality.leaves)]
    rotations = [model.simulate(each).channels["theta"] for each in played]
    rows = min(map(len, rotations))
    stacked = np.stack([theta[:rows] for theta in rotations])
    return np.asarray(np.ptp(stacked, axis=0) / scene.block.alpha)
