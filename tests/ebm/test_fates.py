"""Fates of many runs against histories that go on for a minute, whatever the scene's duration."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel, packing
from rockcheck.ebm.core.decide import PATIENCE
from rockcheck.ebm.fates import (
    AT_REST,
    FAILED,
    MOVING,
    OVERTURNED_LEFT,
    UNDECIDED,
    Fates,
    Keep,
    RunTable,
    play_fates,
)
from rockcheck.scenes import (
    PAPER_BLOCK,
    Block,
    Floor,
    InputError,
    Record,
    Rest,
    Ricker,
    Scene,
    Wall,
    kinematics,
)
from rockcheck.scenes.history import OUTCOMES
from tests.ebm.cases import pulse_scene, random_scene

MODEL = EventBasedModel(pivot="unilateral")
RECORD = Record.from_samples(3.0 * np.sin(0.07 * np.arange(300.0)), 0.02)


def table_of(scenes, **columns):
    """A row a scene, each under its own motion."""
    count = len(scenes)
    return RunTable(
        **{
            "scenes": scenes,
            "motions": [(scene.excitation, scene.vertical) for scene in scenes],
            "scene": np.arange(count),
            "motion": np.arange(count),
            "factor": np.ones(count),
            "vertical_factor": np.ones(count),
            "gap_left": np.full(count, np.nan),
            "gap_right": np.full(count, np.nan),
        }
        | columns
    )


def fates_of(*scenes, model=MODEL, **columns) -> Fates:
    return play_fates(table_of(scenes, **columns), model, jobs=1)


def resting(**more) -> Scene:
    return pulse_scene(1.0, 1.0, 0.6, excitation=Rest(), **more)


def pulses_beside_walls(count: int, seed: int) -> list[Scene]:
    rng = np.random.default_rng(seed)
    return [
        pulse_scene(
            rng.uniform(0.5, 6.0),
            rng.uniform(1.0, 6.0),
            rng.uniform(0.2, 1.0),
            (
                str(rng.choice(["left", "right"])),
                rng.uniform(0.0, 0.3),
                rng.choice([0.0, 0.5, 0.9]),
            ),
            duration=4.0,
        )
        for _ in range(count)
    ]


def falls(outcome: str) -> bool:
    return outcome.startswith("overturned")


def test_a_block_that_falls_after_the_scene_is_over_falls():
    """It stands at 85 degrees when the scene ends, and falls 0.03 s later."""
    scene = pulse_scene(
        *(1.0, 1.0, 0.3, ("left", 0.053, 0.0)),
        excitation=Ricker(amplitude=4.0, period=1.5),
        duration=6.0,
    )
    assert MODEL.simulate(scene).outcome == "moving"
    assert fates_of(scene).outcome.tolist() == [3]


def test_fates_are_those_of_histories_of_a_minute():
    scenes = pulses_beside_walls(80, 5)
    fates = fates_of(*scenes)
    histories = [MODEL.simulate(scene.replace(duration=60.0, output_step=0.5)) for scene in scenes]
    ends = [OUTCOMES.index(history.outcome) for history in histories]
    fell = [falls(history.outcome) for history in histories]
    assert fates.overturned.tolist() == fell
    assert fates.outcome[fell].tolist() == np.array(ends)[fell].tolist()
    assert 10 < sum(fell) < 70


@pytest.mark.parametrize("seconds", [1.0, 2.0, 4.0])
@pytest.mark.parametrize("push", [4.0, 6.0])
def test_a_block_held_against_a_wall_is_released_where_the_push_ends(push, seconds):
    """It leans to the left at rest, and falls over its weaker corner once nothing holds it."""
    scene = resting(duration=60.0).replace(
        block=Block(half_width=0.25, half_height=1.0, centre_of_mass=(0.1, 0.0)),
        walls=[Wall(side="left", gap=0.5, restitution=0.0)],
        excitation=Record.from_samples([push] * 5, 0.25 * seconds),
        output_step=0.1,
    )
    assert MODEL.simulate(scene).outcome == "overturned right"
    assert OUTCOMES[fates_of(scene).outcome[0]] == "overturned right"


def test_fates_of_blocks_with_an_offset_mass():
    rng = np.random.default_rng(3)
    scenes = [random_scene(rng) for _ in range(40)]
    histories = [MODEL.simulate(scene.replace(duration=60.0, output_step=0.5)) for scene in scenes]
    fell = [falls(history.outcome) for history in histories]
    assert fates_of(*scenes).overturned.tolist() == fell


def test_a_row_is_its_scene_with_the_factor_and_the_gaps():
    """One scene and one motion, stored once, under many factors and gaps."""
    start = pulse_scene(1.0, 1.0, 0.5, ("left", 0.1, 0.5), excitation=RECORD)
    factors, gaps = np.array([0.8, 1.1, 1.4, 1.7]), np.array([0.02, 0.05, 0.1, np.inf])
    rows = RunTable(
        scenes=[start],
        motions=[(RECORD, Rest())],
        scene=np.zeros(4, int),
        motion=np.zeros(4, int),
        factor=factors,
        vertical_factor=np.ones(4),
        gap_left=gaps,
        gap_right=np.array([np.nan, np.nan, 0.03, 0.03]),
        restitution=0.25,
    )
    walls = [
        [Wall(side="left", gap=0.02, restitution=0.5)],
        [Wall(side="left", gap=0.05, restitution=0.5)],
        [
            Wall(side="left", gap=0.1, restitution=0.5),
            Wall(side="right", gap=0.03, restitution=0.25),
        ],
        [Wall(side="right", gap=0.03, restitution=0.25)],
    ]
    alone = [
        start.replace(walls=beside, excitation=RECORD.scaled(factor))
        for beside, factor in zip(walls, factors, strict=True)
    ]
    found, expected = play_fates(rows, MODEL), fates_of(*alone)
    assert found.outcome.tolist() == expected.outcome.tolist()
    np.testing.assert_allclose(found.peak, expected.peak, rtol=1e-6)
    assert len(set(found.peak.tolist())) == 4


@pytest.mark.parametrize("excitation", [Ricker(amplitude=4.0, period=1.0), RECORD])
def test_units_of_a_row_are_those_of_its_scene(excitation):
    scenes = [
        pulse_scene(1.0, 1.0, 0.5, block=PAPER_BLOCK.scaled(size), gravity=g, excitation=excitation)
        for size, g in ((0.5, 9.81), (1.0, 3.7), (2.0, 9.81))
    ]
    played = [MODEL.simulate(scene.replace(duration=60.0, output_step=0.002)) for scene in scenes]
    peaks = [history.peak_rotation for history in played]
    fallen = [falls(history.outcome) for history in played]
    fates = fates_of(*scenes)
    assert fates.overturned.tolist() == fallen
    stood = ~np.array(fallen)
    np.testing.assert_allclose(fates.peak[stood], np.array(peaks)[stood], rtol=1e-4)


def test_a_motion_times_zero_is_rest():
    scene = pulse_scene(1.0, 4.0, 0.5)
    found = fates_of(scene, factor=np.zeros(1))
    assert (found.outcome.tolist(), found.peak.tolist()) == ([AT_REST], [0.0])


def test_a_block_that_leans_on_a_wall_is_at_rest():
    """Past its balance point, and held by the wall."""
    scene = resting(walls=[Wall(side="left", gap=1.0)], initial_rotation=1.05 * PAPER_BLOCK.alpha)
    assert fates_of(scene).outcome.tolist() == [AT_REST]


def test_a_block_that_swings_for_ever_beside_an_elastic_wall_moves():
    wall = Wall(side="left", gap=0.003, restitution=1.0)
    scene = pulse_scene(0.5 + 7.5 * 17 / 99, 1.0 + 11.0 * 6 / 99, 0.3).replace(walls=(wall,))
    assert fates_of(scene, model=EventBasedModel()).outcome.tolist() == [MOVING]


def test_what_slides_without_friction_between_elastic_walls_is_undecided():
    """So fast that energy excludes nothing; it is given up after PATIENCE/p."""
    walls = [Wall(side=side, gap=0.5, restitution=1.0) for side in ("left", "right")]
    scene = resting(walls=walls, initial_velocity=2.0, floor=Floor(friction=0.0))
    found = fates_of(scene)
    assert found.outcome.tolist() == [UNDECIDED]
    assert found.time_s[0] == pytest.approx(PATIENCE / PAPER_BLOCK.frequency_parameter)


@pytest.mark.parametrize("model", [MODEL, EventBasedModel()], ids=["unilateral", "bilateral"])
@pytest.mark.parametrize("keeps", list(Keep))
@pytest.mark.parametrize("velocity", [2.0, -2.0])
def test_what_slides_away_without_friction_moves_for_good(velocity, keeps, model):
    """So fast that energy excludes nothing; a wall behind it is out of reach."""
    behind = "left" if velocity > 0.0 else "right"
    for walls in ([], [Wall(side=behind, gap=0.01)]):
        scene = resting(walls=walls, initial_velocity=velocity, floor=Floor(friction=0.0))
        found = play_fates(table_of([scene]), model, keeps=keeps)
        assert found.outcome.tolist() == [MOVING]
        assert found.time_s[0] < 1.0


def test_the_duration_of_a_scene_does_not_count():
    scenes = pulses_beside_walls(6, 8)
    short = fates_of(*(scene.replace(duration=0.1) for scene in scenes))
    np.testing.assert_array_equal(short.peak, fates_of(*scenes).peak)


def test_fates_do_not_depend_on_jobs():
    table = table_of(pulses_beside_walls(300, 9))
    found, alone = play_fates(table, MODEL, jobs=3), play_fates(table, MODEL, jobs=1)
    np.testing.assert_array_equal(found.time_s, alone.time_s)
    np.testing.assert_array_equal(found.outcome, alone.outcome)


def test_a_row_that_starts_inside_its_wall_fails_and_says_so():
    scene = resting(initial_rotation=0.1)
    found = fates_of(scene, scene, gap_left=np.array([0.01, 0.5]))
    assert found.outcome.tolist() == [FAILED, AT_REST]
    assert found.reasons == {0: "the block would start inside a wall"}


def test_a_run_that_reaches_its_cap_fails_and_says_so():
    scene = pulse_scene(1.0, 4.0, 0.5)
    found = fates_of(scene, model=MODEL.model_copy(update={"most_steps": 3}))
    assert found.outcome.tolist() == [FAILED]
    assert found.reasons == {0: "the cap on steps was reached"}


@pytest.mark.parametrize(
    ("wrong", "key"),
    [
        ({"factor": np.ones(2)}, "factor"),
        ({"scene": np.array([1])}, "scene"),
        ({"motion": np.array([-1])}, "motion"),
        ({"vertical_factor": np.array([math.nan])}, "vertical_factor"),
        ({"gap_left": np.array([-0.1])}, "gap_left"),
        ({"restitution": 1.5}, "restitution"),
    ],
)
def test_a_table_that_is_wrong_is_refused(wrong, key):
    table = table_of([resting()])
    with pytest.raises(InputError, match=key):
        replace(table, **wrong)


def test_bouc_wen_friction_has_no_fates():
    with pytest.raises(InputError, match="friction"):
        fates_of(resting(), model=EventBasedModel(friction="bouc-wen"))


def test_a_fall_to_the_left_is_told_from_one_to_the_right():
    scene = resting(initial_rotation=1.2 * PAPER_BLOCK.alpha)
    assert fates_of(scene, scene.mirrored()).outcome.tolist() == [OVERTURNED_LEFT, 3]


@pytest.mark.parametrize("keeps", [Keep.STRIKES, Keep.EXTREMES])
def test_what_is_kept_of_a_run_changes_no_fate_and_no_peak(keeps):
    rng = np.random.default_rng(20261129)
    scenes = [*pulses_beside_walls(40, 20261129), *(random_scene(rng) for _ in range(40))]
    lean = play_fates(table_of(scenes), MODEL, keeps=Keep.NOTHING)
    rich = play_fates(table_of(scenes), MODEL, keeps=keeps)
    assert rich.outcome.tolist() == lean.outcome.tolist()
    assert rich.peak.tolist() == pytest.approx(lean.peak.tolist(), rel=0.0, abs=0.0, nan_ok=True)


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
@pytest.mark.parametrize(("share", "inside"), [(0.0, False), (-0.5e-12, False), (-1e-9, True)])
def test_a_corner_that_touches_a_wall_to_rounding_is_not_inside(size, share, inside):
    """Of a block that is tilted to the left, by a share of its size."""
    block = PAPER_BLOCK.scaled(size)
    scene = resting(initial_rotation=0.1).replace(block=block)
    touches = -kinematics.clearance(block, "left", 0.0, *scene.initial_state[:3:2])
    gap = np.array([touches + share * block.half_diagonal])
    assert packing.inside_a_wall(table_of([scene], gap_left=gap)).tolist() == [inside]


def test_a_gap_of_zero_is_allowed():
    table = table_of([resting()], gap_left=np.zeros(1))
    assert table.gap_left.tolist() == [0.0]
