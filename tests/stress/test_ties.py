"""Scenes on a knife edge: what a stress run holds against what is said of them."""

import pytest

from rockcheck import EventBasedModel
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
