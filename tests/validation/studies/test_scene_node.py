"""A scene's own pulse in its spectrum: played as a node, and answered first."""

import numpy as np
import pytest

from rockcheck import EventBasedModel
from rockcheck.scenes import files
from rockcheck.validation.paper import Panel
from rockcheck.validation.studies.spectrum import scene_node
from rockcheck.validation.studies.spectrum.study import Spectra
from rockcheck.validation.studies.spectrum.tiles import Request, moved_to
from rockcheck.validation.study import run

SCENE = files.load_scene("bookcase")
NODE = scene_node.ratios(SCENE)
AROUND = (0.5 * NODE[0], 2.1 * NODE[0]), (0.5 * NODE[1], 2.1 * NODE[1])


def played(tmp_path, ranges=AROUND):
    request = Request(6, *ranges, model="ebm-unilateral", through=NODE)
    return run(Spectra((Panel("own", "own", SCENE),), request), tmp_path, jobs=1)


def test_the_nearest_node_moves_to_the_value():
    assert moved_to(np.array([1.0, 2.0, 3.0]), 2.2).tolist() == [1.0, 2.2, 3.0]


def test_an_axis_that_does_not_reach_the_value_stays():
    assert moved_to(np.array([1.0, 2.0, 3.0]), 3.2).tolist() == [1.0, 2.0, 3.0]


def test_the_own_pulse_has_the_outcome_of_its_simulation(tmp_path):
    outcome = EventBasedModel(pivot="unilateral").simulate(SCENE.replace(duration=20.0)).outcome
    letter = played(tmp_path).data["own"]["letter"]
    assert (letter != "S") == outcome.startswith("overturned")


def test_the_answer_is_about_the_own_pulse(tmp_path):
    assert played(tmp_path).answer.startswith("Under its own pulse the block ")


def test_a_pulse_beyond_the_axes_is_played_all_the_same(tmp_path):
    beyond = (2.0 * NODE[0], 3.0 * NODE[0]), AROUND[1]
    assert "beyond the axes" in played(tmp_path, beyond).answer


@pytest.mark.parametrize(("letters", "nearest"), [("SSSLL", 1.5), ("LSSSS", 0.5), ("SSSSS", None)])
def test_the_nearest_change_is_that_of_the_nearest_node(letters, nearest):
    axis = np.array([0.5, 0.75, 1.0, 1.5, 2.0])
    change = scene_node.nearest_change("amplitude", axis, np.array(list(letters)), 2)
    assert (change and change.other) == nearest
