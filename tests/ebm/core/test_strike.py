"""What an impact does to a block: onto its contact, landings, rebounds from walls, and the Zeno
rule."""

import math

import numpy as np
import pytest
from cases import places, random_scene
from stepping import FLAT, ROCKS, TILTED, run_at, setting_of, six

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.core import contacts, settle, strike
from rockcheck.ebm.core.ground import ground_of
from rockcheck.ebm.core.names import Family, Guard, Pivot, Rule
from rockcheck.ebm.core.state import Base
from rockcheck.scenes import PAPER_BLOCK, Floor, Rest, Scene, Wall


@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
def test_a_block_rocks_on_until_its_rate_is_a_ten_millionth(pivot):
    """Housner's impacts follow each other down to a rate of 1e-6 sqrt(g/R) at least; with the
    paper's pivot all to 5e-8."""
    alpha = PAPER_BLOCK.alpha
    tilt, ratio = 0.3 * alpha, 1.0 - 1.5 * math.sin(alpha) ** 2
    scene = Scene(
        name="still",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.8),
        initial_rotation=tilt,
        duration=12.0,
        output_step=0.1,
    )
    history = EventBasedModel(pivot=pivot).simulate(scene)
    assert history.outcome == "at rest"
    unit = math.sqrt(scene.gravity * PAPER_BLOCK.radius) * math.sin(alpha) * (1.0 + ratio)
    rates = [one.impulse / unit for one in history.event_list if one.kind == "floor impact"]
    first = math.sqrt(1.5 * (math.cos(alpha - tilt) - math.cos(alpha)))
    np.testing.assert_allclose(rates[:100], first * ratio ** np.arange(100), rtol=1e-6)
    assert rates[-1] < 1e-6
    if pivot == "bilateral":
        assert len(rates) == math.ceil(math.log(5e-8 / first) / math.log(ratio))


@pytest.mark.parametrize(
    ("which", "pivot", "toward"),
    [
        (Guard.LANDING, Pivot.OFF, 0),
        (Guard.TIP_GAP, Pivot.STICK, 1),
        (Guard.TIP_GAP, Pivot.SLIPPING, 1),
        (Guard.FAR_GAP, Pivot.SLIPPING, -1),
    ],
)
@pytest.mark.parametrize("tilt", [0.0, 0.15])
@pytest.mark.parametrize("side", [1, -1])
def test_a_block_is_put_onto_the_contact_that_closes(side, tilt, which, pivot, toward):
    """The gap is zero to rounding, whichever it was and whatever the pivot does; what need not give
    way keeps its place."""
    alpha, off = 0.4, 1e-7
    b = setting_of(alpha, walls=[Wall(side="left", gap=0.05), Wall(side="right", gap=0.1)])
    family, sense = (Family.TILT, side) if tilt else (Family.FLAT, 1)
    wall = toward * sense
    place = [0.0, math.cos(alpha - tilt) + off * (wall == 0), side * tilt, 0.0, 0.0, 0.0]
    state = run_at(place, family=family, sense=sense, pivot=pivot).state
    z = state.motion
    if wall:
        z.x = -wall * (contacts.wall_gap(b, z, wall) - off)
    before = six(z)
    strike.touch(b, state.mode, z, which)
    gap = contacts.wall_gap(b, z, wall) if wall else contacts.floor_gap(b, z)
    assert gap == pytest.approx(0.0, abs=1e-13)
    assert np.max(np.abs(six(z) - before)) == pytest.approx(off, rel=1.0)
    if wall and tilt and pivot == Pivot.STICK:
        pivots = [one[0] - side * math.sin(alpha - abs(one[2])) for one in (before, six(z))]
        assert pivots[1] == pytest.approx(pivots[0], abs=1e-15)
        assert contacts.floor_gap(b, z) == 0.0
    else:
        kept = [k for k in range(6) if k != (0 if wall else 1)]
        np.testing.assert_array_equal(six(z)[kept], before[kept])


