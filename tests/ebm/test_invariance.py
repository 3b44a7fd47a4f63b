"""Symmetry, similarity and limits: answers that follow from another run without any formula."""

import math

import numpy as np
import pytest
from cases import random_scene

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import (
    PAPER_BLOCK,
    Block,
    Floor,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
    kinematics,
    load_scene,
)
from rockcheck.validation.studies.stress.checks import check_run

PIVOTS = ["bilateral", "unilateral"]
SLOPE = 9.81 * math.tan(PAPER_BLOCK.alpha)
RICKER = Ricker(amplitude=4.0 * SLOPE, period=0.65)


#: A scene with what is changed in it.
scene_of = Scene(
    name="symmetry",
    block=PAPER_BLOCK,
    floor=Floor(friction=0.3),
    excitation=RICKER,
    duration=5.0,
).replace


def walls(left: float | None = None, right: float | None = None, e: float = 0.0) -> list[Wall]:
    return [
        Wall(side=side, gap=gap, restitution=e)
        for side, gap in (("left", left), ("right", right))
        if gap is not None
    ]


SCENES = {
    "no wall": scene_of(),
    "left wall": scene_of(walls=walls(left=0.053)),
    "elastic right wall": scene_of(walls=walls(right=0.103, e=1.0)),
    "both walls": scene_of(walls=walls(left=0.053, right=0.02, e=0.5)),
    "walls at no distance": scene_of(walls=walls(left=0.0, right=0.0)),
    "symmetric pulse": scene_of(
        excitation=Ricker(amplitude=3.0 * SLOPE, period=0.8, symmetric=True),
        walls=walls(left=0.1, e=0.5),
    ),
    "sine": scene_of(excitation=Sine(amplitude=2.0 * SLOPE, period=0.7, cycles=3)),
    "record": load_scene("fig5b").replace(duration=8.0),
    "vertical record": load_scene("fig4a").replace(
        vertical=load_scene("fig4b").excitation, duration=6.0
    ),
    "tilted": scene_of(
        excitation=Rest(),
        initial_rotation=0.7 * PAPER_BLOCK.alpha,
        initial_angular_velocity=0.1,
        initial_velocity=0.05,
    ),
    # Found by `rockcheck stress`: its mirror image differed in the last bit.
    "sliding between walls": scene_of(
        block=Block(half_width=0.45239232010061675, half_height=0.891819033612751),
        floor=Floor(friction=0.0772),
        walls=[
            Wall(side="left", gap=0.0, restitution=0.42153884661618235),
            Wall(side="right", gap=0.00013319196436825637, restitution=0.7813616),
        ],
        excitation=Rest(),
        initial_velocity=1.0375582304532138,
        duration=0.08,
        output_step=1e-3,
    ),
    # At rest, symmetric, and the floor falls away faster than g: the pivot that cannot let go has
    # no corner to choose.
    "hangs": scene_of(
        excitation=Rest(),
        vertical=Record.from_samples([0.0, -20.0, -20.0], time_step=0.1),
        duration=0.3,
        output_step=0.01,
    ),
    # Of loaded blocks the mass is exchanged, too.
    **{f"loaded {seed}": random_scene(np.random.default_rng(seed)) for seed in range(30)},
    "squat": scene_of(
        block=Block(half_width=2.0, half_height=1.0),
        floor=Floor(friction=1.2),
        excitation=Ricker(amplitude=30.0, period=1.0),
    ),
}


@pytest.mark.parametrize(
    ("kind", "name"),
    [(kind, name) for kind in (*PIVOTS, "bouc-wen") for name in SCENES] + [("no-slip", "hangs")],
)
def test_mirror_image_to_the_bit(kind, name):
    """Left and right exchanged, with record, walls and mass; all that a stress run asks for holds,
    too."""
    settings = {"pivot": kind} if kind in PIVOTS else {"friction": kind}
    played = check_run(EventBasedModel(**settings), SCENES[name])
    assert played.broken == []
    assert played.figures["mirror"] == 0.0
    assert SCENES[name].mirrored().mirrored() == SCENES[name]


