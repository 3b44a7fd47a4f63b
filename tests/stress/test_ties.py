"""Scenes on a knife edge: what a stress run holds against what is said of them."""

import math

import numpy as np
import pytest

from rockcheck import EventBasedModel, History, Record, Rest, Ricker, Sine
from rockcheck.ebm import ties as ebm_ties
from rockcheck.validation.studies.stress import ties
from rockcheck.validation.studies.stress.players import PLAYERS
from rockcheck.validation.uncertainty import numerical

MODEL = EventBasedModel(pivot="unilateral")
KINDS = len(ties.EQUALITIES)
#: Numbers whose sides part: a friction, a balance, a strike of both walls, a side at its wall.
PARTING = (0, 2, 4, 8)


@pytest.mark.parametrize("number", range(2 * KINDS))
def test_all_is_said_of_a_scene_on_its_edge(number):
    scene = ties.tie_scene(1, number)
    assert ties.equality_of(number).holds(scene)
    assert ties.unsaid(MODEL, scene, number) == []


@pytest.mark.parametrize("number", range(KINDS))
def test_nothing_is_asked_of_a_scene_beside_its_edge(number):
    equality = ties.equality_of(number)
    moved = equality.moved(ties.tie_scene(1, number), ties.AWAY)
    assert not equality.holds(moved)
    assert ties.unsaid(MODEL, moved, number) == []


@pytest.mark.parametrize("number", range(KINDS))
def test_an_edge_that_is_not_named_is_noticed(number, monkeypatch):
    monkeypatch.setattr(ties, "edges_of", lambda scene: ())
    assert "it is not named" in ties.unsaid(MODEL, ties.tie_scene(1, number), number)


@pytest.mark.parametrize("number", [0, 2, 4])
def test_an_edge_that_is_named_too_widely_is_noticed(number, monkeypatch):
    monkeypatch.setattr(ebm_ties, "EQUAL", 0.01)
    unsaid = ties.unsaid(MODEL, ties.tie_scene(1, number), number)
    assert "a scene off by a thousandth is named" in unsaid


@pytest.mark.parametrize("number", PARTING)
def test_a_tie_that_is_not_told_is_noticed(number, monkeypatch):
    monkeypatch.setattr(ties, "ties_of", lambda scene, model: ())
    (unsaid,) = ties.unsaid(MODEL, ties.tie_scene(1, number), number)
    assert unsaid.endswith("no tie is told")


@pytest.mark.parametrize("number", PARTING)
def test_a_horizon_past_a_tie_is_noticed(number, monkeypatch):
    monkeypatch.setattr(ties, "predictability_horizon", lambda scene, model: scene.duration)
    (unsaid,) = ties.unsaid(MODEL, ties.tie_scene(1, number), number)
    assert "the horizon is" in unsaid


@pytest.mark.parametrize("number", PARTING)
def test_a_tie_that_is_called_converged_is_noticed(number, monkeypatch):
    monkeypatch.setattr(numerical, "ties_of", lambda scene: ())
    unsaid = ties.unsaid(MODEL, ties.tie_scene(1, number), number)
    assert unsaid == ["a figure is called converged"]


def test_what_is_not_said_breaks_an_invariant(monkeypatch):
    player = PLAYERS["ebm-unilateral ties"]
    scene = player.scene(1, 2)
    assert player.check(scene, 1, 2).broken == []
    monkeypatch.setattr(ties, "ties_of", lambda scene, model: ())
    played = player.check(scene, 1, 2)
    assert played.broken == ["ties"]
    assert "no tie is told" in played.failure


# What the scenes are


def scenes(number, count=40):
    """Scenes of the kind of that number, of many seeds."""
    return [ties.tie_scene(seed, number) for seed in range(count)]


FRICTION, PUSH, BALANCE, FLUSH, BETWEEN = range(KINDS)


def check_span(values, low, high):
    """These are between two values, and come near to both."""
    near = 0.2 * (high - low)
    assert low <= min(values) < low + near
    assert high - near < max(values) <= high


