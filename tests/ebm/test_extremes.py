"""Extremes of a run as the event core keeps them, against rows so dense that they hide little."""

import math

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.fates import Keep, play_fates
from rockcheck.scenes import (
    PAPER_BLOCK,
    Floor,
    InputError,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
    kinematics,
)
from tests.ebm.cases import free_rocking, pulse_scene, random_scene
from tests.ebm.test_fates import pulses_beside_walls, table_of

#: Time between dense rows, s.
DENSE = 5e-5
MODELS = {
    "bilateral": EventBasedModel(),
    "unilateral": EventBasedModel(pivot="unilateral"),
    "floor-first": EventBasedModel(pivot="unilateral", impacts="floor-first"),
    "no-slip": EventBasedModel(friction="no-slip"),
    "bouc-wen": EventBasedModel(friction="bouc-wen"),
}
SIDES = {"left": 1.0, "right": -1.0}


def any_scene(rng: np.random.Generator, model: EventBasedModel) -> Scene:
    """A loaded block, perhaps beside walls, under a pulse or a record, or thrown."""
    while True:
        scene = random_scene(rng).replace(duration=2.5)
        slope = scene.gravity * scene.block.slope
        kind = rng.integers(4)
        if kind == 1:
            noise = slope * np.cumsum(rng.normal(size=150)) * 0.3
            scene = scene.replace(excitation=Record.from_samples(noise, 0.01))
        elif kind == 2:
            scene = scene.replace(
                excitation=Sine(amplitude=2.0 * slope, period=0.8, cycles=2),
                vertical=Ricker(amplitude=5.0, period=0.4),
            )
        elif kind == 3:
            thrown = rng.uniform(-1.0, 1.0, 3)
            try:
                scene = scene.replace(
                    excitation=Rest(),
                    initial_rotation=thrown[0] * scene.block.alpha,
                    initial_angular_velocity=0.5 * thrown[1],
                    initial_velocity=0.0 if model.friction == "no-slip" else thrown[2],
                )
            except InputError:  # inside a wall
                continue
        if model.pivot == "unilateral" and rng.uniform() < 0.3:
            scene = scene.replace(floor=Floor(friction=scene.floor.friction, restitution=0.3))
        return scene


