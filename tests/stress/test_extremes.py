"""Extremes and fates of a stress run: what contradicts them is noticed."""

import dataclasses
import math

import pytest

from rockcheck import EventBasedModel, Floor, History, Ricker, Scene, Wall
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