@pytest.mark.parametrize(
    "scale",
    [1e-3 / PAPER_BLOCK.radius, 0.25, 3.0, 1e3 / PAPER_BLOCK.radius],
    ids=["R = 1 mm", "1/4", "3", "R = 1 km"],
)
@pytest.mark.parametrize("pivot", PIVOTS)
def test_dynamic_similarity(pivot, scale):
    model, scene = EventBasedModel(pivot=pivot, tolerance=1e-14), SCENES["left wall"]
    root = math.sqrt(scale)
    scaled = scene.replace(
        block=Block(
            half_width=scale * PAPER_BLOCK.half_width, half_height=scale * PAPER_BLOCK.half_height
        ),
        walls=[Wall(side="left", gap=scale * 0.053)],
        excitation=Ricker(amplitude=RICKER.amplitude, period=root * RICKER.period),
        duration=root * scene.duration,
        output_step=root * scene.output_step,
    )
    small, large = model.simulate(scene).channels, model.simulate(scaled).channels
    np.testing.assert_allclose(large["theta"], small["theta"], rtol=0.0, atol=1e-12)
    for name in ("x", "y", "slip"):
        np.testing.assert_allclose(large[name] / scale, small[name], rtol=0.0, atol=2e-12)
    assert np.mean(small["mode"] == large["mode"]) > 0.999


@pytest.mark.parametrize("pivot", PIVOTS)
def test_walls_out_of_reach_do_not_matter(pivot):
    model = EventBasedModel(pivot=pivot)
    free = model.simulate(scene_of()).channels
    beside = model.simulate(scene_of(walls=walls(left=50.0, right=50.0, e=1.0))).channels
    for name, channel in free.items():
        np.testing.assert_array_equal(beside[name], channel, err_msg=name)


@pytest.mark.parametrize(("energy_cap", "gains"), [(False, 6), (True, 0)])
def test_the_energy_cap_removes_every_gain(energy_cap, gains):
    """Newton's restitution with friction can add energy at an impact; capped, it never does."""
    scene = scene_of(
        block=Block(half_width=0.7, half_height=0.72),
        floor=Floor(friction=0.187, restitution=0.95),
        walls=walls(left=0.05, right=0.05, e=1.0),
        excitation=Rest(),
        initial_rotation=0.02,
        initial_velocity=1.32,
        initial_angular_velocity=-0.78,
        duration=2.0,
    )
    model = EventBasedModel(pivot="unilateral", energy_cap=energy_cap)
    assert model.simulate(scene).cost.energy_gains == gains


