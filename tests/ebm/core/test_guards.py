"""The guards of a mode and the series that they follow, against Newton and Euler."""

import math

import numpy as np
import pytest
from cases import G, places, random_scene
from numpy.polynomial import Polynomial
from situations import (
    PIVOTS,
    Core,
    Mode,
    Situation,
    answer,
    at_wall,
    candidates,
    margin,
    random_tilt,
    run_of,
    standing,
)
from stepping import FLAT, RESTS, ROCKS, TILTED, run_at, setting_of

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.core import contacts, ground, guards, modes, motion, series, steps
from rockcheck.ebm.core.names import Guard, Pivot, Row, Rule
from rockcheck.ebm.core.state import Base
from rockcheck.scenes import PAPER_BLOCK, Floor, Record, Rest, Ricker, Scene, Sine, Wall


@pytest.mark.parametrize("pivot", PIVOTS)
@pytest.mark.parametrize("touch", ["none", "tip", "far"])
def test_guards_are_what_their_names_say(touch, pivot):
    rng = np.random.default_rng(47)
    seen: set[str] = set()
    for _ in range(40):
        at, side, touched = random_tilt(rng, touch)
        for mode in candidates(side, touched, pivot):
            if margin(at, mode, touched, pivot) == -math.inf or (
                mode.floor == "stick" and at.state[5] != 0.0 and touched != (False, False)
            ):
                continue
            if mode.floor == "stick":  # rock: as if it stood
                at = Situation(at.alpha, at.mu_s, at.mu_k, at.u, at.g, standing(at), at.walls)
            found = answer(at, mode)
            size = 1.0 + max(map(abs, found[1:]))
            guards, moves = Core(at, pivot).guards(mode, at.state)
            seen |= guards.keys()
            cone = at.mu_s * mode.pull * found.normal
            forces = {
                "push": mode.pull * found.normal,
                "tip push": found.tip,
                "far push": found.far,
                "cone +": cone - found.friction,
                "cone -": cone + found.friction,
            }
            tau = 1e-3
            phi, xi, y = (moves[name](tau) for name in ("phi", "xi", "y"))
            v, w = (moves[name].deriv()(tau) for name in ("xi", "phi"))
            slips = {"slip": mode.slip * (v + math.cos(at.alpha - phi) * w)}
            places = gaps(at, side, phi, xi) | {
                "landing": y - math.cos(at.alpha - phi),
                "topple": 0.5 * math.pi - phi,
                "phi": phi,
                **(slips if touch == "none" else {}),
            }
            assert guards["phi"](tau) == pytest.approx(phi, abs=1e-15)
            now = {name: guards[name](0.0) for name in guards.keys() & forces.keys()}
            known = {name: forces[name] for name in now}
            assert now == pytest.approx(known, abs=1e-11 * size), mode
            then = {name: guards[name](tau) for name in guards.keys() & places.keys()}
            known = {
                name: pytest.approx(places[name], abs=1e-11 if name == "slip" else 1e-12)
                for name in then
            }
            assert then == known, mode
    assert seen >= (
        {"phi", "push", "cone +", "cone -", "slip"}
        | ({f"{touch} push", f"{touch} gap"} if touch != "none" else set())
        | ({"landing", "topple"} if pivot == "unilateral" else set())
    )


@pytest.mark.parametrize("n", [1, 2, 3])
def test_the_inverse_of_a_matrix(n):
    a = np.random.default_rng(n).normal(size=(6, 3))
    motion.inverse_of(a, 0, 3, n)
    assert a[3 : 3 + n, :n] == pytest.approx(np.linalg.inv(a[:n, :n]), rel=1e-9)


def gaps(at: Situation, side: int, phi: float, xi: float) -> dict[str, float]:
    """Clear distance of the tip wall and the far wall from the nearest of the block's four corners,
    which are turned one by one."""
    corners = (
        np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]])
        @ np.array(
            [[sx * math.sin(at.alpha), sy * math.cos(at.alpha)] for sx in (1, -1) for sy in (1, -1)]
        ).T
    )
    return {
        "tip gap": float(np.min(xi + corners[0])) + (at_wall(at, side) or math.inf),
        "far gap": (at_wall(at, -side) or math.inf) - float(np.max(xi + corners[0])),
    }


