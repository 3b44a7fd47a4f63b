"""The series of loaded blocks against Newton and Euler."""

import math

import numpy as np
import pytest
from loaded import G, random_scene, scene_of
from stepping import TILTED, run_at, six

from rockcheck.ebm import natural
from rockcheck.ebm.core import bouc_wen, contacts, motion
from rockcheck.ebm.core.names import Family, Pivot, Row
from rockcheck.ebm.core.state import Run
from rockcheck.scenes import Block, Record, Wall


def newton_euler(
    block: Block, state: np.ndarray, u: float, mode: str, S: int, d: int, wall: int, mu: float
) -> np.ndarray:
    """x'', y'', theta'' of the mass's centre, P, Q, N by the balances of force and moment and the
    contacts' accelerations, in the world.

    `wall` is +1 where a corner rests on a left wall, -1 on a right one, 0 on none; S the pivot, d
    the sense of its slip.
    """
    theta, w = state[2], state[5]
    dx, dz = block.offset
    rotation = np.array([[math.cos(theta), -math.sin(theta)], [math.sin(theta), math.cos(theta)]])
    pivot = rotation @ [-S * block.half_width - dx, -block.half_height - dz]
    corner = rotation @ [
        -wall * block.half_width - dx,
        (block.half_height if wall == S else -block.half_height) - dz,
    ]
    inertia = block.gyration_squared
    # Unknowns: ax, ay, spin, P, Q, N (the wall pushes to the right where it is the left one).
    rows = [
        ([1, 0, 0, 0, -1, -wall], -u),
        ([0, 1, 0, -1, 0, 0], -G),
        ([0, 0, inertia, -pivot[0], pivot[1], wall * corner[1]], 0.0),
        ([0, 1, pivot[0], 0, 0, 0], w * w * pivot[1]),
        ([1, 0, -pivot[1], 0, 0, 0], w * w * pivot[0])
        if mode in ("rock", "lean")
        else ([0, 0, 0, mu * d, 1, 0], 0.0),
        ([1, 0, -corner[1], 0, 0, 0], w * w * corner[0]) if wall else ([0, 0, 0, 0, 0, 1], 0.0),
    ]
    return np.linalg.solve(
        np.array([row for row, _ in rows], dtype=float), np.array([right for _, right in rows])
    )


@pytest.mark.parametrize("case", [1, -1], ids=["tip wall", "far wall"])
@pytest.mark.parametrize("mode", ["rock", "slide-rock", "lean", "ladder"])
def test_series_begin_with_newton_and_euler(mode, case):
    """Accelerations and forces of the models' series in every mode at 200 random loaded blocks and
    states, to 1e-10."""
    rng = np.random.default_rng(11)
    for _ in range(200):
        b, h = rng.uniform(0.1, 0.5), rng.uniform(0.5, 1.5)
        place = (rng.uniform(-0.6, 0.6) * b, rng.uniform(-0.6, 0.6) * h)
        block = Block(
            half_width=b,
            half_height=h,
            centre_of_mass=place,
            moment_of_inertia=rng.uniform(0.25, 0.5) * (b * b + h * h),
        )
        S, d = int(rng.choice([-1, 1])), int(rng.choice([-1, 1]))
        wall = S * case if mode in ("lean", "ladder") else 0
        mu, level = (
            rng.uniform(0.05, min(1.0, 0.5 * block.least_painleve_friction)),
            rng.uniform(-3.0, 3.0),
        )
        walls = [Wall(side="left", gap=0.1), Wall(side="right", gap=0.1)]
        ramp = Record.from_samples(np.full(3, level), 10.0)
        scene = scene_of(block, mu, excitation=ramp, walls=walls)
        setting, unit, R = (
            natural.setting_of(scene, unilateral=False, no_slip=False, energy_cap=False),
            natural.time_unit(scene),
            block.radius,
        )
        pivot = block.pivot("left" if S > 0 else "right")
        theta, w = (
            S * rng.uniform(0.01, 0.9) * pivot.alpha,
            0.0 if mode == "lean" else rng.uniform(-1.0, 1.0),
        )
        s, c = (
            pivot.radius * math.sin(pivot.alpha - abs(theta)),
            pivot.radius * math.cos(pivot.alpha - abs(theta)),
        )
        # The corner keeps to the wall: the centre's velocity is that of the turn, and the slip's
        # sense too.
        if mode == "ladder":
            dx, dz = block.offset
            top = h - dz if wall == S else -h - dz
            vx = w * (math.sin(theta) * (-wall * b - dx) + math.cos(theta) * top)
            slip = vx + c * w
            d = 1 if slip > 0.0 else -1
        else:
            vx = -c * w + (0.0 if mode in ("rock", "lean") else d * rng.uniform(0.1, 1.0))
        expected = newton_euler(
            block, np.array([0.0, c, theta, vx, S * s * w, w]), level, mode, S, d, wall, mu
        )
        if mode in ("slide-rock", "ladder") and expected[3] < 0.0:
            continue  # the floor pulls: friction acts the other way
        run = run_at(
            [0.0, c / R, theta, vx * unit / R, S * s * w * unit / R, w * unit],
            **TILTED,
            sense=S,
            slip=S * d if mode in ("slide-rock", "ladder") else 0,
            pivot=Pivot.STICK if mode in ("rock", "lean") else Pivot.SLIPPING,
            tip=wall == S,
            far=wall == -S,
        )
        motion.tilt_series(setting, natural.base_of(scene), run, 12, 0.0, 0.0)
        a = run.a
        push = a[Row.NA, 0] - a[Row.NB, 0]
        found = np.array(
            [
                0.0,
                0.0,
                S * a[Row.OMEGA, 1] / unit**2,
                a[Row.P, 0] * G,
                S * a[Row.Q, 0] * G,
                S * push * G,
            ]
        )
        wanted = expected * [0.0, 0.0, 0.0 if mode == "lean" else 1.0, 1.0, 1.0, wall]
        found[2] = 0.0 if mode == "lean" else found[2]
        if mode == "lean":  # at rest: what the block would do is prevented
            static = newton_euler(
                block, np.array([0.0, c, theta, 0.0, 0.0, 0.0]), level, "lean", S, d, wall, mu
            )
            assert static[:3] == pytest.approx(0.0, abs=1e-9)
        assert found == pytest.approx(wanted, rel=1e-9, abs=1e-9), (mode, case, S)


