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
from rockcheck.ebm import fates, ties
from rockcheck.ebm.horizon import predictability_horizon
from rockcheck.ebm.ties import Tie, edges_of, fate_words, ties_of
from rockcheck.scenes import PAPER_BLOCK, History, ModelFailure


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
    symmetric = Ricker(amplitude=limit, period=0.9, symmetric=True)
    assert "acceleration equals g tan(alpha)" in [
        edge.what for edge in edges_of(standing(symmetric))
    ]


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


# What is equal, and its two sides

#: Slopes 0.2 (over the right corner) and 0.4 (over the left one).
LOADED = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.1, 0.0))
OVER_RIGHT, OVER_LEFT = (0.3 - 0.1) / 1.0, (0.3 + 0.1) / 1.0


def loaded(**change):
    """A block whose mass lies to the right, on a base at rest."""
    scene = {
        "name": "loaded",
        "block": LOADED,
        "floor": Floor(friction=0.7),
        "excitation": Rest(),
        "duration": 2.0,
    }
    return Scene(**scene | change)


def names(scene):
    return [edge.what for edge in edges_of(scene)]


@pytest.mark.parametrize("slope", [OVER_RIGHT, OVER_LEFT])
@pytest.mark.parametrize("floor", [(1.0, None), (0.5, 1.0)])
def test_friction_may_equal_the_slope_of_either_corner(slope, floor):
    share, static = floor
    floor = Floor(friction=share * slope, static_friction=static and static * slope)
    assert names(loaded(floor=floor)) == ["friction equals B/H"]


def test_kinetic_friction_may_equal_the_slope():
    floor = Floor(friction=OVER_LEFT, static_friction=0.9)
    assert names(loaded(floor=floor)) == ["friction equals B/H"]


def test_both_frictions_are_moved_off_an_equality():
    floor = Floor(friction=0.1, static_friction=OVER_RIGHT)
    (edge,) = edges_of(loaded(floor=floor))
    below, above = (side.floor for side in edge.sides(0.01))
    assert [below.friction, above.friction] == pytest.approx([0.099, 0.101])
    assert [below.static_friction, above.static_friction] == pytest.approx([0.198, 0.202])


@pytest.mark.parametrize(
    ("push", "what"),
    [
        # A base that moves to the right tips the block over its left corner.
        (9.81 * OVER_LEFT, "acceleration equals g tan(alpha)"),
        (-9.81 * OVER_RIGHT, "acceleration equals g tan(alpha)"),
        (9.81 * 0.7, "acceleration equals mu g"),
        (-9.81 * 0.7, "acceleration equals mu g"),
    ],
)
def test_a_base_may_just_reach_what_moves_the_block(push, what):
    base = Record.from_samples(np.full(50, push), 0.01)
    assert names(loaded(excitation=base)) == [what]


@pytest.mark.parametrize("push", [-9.81 * OVER_LEFT, 9.81 * OVER_RIGHT, 0.7 / 9.81])
def test_what_moves_the_other_corner_is_no_edge(push):
    base = Record.from_samples(np.full(50, push), 0.01)
    assert names(loaded(excitation=base)) == []


JUST = Record.from_samples(np.full(50, 9.81 * OVER_LEFT), 0.01)


@pytest.mark.parametrize(
    "change",
    [
        {"vertical": Ricker(amplitude=1.0, period=0.5)},
        {"initial_rotation": 0.01},
        {"initial_velocity": 0.1},
        {"initial_angular_velocity": 0.1},
        {"initial_height": 0.1},
    ],
    ids=lambda change: next(iter(change)),
)
def test_a_block_that_moves_anyhow_has_no_acceleration_that_just_moves_it(change):
    assert names(loaded(excitation=JUST, **change)) == []


def test_a_base_is_moved_off_an_equality_as_a_whole():
    (edge,) = edges_of(loaded(excitation=JUST))
    below, above = (side.excitation for side in edge.sides(0.01))
    assert below == JUST.scaled(0.99)
    assert above == JUST.scaled(1.01)


@pytest.mark.parametrize("tilt", [math.atan(OVER_LEFT), -math.atan(OVER_RIGHT)])
def test_a_block_may_balance_over_either_corner(tilt):
    (edge,) = edges_of(loaded(initial_rotation=tilt))
    assert edge.what == "balanced over its corner"
    below, above = (side.initial_rotation for side in edge.sides(0.01))
    assert [below, above] == pytest.approx([0.99 * tilt, 1.01 * tilt])