@pytest.mark.parametrize("pivot", PIVOTS)
def test_constant_vertical_acceleration_is_gravity(pivot):
    model = EventBasedModel(pivot=pivot, tolerance=1e-13)
    shaken, heavy = (
        model.simulate(scene_of(walls=walls(left=0.053, e=0.5), duration=4.0, **change)).channels
        for change in (
            {"vertical": Record.from_samples([3.0, 3.0], time_step=5.0)},
            {"gravity": 9.81 + 3.0},
        )
    )
    assert np.max(np.abs(heavy["theta"])) > 0.01
    for name in ("theta", "x"):
        np.testing.assert_allclose(shaken[name], heavy[name], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("pivot", PIVOTS)
def test_rows_of_a_shaken_block_at_rest(pivot):
    """A block on a floor that shakes vertically, too little to lift it, stays where it stands.

    Such rows once held whatever the memory had held.
    """
    scene = scene_of(
        excitation=Rest(), vertical=Sine(amplitude=4.0, period=0.4, cycles=8), duration=1.0
    )
    model = EventBasedModel(pivot=pivot)
    # Leaves other numbers in the memory.
    model.simulate(scene_of(duration=1.5, initial_velocity=1.0))
    motion = model.simulate(scene).channels
    assert set(motion["mode"]) == {"rest"}
    np.testing.assert_array_equal(
        [motion[name] for name in ("x", "theta", "x_dot", "y_dot", "theta_dot", "slip")], 0.0
    )


@pytest.mark.parametrize("pivot", PIVOTS)
def test_floor_that_falls_away(pivot):
    """A floor that falls faster than g: the block flies freely (unilateral), or hangs: by both
    corners, and by one once it is pushed."""
    falls = scene_of(
        excitation=Rest(),
        vertical=Record.from_samples([-12.0, -12.0], time_step=0.1),
        duration=0.1,
        output_step=0.01,
    )
    history = EventBasedModel(pivot=pivot).simulate(falls)
    assert history.cost.rules == ({"hangs flat": 1} if pivot == "bilateral" else {})
    motion = history.channels
    assert not motion["theta"].any()
    pushed = (
        EventBasedModel(pivot=pivot)
        .simulate(
            falls.replace(
                excitation=Record.from_samples([0.0, 0.0, 0.0, 1e-6, 0.0], time_step=0.01)
            )
        )
        .channels
    )
    assert bool(np.all(pushed["theta"][5:] > 0.0)) == (pivot == "bilateral")
    assert not pushed["theta"][:3].any()
    lift = kinematics.pivot_height(PAPER_BLOCK, motion["y"], motion["theta"])
    free = 0.5 * (12.0 - 9.81) * motion["t"] ** 2
    np.testing.assert_allclose(lift, free if pivot == "unilateral" else 0.0, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("pivot", PIVOTS)
def test_sampled_pulse_tends_to_the_pulse(pivot):
    scene = scene_of(duration=3.0, walls=walls(left=0.053))
    model = EventBasedModel(pivot=pivot, tolerance=1e-13)
    truth = model.simulate(scene).channels["theta"]
    records = (
        Record.from_samples(RICKER.acceleration(np.arange(0.0, 3.0 + step, step)), time_step=step)
        for step in (0.004, 0.001, 0.00025)
    )
    errors = [
        np.max(np.abs(model.simulate(scene.replace(excitation=record)).channels["theta"] - truth))
        for record in records
    ]
    assert errors[2] < 1e-5
    np.testing.assert_allclose(-np.diff(np.log(errors)) / math.log(4.0), 2.0, atol=0.35)


@pytest.mark.parametrize("name", ["no wall", "elastic right wall", "both walls", "vertical record"])
@pytest.mark.parametrize("pivot", PIVOTS)
def test_sticking_floor_holds_the_pivot(pivot, name):
    motion = EventBasedModel(pivot=pivot).simulate(SCENES[name]).channels
    holds = np.isin(motion["mode"], ["rest", "rock", "lean"])
    assert 0.1 < np.mean(holds) < 0.99
    assert np.max(np.abs(motion["slip_rate"][holds])) < 1e-12
    # The other corner becomes the pivot at an impact: the slip of the lower corner is continuous
    # there too.
    assert np.max(np.abs(np.diff(motion["slip"]))[holds[1:] & holds[:-1]]) < 1e-12


@pytest.mark.parametrize("alpha", [0.02, 0.25, 0.78, 1.2])
@pytest.mark.parametrize("radius", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("pivot", PIVOTS)
def test_needles_and_slabs_from_a_millimetre_to_a_kilometre(pivot, radius, alpha):
    """Any block ends its run; energy left over after a plastic pulse of the floor is never more
    than it had, and it rests."""
    block = Block(half_width=radius * math.sin(alpha), half_height=radius * math.cos(alpha))
    unit = math.sqrt(radius / 9.81)
    history = EventBasedModel(pivot=pivot).simulate(
        scene_of(
            block=block,
            floor=Floor(friction=0.9, static_friction=1.1),
            excitation=Rest(),
            initial_rotation=0.5 * alpha,
            duration=400.0 * unit,
            output_step=0.5 * unit,
        )
    )
    motion = history.channels
    energy = kinematics.energy(
        block, 9.81, *(motion[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
    )
    assert np.all(np.diff(energy) <= 1e-9 * 9.81 * radius)
    assert np.max(np.abs(motion["theta"])) == pytest.approx(0.5 * alpha, rel=1e-12)
    assert history.outcome == "at rest" or alpha < 0.1


@pytest.mark.parametrize(
    "start",
    [
        {"initial_rotation": 0.1, "initial_angular_velocity": -0.3, "initial_velocity": 0.2},
        {"initial_angular_velocity": 0.2},
        {"initial_rotation": -0.2},
        {"initial_velocity": -0.4},
        {"initial_height": 0.05, "initial_rotation": 0.05},
    ],
    ids=str,
)
def test_initial_state_is_where_it_was_put(start):
    scene = scene_of(excitation=Rest(), **start)
    motion = (
        EventBasedModel(pivot="unilateral" if "initial_height" in start else "bilateral")
        .simulate(scene)
        .channels
    )
    row = [motion[name][0] for name in ("x", "y", "theta", "x_dot", "y_dot", "theta_dot")]
    np.testing.assert_allclose(row, scene.initial_state, rtol=1e-14, atol=1e-15)
    assert motion["slip_rate"][0] == pytest.approx(scene.initial_velocity, abs=1e-14)


def test_static_friction_only_decides_when_slip_begins():
    history = EventBasedModel().simulate(
        scene_of(
            floor=Floor(friction=0.1, static_friction=0.2),
            excitation=Record.from_samples([0.0, 9.81], time_step=1.0),
            duration=1.0,
        )
    )
    (begin,) = [e for e in history.event_list if e.kind == "slip"]
    assert begin.t == pytest.approx(0.2, abs=1e-12)
    t = history.channels["t"]
    expected = np.where(
        t > 0.2,
        -9.81 * ((t**3 - 0.2**3) / 6.0 - 0.1 * (t - 0.2) ** 2 / 2.0 - 0.02 * (t - 0.2)),
        0.0,
    )
    np.testing.assert_allclose(history.channels["x"], expected, rtol=0.0, atol=1e-12)
