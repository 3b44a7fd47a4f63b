"""Storeys of random buildings: what must hold of their motions does, and what does not is told."""

import pytest

from rockcheck import Record
from rockcheck.scenes import buildings
from rockcheck.scenes.buildings import Modal, Mode, Regular
from rockcheck.validation.studies.stress import storeys
from rockcheck.validation.studies.stress.players import PLAYERS

PLAYER = PLAYERS["ebm-unilateral storeys"]
#: Of the first scenes one under a record in a regular building, and one by modes.
REGULAR, MODAL = 5, 9


def case_of(number):
    scene = PLAYER.scene(1, number)
    return storeys.random_building(scene, 1, number), scene


def faults(number):
    return [*storeys.faults(*case_of(number))]


@pytest.mark.parametrize("number", range(8))
def test_what_must_hold_of_a_storey_does(number):
    assert faults(number) == []


def test_every_third_building_is_given_by_its_modes():
    kinds = [type(case_of(number)[0]) for number in range(6)]
    assert kinds == [Modal, Regular, Regular] * 2


def test_the_block_stands_on_the_storey():
    building, scene = case_of(REGULAR)
    assert storeys.stood(building, scene).excitation.notes[-1].startswith(building.words)


def test_a_building_that_vibrates_too_long_is_left_out():
    slow = Modal(modes=(Mode(period=90.0, damping=0.001, participation=1.0),))
    scene = case_of(REGULAR)[1]
    scene = scene.replace(excitation=scene.excitation.scaled(1e4))
    assert storeys.stood(slow, scene) == scene
    assert [*storeys.faults(slow, scene)] == []


def wrong(monkeypatch, change):
    """Storeys whose motions are changed by a function of the ground's motion and their own."""

    def moved(building, ground, quiet):
        motion = buildings.storey_motion(building, ground, quiet)
        return change(ground, motion)

    monkeypatch.setattr(storeys, "storey_motion", moved)


def with_samples(motion, samples):
    return Record.from_samples(samples, motion.time_step)


@pytest.mark.parametrize("number", [REGULAR, MODAL])
def test_what_is_not_linear_is_told(monkeypatch, number):
    def change(ground, motion):
        return with_samples(motion, motion.samples + 1e-6 * motion.samples**2)

    wrong(monkeypatch, change)
    told = faults(number)
    assert "under twice the ground's motion it is not twice as large" in told
    assert "under the mirror image it is no mirror image" in told


def test_a_rigid_building_that_moves_by_itself_is_told(monkeypatch):
    wrong(monkeypatch, lambda ground, motion: with_samples(motion, 2.0 * motion.samples))
    told = faults(REGULAR)
    assert told == [
        "a rigid building does not move with the ground",
        "storey 0 does not move with the ground",
    ]


def test_a_motion_that_depends_on_its_steps_is_told(monkeypatch):
    def change(ground, motion):
        return with_samples(motion, (1.0 + 1e-6 * ground.time_step) * motion.samples)

    wrong(monkeypatch, change)
    (told,) = (fault for fault in faults(REGULAR) if "finer" in fault)
    assert told.startswith("with the ground's lines written finer it changes by ")


def test_the_player_tells_what_does_not_hold(monkeypatch):
    monkeypatch.setattr(storeys, "faults", lambda building, scene: iter(["it does not"]))
    played = PLAYER.check(PLAYER.scene(1, REGULAR), 1, REGULAR)
    assert played.broken == ["storey"]
    assert "it does not" in played.failure


def test_a_run_on_a_storey_has_every_invariant():
    played = PLAYER.check(PLAYER.scene(1, 0), 1, 0)
    assert played.broken == []
    assert {"storey", "energy", "mirror", "similarity"} <= {*played.figures}