def figures(scene: Scene, channels) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Of each extreme what it is the largest of, a value a row, and the rates of that."""
    block, x, theta = scene.block, channels["x"], channels["theta"]
    x_dot, theta_dot = channels["x_dot"], channels["theta_dot"]
    found = {"slip": (np.abs(channels["slip"]), channels["slip_rate"])}
    tops = []
    for side, sign in SIDES.items():
        bottom, top = kinematics.side_corners(block, side, 0.0, x, theta, x_dot, theta_dot)
        found[f"rotation_{side}"] = np.maximum(sign * theta, 0.0), theta_dot
        reach = np.maximum(np.maximum(-bottom[0], -top[0]), 0.0)
        found[f"reach_{side}"] = reach, np.append(bottom[1], top[1])
        tops.append((np.abs(top[0] - top[0][0]), top[1]))
    found["top_displacement"] = np.maximum(tops[0][0], tops[1][0]), np.append(*(r for _, r in tops))
    height = kinematics.pivot_height(block, channels["y"], theta)
    size = block.half_diagonal * np.abs(theta_dot)
    found["hop"] = np.maximum(height, 0.0), np.abs(channels["y_dot"]) + size
    return found


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize("seed", range(22))
def test_extremes_are_those_of_dense_rows(name, seed):
    """None is below a row, and none is above the rows by more than one moves until the next."""
    model = MODELS[name]
    scene = any_scene(np.random.default_rng([seed, 17]), model)
    history = model.simulate(scene.replace(output_step=DENSE))
    fell = history.outcome.removeprefix("overturned ")
    for key, (values, rates) in figures(scene, history.channels).items():
        if fell in SIDES and key != "slip" and key != f"rotation_{fell}":
            rates = 10.0 * rates  # what it does as it comes to lie, after its last row
        extreme = getattr(history.extremes, key)
        assert extreme >= np.max(values) - 1e-10, key
        if key != f"rotation_{fell}":
            assert extreme <= np.max(values) + 1.01 * DENSE * np.max(np.abs(rates)) + 1e-9, key


@pytest.mark.parametrize("name", MODELS)
def test_extremes_do_not_depend_on_the_output_step(name):
    model = MODELS[name]
    for seed in range(8):
        scene = any_scene(np.random.default_rng([seed, 5]), model)
        coarse, middle, fine = (
            model.simulate(scene.replace(output_step=step)).extremes for step in (0.02, 0.005, 1e-3)
        )
        assert coarse == middle
        assert middle == fine


@pytest.mark.parametrize("name", MODELS)
def test_a_mirror_image_exchanges_the_sides_to_the_bit(name):
    model = MODELS[name]
    for seed in range(8):
        scene = any_scene(np.random.default_rng([seed, 6]), model)
        one = vars(model.simulate(scene).extremes)
        other = vars(model.simulate(scene.mirrored()).extremes)
        for key, value in one.items():
            swapped = key.replace("left", "LEFT").replace("right", "left").replace("LEFT", "right")
            mirrored = other[swapped]
            if key == "walls":
                mirrored = {
                    {"left": "right", "right": "left"}[side]: at for side, at in mirrored.items()
                }
            if key == "last_slip":
                mirrored = -mirrored
            assert mirrored == value, key


def test_extremes_scale_with_the_block():
    """Four times as large, all takes twice as long; speeds double."""
    small = pulse_scene(1.3, 3.0, 0.4, ("left", 0.05, 0.5))
    large = small.replace(
        block=small.block.scaled(4.0),
        walls=[wall.replace(gap=4.0 * wall.gap) for wall in small.walls],
        excitation=small.excitation.stretched(2.0),
        duration=2.0 * small.duration,
    )
    model = MODELS["unilateral"]
    one, other = model.simulate(small).extremes, model.simulate(large).extremes
    wall, same = one.walls["left"], other.walls["left"]
    assert wall.strikes == same.strikes > 0
    assert other.rotation_left == pytest.approx(one.rotation_left, rel=1e-8)
    assert other.slip == pytest.approx(4.0 * one.slip, rel=1e-8)
    assert other.reach_right == pytest.approx(4.0 * one.reach_right, rel=1e-8)
    assert other.hop == pytest.approx(4.0 * one.hop, rel=1e-7)
    assert same.speed == pytest.approx(2.0 * wall.speed, rel=1e-8)
    assert same.impulse == pytest.approx(2.0 * wall.impulse, rel=1e-8)
    assert same.first_s == pytest.approx(2.0 * wall.first_s, rel=1e-8)


def test_a_block_released_from_a_tilt_turns_as_far_on_the_other_side_as_an_impact_leaves_it():
    """Housner's ratio of energies, (1 - 1.5 sin^2 alpha)^2, and the place of its corners."""
    scene = free_rocking(0.5)
    extremes, alpha = MODELS["bilateral"].simulate(scene).extremes, scene.block.alpha
    rest = (1.0 - 1.5 * math.sin(alpha) ** 2) ** 2
    lifted = math.cos(0.5 * alpha) - math.cos(alpha)
    other_side = alpha - math.acos(math.cos(alpha) + rest * lifted)
    assert extremes.rotation_left == 0.5 * alpha
    assert extremes.rotation_left_s == 0.0
    assert extremes.rotation_right == pytest.approx(other_side, abs=1e-11)
    assert extremes.slip == pytest.approx(0.0, abs=1e-12)
    size = scene.block.half_diagonal
    reach = size * (math.sin(alpha + other_side) - math.sin(alpha - other_side))
    assert extremes.reach_right == pytest.approx(reach, abs=1e-11)