def test_scenes_are_of_all_slendernesses_and_sizes():
    blocks = [scene.block for scene in scenes(FRICTION)]
    check_span([math.atan(b.half_width / b.half_height) for b in blocks], 0.1, 0.7)
    check_span([math.hypot(b.half_width, b.half_height) for b in blocks], 0.2, 5.0)


def test_pulses_are_of_all_sizes_and_lengths():
    pulses = [(scene.excitation, scene) for scene in scenes(FRICTION)]
    sizes = [pulse.amplitude / (9.81 * scene.block.slope) for pulse, scene in pulses]
    lengths = [pulse.period * scene.frequency_parameter / (2 * math.pi) for pulse, scene in pulses]
    check_span([abs(size) for size in sizes], 1.1, 3.0)
    assert {math.copysign(1.0, size) for size in sizes} == {-1.0, 1.0}
    check_span(lengths, 0.5, 2.0)


def test_pulses_are_of_both_kinds():
    pulses = [scene.excitation for scene in scenes(FRICTION)]
    assert {type(pulse) for pulse in pulses} == {Ricker, Sine}
    assert {pulse.cycles for pulse in pulses if isinstance(pulse, Sine)} == {1}


def test_scenes_last_for_eight_roots_of_their_radius():
    for scene in scenes(FLUSH, 5):
        assert scene.duration == pytest.approx(8.0 * math.sqrt(scene.block.radius))


def test_frictions_are_low_and_high():
    check_span([scene.floor.friction for scene in scenes(FLUSH)], 0.2, 1.2)


def test_a_push_reaches_what_uplifts_the_block_to_either_side():
    signs = set()
    for scene in scenes(PUSH, 12):
        assert isinstance(scene.excitation, Record)
        samples = np.array(scene.excitation.samples)
        limit = 9.81 * scene.block.half_width / scene.block.half_height
        assert np.abs(samples) == pytest.approx(limit)
        assert scene.excitation.quiet_after == pytest.approx(4.0, abs=0.02)
        signs.add(float(np.sign(samples[0])))
    assert signs == {-1.0, 1.0}


def test_a_balanced_block_leans_to_either_side_on_a_base_at_rest():
    balanced = scenes(BALANCE, 12)
    assert {scene.initial_rotation / scene.block.alpha for scene in balanced} == {-1.0, 1.0}
    assert {type(scene.excitation) for scene in balanced} == {Rest}


def test_a_touched_wall_is_on_either_side_plastic_or_not():
    walls = [wall for scene in scenes(FLUSH, 24) for wall in scene.walls]
    assert {wall.gap for wall in walls} == {0.0}
    assert {wall.side for wall in walls} == {"left", "right"}
    assert {wall.restitution for wall in walls} == {0.0, 0.5}


def test_equal_walls_are_a_share_of_the_width_away():
    between = scenes(BETWEEN)
    check_span([scene.walls[0].gap / scene.block.half_width for scene in between], 0.02, 0.3)
    assert {wall.restitution for scene in between for wall in scene.walls} == {0.5}


def test_half_of_the_blocks_between_walls_turn_in_the_air_about_their_centre():
    turning = [scene for scene in scenes(BETWEEN) if scene.initial_height]
    assert 10 <= len(turning) <= 30
    rates = [scene.initial_angular_velocity / scene.frequency_parameter for scene in turning]
    check_span(rates, 0.5, 2.0)
    for scene in turning:
        assert scene.initial_height == pytest.approx(0.3 * scene.block.radius)
        assert scene.initial_state[3] == pytest.approx(0.0, abs=1e-12)
        assert scene.excitation == Rest()


@pytest.mark.parametrize(
    ("number", "what"),
    [
        (FRICTION, lambda scene: scene.floor.friction),
        (PUSH, lambda scene: scene.excitation.samples[7]),
        (BALANCE, lambda scene: scene.initial_rotation),
        (BETWEEN, lambda scene: scene.walls[0].gap),
    ],
    ids=["friction", "push", "balance", "between"],
)
@pytest.mark.parametrize("change", [-0.01, 0.01])
def test_a_scene_is_moved_off_its_equality_by_a_share(number, what, change):
    scene = ties.tie_scene(1, number)
    moved = ties.equality_of(number).moved(scene, change)
    assert what(moved) == pytest.approx((1.0 + change) * what(scene))


