"""The same spectra by the other models."""

import dataclasses
import json
from collections import defaultdict

import numpy as np
import pytest

from rockcheck import Floor, Record, Spectrum
from rockcheck.validation.paper import paper_panels
from rockcheck.validation.studies.spectrum import agreement
from rockcheck.validation.studies.spectrum.agreement_blocks import agreement_blocks
from rockcheck.validation.studies.spectrum.tiles import Book, Played, Request


def made(panel, outcomes):
    size = len(outcomes)
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
    spectrum = made(paper_panels(8)[0], np.tile(np.arange(60) >= 30, (60, 1)))
    near, away = agreement.choose_nodes(spectrum, 50, "name")
    assert len(np.unique([*near, *away], axis=0)) == 2 * len(near) == 50
    assert set(near[:, 1]) <= {28, 29, 30, 31}
    assert set(away[:, 1]).isdisjoint({28, 29, 30, 31})
    np.testing.assert_array_equal(near, agreement.choose_nodes(spectrum, 50, "name")[0])
    whole = np.concatenate(agreement.choose_nodes(spectrum, 3600, "name"))
    assert len(np.unique(whole, axis=0)) == 3600


class Answers(Book):
    """A book in which all is played: as `letter` says of (task, number of the node)."""

    def __init__(self, letter):
        super().__init__({})
        self.letter, self.played = letter, defaultdict(list)

    def ask(self, tasks):
        return [Played("".join(self.letters(task))) for task in tasks]

    def letters(self, task):
        seen = self.played[task.scene.name, task.request.model]
        for node in zip(task.amplitudes, task.frequencies, strict=True):
            seen.append(node)
            yield self.letter(task, len(seen) - 1)


@pytest.fixture
def agree(monkeypatch):

    def found_of(letter, models, spectra, map_size):
        for name, value in {
            "CANDIDATES": models,
            "MAP_SIZE": map_size,
            "PLAYED_SHARE": {"dart": 0.2, "drake": 0.2},
        }.items():
            monkeypatch.setattr(agreement, name, value)
        monkeypatch.setattr("rockcheck.validation.execute.models.not_installed", lambda model: "")
        book = Answers(letter)
        return agreement.agree(book, spectra, Request(20), 40), book.played

    return found_of


def test_agreement_counts_equal_outcomes(agree):
    panel = paper_panels(8)[0]

    def letter(task, number):
        """Of the CM's nodes the first is wrong, near the boundary, and the last of 40 has failed,
        away from it; of its map the first is wrong. Where the reference has failed nothing is
        equal to it."""
        right = "R" if task.frequencies[number % 40 % len(task.frequencies)] < 4.2 else "S"
        wrong = {
            "cm": {0: (other := {"R": "S", "S": "R"}[right]), 39: "U", 40: other},
            "ebm-unilateral": {30: "U"},
        }
        return wrong.get(task.request.model, {}).get(number, right)

    spectra = {panel: made(panel, np.tile(np.arange(20) < 10, (20, 1)))}
    found, _ = agree(letter, ("ebm-unilateral", "cm"), spectra, 5)
    assert {
        (s["model"], s["near"]): (s["equal"]["ebm"], s["nodes"], s["failed"])
        for s in found["shares"]
    } == {
        ("ebm-unilateral", True): (20, 20, 0),
        ("ebm-unilateral", False): (19, 20, 1),
        ("cm", True): (19, 20, 0),
        ("cm", False): (19, 20, 1),
    }
    _, table, by_spectrum, plot = agreement_blocks(found, [panel], came_with_package=False)
    assert table.rows[:2] == [
        ["ebm-unilateral", 1.0, 0.95, None, None, 40, 1],
        ["cm", 0.95, 0.95, 0.95, 0.9, 40, 1],
    ]
    assert by_spectrum.rows[1] == [panel.name, *table.rows[1]]
    assert json.loads(json.dumps(found)) == found
    assert [  # whether the axes are a record's
        list(
            agreement_blocks(
                found, [dataclasses.replace(panel, scene=one)], came_with_package=False
            )
        )[-1].data["record"]
        for one in (
            panel.scene,
            panel.scene.replace(excitation=Record.from_samples([0.0, 1.0], 0.1)),
        )
    ] == [False, True]
    equal = {"ebm": 25, "ebm-unilateral": 25, "cm": 24}
    assert {one["model"]: one["equal"] for one in found["maps"]} == equal
    assert [(one["row"], len(one["outcomes"])) for one in plot.data["panels"]] == [
        (name, 25) for name in equal
    ]