@pytest.mark.parametrize(
    ("slip", "kept"), [(0.1, True), (-3e-7, True), (1e-7, False), (-1e-7, False)]
)
@pytest.mark.parametrize(("bounce", "left"), [(0.1, 0.1), (4e-8, 0.0)])
def test_a_block_that_lands_with_less_spin_than_counts_slides_on(slip, kept, bounce, left):
    b, place = setting_of(0.4), [0.2, math.cos(0.4), 0.0]
    state = run_at([*place, slip, bounce, 3e-8]).state
    v = contacts.slip_velocity(b, state.motion) if kept else 0.0
    strike._settle_flat(b, state, settle.SETTLE)
    assert six(state.motion).tolist() == [*place, v, left, 0.0]
    assert state.rules[Rule.SETTLES] == 1
    assert state.rules.sum() == 1


def struck_at(times) -> tuple[list[float], np.void]:
    """The settling speed as impacts at these times find it, and the state after them."""
    state, speeds = run_at().state, []
    for state.t in times:
        speeds.append(settle.settling_speed(state))
    return speeds, state


def test_the_settling_speed_rises_as_impacts_accumulate():
    times = 2.5e-7 * np.arange(1, 50_101)
    speeds, state = struck_at([*times, *(times[-1] + [0.024, 0.024 + 0.026])])
    rises = [k + 1 for k in range(1, 50_100) if speeds[k] != speeds[k - 1]]
    assert rises == [100, 200, 300, 400, 500, 50_000]
    np.testing.assert_allclose(
        [speeds[0], *(speeds[k - 1] for k in rises)], [5e-8, 5e-7, 5e-6, 5e-5, 5e-4, 2.5e-3, np.inf]
    )
    assert state.rules[Rule.RATTLES] == 501
    assert speeds[-2:] == [np.inf, 5e-8]
    # As many in a longer time are no rattle.
    assert set(struck_at(3e-4 * np.arange(300))[0]) == {5e-8}


def test_impacts_at_one_instant_end_plastic():
    speeds, state = struck_at([1.0] * 21 + [1.001])
    # The first, and twenty more at its instant.
    assert speeds == [5e-8] * 20 + [np.inf, 5e-8]
    assert state.rules[Rule.ENDLESS_STAGES] == 1


@pytest.mark.parametrize("case", [1, -1], ids=["tip wall", "far wall"])
def test_the_corner_of_a_loaded_block_leaves_as_newton_says(case):
    """In the world: the corner that strikes leaves with -e times its approach, the pivot stays on
    the floor, and an impact that adds energy is counted, with its share."""
    rng, gains, bounces = np.random.default_rng(3), 0, {1: 1.0, -1: 0.6}
    walls = [
        Wall(side=side, gap=5.0, restitution=bounces[sign])
        for side, sign in (("left", 1), ("right", -1))
    ]
    for _ in range(60):
        scene = random_scene(rng).replace(walls=walls)
        b = natural.setting_of(scene, EventBasedModel())
        sense, tilt, w = int(rng.choice([-1, 1])), rng.uniform(0.2, 0.9), rng.uniform(-1.0, 1.0)
        block, wall = scene.block, sense * case
        theta = sense * tilt * block.pivot("left" if sense > 0 else "right").alpha
        pivot, corner = np.array(places(block, theta, sense, case)) / block.radius
        vx = w * corner[1] - wall * rng.uniform(0.1, 1.0)  # it approaches
        start = [0.0, -pivot[1], theta, vx, -w * pivot[0], w]
        state = run_at(start, **ROCKS, sense=sense).state
        z, before = state.motion, vx - w * corner[1]
        energy = vx**2 + start[4] ** 2 + w * w / b.spin
        strike._wall_impact(b, state, case > 0, 1e-9)
        assert z.vx - z.w * corner[1] == pytest.approx(-bounces[wall] * before, abs=1e-12)
        assert z.vy + z.w * pivot[0] == pytest.approx(0.0, abs=1e-12)
        assert state.largest_gain == pytest.approx(
            max((z.vx**2 + z.vy**2 + z.w**2 / b.spin) / energy - 1.0, 0.0), abs=1e-11
        )
        gains += state.gains
    assert 0 < gains < 60