@pytest.mark.parametrize("case", [1, -1], ids=["tip wall", "far wall"])
def test_bouc_wens_series_keep_the_corner_on_its_wall(case):
    """x follows the corner's reach, +-s', in every term of the series, for 100 loaded blocks that
    turn along a wall."""
    rng, order = np.random.default_rng(14), 8
    for _ in range(100):
        scene = random_scene(rng).replace(
            walls=(Wall(side="left", gap=0.01), Wall(side="right", gap=0.01))
        )
        b = natural.setting_of(scene, unilateral=False, no_slip=False, energy_cap=False, yields=0.1)
        S = int(rng.choice([-1, 1]))
        side = b.left if S > 0 else b.right
        sine, cosine = (side.tip_sin, side.tip_cos) if case > 0 else (side.far_sin, side.far_cos)
        phi, w = rng.uniform(0.1, 0.8) * side.alpha, rng.uniform(-0.3, 0.3)
        s, c = side.radius * math.sin(side.alpha - phi), side.radius * math.cos(side.alpha - phi)
        run = run_at(
            [0.0, c, S * phi, S * case * (sine * s + cosine * c) * w, S * S * s * w, S * w],
            t=1.0,
            **TILTED,
            sense=S,
            pivot=Pivot.SLIPPING,
            slip=1 if w > 0 else -1,
            tip=case > 0,
            far=case < 0,
        )
        bouc_wen.friction_series(b, natural.base_of(scene), run, 0.3, False, order)
        a = run.a
        for k in range(1, order - 1):
            reach = case * (sine * a[Row.COS, k] - cosine * a[Row.SIN, k])
            assert a[Row.XI, k] == pytest.approx(reach, rel=1e-10, abs=1e-10), k


@pytest.mark.parametrize("case", [1, -1], ids=["tip wall", "far wall"])
def test_a_step_along_a_wall_ends_on_wall_and_floor(case):
    """LADDER of 50 loaded blocks: corner and pivot stay where they are held, and rates are those of
    the places."""
    rng = np.random.default_rng(21)
    walls = (Wall(side="left", gap=0.3), Wall(side="right", gap=0.4))
    for _ in range(50):
        scene = random_scene(rng).replace(walls=walls)
        b = natural.setting_of(scene, unilateral=False, no_slip=False, energy_cap=False)
        S, w = int(rng.choice([-1, 1])), rng.uniform(-0.3, 0.3)
        side = b.left if S > 0 else b.right
        phi = rng.uniform(0.1, 0.8) * side.alpha
        along = {"sense": S, "pivot": Pivot.SLIPPING, "slip": 1, "tip": case > 0, "far": case < 0}
        run = run_at([0.0, 0.0, S * phi, 0.0, 0.0, S * w], t=1.0, **TILTED | along)
        z = run.state.motion
        z.x -= S * case * contacts.wall_gap(b, z, S * case)
        run.state.order = motion.tilt_series(b, natural.base_of(scene), run, 15, 0.0, 0.0)
        before, there, after = (ended_at(b, run, tau) for tau in (0.02 - 1e-5, 0.02, 0.02 + 1e-5))
        assert contacts.wall_gap(b, run.state.sampled, S * case) == pytest.approx(0.0, abs=1e-14)
        assert contacts.floor_gap(b, run.state.sampled) == pytest.approx(0.0, abs=1e-14)
        assert there[3:] == pytest.approx((after - before)[:3] / 2e-5, abs=1e-8)


def ended_at(b: np.record, run: Run, tau: float) -> np.ndarray:
    motion.motion_at(b, run.state, run.a, tau, run.state.sampled)
    return six(run.state.sampled)


def test_a_flat_block_falls_freely():
    scene = scene_of(excitation=Record.from_samples([0.0, 0.0], 1.0))
    b = natural.setting_of(scene, unilateral=True, no_slip=False, energy_cap=False)
    run = run_at([0.1, 1.5, 0.0, 0.2, 0.3, 0.0], family=Family.FLAT, sense=1, pivot=Pivot.OFF)
    run.state.order = motion.flat_series(b, natural.base_of(scene), run, 15)
    assert ended_at(b, run, 0.4) == pytest.approx([0.18, 1.54, 0.0, 0.2, -0.1, 0.0], abs=1e-14)