def test_slow_engines_play_fewer_nodes_and_only_contacts_that_they_have(agree):
    flat, bouncing = "figure-8-gap-3-e-0", "figure-8-gap-3-e-1"
    spectra = {
        panel: made(panel, -np.tile(np.arange(20) >= 10, (20, 1)).T.astype(int))
        for panel in paper_panels()
        if panel.name in (flat, bouncing)
    }
    found, played = agree(lambda *_: "S", ("ebm-unilateral", "cm", "dart", "drake"), spectra, 3)
    counted = {(s["spectrum"], s["model"], s["near"]): s["nodes"] for s in found["shares"]}
    assert {name: n for name, n in counted.items() if name[1] in ("dart", "drake")} == {
        (*name, near): 4
        for name in ((flat, "dart"), (flat, "drake"), (bouncing, "dart"))
        for near in (True, False)
    }
    assert counted[flat, "cm", True] == counted[flat, "cm", False] == 20
    assert set(played[flat, "dart"]) == set(played[flat, "drake"]) < set(played[flat, "cm"])
    assert (bouncing, "drake") not in played
    assert {one["model"] for one in found["maps"]} == {"ebm", "ebm-unilateral", "cm"}
    _, table, *_ = agreement_blocks(found, list(spectra), came_with_package=False)
    assert [row["nodes"] for row in table.records()] == [80, 80, 16, 8]


def test_a_model_that_plays_all_nodes_plays_those_near_the_boundary_that_are_more(agree):
    """Of stripes three nodes wide two nodes in the first one make all near but ten."""
    panel = paper_panels(8)[0]
    outcomes = np.tile(np.arange(20) // 3 % 2, (20, 1))
    outcomes[[5, 15], 0] = 1
    spectra = {panel: made(panel, outcomes)}
    found, _ = agree(lambda *_: "S", ("ebm-unilateral", "cm"), spectra, 3)
    near, away = (share["nodes"] for share in found["shares"] if share["model"] == "cm")
    assert near == 30
    assert away == 10


def test_an_agreement_names_the_models_that_play_fewer_nodes(agree):
    panel = paper_panels(8)[0]
    spectra = {panel: made(panel, np.tile(np.arange(20) >= 10, (20, 1)))}
    found, _ = agree(lambda *_: "S", ("ebm-unilateral", "cm", "dart", "drake"), spectra, 3)
    assert ": dart, drake." in found["about"]


def test_an_engine_that_plays_all_nodes_draws_a_map():
    assert max(agreement.PLAYED_SHARE.values()) < 1.0


@pytest.mark.parametrize("restitution", [0.0, 0.5])
def test_an_engine_without_restitution_does_not_play_a_floor_that_bounces(restitution):
    engine = Request(model="mujoco", settings={"settings": "default", "time_step": 1e-3})
    free = paper_panels(8)[0]
    scene = free.scene.replace(floor=Floor(friction=0.3, restitution=restitution))
    assert agreement.plays(engine, dataclasses.replace(free, scene=scene)) == (restitution == 0.0)


def of_models(*models):
    """An agreement made up: maps of these models, of one node a panel."""
    return {
        "about": "About.",
        "date": "2026-01-02",
        "versions": {"rockcheck": "9.9"},
        "settings": {"ebm": {}, "cm": {"penetration": 1e-6}},
        "shares": [],
        "map_frequencies": [1.0],
        "map_amplitudes": [2.0],
        "maps": [
            {
                "model": model,
                "nodes": 8,
                "equal": 7,
                "outcomes": {panel.name: ["S"] for panel in paper_panels(8)},
            }
            for model in models
        ],
    }


def map_of(*models):
    return [*agreement_blocks(of_models(*models), paper_panels(8), came_with_package=False)][-1]


def test_only_the_first_model_s_maps_have_the_titles_of_the_panels():
    count = len(paper_panels(8))
    titled = [bool(tile["title"]) for tile in map_of("ebm", "cm").data["panels"]]
    assert titled == [True] * count + [False] * count


def test_maps_are_as_high_as_they_have_rows():
    heights = [map_of(*models).data["height"] for models in (("ebm",), ("ebm", "cm"))]
    assert heights == pytest.approx([1.32, 2.24])


def test_a_model_is_not_compared_with_itself():
    note = map_of("ebm", "ebm-unilateral", "cm").note
    assert note.endswith(": ebm 7 of 8, cm 7 of 8.")


@pytest.mark.parametrize(
    ("came", "words"),
    [
        (False, "About. Computed on 2026-01-02. Settings: ebm as it comes; cm penetration 1e-06."),
        (True, "About. Not computed in this run: it came with the package, from a run on"),
    ],
)
def test_an_agreement_says_where_it_comes_from(came, words):
    first = next(agreement_blocks(of_models("ebm"), paper_panels(8), came_with_package=came))
    assert first.text.startswith(words)


def test_the_command_compares_models(tmp_path, monkeypatch, told):
    monkeypatch.setattr(agreement, "CANDIDATES", ("ebm-unilateral",))
    monkeypatch.setattr(agreement, "MAP_SIZE", 5)
    said = told("spectrum", "fig8", "--size", "12", "--agreement", "6", "--out", str(tmp_path))
    (row,) = said["tables"]["agreement"]
    assert row["model"] == "ebm-unilateral"
    assert row["nodes"] == 7 * 6
    assert [one["model"] for one in said["agreement"]["maps"]] == ["ebm", "ebm-unilateral"]
    assert (tmp_path / "figures" / "models.svg").exists()