@pytest.mark.parametrize(("guard", "wall"), [(Guard.TIP_GAP, 1), (Guard.FAR_GAP, -1)])
def test_the_corner_whose_gap_closes_rebounds(guard, wall):
    """The top one on the side to which the block tips, left, or the bottom one on the other."""
    touches = math.sin(0.5) - math.sin(0.4)
    walls = [
        Wall(side="left", gap=touches if wall > 0 else 0.3, restitution=0.5),
        Wall(side="right", gap=touches if wall < 0 else 0.3, restitution=0.5),
    ]
    block, still = setting_of(0.4, walls=walls, pivot="bilateral"), ground_of(Rest(), 1.0, 1.0)
    slides = TILTED | {"sense": 1, "pivot": Pivot.SLIPPING, "slip": -wall}
    run = run_at((0.0, math.cos(0.3), 0.1, -0.2 * wall, 0.0, 0.0), **slides)
    run.state.guard, upward = guard, wall * math.cos(0.5)
    strike.strike(block, Base(still, still), run, 1e-9)
    motion, side = run.state.motion, 0 if wall > 0 else 1
    assert motion.vx - upward * motion.w == pytest.approx(0.1 * wall, abs=1e-12)
    assert run.state.wall_impulse[side] > 0.0
    assert run.state.wall_impulse[1 - side] == 0.0
    # The floor's impulse, all that is vertical, counts with the wall's.
    assert run.state.impulse == pytest.approx(run.state.wall_impulse[side] + abs(motion.vy))


@pytest.mark.parametrize(("spin", "flat"), [(0.0, 1), (0.1, 1), (0.3, 0), (-0.3, 0)])
def test_a_block_lands_flat_where_both_corners_come_down(spin, flat):
    """At 0.1, and at 0.39 times the spin less and more."""
    block, still = setting_of(0.4), ground_of(Rest(), 1.0, 1.0)
    run = run_at((0.0, math.cos(0.4), 0.0, 0.0, -0.1, spin), **FLAT, pivot=Pivot.OFF)
    run.state.guard = Guard.LANDING
    strike.strike(block, Base(still, still), run, 1e-9)
    assert run.state.rules[Rule.FLAT_LANDING] == flat


@pytest.mark.parametrize("sense", [1, -1])
def test_a_pivot_that_stands_lands_on_the_floor_and_gains_nothing_from_an_elastic_wall(sense):
    walls = [Wall(side=side, gap=5.0, restitution=1.0) for side in ("left", "right")]
    b = setting_of(0.4, walls=walls, pivot="bilateral", friction="no-slip")
    for w in sense * np.linspace(0.01, 1.0, 50):
        s, c = math.sin(0.3), math.cos(0.3)
        struck = run_at([0.0, c, 0.1 * sense, -c * w, sense * s * w, w], **ROCKS, sense=sense).state
        strike._wall_impact(b, struck, True, 1e-9)
        assert struck.motion.w == pytest.approx(-w)
        assert struck.gains == 0
        landed = run_at([0.0, math.cos(0.4), 0.0, 0.0, 0.0, -w], **ROCKS, sense=sense).state
        strike._floor_impact(b, landed, 1e-9)
        assert landed.motion.vy == -sense * math.sin(0.4) * landed.motion.w != 0.0


@pytest.mark.parametrize("slip", [0.3, -0.3])
@pytest.mark.parametrize("sense", [1, -1])
def test_a_block_that_lands_flush_with_a_wall_is_thrown_back(sense, slip):
    """By the wall toward which it would rock: its spin, and its slip where that is toward the
    wall, too."""
    side, c, w, e = "right" if sense > 0 else "left", math.cos(0.4), -0.2 * sense, 0.6
    b = setting_of(0.4, walls=[Wall(side=side, gap=0.0, restitution=e)], pivot="bilateral")
    state = run_at([0.0, c, 0.0, slip - c * w, 0.0, w], **ROCKS, sense=sense).state
    strike._floor_impact(b, state, 1e-9)
    z, s = state.motion, math.sin(0.4)
    assert float(state.known) == pytest.approx(0.0)
    assert z.w == pytest.approx(-e * w)
    assert z.vx + c * z.w == pytest.approx(-e * slip if sense * slip > 0.0 else slip)
    assert z.vy == pytest.approx(-sense * s * e * w)
    assert state.impulse == pytest.approx((1.0 + e) * s * 0.2)