def test_a_flat_block_that_slides_into_a_wall_strikes_it_with_its_speed():
    """Its side is the corner: v^2 = v0^2 - 2 mu g gap; the wall takes (1 + e) v."""
    wall = Wall(side="right", gap=0.2, restitution=0.5)
    scene = free_rocking(0.0, initial_velocity=2.0, walls=(wall,), floor=Floor(friction=0.1))
    for model in (MODELS["bilateral"], MODELS["unilateral"]):
        extremes = model.simulate(scene).extremes
        speed = math.sqrt(4.0 - 2.0 * 0.1 * 9.81 * 0.2)
        struck = extremes.walls["right"]
        assert struck.strikes == 1
        assert struck.speed == pytest.approx(speed, rel=1e-9)
        assert struck.first_s == pytest.approx((2.0 - speed) / 0.981, rel=1e-9)
        assert extremes.reach_right == pytest.approx(0.2, abs=1e-9)
        back = (0.5 * speed) ** 2 / (2.0 * 0.1 * 9.81)
        assert extremes.slip == pytest.approx(back - 0.2, abs=1e-9)
        assert extremes.last_slip == pytest.approx(0.2 - back, abs=1e-9)
        assert extremes.first_slip_s == 0.0
        assert extremes.hop == 0.0


def test_the_impulse_of_a_wall_is_what_stops_a_flat_block():
    wall = Wall(side="right", gap=0.2, restitution=0.5)
    scene = free_rocking(0.0, initial_velocity=2.0, walls=(wall,), floor=Floor(friction=0.1))
    struck = MODELS["bilateral"].simulate(scene).extremes.walls["right"]
    assert struck.impulse == pytest.approx(1.5 * struck.speed, rel=1e-12)


def test_a_wall_takes_its_share_of_an_impulse_and_not_the_floor_s():
    """Of one strike the history tells the impulses of wall and floor together."""
    scene = pulse_scene(1.0, 1.0, 0.3, ("left", 0.053, 0.0)).replace(
        excitation=Ricker(amplitude=4.0, period=1.5), duration=2.79
    )
    history = MODELS["bilateral"].simulate(scene)
    (impact,) = (event for event in history.event_list if event.kind == "wall impact")
    struck = history.extremes.walls["left"]
    assert struck.first_s == impact.t
    assert 0.0 < struck.impulse < 0.99 * impact.impulse


def test_a_landing_flush_with_a_wall_strikes_it():
    """It tips off about its far corner and comes back: one landing, one strike, at both pivots."""
    wall = Wall(side="left", gap=0.0, restitution=0.0)
    scene = free_rocking(-0.5, walls=(wall,), duration=1.0)
    for model in (MODELS["bilateral"], MODELS["unilateral"]):
        struck = model.simulate(scene).extremes.walls["left"]
        assert struck.strikes >= 1
        assert struck.speed > 0.1
        assert struck.impulse > 0.1


def test_a_block_that_stands_has_no_extremes():
    extremes = MODELS["unilateral"].simulate(free_rocking(0.0)).extremes
    assert extremes.peak_rotation == 0.0
    assert extremes.reach_left == 0.0
    assert extremes.top_displacement == 0.0
    assert extremes.first_uplift_s is None
    assert extremes.first_slip_s is None


def test_uplift_and_slip_are_dated_by_their_events():
    scene = pulse_scene(1.0, 3.0, 0.3)
    history = MODELS["unilateral"].simulate(scene)
    first = {event.kind: event.t for event in reversed(history.event_list)}
    assert history.extremes.first_uplift_s == first["uplift"]
    assert history.extremes.first_slip_s <= first["slip"]


def test_a_block_that_overturns_has_turned_by_a_right_angle():
    scene = free_rocking(1.1)
    history = MODELS["no-slip"].simulate(scene)
    extremes, block = history.extremes, scene.block
    assert extremes.rotation_left == 0.5 * math.pi
    assert extremes.rotation_left_s == history.overturned_at
    assert extremes.reach_left == pytest.approx(2.0 * block.half_height, rel=1e-9)


