"""Extremes and fates of a stress run: what contradicts them is noticed."""

import dataclasses
import math

import pytest

from rockcheck import EventBasedModel, Floor, History, Rest, Ricker, Scene, Wall
from rockcheck.scenes import PAPER_BLOCK, Extremes
from rockcheck.validation.studies.stress import ends, extremes
from rockcheck.validation.studies.stress.checks import audited, check_run
from rockcheck.validation.studies.stress.motion import Motion

MODEL = EventBasedModel(pivot="unilateral")
HITS = Scene(
    name="hits",
    block=PAPER_BLOCK,
    floor=Floor(friction=0.3),
    walls=[Wall(side="left", gap=0.05, restitution=0.5)],
    excitation=Ricker(amplitude=8.0, period=1.2),
    duration=4.0,
    output_step=0.04,
)
#: It stands at 85 degrees when its scene is over, and falls then.
FALLS_LATER = HITS.replace(
    walls=[Wall(side="left", gap=0.053, restitution=0.0)],
    excitation=Ricker(amplitude=4.0, period=1.5),
    duration=6.0,
)


def played(scene: Scene = HITS) -> Motion:
    return Motion(scene, MODEL.simulate(scene))


def told_otherwise(motion: Motion, **change: float) -> Motion:
    told = dataclasses.replace(motion.history.extremes, **change)
    return Motion(motion.scene, dataclasses.replace(motion.history, model_extremes=told))


def scaled(extreme: Extremes, name: str, factor: float) -> dict[str, float]:
    return {name: factor * getattr(extreme, name)}


SHOWN = (
    *("rotation_left", "rotation_right", "reach_left", "reach_right"),
    *("slip", "top_displacement", "hop"),
)


@pytest.mark.parametrize("name", SHOWN)
def test_an_extreme_below_a_row_is_noticed(name):
    motion = played()
    right = motion.history.extremes
    assert extremes.beyond(motion) < 1e-12
    assert extremes.beyond(told_otherwise(motion, **scaled(right, name, 0.3))) > 1e-6


@pytest.mark.parametrize("name", SHOWN)
def test_an_extreme_that_dense_rows_do_not_show_is_noticed(name):
    motion = played(HITS.replace(output_step=1e-3))
    right = motion.history.extremes
    assert extremes.unseen(motion, MODEL.simulate) < 1.0
    wrong = told_otherwise(motion, **{name: 1.5 * getattr(right, name) + 0.1})
    assert extremes.unseen(wrong, MODEL.simulate) > 1.0


def test_a_block_that_falls_is_seen_up_to_its_last_row():
    motion = played(audited(FALLS_LATER.replace(duration=12.0)))
    assert motion.history.outcome == "overturned right"
    assert extremes.unseen(motion, MODEL.simulate) < 1.0


def corner(motion: Motion, row: int, sideways: int, up: int) -> tuple[float, float]:
    """A corner of the block in a row, m: left or right (-1, 1), bottom or top (-1, 1)."""
    block = motion.scene.block
    x, y, theta = (float(motion.channels[name][row]) for name in ("x", "y", "theta"))
    across, along = sideways * block.half_width, up * block.half_height
    return (
        x + across * math.cos(theta) - along * math.sin(theta),
        y + across * math.sin(theta) + along * math.cos(theta),
    )


def test_rows_show_what_a_loop_over_corners_finds():
    motion = played()
    shown = extremes.shown_by_rows(motion)
    rows = range(len(motion.channels["t"]))
    b = HITS.block.half_width
    left = min(corner(motion, row, -1, up)[0] for row in rows for up in (-1, 1))
    right = max(corner(motion, row, 1, up)[0] for row in rows for up in (-1, 1))
    moved = [
        abs(corner(motion, row, side, 1)[0] - corner(motion, 0, side, 1)[0])
        for row in rows
        for side in (-1, 1)
    ]
    lowest = [min(corner(motion, row, side, -1)[1] for side in (-1, 1)) for row in rows]
    assert shown["reach_left"] == pytest.approx(-left - b)
    assert shown["reach_right"] == pytest.approx(right - b)
    assert shown["top_displacement"] == pytest.approx(max(moved))
    assert shown["hop"] == pytest.approx(max(lowest), abs=1e-12)
    assert shown["rotation_left"] == max(motion.channels["theta"])
    assert shown["rotation_right"] == -min(motion.channels["theta"])
    assert shown["slip"] == max(abs(motion.channels["slip"]))