@pytest.mark.parametrize(("gap", "leans"), [(0.3, True), (0.0, False)])
def test_nothing_rebounds_between_two_walls(gap, leans):
    """A block that leans on one wall as it strikes the other, and one that fills the room."""
    walls = tuple(Wall(side=side, gap=gap, restitution=0.9) for side in ("left", "right"))
    b = setting_of(0.4, walls=walls, pivot="bilateral")
    mode = {"family": Family.TILT if leans else Family.FLAT, "sense": 1, "tip": leans}
    state = run_at([0.0, math.cos(0.4), 0.1 * leans, -0.3, 0.1, 0.2], **mode).state
    strike._wall_impact(b, state, False, 1e-9)
    wedged = state.rules[Rule.WEDGED], state.rules.sum(), state.impulse
    assert wedged == (1, 1, 0.3)
    assert not state.known
    assert six(state.motion)[3:].tolist() == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("tilt", [9e-11, -9e-11])
def test_a_tilt_of_rounding_is_set_upright_about_its_pivot(tilt):
    """The lower corner keeps its height, and its slip if that is more than rounding."""
    block = setting_of(PAPER_BLOCK)
    motion = run_at((0.0, 0.9, tilt, 0.01, 0.0, 9e-10)).state.motion
    height, slip = contacts.floor_gap(block, motion), contacts.slip_velocity(block, motion)
    contacts.upright(block, motion)
    assert motion.theta == 0.0
    assert motion.w == 0.0
    assert motion.vx == slip
    assert contacts.floor_gap(block, motion) == pytest.approx(height, abs=1e-15)


@pytest.mark.parametrize(
    ("gap", "rate", "seen"),
    [
        (9e-11, -9e-10, (0.0, 0.0)),
        (-9e-11, -9e-10, (0.0, 0.0)),
        (9e-11, -2e-9, (9e-11, -2e-9)),
        (-9e-11, -2e-9, (0.0, -2e-9)),
        (9e-11, 0.0, (9e-11, 0.0)),
        (-9e-11, 1.0, (0.0, 1.0)),
        (2e-10, -9e-10, (2e-10, -9e-10)),
    ],
)
def test_a_gap_that_is_closed_to_rounding(gap, rate, seen):
    """It rests where it closes slowly, and has no depth where it is let go."""
    assert contacts.closed_gap(gap, rate) == seen


@pytest.mark.parametrize(("side", "sign"), [("left", -1.0), ("right", 1.0)])
def test_a_flying_block_that_turns_flush_against_a_wall_strikes_no_floor(side, sign):
    """In the air its upper corner strikes, then its lower one as the block passes upright."""
    scene = Scene(
        name="flies",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.3),
        walls=[Wall(side=side, gap=0.1, restitution=0.0)],
        initial_height=0.5,
        initial_rotation=0.02 * sign,
        initial_velocity=sign,
        duration=0.3,
    )
    history = EventBasedModel(pivot="unilateral").simulate(scene)
    strikes = history.extremes.walls[side].strikes
    assert strikes == 3
    assert [event.kind for event in history.event_list] == ["wall impact"] * strikes


def test_a_flying_block_that_turns_upright_where_it_touches_is_put_onto_the_floor():
    """Its lower corner is on the floor to rounding, and at rest."""
    block, still = setting_of(0.4), ground_of(Rest(), 1.0, 1.0)
    place = (0.0, math.cos(0.4) + 5e-11, 0.0, 0.0, 0.3 * math.sin(0.4), -0.3)
    run = run_at(place, **TILTED, sense=1, pivot=Pivot.OFF)
    run.state.guard = Guard.PHI
    strike.strike(block, Base(still, still), run, 1e-9)
    assert run.state.motion.y == math.cos(0.4)
