"""What the invariants of the stress study say of histories that are made up."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_histories import BLOCK, STANDS, G, history

from rockcheck import Block, EventBasedModel, Floor, Record, Ricker, Wall
from rockcheck.scenes.history import Cost
from rockcheck.validation.studies.stress import checks
from rockcheck.validation.studies.stress.checks import audited, check_run
from rockcheck.validation.studies.stress.conditions import conditions
from rockcheck.validation.studies.stress.energy import energy_error, energy_without_source
from rockcheck.validation.studies.stress.forces import tilted_forces
from rockcheck.validation.studies.stress.horizon import Horizon, disturbed
from rockcheck.validation.studies.stress.invariants import INVARIANTS, CheckedRun
from rockcheck.validation.studies.stress.motion import Motion


def model(*histories, pivot="bilateral", friction="coulomb", energy_cap=False):
    """A model whose runs have these histories, one after another."""
    left = list(histories)
    return SimpleNamespace(
        pivot=pivot,
        friction=friction,
        energy_cap=energy_cap,
        simulate=lambda scene: left.pop(0),
    )


# --- conditions on the rows


def pushed(friction, u, rows=(0.1, 0.2)):
    """Coulomb's figure of a block that stands while its base accelerates by u g."""
    scene = STANDS.replace(
        floor=Floor(friction=friction), excitation=Record.from_samples([u * G, u * G], 1.0)
    )
    return conditions(model(), Motion(scene, history(rows)))["coulomb"]


def test_friction_beyond_the_cone_is_told_of_the_acceleration_at_play():
    assert pushed(0.1, 0.2) == pytest.approx((0.2 - 0.1) / (1.0 + 0.2 + 1.0))
    assert pushed(0.21, 0.2) == 0.0


def test_a_block_that_should_tip_does_not_stand():
    slope = BLOCK.half_width / BLOCK.half_height
    assert pushed(5.0, slope + 0.1) == pytest.approx(0.1 / (2.0 + slope + 0.1))


def test_a_base_that_jumps_is_not_judged_where_it_jumps():
    """At its first sample, and at its last one, with which it ends."""
    assert pushed(0.1, 0.2, rows=(0.0, 1.0)) == 0.0


@pytest.mark.parametrize(("u", "stands"), [(0.3, False), (-0.3, True)])
def test_a_base_that_accelerates_to_the_right_tips_a_block_to_the_left(u, stands):
    """Whose mass lies near its left side: that slope is 0.2, and the other one 0.4."""
    loaded = Block(half_width=0.3, half_height=1.0, centre_of_mass=(-0.1, 0.0))
    scene = STANDS.replace(
        block=loaded,
        floor=Floor(friction=1.0),
        excitation=Record.from_samples([u * G, u * G], 1.0),
    )
    rows = history([0.1, 0.2], y=loaded.half_height)
    assert (conditions(model(), Motion(scene, rows))["coulomb"] == 0.0) == stands


@pytest.mark.parametrize(
    ("near", "off", "judged"),
    [
        *((1e4, off, False) for off in (0.0, 5e-9, -5e-9)),
        *((1e4, off, True) for off in (2e-7, -2e-7)),
        *((400.0, off, False) for off in (5e-10, -5e-10)),
        *((400.0, off, True) for off in (1e-9, -1e-9)),
    ],
)
def test_a_row_is_judged_unless_it_is_as_near_to_an_event_as_can_be_told(near, off, judged):
    """By rounding of its time, and in a billionth of the block's."""
    scene = STANDS.replace(
        floor=Floor(friction=0.1),
        duration=2e4,
        excitation=Record.from_samples([0.2 * G, 0.2 * G], 2e4),
    )
    rows = history([0.0, near + off], events=[(near, "floor impact")])
    assert (conditions(model(), Motion(scene, rows))["coulomb"] > 0.0) == judged


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tilted_block_that_stands_on_too_little_friction(sign):
    """It starts from a tilt: its centroid is lowered, and drawn back, by what turns it upright."""
    pivot = BLOCK.pivot("left")
    s, c = (pivot.radius * f(pivot.alpha - 0.1) for f in (math.sin, math.cos))
    spin = -s / (BLOCK.gyration_squared + pivot.radius**2)
    lift, pull = 1.0 + s * spin, -c * spin
    scene = STANDS.replace(floor=Floor(friction=0.01))
    rows = history([0.1, 0.2], mode="rock", theta=sign * 0.1, x=-sign * (BLOCK.half_width - s), y=c)
    found = conditions(model(), Motion(scene, rows))
    assert found["coulomb"] == pytest.approx((pull - 0.01 * lift) / 2.0, rel=1e-6)


# --- one run