def test_a_block_at_rest_has_no_extremes():
    shown = extremes.shown_by_rows(played(HITS.replace(excitation=Rest())))
    assert set(shown.values()) == {0.0}


def test_a_rotation_beyond_its_extreme_is_measured_in_radians():
    motion = played()
    shown = extremes.shown_by_rows(motion)["rotation_left"]
    far = max(abs(motion.channels["x"]))
    told = told_otherwise(motion, rotation_left=0.5 * shown)
    assert extremes.beyond(told) == pytest.approx(0.5 * shown / (1.0 + 0.5 * shown + far))


def test_a_length_beyond_its_extreme_is_measured_in_the_radius():
    motion = played()
    shown = extremes.shown_by_rows(motion)["top_displacement"]
    far = max(abs(motion.channels["x"]))
    told = told_otherwise(motion, top_displacement=0.5 * shown)
    radius = HITS.block.radius
    assert extremes.beyond(told) == pytest.approx(0.5 * shown / (radius + 0.5 * shown + far))


def test_an_extreme_that_no_row_reaches_is_not_beyond():
    motion = played()
    told = told_otherwise(motion, rotation_left=1.0, hop=1.0)
    assert extremes.beyond(told) <= extremes.beyond(motion)


def test_a_rotation_of_a_hundredth_that_no_row_shows_is_noticed():
    """In the millisecond between two rows it turns by a few thousandths at most."""
    motion = played(HITS.replace(output_step=1e-3))
    wrong = told_otherwise(
        motion, rotation_left=extremes.shown_by_rows(motion)["rotation_left"] + 0.02
    )
    assert extremes.unseen(wrong, MODEL.simulate) > 1.0


def test_between_rows_that_are_ten_times_as_far_apart_more_is_unseen():
    fine, coarse = (played(HITS.replace(output_step=step)) for step in (1e-3, 1e-2))
    at_once = [
        extremes.unseen(told_otherwise(motion, rotation_left=1.0), MODEL.simulate)
        for motion in (fine, coarse)
    ]
    assert at_once[0] > 8.0 * at_once[1]


def way(motion: Motion) -> float:
    """How far (R or rad) a place may move and come back between two rows, by a loop over rows."""
    scene, block = motion.scene, motion.scene.block
    radius = math.hypot(block.half_width, block.half_height)
    unit = math.sqrt(radius / 9.81)
    step = scene.output_step / unit
    speeds, turns, pushes, lifts = [], [], [], []
    for row, t in enumerate(motion.channels["t"]):
        x_dot, y_dot, w = (
            abs(float(motion.channels[name][row])) for name in ("x_dot", "y_dot", "theta_dot")
        )
        speeds.append((x_dot + y_dot + radius * w) * unit / radius)
        turns.append((w * unit) ** 2)
        pushes.append(abs(float(scene.excitation.acceleration(t))) / 9.81)
        lifts.append(abs(float(scene.vertical.acceleration(t))) / 9.81)
    felt = 1.0 + max(pushes) + max(lifts) + max(turns)
    # of a homogeneous block R^2 is three times the square of its radius of gyration
    return 3.0 * step * (max(speeds) + felt * step) + 1e-9


@pytest.mark.parametrize(("name", "unit"), [("rotation_left", 1.0), ("slip", HITS.block.radius)])
def test_what_no_row_shows_is_a_share_of_the_way_between_two(name, unit):
    motion = played(HITS.replace(vertical=Ricker(amplitude=4.0, period=0.5), output_step=0.02))
    shown = extremes.shown_by_rows(motion)[name]
    told = told_otherwise(motion, **{name: shown + 2.0})
    assert extremes.unseen(told, MODEL.simulate) == pytest.approx(2.0 / unit / way(motion))


def test_what_falls_is_played_up_to_its_last_row():
    scenes = []

    def play(scene):
        scenes.append(scene)
        return MODEL.simulate(scene)

    motion = played(FALLS_LATER.replace(duration=12.0))
    extremes.unseen(motion, play)
    assert [scene.duration for scene in scenes] == [motion.channels["t"][-1]]


def test_what_never_was_in_both_runs_is_no_change():
    motion = played(HITS.replace(excitation=Rest()))
    assert motion.history.extremes.first_slip_s is None
    assert extremes.change_with_rows(motion, MODEL.simulate) == 0.0