@pytest.mark.parametrize("tilt", [-math.atan(OVER_LEFT), math.atan(OVER_RIGHT)])
def test_the_balance_over_the_other_corner_is_none(tilt):
    assert names(loaded(initial_rotation=tilt)) == []


@pytest.mark.parametrize("moves", ["initial_velocity", "initial_angular_velocity"])
def test_a_block_that_passes_its_balance_does_not_balance(moves):
    tilt = math.atan(OVER_LEFT)
    assert names(loaded(initial_rotation=tilt, **{moves: 0.1})) == []


def walls(left, right):
    return [Wall(side="left", gap=left), Wall(side="right", gap=right)]


def test_each_wall_that_is_touched_is_an_edge():
    assert names(loaded(walls=walls(0.0, 0.0))) == [
        "it touches the left wall",
        "it touches the right wall",
    ]


def test_a_touched_wall_is_moved_away_and_the_other_stays():
    (edge,) = edges_of(loaded(walls=walls(0.2, 0.0)))
    (apart,) = edge.sides(0.01)
    assert apart.wall("left").gap == 0.2
    assert apart.wall("right").gap == pytest.approx(0.01 * LOADED.radius)


def test_of_equal_gaps_the_left_one_is_moved():
    (edge,) = edges_of(loaded(walls=walls(0.2, 0.2)))
    near, far = edge.sides(0.01)
    assert [near.wall("left").gap, far.wall("left").gap] == pytest.approx([0.198, 0.202])
    assert [near.wall("right").gap, far.wall("right").gap] == [0.2, 0.2]


@pytest.mark.parametrize("gaps", [(0.2, 0.2 * (1.0 + 1e-11)), (0.1, 0.2)])
def test_gaps_that_differ_are_no_edge(gaps):
    assert names(loaded(walls=walls(*gaps))) == []


def test_gaps_that_differ_by_rounding_are_equal():
    assert names(loaded(walls=walls(0.3, 0.1 + 0.2))) == ["both walls are equally far"]


# When the sides part

TIMES = 0.1 * np.arange(11)
STAYS = np.zeros(11)


def apart_from(row, size=1.0, before=0.0):
    """Rotations (alpha) that are `before` until a row, and `size` from there."""
    return np.where(np.arange(11) < row, before, size)


class Made:
    """A model whose rotations (alpha) are given by the factor on a number of the scene."""

    def __init__(self, rotations, number, slips=None):
        self.rotations, self.number, self.slips = rotations, number, slips or {}

    def simulate(self, scene):
        factor = round((self.number(scene) - 1.0) / 1e-7)
        if factor not in self.rotations:
            raise ModelFailure("it takes too many steps")
        block = scene.block
        theta = block.alpha * self.rotations[factor]
        x = block.alpha * block.radius * self.slips.get(factor, STAYS)
        return History(
            name="made",
            model="made",
            channels={"t": TIMES[: len(theta)], "theta": theta, "x": x[: len(theta)]},
            event_list=(),
            outcome="moving",
            block=block,
        )


EQUAL_FRICTION = loaded(floor=Floor(friction=OVER_LEFT), output_step=0.1, duration=1.0)
EQUAL_GAPS = loaded(walls=walls(0.2, 0.2), output_step=0.1, duration=1.0)


@pytest.fixture
def friction_tie(monkeypatch):
    """The ties of a friction, of rotations at and on both sides of it."""
    monkeypatch.setattr(ties, "fate_words", lambda scene, model: "moving")

    def found(at, below, above, slips=None):
        rotations = {0: at, -1: below, 1: above}
        model = Made(rotations, lambda scene: scene.floor.friction / OVER_LEFT, slips)
        return ties_of(EQUAL_FRICTION, model)

    return found


@pytest.fixture
def gap_ties(monkeypatch):
    """The ties of equal gaps, of a side that parts at a row, and farther off at another."""
    monkeypatch.setattr(ties, "fate_words", lambda scene, model: "moving")

    def found(near, far):
        rotations = {0: STAYS, -1: STAYS, 1: apart_from(near), -10: STAYS, 10: apart_from(far)}
        model = Made(rotations, lambda scene: scene.wall("left").gap / 0.2)
        return ties_of(EQUAL_GAPS, model)

    return found