def figure(name, *histories, scene=STANDS, **settings):
    return check_run(model(*histories, **settings), scene, only=name).figures[name]


ROWS = STANDS.output_times


def test_a_run_that_stands_contradicts_nothing():
    assert figure("outcome", history(ROWS)) == 0.0


def test_an_event_at_the_very_end_is_in_order():
    assert figure("outcome", history(ROWS, events=[(0.4, "floor impact")])) == 0.0
    assert figure("outcome", history(ROWS, events=[(0.401, "floor impact")])) == 1.0


@pytest.mark.parametrize(("theta", "contradicts"), [(1.5, 0.0), (1.6, 1.0)])
def test_a_block_that_has_not_fallen_is_within_a_right_angle(theta, contradicts):
    assert figure("outcome", history(ROWS, theta=theta)) == contradicts


@pytest.mark.parametrize(("restitution", "gain"), [(0.0, 0.1), (0.5, 0.0)])
def test_an_impact_that_adds_energy_is_a_fault_where_nothing_bounces(restitution, gain):
    scene = STANDS.replace(walls=[Wall(side="left", gap=0.5, restitution=restitution)])
    cost = Cost(energy_gains=1, largest_energy_gain=0.1)
    gained = figure("impacts", history(ROWS, cost=cost), scene=scene, pivot="unilateral")
    assert gained == gain


def test_a_mirror_image_with_another_end_is_noticed():
    fallen = history(ROWS, events=[(0.4, "overturned left")], outcome="overturned left")
    image = history(ROWS, events=[(0.4, "overturned right")], outcome="overturned right")
    assert figure("mirror", fallen, image) == 0.0
    stands = dataclasses.replace(image, outcome="at rest", model_extremes=image.extremes)
    assert figure("mirror", fallen, stands) == 1.0


def test_a_block_that_leans_and_hardly_moves_is_not_judged_by_a_wall_within_its_reach():
    model = EventBasedModel(pivot="unilateral")
    balanced = STANDS.replace(initial_rotation=BLOCK.alpha, floor=Floor(friction=0.6))
    assert check_run(model, balanced, seed=1, audit=True).figures["clearance"] == 0.0


def test_the_whole_run_goes_on_three_hundred_natural_units_after_the_base(monkeypatch):
    played = []
    plain = checks.batch.run_batch

    def run_batch(given, *rest, **how):
        played.append(float(given.given["duration"][0]))
        return plain(given, *rest, **how)

    monkeypatch.setattr(checks.batch, "run_batch", run_batch)
    base = Record.from_samples([0.1, 0.0, 0.0], 3.0)
    check_run(EventBasedModel(), STANDS.replace(excitation=base, duration=2.0), audit=True)
    unit = math.sqrt(BLOCK.radius / G)
    assert played == pytest.approx([6.0 / unit + 300.0] * 2)


def test_an_audited_run_has_rows_for_the_block_and_for_a_pulse():
    """Some thirty in sqrt(R/g), 64 in a quick pulse's period, eight between two samples."""
    unit = math.sqrt(BLOCK.radius / G)
    assert audited(STANDS).output_step == pytest.approx(0.03 * unit)
    quick = STANDS.replace(excitation=Ricker(amplitude=1.0, period=0.2))
    assert audited(quick).output_step == pytest.approx(0.2 / 64)
    recorded = STANDS.replace(excitation=Record.from_samples([0.0, 1.0, 0.0], 0.05))
    assert audited(recorded).output_step == pytest.approx(0.05 / 8)


#: The least that must be noticed of each invariant.
LEAST = {
    **dict.fromkeys(
        ("ends", "finite", "outcome", "mirror", "clearance", "fate", "ties", "storey"), 1.0
    ),
    **dict.fromkeys(("penetration", "floor", "stick", "energy", "extremes", "rows"), 3e-9),
    **dict.fromkeys(("coulomb", "push"), 3e-7),
    **dict.fromkeys(("similarity", "tolerance", "decided"), 3e-6),
    **{"impacts": 1e-15, "unseen": 1.5, "depth": 1.5, "source": 0.06},
}


@pytest.mark.parametrize("name", INVARIANTS)
def test_the_least_fault_of_each_kind_is_noticed(name):
    assert CheckedRun(figures={name: LEAST[name]}).broken == [name]
    assert CheckedRun(figures={name: math.nan}).broken == [name]
    assert CheckedRun(figures={name: 0.0}).broken == []


# --- a motion as the invariants see it


def tilting(theta, **columns):
    """A motion with these rotations, a row each 0.1 s."""
    return Motion(STANDS, history(0.1 * np.arange(len(theta)), theta=np.array(theta), **columns))