def test_a_block_that_falls_within_its_first_row_shows_nothing():
    falls = FALLS_LATER.replace(duration=12.0, output_step=12.0)
    motion = played(falls)
    until = {name: column[:1] for name, column in motion.channels.items()}
    cut = Motion(falls, dataclasses.replace(motion.history, channels=until))
    assert extremes.unseen(cut, MODEL.simulate) == 0.0


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("rotation_left", 1.0),
        ("rotation_left_s", math.sqrt(HITS.block.radius / 9.81)),
        ("slip", HITS.block.radius),
    ],
)
def test_a_change_with_rows_is_measured_in_natural_units(name, unit):
    motion = played()
    value = getattr(motion.history.extremes, name)
    told = told_otherwise(motion, **{name: value + 0.1})
    assert extremes.change_with_rows(told, MODEL.simulate) == pytest.approx(
        0.1 / (unit + value + 0.1)
    )


def test_a_speed_at_a_wall_is_measured_in_the_root_of_gravity_and_radius():
    motion = played()
    wall = motion.history.extremes.walls["left"]
    faster = dataclasses.replace(wall, speed=wall.speed + 0.1)
    told = told_otherwise(motion, walls={"left": faster})
    unit = math.sqrt(9.81 * HITS.block.radius)
    assert extremes.change_with_rows(told, MODEL.simulate) == pytest.approx(
        0.1 / (unit + wall.speed + 0.1)
    )


def test_rows_are_played_again_three_times_as_far_apart():
    steps = []

    def play(scene):
        steps.append(scene.output_step)
        return MODEL.simulate(scene)

    extremes.change_with_rows(played(), play)
    extremes.change_with_rows(played(HITS.replace(output_step=2.0)), play)
    assert steps == pytest.approx([0.124, 4.0])


def from_rows(scene: Scene) -> History:
    return dataclasses.replace(MODEL.simulate(scene), model_extremes=None)


def test_extremes_that_are_read_from_rows_change_with_them():
    assert extremes.change_with_rows(played(), MODEL.simulate) == 0.0
    motion = Motion(HITS, from_rows(HITS))
    assert extremes.change_with_rows(motion, from_rows) > 1e-6


def test_an_extreme_that_only_some_runs_have_is_a_change():
    motion = played()
    never = told_otherwise(motion, first_slip_s=None)
    assert extremes.change_with_rows(never, MODEL.simulate) == math.inf


def test_a_wall_s_strikes_belong_to_its_extremes():
    motion = played()
    wall = dataclasses.replace(motion.history.extremes.walls["left"], strikes=99)
    wrong = told_otherwise(motion, walls={"left": wall})
    assert extremes.change_with_rows(wrong, MODEL.simulate) > 0.5


@pytest.mark.parametrize("name", ["rotation_left", "reach_right", "last_slip"])
def test_a_bit_that_differs_in_the_mirror_image_is_noticed(name):
    right = MODEL.simulate(HITS).extremes
    image = MODEL.simulate(HITS.mirrored()).extremes
    assert extremes.bits_of_mirror_image(right, image) == 0
    value = math.nextafter(getattr(right, name), math.inf)
    wrong = dataclasses.replace(right, **{name: value})
    assert extremes.bits_of_mirror_image(wrong, image) == 1


def test_of_two_extremes_that_never_were_no_bit_differs():
    still = HITS.replace(excitation=Rest())
    right = MODEL.simulate(still).extremes
    assert right.first_slip_s is None
    assert extremes.bits_of_mirror_image(right, MODEL.simulate(still.mirrored()).extremes) == 0


def test_an_extreme_that_one_side_never_had_differs():
    right = MODEL.simulate(HITS).extremes
    image = dataclasses.replace(MODEL.simulate(HITS.mirrored()).extremes, first_slip_s=None)
    assert extremes.bits_of_mirror_image(right, image) == 1


def test_a_strike_at_the_same_side_of_the_image_differs():
    right = MODEL.simulate(HITS).extremes
    assert right.walls["left"].strikes > 0
    mirrored = MODEL.simulate(HITS.mirrored()).extremes
    wall = dataclasses.replace(mirrored.walls["right"], strikes=0)
    image = dataclasses.replace(mirrored, walls={"right": wall})
    assert extremes.bits_of_mirror_image(right, image) == 1


