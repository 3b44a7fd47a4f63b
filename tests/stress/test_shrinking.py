"""Smaller scenes that still fail, of failures made up."""

import numpy as np
import pytest

from rockcheck import Block, Floor, Record, Rest, Ricker, Scene, Wall
from rockcheck.validation.studies.stress.shrinking import shrink

SCENE = Scene(
    name="fails",
    block=Block(half_width=0.31234567, half_height=1.2345678),
    floor=Floor(friction=0.31234567, restitution=0.2),
    walls=[Wall(side="left", gap=0.1), Wall(side="right", gap=0.2)],
    excitation=Ricker(amplitude=2.345678, period=0.91),
    vertical=Ricker(amplitude=1.2, period=0.5),
    initial_rotation=0.0,
    initial_velocity=0.1,
    duration=4.0,
    output_step=0.02,
)


def smallest(shows, scene=SCENE, trials=5000):
    return shrink(scene, shows, trials)


def test_all_that_does_not_matter_is_dropped():
    scene, is_minimal = smallest(lambda scene: scene.floor.friction > 0.25)
    assert is_minimal
    assert scene.walls == ()
    assert scene.excitation == Rest()
    assert scene.vertical == Rest()
    assert scene.initial_velocity == 0.0
    assert scene.floor.restitution == 0.0
    assert scene.floor.friction == 0.3
    assert scene.name == "fails"


def test_what_matters_stays():
    scene, _ = smallest(lambda scene: scene.wall("right") is not None)
    assert [wall.side for wall in scene.walls] == ["right"]
    assert scene.excitation == Rest()


def test_numbers_keep_the_digits_that_matter():
    scene, _ = smallest(lambda scene: 2.345 <= getattr(scene.excitation, "amplitude", 0.0) < 2.347)
    assert scene.excitation.amplitude == 2.346


def test_a_run_is_as_short_as_the_failure_lets_it():
    scene, _ = smallest(lambda scene: scene.duration > 0.7)
    assert 0.7 < scene.duration < 0.8
    assert scene.duration / scene.output_step == pytest.approx(200.0, rel=0.02)


def test_a_record_is_cut_to_what_matters():
    samples = np.arange(1.0, 41.0)
    recorded = SCENE.replace(excitation=Record.from_samples(samples, 0.01))

    def shows(scene):
        return 7.0 in getattr(scene.excitation, "unscaled", ())

    scene, _ = smallest(shows, recorded)
    assert scene.excitation.unscaled == (7.0,)


@pytest.mark.parametrize("size", [0.1, 1.0, 30.0])
def test_the_block_is_brought_to_a_radius_near_a_metre(size):
    scene, _ = smallest(lambda scene: True, SCENE.replace(block=SCENE.block.scaled(size), walls=()))
    assert 0.5 < scene.block.radius < 2.0


@pytest.mark.parametrize("trials", [0, 3])
def test_it_ends_after_its_trials(trials):
    tried = []

    def shows(scene):
        tried.append(scene)
        return False

    scene, is_minimal = smallest(shows, trials=trials)
    assert scene == SCENE
    assert not is_minimal
    assert len(tried) == trials


def test_the_vertical_motion_is_dropped_first():
    tried = []
    smallest(lambda scene: tried.append(scene) is not None, trials=2)
    assert tried[0].vertical == Rest()
    assert tried[1].excitation == Rest()


def test_a_run_is_cut_to_a_hundredth_of_the_block_s_time():
    """Of sqrt(R/g), 0.32 s at 1 m."""
    scene, _ = smallest(lambda scene: True)
    assert 0.003 < scene.duration < 0.013