@pytest.mark.parametrize("vertical", [Rest(), Ricker(amplitude=3.0, period=1.1)], ids=["", "up"])
@pytest.mark.parametrize(
    "mode",
    [("stick", 0, 1), ("slip", 1, 1), ("slip", -1, 1), ("slip", 1, -1), ("off", 0, 1)],
    ids=str,
)
def test_series_obey_newton_and_euler_in_every_term(mode, vertical):
    """Rock, slide-rock and flight at random states: forces and motion, contacts and Coulomb's law
    hold as polynomials of time, up to their last term."""
    (floor, slip, pull), rng = mode, np.random.default_rng(5)
    scene = Scene(
        name="series",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.4),
        excitation=Ricker(amplitude=6.0, period=1.3),
        vertical=vertical,
        duration=1.0,
    )
    block = natural.setting_of(scene, EventBasedModel(pivot="unilateral"))
    for _ in range(20):
        side, w = int(rng.choice([-1, 1])), rng.uniform(-0.5, 0.5)
        phi, v = rng.uniform(0.0, 1.2) * PAPER_BLOCK.alpha, slip * rng.uniform(0.0, 1.0)
        s, c = math.sin(PAPER_BLOCK.alpha - phi), math.cos(PAPER_BLOCK.alpha - phi)
        run = run_of(
            Mode(True, side, floor, slip, pull, tip=False, far=False),
            (side * s, c, side * phi, side * (v - c * w), s * w, side * w),
        )
        run.state.t = rng.uniform(0.5, 2.5)
        base = natural.base_of(scene)
        assert motion.mode_series(block, base, run, series.ORDER, 0.0, 1.0) == series.ORDER
        phi, w, s, c, x, y, p, q, u, g = (
            Polynomial(run.a[Row[name], : series.ORDER + 1])
            for name in ("PHI", "OMEGA", "SIN", "COS", "XI", "Y", "P", "Q", "U", "G")
        )
        if floor == "stick":  # its place is sine and cosine but for a constant
            x, y = s, c
        laws = [
            (s.deriv(), -w * c),
            (c.deriv(), w * s),
            (phi.deriv(), w),
            (phi.deriv(2), 3.0 * (c * q - s * p)),
            (x.deriv(2), q - u),
            (y.deriv(2), p - g),
        ]
        if floor == "slip":
            laws += [(y, c), (q, -0.4 * slip * pull * p)]
        for one, other in laws:
            terms = (one - other).coef[: series.ORDER - 1]  # accelerations have two terms fewer
            assert np.abs(terms).max() < 5e-15 * max(1.0, np.abs(one.coef).max())


@pytest.mark.parametrize(("z", "loads"), [(0.4, True), (-0.4, False)])
@pytest.mark.parametrize("tilted", [True, False])
def test_series_obey_bouc_wens_law_in_every_term(tilted, z, loads):
    """u_y z' = V (1 - z^2) where the pivot loads, V where it unloads, and Q = -mu z P."""
    scene = Scene(
        name="winds",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.4),
        excitation=Ricker(amplitude=6.0, period=1.3),
        vertical=Ricker(amplitude=3.0, period=1.1),
        duration=1.0,
    )
    model = EventBasedModel(friction="bouc-wen", yield_displacement=0.1 * PAPER_BLOCK.radius)
    block, phi, w = natural.setting_of(scene, model), 0.1 * tilted, 0.3 * tilted
    s, c = math.sin(PAPER_BLOCK.alpha - phi), math.cos(PAPER_BLOCK.alpha - phi)
    mode = TILTED if tilted else FLAT
    run = run_at(
        (s, c, phi, 0.2 - c * w, s * w, w),
        t=1.0,
        **mode | {"sense": 1, "pivot": Pivot.SLIPPING, "slip": 1},
    )
    run.state.winds, run.state.zeta = True, z
    order = motion.mode_series(block, natural.base_of(scene), run, 12, 0.0, 1.0)
    phi, w, s, c, x, y, p, q, u, g, z = (
        Polynomial(run.a[Row[name], : order - 1])
        for name in ("PHI", "OMEGA", "SIN", "COS", "XI", "Y", "P", "Q", "U", "G", "Z")
    )
    slip = (x - s).deriv() if tilted else x.deriv()
    laws = [
        (x.deriv(2), q - u),
        (y.deriv(2), p - g),
        (0.1 * z.deriv(), slip * (1.0 - z * z) if loads else slip),
        (q, -0.4 * z * p),
    ]
    if tilted:
        laws += [
            (s.deriv(), -w * c),
            (c.deriv(), w * s),
            (phi.deriv(2), 3.0 * (c * q - s * p)),
        ]
    for one, other in laws:
        terms = (one - other).coef[: order - 3]
        assert np.abs(terms).max() < 1e-13 * max(1.0, np.abs(one.coef).max())


