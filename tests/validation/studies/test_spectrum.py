"""Spectra as a study: tiles that are kept, the law of impacts, refinement, the other models, the
command."""

import base64
import io
import itertools
import json
from collections import Counter
from unittest.mock import Mock

import numpy as np
import pytest

from rockcheck import (
    Block,
    ContinuousModel,
    ModelFailure,
    Ricker,
    Scene,
    Sine,
    Spectrum,
    Wall,
    overturning_spectrum,
)
from rockcheck.ebm.spectrum import node_scene
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.paper import Panel, paper_panels
from rockcheck.validation.studies.spectrum.spectrum_blocks import KEPT_AN_AXIS
from rockcheck.validation.studies.spectrum.study import Spectra
from rockcheck.validation.studies.spectrum.tiles import (
    COARSE,
    PARTS,
    Book,
    Request,
    differing,
)
from rockcheck.validation.study import run

SCENE = """duration = 1.0
block = { half_width = 0.2, half_height = 1.0 }
floor = { friction = 0.5 }
walls = [{ side = "left", gap = 0.02 }]
excitation = { kind = "ricker", amplitude = 1.0, period = 0.5 }
"""


PANELS = {panel.name: panel for panel in paper_panels()}


def outcomes(found):
    return {
        name.removesuffix(".npz"): dict(np.load(io.BytesIO(content)))
        for name, content in found.files.items()
        if name.endswith("npz")
    }


def on_grid(frequencies, amplitudes, **how):
    return Request(2, tuple(frequencies), tuple(amplitudes), **how)


@pytest.mark.parametrize(
    ("figure", "side", "friction"),
    [(6, "left", 0.3), (7, "left", 0.6), (8, "right", 0.3), (9, "right", 0.6)],
)
def test_the_papers_28_spectra(figure, side, friction):
    free, *panels = paper_panels(figure)
    assert free.wall is None
    assert free.scene.floor.friction == friction
    assert {
        (p.scene.floor.friction, p.wall.side, p.wall.gap, p.wall.restitution) for p in panels
    } == {*itertools.product([friction], [side], (0.003, 0.053, 0.103), (0.0, 1.0))}
    assert len(PANELS) == len(paper_panels()) == 28


# Tiles


def test_tiles_make_the_spectrum_of_one_batch(tmp_path, monkeypatch):
    monkeypatch.setattr("rockcheck.validation.studies.spectrum.tiles.TILE", 20)
    study = Spectra((PANELS["figure-8-gap-3-e-0"],), Request(8))
    assert [task.what for task in study.tasks({})].count("outcomes") == 4
    (mine,) = outcomes(run(study, tmp_path, jobs=1)).values()
    axes = study.request.frequencies, study.request.amplitudes
    np.testing.assert_array_equal(
        mine["outcomes"], overturning_spectrum(study.panels[0].scene, *axes).outcomes
    )


def test_a_task_that_failed_leaves_its_nodes_undecided():
    study = Spectra((PANELS["figure-8-gap-3-e-0"],), Request(4))
    done = {study.tasks({})[0]: pool.Failure("crashed")}
    spectrum = Book(done).spectrum(study.panels[0], study.request)
    assert len(spectrum.undecided) == 16
    assert spectrum.safe_area == 0.0
    assert study.gather(done).exit_code == 3
    assert [
        row[-3:] for row in study.gather(done).files["figure-8-gap-3-e-0.csv"].split()[-4:]
    ] == [b",,,"] * 4


def test_a_tile_depends_on_all_that_its_outcomes_do():
    scene, a = PANELS["figure-8-gap-3-e-0"].scene, np.array([1.0, 2.0])

    def key(scene=scene, a=a, f=a, model="ebm", what="outcomes", **settings):
        request = Request(model=model, settings=settings or {"tolerance": 1e-8})
        return request.nodes(scene, a, f, what)[0].key

    assert key() == key(scene.replace(name="other", duration=9.0))
    others = [
        key(scene.replace(walls=())),
        key(a=2.0 * a),
        key(f=2.0 * a),
        key(tolerance=1e-9),
        key(model="ebm-unilateral"),
        key(what="motions"),
        # which has other steps in spectra than by default
        key(model="mujoco", cone_correction=False),
        key(model="mujoco", settings="default"),
        key(model="mujoco", time_step=1e-3),
        key(scene.replace(excitation=Ricker(amplitude=1.0, period=1.0, symmetric=True))),
    ]
    assert len({key(), *others}) == 11


def test_another_model_plays_in_processes(tmp_path):
    request = on_grid([2.0, 6.0], [1.2, 3.0], model="cm", settings={"penetration": 1e-6})
    study = Spectra((PANELS["figure-8-gap-3-e-0"],), request)
    assert {task.where for task in study.tasks({})} == {"worker"}
    (found,) = outcomes(run(study, tmp_path, jobs=1)).values()
    assert found["outcomes"].tolist() == [[0, 0], [-1, 0]]