def test_a_block_that_falls_after_its_scene_has_one_fate():
    history = MODEL.simulate(FALLS_LATER)
    assert history.outcome == "moving"
    assert ends.contradictions(MODEL, FALLS_LATER, history) == 0.0


def test_a_fate_that_stops_at_the_clock_is_noticed(monkeypatch):
    """Of the same fate everywhere it is the long history that knows better."""
    history = MODEL.simulate(FALLS_LATER)

    class Standing:
        class outcome:
            @staticmethod
            def tolist():
                return [1, 1, 1, 1]

    monkeypatch.setattr(ends, "play_fates", lambda *given, **how: Standing)
    assert ends.contradictions(MODEL, FALLS_LATER, history) == 1.0
    assert "fate" in check_run(MODEL, FALLS_LATER, audit=True, only="fate").broken


def test_fates_that_differ_by_rows_or_the_mirror_image_are_noticed(monkeypatch):
    history = MODEL.simulate(FALLS_LATER)

    class Mixed:
        class outcome:
            @staticmethod
            def tolist():
                return [3, 3, 0, 3]

    monkeypatch.setattr(ends, "play_fates", lambda *given, **how: Mixed)
    assert ends.contradictions(MODEL, FALLS_LATER, history) == 2.0


def test_friction_that_is_never_decided_has_no_fate():
    model = EventBasedModel(friction="bouc-wen")
    assert ends.contradictions(model, HITS, model.simulate(HITS)) is None


def fates_of(*codes):
    """What `play_fates` gives for the scene, briefer, longer, and its mirror image."""

    class Played:
        class outcome:
            @staticmethod
            def tolist():
                return list(codes)

    return lambda *given, **how: Played


@pytest.mark.parametrize(
    ("codes", "count"),
    [
        ((3, 3, 3, 2), 0.0),  # right, and its image left
        ((3, 1, 3, 2), 1.0),
        ((3, 1, 0, 2), 2.0),
        ((3, 3, 3, 3), 1.0),
        ((2, 2, 2, 3), 1.0),  # the long history falls to the right
        ((1, 1, 1, 1), 1.0),  # and does not stand
        ((5, 5, 5, 5), 2.0),  # a fate that failed agrees with neither history
    ],
)
def test_each_contradiction_of_a_block_that_falls_later_counts(monkeypatch, codes, count):
    monkeypatch.setattr(ends, "play_fates", fates_of(*codes))
    history = MODEL.simulate(FALLS_LATER)
    assert MODEL.simulate(FALLS_LATER.replace(duration=12.0)).outcome == "overturned right"
    assert ends.contradictions(MODEL, FALLS_LATER, history) == count


#: It rocks, and comes to rest.
STANDS = HITS.replace(excitation=Ricker(amplitude=3.0, period=1.2))


@pytest.mark.parametrize(("code", "count"), [(1, 0.0), (0, 0.0), (4, 0.0), (2, 2.0)])
def test_what_stands_to_the_end_falls_in_no_fate(monkeypatch, code, count):
    """A fall contradicts the long history, and its image should fall to the other side."""
    monkeypatch.setattr(ends, "play_fates", fates_of(code, code, code, code))
    assert ends.contradictions(MODEL, STANDS, MODEL.simulate(STANDS)) == count


def test_a_history_that_fell_has_the_fate_of_its_side(monkeypatch):
    fell = FALLS_LATER.replace(duration=12.0)
    monkeypatch.setattr(ends, "play_fates", fates_of(2, 2, 2, 3))
    assert ends.contradictions(MODEL, fell, MODEL.simulate(fell)) == 2.0


def test_fates_are_asked_of_scenes_with_other_rows_and_ends(monkeypatch):
    scenes = []

    def table_of(*given):
        scenes.extend(given)

    monkeypatch.setattr(ends, "table_of", table_of)
    monkeypatch.setattr(ends, "play_fates", fates_of(3, 3, 3, 2))
    ends.contradictions(MODEL, FALLS_LATER, MODEL.simulate(FALLS_LATER))
    as_it_is, brief, long, image = scenes
    lasts = FALLS_LATER.excitation.quiet_after + 1000.0 * math.sqrt(HITS.block.radius / 9.81)
    assert as_it_is == FALLS_LATER
    assert [brief.duration, brief.output_step] == pytest.approx([3.0, 0.012])
    assert [long.duration, long.output_step] == pytest.approx([lasts, lasts / 100])
    assert image == FALLS_LATER.mirrored()