def test_at_its_balance_point_the_floor_s_push_follows_the_base():
    """Nothing moves, and the series of the motion has no terms: that of the push has."""
    upward = ground.ground_of(Sine(amplitude=0.4, period=0.9), 1.0, 1.0)
    base = Base(ground.ground_of(Rest(), 1.0, 1.0), upward)
    run = run_at((0.0, 1.0, 0.3, 0.0, 0.0, 0.0), t=0.2, **ROCKS, sense=1)
    order = motion.mode_series(setting_of(0.3), base, run, series.ORDER, 1e-12, 0.1)
    push = series.value(run.a, Row.P, order - 2, 0.1)
    assert push == pytest.approx(1.0 + ground.acceleration(upward, 0.3), abs=1e-11)


def test_a_flying_block_falls_as_g_and_the_base_s_motion_say():
    upward = ground.ground_of(Ricker(amplitude=0.3, period=1.1), 1.0, 1.0)
    base = Base(ground.ground_of(Rest(), 1.0, 1.0), upward)
    run = run_at((0.0, 2.0, 0.0, 0.0, 0.5, 0.0), t=1.0, **FLAT, pivot=Pivot.OFF)
    order = motion.mode_series(setting_of(0.3), base, run, 12, 0.0, 1.0)
    y, g = (Polynomial(run.a[row, : order - 1]) for row in (Row.Y, Row.G))
    assert (y.deriv(2) + g).coef[: order - 3] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize(
    ("mu", "friction", "holds"),
    [(1.2, "coulomb", True), (0.01, "coulomb", False), (0.01, "no-slip", True)],
)
def test_a_rocking_block_is_proved_to_stick_by_its_friction(mu, friction, holds):
    still = ground.ground_of(Rest(), 1.0, 1.0)
    block = setting_of(0.3, mu, pivot="bilateral", friction=friction)
    run = run_at((0.0, math.cos(0.2), 0.1, 0.0, 0.0, 0.0), **ROCKS, sense=1)
    run.state.order = motion.mode_series(block, Base(still, still), run, series.ORDER, 0.0, 0.1)
    run.state.length = 0.1
    assert guards.rock_guards_hold(block, run) == holds


@pytest.mark.parametrize(("away", "spins"), [(0.0, 0.0), (0.05, 0.1 * contacts.SLOW)])
@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_a_spin_of_rounding_is_taken_from_a_block_that_leans_on_a_wall(side, sign, away, spins):
    """One wall is enough; the same block a little away from it keeps its spin, which is then a
    motion."""
    alpha, phi, gap = 0.3, 0.1, 0.2
    touches = math.sin(alpha + phi) - math.sin(alpha) - gap  # where the top corner meets the wall
    place = [sign * (touches + away), math.cos(alpha - phi), sign * phi]
    z = run_at([*place, 0.0, 0.0, 0.1 * contacts.SLOW]).state.motion
    modes._clean(setting_of(alpha, walls=[Wall(side=side, gap=gap, restitution=0.0)]), z, True)
    assert z.w == spins


