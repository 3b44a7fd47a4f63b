"""Random scenes over all that a user could write.

Each follows from a seed and a number, so any one can be made again.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any, Literal

import numpy as np

from rockcheck.scenes import (
    Block,
    Cosine,
    Excitation,
    Floats,
    Floor,
    HalfSine,
    InputError,
    Record,
    Rest,
    Ricker,
    Scene,
    Side,
    Sine,
    Wall,
    Wavelet,
)

#: Kinds of scenes by what models can play: the bilateral pivot neither bounces nor hops, Bouc-Wen
#: friction has one coefficient, and a pivot that never slips does not start with slip.
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

WALLED: tuple[tuple[Side, ...], ...] = (
    (),
    ("left",),
    ("right",),
    ("left", "right"),
)


def random_scene(seed: int, number: int, kind: Kind = "unilateral") -> Scene:
    """Scene `number` of the run with this seed.

    It is the same for all kinds, except for what a kind cannot play.
    """
    r = np.random.default_rng([seed, number])
    alpha = float(r.uniform(*ALPHA)) if r.random() < 0.7 else _log(r, *ALPHA)
    radius = _log(r, *RADIUS)
    gravity = 9.81 if r.random() < 0.8 else _log(r, 1.0, 30.0)
    chance = np.random.default_rng([seed, number, 2])
    block, most = loaded(
        Block(half_width=radius * math.sin(alpha), half_height=radius * math.cos(alpha)),
        chance,
        lambda: float(chance.uniform(*OFF_CENTRE)),
        lambda: float(chance.uniform(*INERTIA)),
    )
    unit = math.sqrt(block.radius / gravity)
    mu = _edge(
        r,
        (0.0, most, min(block.slope, most)),
        lambda: most / FRICTION[1] * float(r.uniform(*FRICTION)),
    )
    mu_s = min(mu * float(r.uniform(1.0, 1.5)), most) if r.random() < 0.3 else mu
    bounce = 0.0 if r.random() < 0.5 else float(r.uniform(0.0, 0.999))
    walls = [
        Wall(
            side=side,
            gap=_one_of(
                r.random(),
                (0.1, lambda: 0.0),
                (0.7, lambda: _log(r, 1e-6, 1.0) * min(radius, 1.0)),
                (1.0, lambda: r.uniform(0.0, 1.0)),
            ),
            restitution=_one_of(
                r.random(),
                (0.3, lambda: 0.0),
                (0.4, lambda: 1.0),
                (1.0, lambda: r.uniform(0.0, 1.0)),
            ),
        )
        for side in WALLED[int(r.integers(4))]
    ]
    own_period = 2.0 * math.pi / block.weaker_pivot.frequency_parameter(gravity)
    excitation = _excitation(r, gravity * min(block.slope, max(mu, 0.05)), own_period)
    vertical = (
        _excitation(r, gravity * (0.3 if r.random() < 0.5 else 0.03), own_period)
        if r.random() < 0.3
        else Rest()
    )
    lasts = max(excitation.quiet_after, vertical.quiet_after) + unit * float(r.uniform(1.0, 20.0))
    duration = min(lasts, unit * LONGEST * float(r.uniform(0.1, 1.0)) ** 2 + unit)
    balance = block.pivot("left").alpha, -block.pivot("right").alpha
    start = _drawn(
        r,
        (
            "initial_rotation",
            math.inf if excitation.kind == "rest" else 0.3,  # without shaking it must move
            lambda: _edge(r, balance, lambda: block.alpha * float(r.uniform(-1.0, 1.0))),
        ),
        (
            "initial_angular_velocity",
            0.3,
            lambda: float(r.uniform(-1.5, 1.5)) * (block.alpha if r.random() < 0.5 else 1.0) / unit,
        ),
        ("initial_velocity", 0.2, lambda: float(r.uniform(-1.0, 1.0)) * (block.radius / unit)),
        ("initial_height", 0.1, lambda: block.radius * _log(r, 1e-6, 1.0)),
    )
    return _scene(
        kind,
        start,
        ["initial_rotation"],  # it would start inside a wall: let it stand
        mu,
        mu_s,
        bounce,
        name=f"stress {seed} {number}",
        block=block,
        walls=walls,
        excitation=excitation,
        vertical=vertical,
        duration=duration,
        gravity=gravity,
    )


def _scene(
    kind: Kind,
    start: dict[str, Any],
    doubtful: Sequence[str],
    mu: float,
    mu_s: float,
    bounce: float,
    **settings: Any,
) -> Scene:
    """A scene with as much of its start as the kind can play and is valid.

    `doubtful` parts are dropped first. `mu`, `mu_s` and `bounce` are the floor's.
    """
    if kind != "unilateral":
        bounce = 0.0
        start.pop("initial_height", None)
    if kind == "no-slip":
        start.pop("initial_velocity", None)
    settings |= {
        "floor": Floor(
            friction=mu,
            static_friction=None if mu_s == mu or kind == "bouc-wen" else mu_s,
            restitution=bounce,
        ),
        "output_step": settings["duration"] / ROWS,
    }
    for key in doubtful:
        try:
            return Scene(**settings, **start)
        except InputError:
            start.pop(key, None)
    return Scene(**settings, **start)


def loaded(
    block: Block, r: np.random.Generator, place: Callable[[], float], inertia: Callable[[], float]
) -> tuple[Block, float]:
    """The block, in a share `LOADED` of the draws with a load, and the largest friction of a scene.

    `place` draws how far the mass's centre is off, of the half sides; its height is off in half of
    the draws. In half of them the moment of inertia is given, too: `inertia` draws it, of the
    largest possible. With more friction, but for a margin, a slipping pivot may jam.
    """
    if r.random() >= LOADED:
        return block, FRICTION[1]
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
    block = block.replace(centre_of_mass=centre, moment_of_inertia=own)
    most = min(FRICTION[1], 0.999 * block.least_painleve_friction)
    return block, FRICTION[1] if block.homogeneous else most


def _log(r: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(r.uniform(math.log(low), math.log(high))))


def _edge(r: np.random.Generator, values: tuple[float, ...], usual: Callable[[], float]) -> float:
    """One of the `values` in a twentieth of the draws, else what is `usual`."""
    near, value = r.random() < 0.05, float(_pick(r, values))
    return value if near else usual()


def _sign(r: np.random.Generator) -> float:
    return 1.0 if r.random() < 0.5 else -1.0


def _one_of(drawn: float, *options: tuple[float, Callable[[], Any]]) -> Any:
    """What the first option makes whose bound is above the number drawn."""
    return next(make for bound, make in options if drawn < bound)()


def _excitation(r: np.random.Generator, uplift: float, own_period: float) -> Excitation:
    amplitude = uplift * _log(r, *AMPLITUDE) * _sign(r)
    period = own_period * _log(r, *PERIOD)
    return _one_of(
        r.random(),
        (0.1, Rest),
        (
            0.45,
            lambda: Ricker(amplitude=amplitude, period=period, symmetric=bool(r.random() < 0.3)),
        ),
        (
            0.54,
            lambda: Sine(amplitude=amplitude, period=period, cycles=int(r.integers(1, 9))),
        ),
        (0.56, lambda: HalfSine(amplitude=amplitude, period=period)),
        (
            0.58,
            lambda: Wavelet(
                amplitude=amplitude,
                period=period,
                gamma=r.uniform(1.2, 4.0),
                phase=r.uniform(0.0, 6.0),
            ),
        ),
        (
            0.6,
            lambda: Cosine(amplitude=amplitude, period=period, cycles=int(r.integers(1, 9))),
        ),
        (
            1.0,
            lambda: Record.from_samples(_samples(r, amplitude), time_step=_log(r, *RECORD_STEP)),
        ),
    )


def _samples(r: np.random.Generator, amplitude: float) -> Floats:
    """A single sample, noise, levels with steps, or spikes in silence."""
    count = max(1, round(_log(r, 2.0, MOST_SAMPLES)))
    return _one_of(
        r.random(),
        (0.1, lambda: np.array([amplitude])),
        (0.4, lambda: amplitude * r.standard_normal(count)),
        (
            0.7,
            lambda: (
                amplitude
                * np.take(  # the places are drawn first
                    indices=np.sort(
                        np.resize(r.integers(0, count, size=max(1, count // 8)), count)
                    ),
                    a=r.standard_normal(count),
                )
            ),
        ),
        (
            1.0,
            lambda: np.where(
                r.random(count) < 0.1, amplitude * r.standard_normal(count) * 3.0, 0.0
            ),
        ),
    )


def _drawn(
    r: np.random.Generator, *parts: tuple[str, float, Callable[[], float]]
) -> dict[str, Any]:
    """A start of some of the parts: a key, the share of the draws that have it, what draws it.

    No number decides about a part that every start has.
    """
    return {key: draw() for key, share, draw in parts if share > 1.0 or r.random() < share}


# Scenes at which rounding decides: round numbers, equal lengths, accelerations exactly at a limit,
# motions as small as noise. Random scenes from continuous distributions meet no ties. Users write
# round numbers and meet many.

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
FRICTIONS = (0.0, 0.1, 0.2, 0.25, 0.3, 0.5, 0.6, 0.75, 1.0, 1.2)
RESTITUTIONS = (0.0, 0.0, 0.25, 0.5, 0.75, 1.0, 0.9999999)
STEPS = (0.01, 0.02, 0.1, 0.25)
#: Places of a load, of the half sides, and its moment of inertia, of the largest possible.
PLACES, INERTIAS = (0.125, 0.25, 0.5, 0.75), (0.125, 0.25, 0.5, 1.0)
#: Starts as powers of ten: noise, small, large. Share of long runs, and their length, s.
SIZES = (-300, -20, -13, -12, -11, -10, -9, -8, -6, -3, -1, 0, 1, 3)
LONG, LASTS = 0.02, 1e4


def exact_scene(seed: int, number: int, kind: Kind = "unilateral") -> Scene:
    """Scene `number` of the run with this seed.

    It is the same for all kinds, except for what a kind cannot play.
    """
    r = np.random.default_rng([seed, number, 1])
    width, height = SIDES[int(r.integers(len(SIDES)))]
    chance = np.random.default_rng([seed, number, 3])
    block, most = loaded(
        Block(half_width=width, half_height=height),
        chance,
        lambda: _pick(chance, PLACES),
        lambda: _pick(chance, INERTIAS),
    )
    gravity = _pick(r, (9.81, 10.0, 1.0))
    side = block.pivot("left" if chance.random() < 0.5 else "right")
    slope = side.arm / side.height
    mu = min(_pick(r, (*FRICTIONS, slope, 0.5 * slope, 3.0 * slope / (4.0 + slope * slope))), most)
    mu_s = min(1.25 * mu, most) if r.random() < 0.2 and kind != "bouc-wen" else mu
    bounce = _pick(r, (0.0, 0.0, 0.0, 0.5, 0.9)) if kind == "unilateral" else 0.0
    excitation = _exact_excitation(
        r,
        (
            0.0,
            gravity,
            gravity * slope,
            gravity * mu,
            gravity * mu_s,
            2.0 * gravity * slope,
            0.5 * gravity,
        ),
    )
    vertical = (
        _exact_excitation(r, (0.0, gravity, gravity, 0.5 * gravity, 2.0 * gravity))
        if r.random() < 0.3
        else Rest()
    )
    walls = _exact_walls(r, block)
    duration = round(_pick(r, (1.0, 2.0, 5.0, 10.0)) * math.sqrt(block.radius / gravity), 2)
    still = excitation.kind == "rest" and vertical.kind == "rest"
    if still and all(wall.restitution <= 0.5 for wall in walls) and r.random() < LONG:
        duration = LASTS

    def tilt() -> float:
        sign = _sign(r)
        alpha = block.pivot("left" if sign > 0.0 else "right").alpha
        size = _pick(r, (alpha, 0.5 * alpha, 0.1, *(10.0**size for size in SIZES if size < 0)))
        return sign * (size if size < 1.5 else 0.1)

    start = _drawn(
        r,
        ("initial_rotation", 1.0 if excitation.kind == "rest" else 0.4, tilt),
        ("initial_angular_velocity", 0.4, lambda: _sign(r) * 10.0 ** int(_pick(r, SIZES))),
        ("initial_velocity", 0.3, lambda: _sign(r) * 10.0 ** int(_pick(r, SIZES))),
        ("initial_height", 0.2, lambda: 10.0 ** int(_pick(r, [one for one in SIZES if one < 1]))),
    )
    return _scene(
        kind,
        start,
        [*reversed(start)],
        mu,
        mu_s,
        bounce,
        name=f"exact {seed} {number}",
        block=block,
        walls=walls,
        excitation=excitation,
        vertical=vertical,
        duration=duration,
        gravity=gravity,
    )


def _pick(r: np.random.Generator, values: Sequence[Any]) -> Any:
    return values[int(r.integers(len(values)))]


def _exact_walls(r: np.random.Generator, block: Block) -> list[Wall]:
    """No wall, one, or two: touching, equidistant, or just wide enough for the block's diagonal."""
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
    for side in WALLED[int(r.integers(4))]:
        walls.append(Wall(side=side, gap=gap, restitution=e))
        if not equal:
            gap, e = _pick(r, gaps), _pick(r, RESTITUTIONS)
    return walls


def _exact_excitation(r: np.random.Generator, levels: tuple[float, ...]) -> Excitation:
    """Rest, a pulse of one of the levels, or a record of few of them; a sine peaks at its level.

    The record jumps, ramps or stays at a level.
    """
    kind = r.random()
    level = _sign(r) * _pick(r, levels[1:])
    period = _pick(r, (0.25, 0.5, 1.0, 2.0))
    held = [  # from the first instant, or after a ramp
        Record.from_samples(np.full(round(4.0 / step), level), time_step=step) for step in STEPS
    ]
    return _one_of(
        kind if level != 0.0 else 0.0,
        (0.3, Rest),
        (0.4, lambda: Ricker(amplitude=level, period=period)),
        (0.5, lambda: Sine(amplitude=level, period=period, cycles=2)),
        (0.7, lambda: _pick(r, held)),
        (
            1.0,
            lambda: Record.from_samples(
                time_step=_pick(r, STEPS),
                samples=np.repeat(
                    np.array([0.0, level, -level, _sign(r) * _pick(r, levels)])[
                        r.integers(0, 4, size=12)
                    ],
                    int(r.integers(1, 4)),
                ),
            ),
        ),
    )
