"""The same spectra by the other models."""

import dataclasses
import json

import numpy as np

from rockcheck.ebm import Spectrum
from rockcheck.scenes import Floor
from rockcheck.validation.paper import paper_panels
from rockcheck.validation.studies.spectrum import agreement
from rockcheck.validation.studies.spectrum.tiles import Book, Played, Request


def made(panel, outcomes, size=40):
    return Spectrum(
        outcomes=np.asarray(outcomes, dtype=np.int8),
        frequency_ratios=np.linspace(0.5, 8.0, size),
        amplitude_ratios=np.linspace(1.0, 12.0, size),
        evaluations=size * size,
        undecided=np.zeros((0, 2), dtype=np.int64),
        scene=panel.scene,
        model=None,
    )


def test_half_of_the_nodes_lie_near_the_boundary():
    grid = np.zeros((60, 60), dtype=np.int8)
    grid[:, 30:] = 1
    spectrum = made(paper_panels(8)[0], grid, 60)
    near, away = agreement.choose_nodes(spectrum, 50, "name")
    assert len(np.unique([*near, *away], axis=0)) == 2 * len(near) == 50
    assert set(near[:, 1]) <= {28, 29, 30, 31}
    assert not {28, 29, 30, 31} & set(away[:, 1])
    np.testing.assert_array_equal(near, agreement.choose_nodes(spectrum, 50, "name")[0])
    whole = np.concatenate(agreement.choose_nodes(spectrum, 3600, "name"))
    assert len(np.unique(whole, axis=0)) == 3600


class Answers(Book):
    """A book in which all is played: as `letter` says of (model, scene, number of the node)."""

    def __init__(self, letter):
        super().__init__({})
        self.letter, self.played = letter, {}

    def ask(self, tasks):
        return [Played("".join(self.letters(task))) for task in tasks]

    def letters(self, task):
        seen = self.played.setdefault((task.scene.name, task.model), [])
        for node in zip(task.amplitudes, task.frequencies, strict=True):
            seen.append(node)
            yield self.letter(task, len(seen) - 1)


def test_agreement_counts_equal_outcomes(monkeypatch):
    monkeypatch.setattr(agreement, "CANDIDATES", ("ebm-unilateral", "cm"))
    monkeypatch.setattr(agreement, "MAP_SIZE", 5)
    panel, request = paper_panels(8)[0], Request(20)
    grid = np.zeros((20, 20), dtype=np.int8)
    grid[:, :10] = 1
    spectrum = made(panel, grid, 20)

    def letter(task, number):
        """Of the CM's nodes the first is wrong, near the boundary, and the last of 40 has failed,
        away from it."""
        n = number if number < 40 else number - 40
        right = "R" if task.frequencies[n % len(task.frequencies)] < 4.2 else "S"
        if task.model != "cm" or number not in (0, 39, 40):
            return right
        return "U" if number == 39 else {"R": "S", "S": "R"}[right]

    found = agreement.agree(Answers(letter), {panel: spectrum}, request, 40)
    assert {
        (s["model"], s["near"]): (s["equal"]["ebm"], s["nodes"], s["failed"])
        for s in found["shares"]
    } == {
        ("ebm-unilateral", True): (20, 20, 0),
        ("ebm-unilateral", False): (20, 20, 0),
        ("cm", True): (19, 20, 0),
        ("cm", False): (19, 20, 1),
    }
    _, table, by_spectrum, plot = agreement.blocks(found, [panel], came=False)
    assert table.rows[0] == ["ebm-unilateral", 1.0, 1.0, None, None, 40, 0]
    assert table.rows[1] == ["cm", 0.95, 0.95, 0.95, 0.95, 40, 1]
    assert by_spectrum.rows[1] == [panel.name, *table.rows[1]]
    assert json.loads(json.dumps(found)) == found
    assert {one["model"]: (one["equal"], one["nodes"]) for one in found["maps"]} == {
        "ebm": (25, 25),
        "ebm-unilateral": (25, 25),
        "cm": (24, 25),
    }
    assert [panel["row"] for panel in plot.data["panels"]] == ["ebm", "ebm-unilateral", "cm"]
    assert {len(panel["outcomes"]) for panel in plot.data["panels"]} == {25}


def test_slow_engines_play_fewer_nodes_and_only_contacts_that_they_have(monkeypatch):
    names = ("ebm-unilateral", "cm", "dart", "drake")
    monkeypatch.setattr(agreement, "CANDIDATES", names)
    monkeypatch.setattr(agreement, "not_installed", lambda model: "")
    monkeypatch.setattr(agreement, "PLAYED_SHARE", {"dart": 0.2, "drake": 0.2})
    monkeypatch.setattr(agreement, "MAP_SIZE", 3)
    flat, bouncing = "figure-8-gap-3-e-0", "figure-8-gap-3-e-1"
    grid = np.zeros((20, 20), dtype=np.int8)
    grid[10:] = -1
    panels = {panel.name: panel for panel in paper_panels()}
    spectra = {panels[name]: made(panels[name], grid, 20) for name in (flat, bouncing)}
    book = Answers(lambda *_: "S")
    found = agreement.agree(book, spectra, Request(20), 40)
    counted = {
        name: [
            (s["near"], s["nodes"]) for s in found["shares"] if (s["spectrum"], s["model"]) == name
        ]
        for name in book.played
    }
    assert counted[flat, "cm"] == [(True, 20), (False, 20)]
    assert (
        counted[flat, "dart"]
        == counted[flat, "drake"]
        == counted[bouncing, "dart"]
        == [(True, 4), (False, 4)]
    )
    played = {name: set(nodes) for name, nodes in book.played.items()}
    assert played[flat, "dart"] == played[flat, "drake"] < played[flat, "cm"]
    assert (bouncing, "drake") not in played
    assert {one["model"] for one in found["maps"]} == {"ebm", "ebm-unilateral", "cm"}
    table = list(agreement.blocks(found, list(spectra), came=False))[1]
    nodes = [row["nodes"] for row in table.records()]
    assert nodes == [80, 80, 16, 8]


def test_an_engine_without_restitution_does_not_play_a_floor_that_bounces():
    engine = Request(model="mujoco", settings={"settings": "default", "time_step": 1e-3})
    free = next(panel for panel in paper_panels() if panel.wall is None)
    bouncy = free.scene.replace(floor=Floor(friction=0.3, restitution=0.5))
    assert agreement.plays(engine, free)
    assert not agreement.plays(engine, dataclasses.replace(free, scene=bouncy))


def test_the_command_compares_models(tmp_path, monkeypatch, told):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(agreement, "CANDIDATES", ("ebm-unilateral",))
    monkeypatch.setattr(agreement, "MAP_SIZE", 5)
    said = told("spectrum", "fig8", "--size", "12", "--out", "out", "--agreement", "6")
    (row,) = said["tables"]["agreement"]
    assert row["model"] == "ebm-unilateral"
    assert row["nodes"] == 7 * 6
    assert [one["model"] for one in said["agreement"]["maps"]] == ["ebm", "ebm-unilateral"]
    assert (tmp_path / "out" / "figures" / "models.svg").exists()