@pytest.mark.parametrize(
    ("name", "pulse", "size", "frequency", "amplitudes", "letters"),
    [
        # As the pulses end the block turns away from rest, at 0.25, 0.99 and 1.73 alpha.
        ("figure-6-unobstructed", Ricker, 1.0, 4.5, [6.4, 6.54, 6.68], "SLL"),
        # It overturns 0.2 s after the pulse, past its balance as that ends, and has lost much of
        # its energy by sliding.
        (
            *("figure-6-gap-103-e-0", Ricker, 1.0),
            *(0.5 + 32 * 7.5 / 99.0, [1.0 + 19 * 11.0 / 99.0], "R"),
        ),
        # The pulse of a small block is over between two rows; a large one falls for minutes.
        *(
            ("figure-6-unobstructed", Sine, 10.0**k, 3.5, [1.5, 3.0, 8.0], "SRR")
            for k in (-3, 0, 3)
        ),
    ],
)
def test_a_model_that_is_simulated_plays_until_the_outcome_is_certain(
    monkeypatch, name, pulse, size, frequency, amplitudes, letters
):
    a = np.array(amplitudes)
    (nodes,) = Request(model="cm", settings={"penetration": 1e-6 * size}).nodes(
        PANELS[name].scene.replace(
            block=PANELS[name].scene.block.scaled(size),
            excitation=pulse(amplitude=1.0, period=1.0),
        ),
        a,
        np.full(len(a), frequency),
    )
    assert nodes.play().letters == letters
    monkeypatch.setattr(ContinuousModel, "simulate", Mock(side_effect=ModelFailure("too much")))
    assert nodes.play().letters == "U" * len(a)


def test_motions_are_the_model_s_own_and_good_enough_to_be_looked_at(tmp_path):
    study = Spectra((PANELS["figure-7-gap-3-e-1"],), Request(20))
    plot = next(run(study, tmp_path, jobs=1).plots())
    ((panel,), (played,)) = plot.data["panels"], plot.played
    nodes = panel["nodes"]
    assert len(nodes) == KEPT_AN_AXIS**2
    assert nodes[0] == [0, 0]
    assert nodes[-1] == [19, 19]
    rows = np.frombuffer(base64.b64decode(played["rows"]), "<f4").reshape(-1, 4)
    parts = np.split(rows.astype(float), played["ends"][:-1])
    model = models.build("ebm", study.request.settings)
    for number in (0, 1, 100, 255):
        i, j = nodes[number]
        node = study.request.amplitudes[i], study.request.frequencies[j]
        scene = node_scene(study.panels[0].scene, *map(float, node))
        frame = model.simulate(scene.replace(output_step=scene.duration / PARTS)).frame
        shown = np.interp(frame.t, parts[number][:, 0], parts[number][:, 1])
        assert np.abs(shown - frame.theta).max() <= 1.001 * COARSE * scene.block.alpha
        assert len(parts[number]) < len(frame)


# Refinement


@pytest.mark.parametrize(
    ("ends", "size", "most"),
    [
        (("8-gap-53-e-0", "7-unobstructed"), 64, 0),
        pytest.param(("unobstructed", "3-e-0"), 256, 0, marks=pytest.mark.slow),
        pytest.param(("53-e-1",), 256, 59, marks=pytest.mark.slow),  # hairs of a few nodes
    ],
)
def test_a_refined_spectrum_is_the_whole_one_with_fewer_runs(tmp_path, ends, size, most):
    panels = tuple(panel for name, panel in PANELS.items() if name.endswith(ends))
    full, refined = (run(Spectra(panels, Request(size, refine=r)), tmp_path) for r in (False, True))
    assert refined.complete
    for name, mine in outcomes(full).items():
        assert np.sum(outcomes(refined)[name]["outcomes"] != mine["outcomes"]) <= most
    assert max(row["runs"] for row in refined.table("spectra").records()) < 0.6 * size**2


# The law of impacts

#: A node of the spectrum beside a wall at 3 mm, e = 1, that falls under one law and stands under
#: the other, between two that do not.
OF_THE_LAW = [5.0, np.linspace(0.5, 8.0, 100)[73]], [6.0, 8.0]


@pytest.mark.parametrize("refine", [False, True])
def test_nodes_that_depend_on_the_law_of_impacts_are_known(tmp_path, refine):
    request = on_grid(*OF_THE_LAW, model="ebm-unilateral", refine=refine)
    found = run(Spectra((PANELS["figure-6-gap-3-e-1"],), request), tmp_path, jobs=1)
    assert [row["depends_on_law"] for row in found.table("spectra").records()] == [1]
    (kept,) = outcomes(found).values()
    shown = next(found.plots()).data["panels"][0]["law"]
    assert kept["depends_on_law"].tolist() == shown == [[0, 1]]


