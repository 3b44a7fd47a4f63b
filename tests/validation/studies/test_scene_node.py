"""A scene's own pulse in its spectrum: played as a node, and answered first."""

import numpy as np
import pytest

from rockcheck import EventBasedModel, Record, Rest, Spectrum
from rockcheck.ebm.spectrum import node_scene
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


def test_the_node_of_a_scene_is_the_node_that_plays_it():
    assert scene_node.ratios(node_scene(SCENE, 3.0, 2.5)) == pytest.approx((2.5, 3.0))


@pytest.mark.parametrize(
    ("excitation", "node"),
    [(Record.from_samples([0.0, 1.0], 0.1), (1.0, 1.0)), (Rest(), None)],
)
def test_a_record_s_node_is_itself(excitation, node):
    assert scene_node.ratios(SCENE.replace(excitation=excitation)) == node


@pytest.mark.parametrize(
    ("scene", "axes"),
    [
        (SCENE, ["amplitude", "frequency"]),
        (SCENE.replace(excitation=Record.from_samples([0.0, 1.0], 0.1)), ["scale", "size"]),
    ],
)
def test_changes_are_told_along_the_axes_of_the_spectrum(scene, axes):
    """Of the node in the middle: it falls to the right above, and to the left beside it."""
    spectrum = Spectrum(
        outcomes=np.array([[0, 0, 0], [-1, 0, 0], [0, 1, 0]], dtype=np.int8),
        frequency_ratios=np.array([1.0, 2.0, 3.0]),
        amplitude_ratios=np.array([1.0, 2.0, 4.0]),
        evaluations=9,
        undecided=np.zeros((0, 2), dtype=np.int64),
        scene=scene,
        model=None,
    )
    found = scene_node.within(spectrum, (2.0, 2.0))
    assert [change.axis for change in found.changes] == axes
    assert [change.letter for change in found.changes] == ["R", "L"]
    assert [(change.other, change.same) for change in found.changes] == [(2.0, 1.0), (0.5, 1.0)]
    assert scene_node.within(spectrum, (2.5, 2.0)) is None
    assert scene_node.within(spectrum, (2.0, 2.5)) is None


@pytest.mark.parametrize(("letters", "same"), [("SSSLL", 1.0), ("LSSSS", 0.75), ("SSSSR", 1.5)])
def test_the_last_node_before_a_change_is_told(letters, same):
    axis = np.array([0.5, 0.75, 1.0, 1.5, 2.0])
    assert scene_node.nearest_change("size", axis, np.array(list(letters)), 2).same == same


@pytest.mark.parametrize(
    ("node", "words"),
    [
        (scene_node.NodeAnswer("U", True), "failed"),
        (scene_node.NodeAnswer("S", True), "wider"),
        (scene_node.NodeAnswer("S", False), "beyond"),
        (
            scene_node.NodeAnswer("S", True, (scene_node.Change("size", "L", 1.5, 1.2),)),
            "at 1.5 times the size (not yet at 1.2)",
        ),
    ],
)
def test_the_answer_tells_what_is_known_of_a_change(node, words):
    assert words in scene_node.answer(node, SCENE)
