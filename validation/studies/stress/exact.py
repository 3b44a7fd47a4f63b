"""Scenes at which rounding decides: round numbers, equal lengths, accelerations exactly at a limit,
motions as small as noise.

Random scenes from continuous distributions meet no ties. Users write round numbers and meet many.
"""

from __future__ import annotations

import math
from typing import Any, Literal

import numpy as np

from rockcheck.scenes import Block, Floor, InputError, Record, Rest, Ricker, Scene, Sine, Wall
from rockcheck.validation.studies.stress.generator import (
    ROWS,
    Excitation,
    Kind,
    loaded,
    most_friction,
)

#: Half width and half height: the paper's block, Pythagorean ones, squat ones, a square, with one
#: size of rounding each.
SIDES = (
    (0.397, 1.555),
    (0.3, 0.4),
    (0.4, 0.3),
    (0.5, 1.0),
    (1.0, 0.5),
    (0.1, 0.05),
    (1.0, 1.0),
    (0.25, 1.0),
    (0.2, 1.0),
    (5.0, 12.0),
)
GRAVITIES = (9.81, 10.0, 1.0)
FRICTIONS = (0.0, 0.1, 0.2, 0.25, 0.3, 0.5, 0.6, 0.75, 1.0, 1.2)
RESTITUTIONS = (0.0, 0.0, 0.25, 0.5, 0.75, 1.0, 0.9999999)
STEPS = (0.01, 0.02, 0.1, 0.25)
#: Places of a load, of the half sides, and its moment of inertia, of the largest possible.
PLACES, INERTIAS = (0.125, 0.25, 0.5, 0.75), (0.125, 0.25, 0.5, 1.0)
#: Starts as powers of ten: noise, small, large. Share of long runs, and their length, s.
SIZES = (-300, -20, -13, -12, -11, -10, -9, -8, -6, -3, -1, 0, 1, 3)
LONG, LASTS = 0.02, 1e4


def exact_scene(seed: int, number: int, kind: Kind = "unilateral") -> Scene:
    """Scene `number` of the run with this seed. It is the same for all kinds, except for what a
    kind cannot play."""
    r = np.random.default_rng([seed, number, 1])
    width, height = SIDES[int(r.integers(len(SIDES)))]
    chance = np.random.default_rng([seed, number, 3])
    block = Block(half_width=width, half_height=height)
    block = loaded(block, chance, lambda: _pick(chance, PLACES), lambda: _pick(chance, INERTIAS))
    gravity = _pick(r, GRAVITIES)
    side = block.pivot("left" if chance.random() < 0.5 else "right")
    slope, most = side.arm / side.height, most_friction(block)
    mu = min(_pick(r, (*FRICTIONS, slope, 0.5 * slope, 3.0 * slope / (4.0 + slope * slope))), most)
    mu_s = min(1.25 * mu, most) if r.random() < 0.2 and kind != "bouc-wen" else mu
    bounce = _pick(r, (0.0, 0.0, 0.0, 0.5, 0.9)) if kind == "unilateral" else 0.0
    levels = (
        0.0,
        gravity,
        gravity * slope,
        gravity * mu,
        gravity * mu_s,
        2.0 * gravity * slope,
        0.5 * gravity,
    )
    excitation = _excitation(r, levels)
    vertical: Excitation = Rest()
    if r.random() < 0.3:
        vertical = _excitation(r, (0.0, gravity, gravity, 0.5 * gravity, 2.0 * gravity))
    walls = _walls(r, block)
    unit = math.sqrt(block.radius / gravity)
    duration = round(_pick(r, (1.0, 2.0, 5.0, 10.0)) * unit, 2)
    still = (
        excitation.kind == "rest"
        and vertical.kind == "rest"
        and all(wall.restitution <= 0.5 for wall in walls)
    )
    if still and r.random() < LONG:
        duration = LASTS
    settings: dict[str, Any] = {
        "name": f"exact {seed} {number}",
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
    start = _start(r, block, kind, excitation.kind == "rest")
    while True:
        try:
            return Scene(**settings, **start)
        except InputError:  # it would start inside a wall
            start.popitem()


def _pick(r: np.random.Generator, values: tuple[float, ...]) -> float:
    return values[int(r.integers(len(values)))]


def _sign(r: np.random.Generator) -> float:
    return 1.0 if r.random() < 0.5 else -1.0


def _walls(r: np.random.Generator, block: Block) -> list[Wall]:
    """No wall, one, or two: touching, at equal distances, or so that the block's diagonal just fits
    between them."""
    sides: tuple[tuple[Literal["left", "right"], ...], ...] = (
        (),
        ("left",),
        ("right",),
        ("left", "right"),
    )
    gaps = (
        0.0,
        0.0,
        0.003,
        0.1,
        block.half_width,
        block.half_diagonal - block.half_width,
        2.0 * block.half_width,
    )
    gap, e = _pick(r, gaps), _pick(r, RESTITUTIONS)
    equal = r.random() < 0.5
    walls = []
    for side in sides[int(r.integers(4))]:
        walls.append(Wall(side=side, gap=gap, restitution=e))
        if not equal:
            gap, e = _pick(r, gaps), _pick(r, RESTITUTIONS)
    return walls


def _excitation(r: np.random.Generator, levels: tuple[float, ...]) -> Excitation:
    """Rest, a pulse whose peak is one of the levels, or a record that jumps or ramps between few of
    them."""
    kind = r.random()
    level = _sign(r) * _pick(r, levels[1:])
    period = _pick(r, (0.25, 0.5, 1.0, 2.0))
    if kind < 0.3 or level == 0.0:
        return Rest()
    if kind < 0.4:
        return Ricker(amplitude=level, period=period)
    if kind < 0.5:
        return Sine(amplitude=level, period=period, cycles=2)
    step = _pick(r, STEPS)
    if kind < 0.7:  # held: from the first instant, or after a ramp
        return Record.from_samples(np.full(round(4.0 / step), level), time_step=step)
    few = np.array([0.0, level, -level, _sign(r) * _pick(r, levels)])
    return Record.from_samples(
        np.repeat(few[r.integers(0, 4, size=12)], int(r.integers(1, 4))), time_step=step
    )


def _start(r: np.random.Generator, block: Block, kind: Kind, must_move: bool) -> dict[str, Any]:
    start: dict[str, Any] = {}
    if r.random() < 0.4 or must_move:
        sign = _sign(r)
        alpha = block.pivot("left" if sign > 0.0 else "right").alpha
        tilt = _pick(r, (alpha, 0.5 * alpha, 0.1, *(10.0**size for size in SIZES if size < 0)))
        start["initial_rotation"] = sign * (tilt if tilt < 1.5 else 0.1)
    if r.random() < 0.4:
        start["initial_angular_velocity"] = _sign(r) * 10.0 ** int(_pick(r, SIZES))
    if r.random() < 0.3 and kind != "no-slip":
        start["initial_velocity"] = _sign(r) * 10.0 ** int(_pick(r, SIZES))
    if r.random() < 0.2 and kind == "unilateral":
        start["initial_height"] = 10.0 ** int(
            _pick(r, tuple(float(size) for size in SIZES if size < 1))
        )
    return start