@pytest.mark.parametrize(
    ("name", "model"), [("gap-3-e-1", "ebm"), ("unobstructed", "ebm-unilateral")]
)
def test_without_a_wall_or_a_hop_no_second_law_is_played(name, model):
    asked = Spectra((PANELS[f"figure-6-{name}"],), on_grid(*OF_THE_LAW, model=model)).tasks({})
    assert [task.what for task in asked] == ["outcomes", "motions"]


@pytest.mark.parametrize(("restitutions", "laws"), [((), 3), ((0.0,), 4), ((0.5,), 4)])
def test_nodes_whose_block_lands_flat_depend_on_the_law(tmp_path, restitutions, laws):
    """A block that is dropped while it moves overturns where its trailing corner is first; the
    pulses are next to nothing."""
    scene = Scene(
        name="dropped",
        excitation=Ricker(amplitude=1.0, period=1.0),
        block=Block(half_width=0.3, half_height=1.0),
        floor={"friction": 0.9},
        walls=[Wall(side="right", gap=9.0, restitution=e) for e in restitutions],
        initial_height=0.05,
        initial_velocity=-1.0,
        duration=1.0,
    )
    grid = on_grid([50.0, 60.0], [1e-9, 2e-9], model="ebm-unilateral")
    study = Spectra((Panel("dropped", "Dropped", scene),), grid)
    assert Counter(task.what for task in study.tasks({})) == {"outcomes": laws, "motions": 1}
    (found,) = outcomes(run(study, tmp_path, jobs=1)).values()
    assert found["outcomes"].tolist() == [[0, 0], [0, 0]]
    assert len(found["depends_on_law"]) == 4


def test_an_undecided_node_does_not_depend_on_the_law():
    one, other = (
        Spectrum(
            outcomes=np.array(sides, dtype=np.int8).reshape(-1, 1),
            undecided=np.array(undecided, dtype=np.int64).reshape(-1, 2),
            frequency_ratios=np.ones(1),
            amplitude_ratios=np.ones(2),
            **dict.fromkeys(("evaluations", "scene", "model")),
        )
        for sides, undecided in (([0, 1], [0, 0]), ([1, 0], []))
    )
    for reference, others in ((one, [other, one]), (other, [one, other])):
        assert differing(reference, others).tolist() == [[1, 0]]


# The command


def test_the_command_writes_figures_data_and_page(tmp_path, told):
    said = told("spectrum", "fig8", "--size", "9", "--out", str(tmp_path))
    assert {f"figure-8.{kind}" for kind in ("svg", "json", "nodes.js", "histories.js")} == {
        path.name for path in (tmp_path / "figures").iterdir()
    }
    data = dict(np.load(tmp_path / "figure-8-gap-3-e-0.npz"))
    settings = json.loads(str(data["settings"]))
    assert settings["scene"]["walls"] == [{"side": "right", "gap": 0.003, "restitution": 0.0}]
    assert settings["settings"] == {"tolerance": 4e-8} == said["settings"]
    np.testing.assert_allclose(
        np.loadtxt(tmp_path / "figure-8-gap-3-e-0.csv", delimiter=",", skiprows=2),
        np.column_stack([np.linspace(1.0, 12.0, 9), data["outcomes"]]),
    )
    rows = said["tables"]["spectra"]
    assert [row["runs"] for row in rows] == 7 * [81]
    assert rows[1]["safe"] == np.mean(data["outcomes"] == 0)


@pytest.mark.parametrize(
    ("text", "words", "model", "stem"),
    [
        (SCENE, [], "ebm-unilateral", "shelf--ebm-unilateral"),
        (SCENE.replace("walls", "#"), [], "ebm", "shelf"),
        (SCENE, ["--model", "ebm"], "ebm", "shelf"),
    ],
)
def test_beside_a_wall_of_ones_own_the_block_may_hop(
    tmp_path, written, told, text, words, model, stem
):
    own = str(written("shelf.toml", text))
    asked = ("spectrum", own, "--size", "3", "--refine", "--out", str(tmp_path))
    assert told(*asked, *words)["model"] == model
    assert {path.name for path in tmp_path.rglob("*.*")} >= {f"{stem}.npz", f"{stem}.svg"}


@pytest.mark.parametrize(
    ("model", "digest"),
    [("ebm", "code_digest"), ("cm", "sources_digest"), ("mujoco", "sources_digest")],
)
def test_nodes_are_played_again_where_the_code_that_plays_them_changed(monkeypatch, model, digest):
    """Of slow models only what plays nodes counts, beside the model's own code."""

    def key():
        (task,) = Request(2, model=model).nodes(PANELS["figure-8-unobstructed"].scene, ONE, ONE)
        return task.key

    before = key()
    assert key() == before
    monkeypatch.setattr(provenance, digest, lambda *files: "another")
    assert key() != before


ONE = np.ones(1)
