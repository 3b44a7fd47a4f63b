"""Random scenes over all that a user could write. Each follows from a seed and a number, so any one
can be made again."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Block, Floor, InputError, Record, Rest, Ricker, Scene, Sine, Wall

#: What a family of models can play: the bilateral pivot neither bounces nor hops, Bouc-Wen friction
#: has one coefficient, and a pivot that never slips does not start with slip.
Kind = Literal["bilateral", "unilateral", "bouc-wen", "no-slip"]
#: Ranges: slenderness (rad), half diagonal (m), friction, amplitude over uplift's, period over the
#: block's, step of records (s).
ALPHA, RADIUS, FRICTION = (0.02, 1.2), (1e-3, 1e3), (0.0, 1.333)
AMPLITUDE, PERIOD, RECORD_STEP = (0.1, 100.0), (0.05, 50.0), (1e-4, 0.1)
#: Share of blocks that bear a load, and of loads that stand in the middle: a third of all is
#: asymmetric. A load's place, of the half sides, and its moment of inertia, of the largest possible
#: at that place.
LOADED, MIDDLE = 0.37, 0.1
OFF_CENTRE, INERTIA = (0.01, 0.8), (0.05, 1.0)
#: Longest run, sqrt(R/g), and most samples of a record, so that a hundred thousand runs stay
#: affordable.
LONGEST, MOST_SAMPLES = 15.0, 300
#: Rows of a history.
ROWS = 100

Excitation = Rest | Ricker | Sine | Record


def random_scene(seed: int, number: int, kind: Kind = "unilateral") -> Scene:
    """Scene `number` of the run with this seed. It is the same for all kinds, except for what a
    kind cannot play."""
    r = np.random.default_rng([seed, number])
    alpha = float(r.uniform(*ALPHA)) if r.random() < 0.7 else _log(r, *ALPHA)
    radius = _log(r, *RADIUS)
    gravity = 9.81 if r.random() < 0.8 else _log(r, 1.0, 30.0)
    block = Block(half_width=radius * math.sin(alpha), half_height=radius * math.cos(alpha))
    chance = np.random.default_rng([seed, number, 2])
    block = loaded(
        block,
        chance,
        lambda: float(chance.uniform(*OFF_CENTRE)),
        lambda: float(chance.uniform(*INERTIA)),
    )
    unit = math.sqrt(block.radius / gravity)
    most = most_friction(block)
    edge = _edge(r, 0.05, (0.0, most, min(block.slope, most)))
    mu = most / FRICTION[1] * float(r.uniform(*FRICTION)) if edge is None else edge
    mu_s = min(mu * float(r.uniform(1.0, 1.5)), most) if r.random() < 0.3 else mu
    bounce = 0.0 if r.random() < 0.5 else float(r.uniform(0.0, 0.999))
    walls = _walls(r, radius)
    uplift = gravity * min(block.slope, max(mu, 0.05))
    own_period = 2.0 * math.pi / block.weaker_pivot.frequency_parameter(gravity)
    excitation = _excitation(r, uplift, own_period)
    vertical: Excitation = Rest()
    if r.random() < 0.3:
        vertical = (
            _excitation(r, gravity * 0.3, own_period)
            if r.random() < 0.5
            else _excitation(r, gravity * 0.03, own_period)
        )
    lasts = max(excitation.quiet_after, vertical.quiet_after) + unit * float(r.uniform(1.0, 20.0))
    duration = min(lasts, unit * LONGEST * float(r.uniform(0.1, 1.0)) ** 2 + unit)
    start = _start(r, block, unit, excitation.kind == "rest")
    if kind != "unilateral":
        bounce = 0.0
        start.pop("initial_height", None)
    if kind == "bouc-wen":
        mu_s = mu
    if kind == "no-slip":
        start.pop("initial_velocity", None)
    settings: dict[str, Any] = {
        "name": f"stress {seed} {number}",
        "block": block,
        "floor": Floor(
            friction=mu, static_friction=None if mu_s == mu else mu_s, restitution=bounce
        ),
        "walls": walls,
        "excitation": excitation,
        "vertical": vertical,
        "duration": duration,
        "output_step": duration / ROWS,
        "gravity": gravity,
    }
    try:
        return Scene(**settings, **start)
    except InputError:  # it would start inside a wall: let it stand
        start.pop("initial_rotation", None)
        return Scene(**settings, **start)


def loaded(
    block: Block, r: np.random.Generator, place: Callable[[], float], inertia: Callable[[], float]
) -> Block:
    """The block, in a share `LOADED` of the draws with a load.

    `place` draws how far the mass's centre is off, of the half sides; its height is off in half of
    the draws. In half of them the moment of inertia is given, too: `inertia` draws it, of the
    largest possible.
    """
    if r.random() >= LOADED:
        return block
    x, z = (
        float(r.choice([-1.0, 1.0])) * side * place()
        for side in (block.half_width, block.half_height)
    )
    centre = (0.0 if r.random() < MIDDLE else x, 0.0 if r.random() < 0.5 else z)
    own = (
        inertia() * (block.half_diagonal**2 - centre[0] ** 2 - centre[1] ** 2)
        if r.random() < 0.5
        else None
    )
    return block.replace(centre_of_mass=centre, moment_of_inertia=own)


def most_friction(block: Block) -> float:
    """As much as a scene may have, but for a little: with more a slipping pivot may jam."""
    return (
        FRICTION[1]
        if block.homogeneous
        else min(FRICTION[1], 0.999 * block.least_painleve_friction)
    )


def _log(r: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(r.uniform(math.log(low), math.log(high))))


def _edge(r: np.random.Generator, share: float, values: tuple[float, ...]) -> float | None:
    """One of the `values` in this share of the draws, else None."""
    drawn = r.random(), int(r.integers(len(values)))
    return values[drawn[1]] if drawn[0] < share else None


def _walls(r: np.random.Generator, radius: float) -> list[Wall]:
    sides: tuple[tuple[Literal["left", "right"], ...], ...] = (
        (),
        ("left",),
        ("right",),
        ("left", "right"),
    )
    walls = []
    for side in sides[int(r.integers(4))]:
        kind = r.random()
        gap = (
            0.0
            if kind < 0.1
            else (
                _log(r, 1e-6, 1.0) * min(radius, 1.0) if kind < 0.7 else float(r.uniform(0.0, 1.0))
            )
        )
        edge = r.random()
        walls.append(
            Wall(
                side=side,
                gap=gap,
                restitution=0.0
                if edge < 0.3
                else 1.0
                if edge < 0.4
                else float(r.uniform(0.0, 1.0)),
            )
        )
    return walls


def _excitation(r: np.random.Generator, uplift: float, own_period: float) -> Excitation:
    amplitude = uplift * _log(r, *AMPLITUDE) * (1.0 if r.random() < 0.5 else -1.0)
    period = own_period * _log(r, *PERIOD)
    kind = r.random()
    if kind < 0.1:
        return Rest()
    if kind < 0.45:
        return Ricker(amplitude=amplitude, period=period, symmetric=bool(r.random() < 0.3))
    if kind < 0.6:
        return Sine(amplitude=amplitude, period=period, cycles=int(r.integers(1, 9)))
    return Record.from_samples(_samples(r, amplitude), time_step=_log(r, *RECORD_STEP))


def _samples(r: np.random.Generator, amplitude: float) -> NDArray[np.float64]:
    """A single sample, noise, levels with steps, or spikes in silence."""
    count = max(1, round(_log(r, 2.0, MOST_SAMPLES)))
    shape = r.random()
    if shape < 0.1:
        return np.array([amplitude])
    if shape < 0.4:
        return amplitude * r.standard_normal(count)
    if shape < 0.7:
        levels = r.integers(0, count, size=max(1, count // 8))
        return amplitude * np.repeat(r.standard_normal(count), 1)[np.sort(np.resize(levels, count))]
    return np.where(r.random(count) < 0.1, amplitude * r.standard_normal(count) * 3.0, 0.0)


def _start(r: np.random.Generator, block: Block, unit: float, must_move: bool) -> dict[str, Any]:
    alpha, radius = block.alpha, block.radius
    speed = radius / unit
    start: dict[str, Any] = {}
    if must_move or r.random() < 0.3:
        balance = block.pivot("left").alpha, -block.pivot("right").alpha
        start["initial_rotation"] = _edge(r, 0.05, balance) or alpha * float(r.uniform(-1.0, 1.0))
    if r.random() < 0.3:
        start["initial_angular_velocity"] = (
            float(r.uniform(-1.5, 1.5)) * (alpha if r.random() < 0.5 else 1.0) / unit
        )
    if r.random() < 0.2:
        start["initial_velocity"] = float(r.uniform(-1.0, 1.0)) * speed
    if r.random() < 0.1:
        start["initial_height"] = radius * _log(r, 1e-6, 1.0)
    return start