def test_a_block_that_stands_has_the_pivot_of_the_next_row():
    assert list(tilting([0.1, 0.0, -0.1, 0.0, 0.1, 0.0, -0.1]).sign) == [1, -1, -1, 1, 1, -1, -1]
    assert list(tilting([-0.1, 0.0]).sign) == [-1, 1]


def test_a_block_that_stands_at_a_wall_touches_it_with_its_top():
    scene = STANDS.replace(walls=[Wall(side="left", gap=0.0)])
    motion = Motion(scene, history(ROWS))
    assert motion.tip.all()
    assert not motion.far.any()


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_forces_a_little_later_or_of_a_faster_block(sign):
    def forces(theta, w, **how):
        unit = math.sqrt(BLOCK.radius / G)
        motion = tilting([sign * theta] * 2, theta_dot=sign * w / unit, mode="rock")
        return motion.forces(motion.within("rock"), np.zeros(2), **how)[0]

    assert forces(0.1, 0.5, later=0.02) == pytest.approx(forces(0.11, 0.5))
    assert forces(0.1, 0.5, faster=0.02) == pytest.approx(forces(0.1, 0.52))


# --- forces


def by_newton_euler(block, phi, mu, w, u, touching, friction):
    """P, Q, N, M of a block tilted to the left whose pivot has Q = `friction` mu P, in units of its
    radius: from the accelerations of the corners that touch."""
    (dx, dz), b, h = block.offset, block.half_width, block.half_height
    turned = np.array([[math.cos(phi), -math.sin(phi)], [math.sin(phi), math.cos(phi)]])
    corners = [(-b - dx, -h - dz), (-b - dx, h - dz), (b - dx, -h - dz)]
    low, top, other = (turned @ np.array(corner) / block.radius for corner in corners)
    inertia = block.gyration_squared / block.radius**2
    _, tip, far = touching
    # unknown: the accelerations of the mass and of the rotation, P, N, M
    rows = [
        [1, 0, 0, -friction * mu, -1, 1],
        [0, 1, 0, -1, 0, 0],
        [0, 0, inertia, low[1] * friction * mu - low[0], top[1], -other[1]],
        [0, 1, low[0], 0, 0, 0],
        [1, 0, -top[1], 0, 0, 0] if tip else [0, 0, 0, 0, 1, 0],
        [1, 0, -other[1], 0, 0, 0] if far else [0, 0, 0, 0, 0, 1],
    ]
    right = [-u, -1, 0, w * w * low[1], tip * w * w * top[0], far * w * w * other[0]]
    *_, push, tip_force, far_force = np.linalg.solve(np.array(rows, float), np.array(right))
    # A wall that is not touched pushes with zero, not with what rounding leaves of it.
    return push, friction * mu * push, tip * tip_force, far * far_force


@pytest.mark.parametrize("touching", [(True, *walls) for walls in ((0, 0), (1, 0), (0, 1))])
def test_a_pivot_slips_against_its_friction_and_pulls_where_walls_push_with_it_alone(touching):
    """Of two signs of the floor's push both can be right near Painleve's limit."""
    block = Block(half_width=0.5, half_height=0.8, centre_of_mass=(0.1, -0.2))
    r = np.random.default_rng(2)
    count = 300
    phi, w, u = r.uniform(0.0, 1.2, count), r.uniform(-1.5, 1.5, count), r.uniform(-1, 1, count)
    slip = r.choice([-1, 1], count).astype(np.int8)
    mu = 3.0
    closed = tuple(np.full(count, bool(one)) for one in touching)
    felt = u, np.ones(count)
    found, _ = tilted_forces(block, (np.ones(count), phi), mu, w, felt, closed, slip)
    pulling = 0
    for k in range(count):
        push, pull = (
            by_newton_euler(block, phi[k], mu, w[k], u[k], touching, sign * slip[k])
            for sign in (-1.0, 1.0)
        )
        pushes, pulls = push[0] >= 0.0, pull[0] < 0.0
        if pulls and (not pushes or (min(push[2:]) < 0.0 <= min(pull[2:]))):
            pulling += 1
            assert found[:, k] == pytest.approx(pull, rel=1e-6, abs=1e-9)
        elif pushes:
            assert found[:, k] == pytest.approx(push, rel=1e-6, abs=1e-9)
    assert 0 < pulling < count


# --- energy

STEP = 0.01


def gaining(gain, *, until=16, events=(), **columns):
    """A block that is pushed by nothing, and gains a kinetic energy of `gain` (J/kg) each step."""
    rows = np.arange(17.0)
    speed = np.sqrt(2.0 * gain * np.minimum(rows, until))
    return history(STEP * rows, x_dot=speed, mode="flight", events=events, **columns)


DENSE = STANDS.replace(duration=16 * STEP, output_step=STEP)