@pytest.mark.parametrize(
    ("left", "spin", "lies"),
    [
        (1e-6, 0.5, True),
        (1e-6, 1e-3, True),
        (1e-6, 0.0, False),
        (1e-6, -0.5, False),
        (1e-3, 0.5, False),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_block_that_lies_down_along_a_wall_meets_it_while_it_turns_over(sign, left, spin, lies):
    """However slowly it turns; one that turns back, or has some way to go, does not."""
    place = [0.0, 0.0, sign * (0.5 * math.pi - left)]
    state = run_at([*place, 0.0, 0.0, sign * spin], **ROCKS, sense=sign).state
    state.guard = Guard.TIP_GAP
    assert steps.lies_along_wall(state) == state.rules[Rule.LANDS_ALONG] == lies
    state.guard = Guard.FAR_GAP
    assert not steps.lies_along_wall(state)


@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("period", [0.3, 1.1, 4.0])
@pytest.mark.parametrize("amplitude", np.linspace(2.6, 30.0, 12).round(3).tolist())
def test_uplift_is_found_to_rounding(amplitude, period, symmetric):
    pulse, limit = Ricker(amplitude=amplitude, period=period, symmetric=symmetric), math.tan(0.25)
    base = ground.ground_of(pulse, 9.81, 0.4)
    t = ground.next_exceedance(base, 0.0, -limit, limit, 0.0, 0.0)
    assert abs(ground.acceleration(base, t)) >= limit * (1.0 - 1e-15)
    assert abs(ground.acceleration(base, t * (1.0 - 1e-14))) < limit


def test_uplift_is_found_in_few_evaluations(monkeypatch):
    evaluated, limit, plain = [], math.tan(0.25), ground.acceleration
    monkeypatch.setattr(ground, "acceleration", lambda g, t: evaluated.append(t) or plain(g, t))
    pulses = [
        Ricker(amplitude=amplitude, period=period)
        for amplitude in np.linspace(2.6, 30.0, 12)
        for period in (0.3, 1.1, 4.0)
    ]
    for pulse in pulses:
        ground.next_exceedance(ground.ground_of(pulse, 9.81, 0.4), 0.0, -limit, limit, 0.0, 0.0)
    assert len(pulses) <= len(evaluated) < 25 * len(pulses)


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
    # Unknowns: ax, ay, spin, P, Q, N (the wall pushes to the right where it is the left one).
    rows = [
        ([1, 0, 0, 0, -1, -wall], -float(scene.excitation.acceleration(0.0))),
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
    rng = np.random.default_rng(11)
    for _ in range(200):
        scene = random_scene(rng).replace(
            walls=WALLS, excitation=Record.from_samples(np.full(3, rng.uniform(-3.0, 3.0)), 10.0)
        )
        b = natural.setting_of(scene, EventBasedModel())
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
        motion.mode_series(b, natural.base_of(scene), run, 12, 0.0, 0.0)
        spin, p, q, tip, far = (
            run.a[Row[name], term]
            for name, term in (("OMEGA", 1), ("P", 0), ("Q", 0), ("NA", 0), ("NB", 0))
        )
        found = [S * spin / unit**2, p * G, S * q * G, S * wall * (tip - far) * G]
        assert found == pytest.approx(expected[2:], rel=1e-9, abs=1e-9), (mode, case, S)


@pytest.mark.parametrize("friction", ["coulomb", "bouc-wen"])
@pytest.mark.parametrize("case", [1, -1], ids=["tip wall", "far wall"])
def test_series_keep_the_corner_on_its_wall(case, friction):
    """x follows the corner's reach, +-s', and y the pivot's in every term of the series, for 100
    loaded blocks that turn along a wall."""
    rng, order = np.random.default_rng(14), 8
    for _ in range(100):
        scene = random_scene(rng).replace(walls=WALLS)
        b = natural.setting_of(scene, EventBasedModel(yield_displacement=0.1 * scene.block.radius))
        S = int(rng.choice([-1, 1]))
        side = b.left if S > 0 else b.right
        theta, w = S * rng.uniform(0.1, 0.8) * side.alpha, S * rng.uniform(-0.3, 0.3)
        pivot, corner = np.array(places(scene.block, theta, S, case)) / scene.block.radius
        along = {"sense": S, "slip": 1 if S * w > 0 else -1, "tip": case > 0, "far": case < 0}
        start = [0.0, -pivot[1], theta, w * corner[1], -w * pivot[0], w]
        run = run_at(start, t=1.0, **TILTED, pivot=Pivot.SLIPPING, **along)
        run.state.winds, run.state.zeta = friction == "bouc-wen", 0.3
        run.state.order = motion.mode_series(b, natural.base_of(scene), run, order, 0.0, 0.0)
        x, y, s, c = (run.a[row, : order - 1] for row in (Row.XI, Row.Y, Row.SIN, Row.COS))
        assert y == pytest.approx(c, rel=1e-10, abs=1e-10)
        sine, cosine = (side.tip_sin, side.tip_cos) if case > 0 else (side.far_sin, side.far_cos)
        assert x[1:] == pytest.approx(case * (sine * c - cosine * s)[1:], rel=1e-10, abs=1e-10)
        motion.motion_at(b, run.state, run.a, 0.0, run.state.sampled)
        assert run.state.sampled.w == pytest.approx(w, rel=1e-12)


@pytest.mark.parametrize(
    ("length", "tau", "guard"), [(2.0, 0.3, Guard.UPLIFT_PLUS), (0.8, 0.27, Guard.NONE)]
)
def test_a_force_that_vanishes_late_in_a_step_is_looked_for_in_a_shorter_one(length, tau, guard):
    """An acceleration that rises by 1 in 1 s lifts a block of slope 0.3 at 0.3 s. Behind a quarter
    of its step the step ends a tenth before."""
    block = setting_of(math.atan(0.3))
    ramp = ground.ground_of(Record.from_samples([0.0, 3.0], time_step=3.0), 1.0, 1.0)
    base = Base(ramp, ground.ground_of(Rest(), 1.0, 1.0))
    run = run_at((0.0, block.height, 0.0, 0.0, 0.0, 0.0), **RESTS)
    run.state.order = motion.mode_series(block, base, run, series.ORDER, 0.0, length)
    run.state.length = length
    guards.fill_guards(block, run.state, run.a)
    guards.first_event(run)
    assert run.state.guard == guard
    assert run.state.tau == pytest.approx(tau, abs=1e-9)


@pytest.mark.parametrize(("z", "watched"), [(-0.1, True), (0.0, False), (0.1, False)])
@pytest.mark.parametrize("slip", [1, -1])
def test_a_winding_pivot_that_unloads_is_watched_until_it_loads(slip, z, watched):
    run = run_at(**TILTED, sense=1, pivot=Pivot.SLIPPING, slip=slip)
    run.state.winds, run.a[Row.Z, 0] = True, slip * z
    guards.fill_guards(setting_of(0.3, friction="bouc-wen", pivot="bilateral"), run.state, run.a)
    assert bool(run.a[Row.THERE, Guard.LOADS]) == watched


@pytest.mark.parametrize(
    ("which", "slack", "gap", "rate", "lift"),
    [
        (Guard.LANDING, 2.0, 0.0, 0.0, contacts.CLOSED),
        (Guard.LANDING, 1.0, 0.0, 0.0, 0.0),
        (Guard.LANDING, 2.0, 2e-10, 0.0, 0.0),
        (Guard.LANDING, 2.0, 0.0, -2e-9, 0.0),
        (Guard.PHI, 2.0, 0.0, 0.0, 0.0),
    ],
)
def test_a_gap_may_close_by_the_noise_in_a_mode_that_goes_on(which, slack, gap, rate, lift):
    """Where it touches without speed."""
    a = run_at().a
    a[Row.GUARD, :2] = gap, rate
    guards._with_slack(which, slack, a)
    assert a[Row.GUARD, 0] == gap + lift


@pytest.mark.parametrize(("tip", "far"), [(1, 0), (0, 1)])
def test_a_corner_on_a_wall_has_a_push_and_no_gap(tip, far):
    mode = TILTED | {"sense": 1, "pivot": Pivot.SLIPPING, "slip": 1, "tip": tip, "far": far}
    run = run_at((0.0, 0.9, 0.1, 0.0, 0.0, 0.0), **mode)
    guards.fill_guards(setting_of(0.3, walls=WALLS), run.state, run.a)
    there = [bool(run.a[Row.THERE, which]) for which in (Guard.TIP_GAP, Guard.FAR_GAP)]
    pushes = [bool(run.a[Row.THERE, which]) for which in (Guard.TIP_PUSH, Guard.FAR_PUSH)]
    assert there == [not tip, not far]
    assert pushes == [bool(tip), bool(far)]


@pytest.mark.parametrize(
    ("which", "degree"),
    [(Guard.PHI, 8), (Guard.SLIP, 7), (Guard.LOADS, 7), (Guard.FLOOR_PUSH, 6)],
)
def test_a_guard_has_the_terms_of_its_series(which, degree):
    """Of a series of 8 a rate and z, which follows a rate, have 7, and an acceleration 6."""
    assert guards.guard(which, 8, run_at().a) == degree


def test_the_table_of_guards_has_a_column_for_each_series():
    assert max(max(series) for _, *series in guards.GUARDS.values()) < Row.GUARD