def test_a_touched_wall_is_moved_by_a_share_of_the_radius():
    scene = ties.tie_scene(1, FLUSH)
    moved = ties.equality_of(FLUSH).moved(scene, 0.01)
    assert moved.walls[0].gap == pytest.approx(0.01 * scene.block.radius)


def test_of_equal_walls_the_other_stays():
    scene = ties.tie_scene(1, BETWEEN)
    moved = ties.equality_of(BETWEEN).moved(scene, 0.01)
    assert moved.walls[1] == scene.walls[1]


def test_only_a_touched_wall_leaves_its_equality_to_one_side():
    leaves = [tuple(equality.leaves) for equality in ties.EQUALITIES]
    assert leaves == [(-1, 1), (-1, 1), (-1, 1), (1,), (-1, 1)]


@pytest.mark.parametrize("change", [{"initial_velocity": 0.1}, {"initial_angular_velocity": 0.1}])
def test_a_block_that_moves_is_not_balanced(change):
    scene = ties.tie_scene(1, BALANCE)
    assert not ties.equality_of(BALANCE).holds(scene.replace(**change))


@pytest.mark.parametrize(
    "change",
    [
        {"initial_rotation": 0.01},
        {"initial_velocity": 0.1},
        {"initial_angular_velocity": 0.1},
        {"initial_height": 0.1},
        {"vertical": Ricker(amplitude=1.0, period=0.5)},
    ],
)
def test_a_block_that_moves_anyhow_is_not_just_reached(change):
    scene = ties.tie_scene(1, PUSH)
    assert not ties.equality_of(PUSH).holds(scene.replace(**change))


def test_walls_that_both_touch_are_not_equally_far():
    scene = ties.tie_scene(1, BETWEEN).replace(initial_height=0.0, initial_angular_velocity=0.0)
    touched = scene.replace(
        initial_velocity=0.0, walls=[wall.replace(gap=0.0) for wall in scene.walls]
    )
    assert not ties.equality_of(BETWEEN).holds(touched)


def test_a_single_wall_is_not_equally_far():
    scene = ties.tie_scene(1, BETWEEN)
    assert not ties.equality_of(BETWEEN).holds(scene.replace(walls=scene.walls[:1]))


# When sides have parted


class Made:
    """A model whose rotations (alpha) part at a row that the distance from the equality gives."""

    def __init__(self, scene, number, row_of, size=1.0):
        self.start, self.number, self.row_of, self.size = number(scene), number, row_of, size

    def simulate(self, scene):
        change = round((self.number(scene) / self.start - 1.0) * 1e9)
        t = scene.output_times
        rows = np.arange(len(t))
        theta = np.where(rows < self.row_of.get(change, 10**6), 0.0, self.size * scene.block.alpha)
        return History(
            name="made",
            model="made",
            channels={"t": t, "theta": theta},
            event_list=(),
            outcome="moving",
            block=scene.block,
        )


def parts_at(number, what, row_of, size=1.0):
    scene = ties.tie_scene(1, number)
    model = Made(scene, what, row_of, size)
    when = ties._parts_at(ties.equality_of(number), model, scene)
    return None if when is None else when / scene.output_step


def friction_of(scene):
    return scene.floor.friction


def gap_of(scene):
    return scene.walls[0].gap


def test_sides_have_parted_when_the_nearer_ones_have():
    assert parts_at(FRICTION, friction_of, {30: 40, 300: 25}) == pytest.approx(40)


def test_sides_that_part_only_farther_off_have_not():
    assert parts_at(FRICTION, friction_of, {300: 25}) is None


@pytest.mark.parametrize(("size", "parts"), [(0.009, False), (0.011, True)])
def test_sides_have_parted_by_a_hundredth_of_the_slenderness(size, parts):
    found = parts_at(FRICTION, friction_of, {30: 40, 300: 40}, size)
    assert (found is not None) == parts


@pytest.mark.parametrize(("row", "parts"), [(40, True), (39, True), (38, False)])
def test_equal_walls_part_at_once_however_near_they_are(row, parts):
    found = parts_at(BETWEEN, gap_of, {30: 40, 300: row})
    assert (found is not None) == parts