def test_sides_part_after_the_last_row_at_which_they_are_within_a_thousandth(friction_tie):
    assert friction_tie(STAYS, STAYS, apart_from(6)) == (
        Tie("friction equals B/H", pytest.approx(0.5), pytest.approx(0.5), ("moving",)),
    )


def test_answers_begin_to_part_where_they_differ_by_more_than_a_millionth(friction_tie):
    grows = np.array([0.0, 0.9e-6, 1.1e-6, 1e-4, 0.9e-3, 1.1e-3, 1.0, 1.0, 1.0, 1.0, 1.0])
    (tie,) = friction_tie(STAYS, STAYS, grows)
    assert tie.from_s == pytest.approx(0.1)
    assert tie.apart_s == pytest.approx(0.4)


def test_the_side_that_parts_first_counts(friction_tie):
    (tie,) = friction_tie(STAYS, apart_from(4), apart_from(7))
    assert tie.from_s == pytest.approx(0.3)
    assert tie.apart_s == pytest.approx(0.3)


def test_sides_that_differ_at_once_part_at_the_start(friction_tie):
    (tie,) = friction_tie(STAYS, STAYS, apart_from(0))
    assert tie.from_s == 0.0
    assert tie.apart_s == 0.0


def test_a_difference_of_less_than_a_thousandth_is_no_tie(friction_tie):
    assert friction_tie(STAYS, STAYS, apart_from(3, size=0.9e-3)) == ()


def test_a_slip_parts_as_well_as_a_rotation(friction_tie):
    (tie,) = friction_tie(STAYS, STAYS, STAYS, slips={1: apart_from(3, size=1.1e-3)})
    assert tie.apart_s == pytest.approx(0.2)


def test_a_slip_of_less_than_a_thousandth_is_no_tie(friction_tie):
    assert friction_tie(STAYS, STAYS, STAYS, slips={1: apart_from(3, size=0.9e-3)}) == ()


def test_rotations_are_compared_not_added(friction_tie):
    tilted = np.full(11, 0.5)
    moved = {factor: np.full(11, 0.7) for factor in (-1, 0, 1)}
    assert friction_tie(tilted, tilted, tilted, slips=moved) == ()


def test_a_history_that_ends_sooner_is_compared_up_to_there(friction_tie):
    (tie,) = friction_tie(STAYS, STAYS, apart_from(3)[:5])
    assert tie.apart_s == pytest.approx(0.2)


def test_a_side_that_cannot_be_played_is_no_tie(monkeypatch):
    monkeypatch.setattr(ties, "fate_words", lambda scene, model: "moving")
    model = Made({0: STAYS}, lambda scene: scene.floor.friction / OVER_LEFT)
    assert ties_of(EQUAL_FRICTION, model) == ()


def test_sides_whose_fates_differ_are_a_tie_even_if_they_part_after_the_end(monkeypatch):
    words = {-1: "at rest", 0: "at rest", 1: "overturned left"}

    def number(scene):
        return scene.floor.friction / OVER_LEFT

    monkeypatch.setattr(
        ties, "fate_words", lambda scene, model: words[round((number(scene) - 1.0) / 1e-7)]
    )
    (tie,) = ties_of(EQUAL_FRICTION, Made({-1: STAYS, 0: STAYS, 1: STAYS}, number))
    assert tie == Tie("friction equals B/H", 1.0, 1.0, ("at rest", "overturned left"))


@pytest.mark.parametrize("far", [4, 6, 8])
def test_equal_gaps_tie_where_sides_farther_off_part_as_soon(gap_ties, far):
    (tie,) = gap_ties(6, far)
    assert tie.apart_s == pytest.approx(0.5)


def test_equal_gaps_do_not_tie_where_sides_farther_off_part_sooner(gap_ties):
    assert gap_ties(6, 3) == ()


@pytest.mark.parametrize(
    ("code", "words"),
    [
        (fates.OVERTURNED_LEFT, "overturned left"),
        (fates.AT_REST, "at rest"),
        (fates.UNDECIDED, "undecided"),
        (fates.FAILED, "failed"),
    ],
)
def test_a_fate_has_the_words_of_an_outcome(monkeypatch, code, words):
    class Played:
        outcome = np.array([code])

    monkeypatch.setattr(fates, "play_fates", lambda *given, **how: Played)
    assert fate_words(loaded(), EventBasedModel(pivot="unilateral")) == words