def test_energy_that_comes_from_nowhere_is_told_of_that_at_play():
    motion = Motion(DENSE, gaining(0.2))
    at_play = G * BLOCK.radius + motion.energy[8]
    assert energy_error(EventBasedModel(), motion) == pytest.approx(8 * 0.2 / at_play)


def test_a_group_of_rows_is_judged_that_ends_a_little_before_an_event():
    """By a hundred-thousandth of a step."""
    event = [((8.0 + 1e-5) * STEP, "floor impact")]
    motion = Motion(DENSE, gaining(0.2, until=8, events=event))
    assert energy_error(EventBasedModel(), motion) > 1e-3


@pytest.mark.parametrize("size", [0.01, 1.0])
def test_the_spring_of_friction_holds_what_the_floor_s_push_lets_it(size):
    """Of a block that falls by its weight: of thrice its weight, and a hundredth of its radius."""
    block = Block(half_width=0.3, half_height=1.0).scaled(size)
    step = math.sqrt(size) * STEP
    scene = DENSE.replace(block=block, output_step=step, duration=16 * step)
    t = step * np.arange(17.0)
    falling = {"y": block.half_height - 0.5 * G * t**2, "y_dot": -G * t}
    rows = dataclasses.replace(
        history(t, mode="flight", x_dot=10.0 * np.sqrt(size * t), **falling), block=block
    )
    motion = Motion(scene, rows)
    held = scene.floor.friction * 0.01 * 3.0
    gain = 50.0 * size * 8 * step / (G * block.radius)
    model = EventBasedModel(friction="bouc-wen", yield_displacement=0.01 * block.radius)
    energy = motion.energy[8] / (G * block.radius)
    assert gain > held
    assert energy_error(model, motion) == pytest.approx((gain - held) / (1.0 + energy))


def test_energy_without_source_is_told_of_that_at_the_start_and_of_the_weight():
    rows = gaining(0.2, y_dot=10.0)
    start = 0.5 * 10.0**2
    gained = energy_without_source(Motion(DENSE, rows))
    assert gained == pytest.approx(16 * 0.2 / (G * BLOCK.radius + start))


# --- the horizon of predictability

LOADED = STANDS.replace(
    block=Block(half_width=0.4, half_height=1.2, centre_of_mass=(0.1, -0.3)),
    floor=Floor(friction=0.25, restitution=1.0),
    walls=[Wall(side="left", gap=0.5)],
)


def changes(scene):
    """By how much each disturbed scene differs, in its half width, gap and friction."""

    def data(one):
        return np.array([one.block.half_width, one.walls[0].gap, one.floor.friction])

    return np.array([data(one) / data(scene) - 1.0 for one in disturbed(scene, 3)])


def test_every_other_scene_is_disturbed_to_the_other_side():
    off = changes(LOADED)
    assert off[0::2] == pytest.approx(-off[1::2], rel=1e-6)


def test_data_are_disturbed_each_by_itself():
    off = changes(LOADED)
    assert len(off) == 6
    assert np.any(np.sign(off[:, 0]) != np.sign(off[:, 1]))


class Repeats:
    """A model whose runs have all the same history; keeps the tolerances that it is asked for."""

    pivot, friction = "bilateral", "coulomb"

    def __init__(self, played):
        self.played, self.tolerances = played, []

    def simulate(self, scene):
        return self.played

    def model_copy(self, update):
        self.tolerances.append(update["tolerance"])
        return self


def test_the_horizon_is_that_of_answers_at_the_finest_tolerances():
    model = Repeats(history(ROWS))
    assert Horizon(model, Motion(STANDS, model.played), 0).row == len(ROWS)
    assert max(model.tolerances) < 2e-11
    assert max(model.tolerances) / min(model.tolerances) >= 99.0


@pytest.mark.parametrize(("turns", "row"), [(-1.0, 12), (1.0, 41)])
def test_the_horizon_is_where_sliding_friction_lets_rounding_grow(turns, row):
    """Near Painleve's limit at a rate of 62 w, where w grows by 1.25 t: to 5e3 in 0.47 sqrt(R/g),
    which is the twelfth row. Of a block that turns the other way it decays."""
    block = Block(half_width=0.5, half_height=0.87)
    unit = math.sqrt(block.radius / G)
    scene = STANDS.replace(block=block, floor=Floor(friction=1.3), duration=4.0)
    spins = np.append(np.minimum(0.05 * np.arange(40.0), 0.8), 0.0)
    rows = history(
        0.04 * np.arange(41.0) * unit,
        mode="slide-rock",
        theta=0.01,
        theta_dot=turns * spins / unit,
        slip_rate=-1.0,
    )
    assert Horizon(Repeats(rows), Motion(scene, rows), 0).row == row