@pytest.mark.parametrize("name", ["bilateral", "unilateral", "no-slip"])
def test_extremes_of_fates_are_those_of_long_histories(name):
    model, scenes = MODELS[name], [*pulses_beside_walls(25, 31)]
    rng = np.random.default_rng(8)
    scenes += [random_scene(rng) for _ in range(25)]
    fates = play_fates(table_of(scenes), model, keeps=Keep.EXTREMES)
    plain = play_fates(table_of(scenes), model)
    assert fates.extremes is not None
    np.testing.assert_array_equal(fates.overturned, plain.overturned)
    for row, scene in enumerate(scenes):
        whole = model.simulate(scene.replace(duration=90.0, output_step=1.0)).extremes
        for key in (
            *("rotation_left", "rotation_right", "slip", "reach_left", "reach_right"),
            *("top_displacement", "hop"),
        ):
            assert fates.extremes[key][row] == pytest.approx(getattr(whole, key), abs=1e-9), key
        assert fates.peak[row] == pytest.approx(whole.peak_rotation, abs=1e-12)
        for side in ("left", "right"):
            strikes = fates.extremes[f"wall_{side}_strikes"][row]
            assert math.isnan(strikes) == (side not in whole.walls)
        for side, wall in whole.walls.items():
            for key in ("speed", "impulse"):
                figure = fates.extremes[f"wall_{side}_{key}"][row]
                assert figure == pytest.approx(getattr(wall, key), abs=1e-9)


def test_extremes_of_a_block_that_bounces_are_those_of_its_whole_motion():
    """Each bounce may slip on: no energy says how far."""
    scenes = [
        free_rocking(tilt, floor=Floor(friction=friction, restitution=restitution))
        for tilt in (0.3, 0.6, 0.9)
        for friction in (0.15, 0.3, 0.6)
        for restitution in (0.3, 0.6, 0.8)
    ]
    model = MODELS["unilateral"]
    fates = play_fates(table_of(scenes), model, keeps=Keep.EXTREMES)
    assert fates.extremes is not None
    wholes = [
        model.simulate(scene.replace(duration=60.0, output_step=1.0)).extremes for scene in scenes
    ]
    slips = [whole.slip for whole in wholes]
    assert fates.extremes["slip"].tolist() == pytest.approx(slips, abs=1e-9)
    hops = [whole.hop for whole in wholes]
    assert fates.extremes["hop"].tolist() == pytest.approx(hops, abs=1e-9)


@pytest.mark.parametrize("name", ["bilateral", "unilateral", "no-slip"])
def test_strikes_kept_alone_are_those_among_the_extremes(name):
    model, scenes = MODELS[name], [*pulses_beside_walls(60, 37)]
    table = table_of(scenes)
    whole = play_fates(table, model, keeps=Keep.EXTREMES).extremes
    alone = play_fates(table, model, keeps=Keep.STRIKES).extremes
    assert whole is not None
    assert alone is not None
    assert set(alone) == {name for name in whole if name.startswith("wall_")}
    assert np.nansum(whole["wall_left_strikes"]) > 20
    for column, values in alone.items():
        np.testing.assert_array_equal(values, whole[column], err_msg=column)


def test_where_no_wall_is_in_reach_a_run_ends_before_the_block_rests():
    """What is left of its energy cannot take it to the wall, nor as far as it has been."""
    scene = free_rocking(0.7, walls=(Wall(side="left", gap=1.0),), duration=60.0)
    fates = play_fates(table_of([scene]), MODELS["unilateral"], keeps=Keep.EXTREMES)
    settled = MODELS["unilateral"].simulate(scene).event_list[-1].t
    assert fates.time_s[0] < 0.3 * settled


def test_blocks_of_the_paper_have_a_table_of_extremes_in_si_units():
    """Columns of a table are those of histories, whatever the units of a row."""
    scenes = [pulse_scene(1.3, 2.0, 0.4, block=PAPER_BLOCK.scaled(size)) for size in (0.5, 3.0)]
    fates = play_fates(table_of(scenes), MODELS["unilateral"], keeps=Keep.EXTREMES)
    assert fates.extremes is not None
    for row, scene in enumerate(scenes):
        whole = MODELS["unilateral"].simulate(scene.replace(duration=60.0)).extremes
        for key in ("slip", "reach_left", "rotation_left_s", "first_uplift_s"):
            assert fates.extremes[key][row] == pytest.approx(getattr(whole, key), rel=1e-9), key
