"""The series of loaded blocks against Newton and Euler."""

import numpy as np
import pytest
from loaded import G, places, random_scene
from stepping import TILTED, run_at, six

from rockcheck.ebm import natural
from rockcheck.ebm.core import bouc_wen, contacts, motion
from rockcheck.ebm.core.names import Pivot, Row
from rockcheck.ebm.core.state import Run
from rockcheck.scenes import Record, Scene, Wall

WALLS = (Wall(side="left", gap=0.3), Wall(side="right", gap=0.4))


def newton_euler(
    scene: Scene, arms: tuple[np.ndarray, np.ndarray], w: float, mode: str, d: int, wall: int
) -> np.ndarray:
    """x'', y'', theta'' of the mass's centre, P, Q, N by the balances of force and moment and the
    contacts' accelerations, in the world.

    `arms` are the places of pivot and corner; `wall` is +1 where the corner rests on a left wall,
    -1 on a right one, 0 on none; d is the sense of the pivot's slip.
    """
    (pivot, corner), inertia = arms, scene.block.gyration_squared
    u = float(scene.excitation.acceleration(0.0))
    # Unknowns: ax, ay, spin, P, Q, N (the wall pushes to the right where it is the left one).
    rows = [
        ([1, 0, 0, 0, -1, -wall], -u),
        ([0, 1, 0, -1, 0, 0], -G),
        ([0, 0, inertia, -pivot[0], pivot[1], wall * corner[1]], 0.0),
        ([0, 1, pivot[0], 0, 0, 0], w * w * pivot[1]),
        ([1, 0, -pivot[1], 0, 0, 0], w * w * pivot[0])
        if mode in ("rock", "lean")
        else ([0, 0, 0, scene.floor.friction * d, 1, 0], 0.0),
        ([1, 0, -corner[1], 0, 0, 0], w * w * corner[0]) if wall else ([0, 0, 0, 0, 0, 1], 0.0),
    ]
    return np.linalg.solve(
        np.array([row for row, _ in rows], dtype=float), np.array([right for _, right in rows])
    )


@pytest.mark.parametrize("case", [1, -1], ids=["tip wall", "far wall"])
@pytest.mark.parametrize("mode", ["rock", "slide-rock", "lean", "ladder"])
def test_series_begin_with_newton_and_euler(mode, case):
    """Accelerations and forces of the models' series in every mode at 200 random loaded blocks and
    states, to 1e-9."""
    rng = np.random.default_rng(11)
    for _ in range(200):
        ramp = Record.from_samples(np.full(3, rng.uniform(-3.0, 3.0)), 10.0)
        scene = random_scene(rng).replace(walls=WALLS, excitation=ramp)
        b = natural.setting_of(scene, unilateral=False, no_slip=False, energy_cap=False)
        unit, R = natural.time_unit(scene), scene.block.radius
        S, w = int(rng.choice([-1, 1])), 0.0 if mode == "lean" else rng.uniform(-1.0, 1.0)
        theta = S * rng.uniform(0.01, 0.9) * (b.left if S > 0 else b.right).alpha
        pivot, corner = places(scene.block, theta, S, case)
        # Along a wall the pivot slips as the block turns.
        slips = {
            "slide-rock": float(rng.choice([-1, 1])) * rng.uniform(0.1, 1.0),
            "ladder": w * (corner[1] - pivot[1]),
        }
        slip, wall = slips.get(mode, 0.0), S * case if mode in ("lean", "ladder") else 0
        expected = newton_euler(scene, (pivot, corner), w, mode, int(np.sign(slip)), wall)
        if mode in slips and expected[3] < 0.0:
            continue  # the floor pulls: friction acts the other way
        velocity = np.array([slip + w * pivot[1], -w * pivot[0]]) * unit / R
        run = run_at(
            [0.0, -pivot[1] / R, theta, *velocity, w * unit],
            **TILTED,
            sense=S,
            slip=int(S * np.sign(slip)),
            pivot=Pivot.SLIPPING if mode in slips else Pivot.STICK,
            tip=wall == S,
            far=wall == -S,
        )
        motion.tilt_series(b, natural.base_of(scene), run, 12, 0.0, 0.0)
        a = run.a
        push = a[Row.NA, 0] - a[Row.NB, 0]
        forces = np.array([a[Row.P, 0], S * a[Row.Q, 0], S * wall * push]) * G
        found = [S * a[Row.OMEGA, 1] / unit**2, *forces]
        assert found == pytest.approx(expected[2:], rel=1e-9, abs=1e-9), (mode, case, S)


@pytest.mark.parametrize("case", [1, -1], ids=["tip wall", "far wall"])
def test_bouc_wens_series_keep_the_corner_on_its_wall(case):
    """x follows the corner's reach, +-s', in every term of the series, for 100 loaded blocks that
    turn along a wall."""
    rng, order = np.random.default_rng(14), 8
    for _ in range(100):
        scene = random_scene(rng).replace(walls=WALLS)
        b = natural.setting_of(scene, unilateral=False, no_slip=False, energy_cap=False, yields=0.1)
        S = int(rng.choice([-1, 1]))
        side = b.left if S > 0 else b.right
        theta, w = S * rng.uniform(0.1, 0.8) * side.alpha, S * rng.uniform(-0.3, 0.3)
        pivot, corner = np.array(places(scene.block, theta, S, case)) / scene.block.radius
        along = {"sense": S, "slip": 1 if S * w > 0 else -1, "tip": case > 0, "far": case < 0}
        start = [0.0, -pivot[1], theta, w * corner[1], -w * pivot[0], w]
        run = run_at(start, t=1.0, **TILTED, pivot=Pivot.SLIPPING, **along)
        bouc_wen.friction_series(b, natural.base_of(scene), run, 0.3, False, order)
        a = run.a
        sine, cosine = (side.tip_sin, side.tip_cos) if case > 0 else (side.far_sin, side.far_cos)
        reach = case * (sine * a[Row.COS] - cosine * a[Row.SIN])
        assert a[Row.XI, 1 : order - 1] == pytest.approx(reach[1 : order - 1], rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("case", [1, -1], ids=["tip wall", "far wall"])
def test_a_step_along_a_wall_ends_on_wall_and_floor(case):
    """LADDER of 50 loaded blocks: corner and pivot stay where they are held, and rates are those of
    the places."""
    rng = np.random.default_rng(21)
    for _ in range(50):
        scene = random_scene(rng).replace(walls=WALLS)
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
