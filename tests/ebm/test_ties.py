"""Scenes on a knife edge of the mechanics: both answers are named."""

import math

import numpy as np
import pytest

from rockcheck import (
    Block,
    EventBasedModel,
    Floor,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
    load_scene,
)
from rockcheck.ebm.horizon import predictability_horizon
from rockcheck.ebm.ties import edges_of, ties_of
from rockcheck.scenes import PAPER_BLOCK


def cube(friction=1.0, push=-10.0):
    """A cube that is pushed by a constant acceleration (after mujoco #1669)."""
    return Scene(
        name="cube",
        block=Block(half_width=0.05, half_height=0.05),
        floor=Floor(friction=friction),
        excitation=Record.from_samples(np.full(501, push), 0.01),
        duration=3.0,
    )


def tall(friction=0.2):
    return Scene(
        name="tall",
        block=Block(half_width=0.2, half_height=1.0),
        floor=Floor(friction=friction),
        excitation=Sine(amplitude=6.0, period=0.6, cycles=2),
        duration=6.0,
    )


def balanced(tilt):
    return Scene(
        name="balanced",
        block=Block(half_width=0.5, half_height=0.5),
        floor=Floor(friction=0.8),
        excitation=Rest(),
        initial_rotation=tilt,
        duration=6.0,
    )


def standing(excitation, walls=()):
    return Scene(
        name="standing",
        block=Block(half_width=0.3, half_height=1.0),
        floor=Floor(friction=0.6),
        walls=walls,
        excitation=excitation,
        duration=4.0,
    )


@pytest.mark.parametrize("scene", [cube(), tall()], ids=["cube", "sine"])
def test_friction_equal_to_the_slope_has_two_answers(scene):
    (tie,) = ties_of(scene)
    assert tie.what == "friction equals B/H"
    assert len(tie.fates) == 2
    assert tie.from_s < 1.0


@pytest.mark.parametrize("scene", [cube(friction=0.999), tall(friction=0.2001)])
def test_friction_near_the_slope_has_one(scene):
    assert list(edges_of(scene)) == []


def test_a_balanced_block_may_fall_to_either_side():
    (tie,) = ties_of(balanced(math.pi / 4))
    assert tie.what == "balanced over its corner"
    assert "overturned left" in tie.fates
    assert len(tie.fates) >= 2


def test_a_block_off_its_balance_has_one_answer():
    assert ties_of(balanced(0.99 * math.pi / 4)) == ()


def test_an_acceleration_that_just_reaches_what_uplifts_is_an_edge():
    limit = 9.81 * 0.3
    edges = [edge.what for edge in edges_of(standing(Sine(amplitude=limit, period=1.0)))]
    assert "acceleration equals g tan(alpha)" in edges


@pytest.mark.parametrize("scene", [cube(), tall()], ids=["cube", "sine"])
def test_answers_part_before_they_are_apart(scene):
    (tie,) = ties_of(scene)
    assert tie.from_s <= tie.apart_s
    assert tie.apart_s < scene.duration


def test_an_edge_whose_sides_do_not_part_is_no_tie():
    """At its uplift a sine of that size lifts nothing that can be seen."""
    assert ties_of(standing(Sine(amplitude=9.81 * 0.3, period=1.0))) == ()


def test_a_side_that_touches_a_wall_is_an_edge():
    pulse = Ricker(amplitude=5.0, period=0.9)
    edges = [edge.what for edge in edges_of(standing(pulse, [Wall(side="left", gap=0.0)]))]
    assert edges == ["it touches the left wall"]


def test_walls_at_equal_gaps_are_an_edge():
    pulse = Ricker(amplitude=5.0, period=0.9)
    walls = [Wall(side="left", gap=0.02), Wall(side="right", gap=0.02)]
    assert [edge.what for edge in edges_of(standing(pulse, walls))] == [
        "both walls are equally far"
    ]


def between(*, turns: float, **more) -> Scene:
    """The paper's block in the middle between two walls; it turns in the air about its centre."""
    walls = [Wall(side=side, gap=0.02, restitution=0.5) for side in ("left", "right")]
    scene = Scene(
        **{
            "name": "between",
            "block": PAPER_BLOCK,
            "floor": Floor(friction=0.5),
            "walls": walls,
            "initial_height": 0.3 if turns else 0.0,
            "initial_angular_velocity": turns,
            "duration": 1.5,
        }
        | more
    )
    return scene.replace(initial_velocity=-scene.initial_state[3])


@pytest.mark.parametrize("turns", [0.3, 2.0])
def test_both_walls_struck_at_one_instant_tie(turns):
    scene = between(turns=turns)
    struck = EventBasedModel(pivot="unilateral").simulate(scene).extremes.walls["left"].first_s
    (tie,) = ties_of(scene)
    assert tie.what == "both walls are equally far"
    assert tie.apart_s == pytest.approx(struck, abs=2.0 * scene.output_step)
    assert predictability_horizon(scene) <= tie.apart_s + scene.output_step


def test_a_motion_that_amplifies_every_difference_is_no_tie_of_equal_gaps():
    """Its sides part after seven seconds of hits, ten times as far off half a second sooner."""
    tall = Block(half_width=0.13969982337845474, half_height=0.9635464891106362)
    walls = [Wall(side=s, gap=0.046044562282075346, restitution=0.3) for s in ("left", "right")]
    scene = between(
        turns=0.0,
        block=tall,
        floor=Floor(friction=0.7075134252450574),
        walls=walls,
        excitation=load_scene("statue").excitation.scaled(1.2823859267211977),
        duration=12.0,
    )
    model = EventBasedModel(pivot="unilateral")
    (edge,) = edges_of(scene)
    theta = [model.simulate(side).channels["theta"] for side in edge.sides(1e-7)]
    assert np.max(np.abs(theta[0] - theta[1])) > 1e-3 * tall.alpha
    assert ties_of(scene) == ()


def test_a_scene_off_every_edge_is_not_played_again():
    assert list(edges_of(load_scene("fig5a"))) == []


def test_the_horizon_ends_where_the_answers_part():
    scene = tall()
    (tie,) = ties_of(scene)
    assert predictability_horizon(scene) <= tie.apart_s + scene.output_step
