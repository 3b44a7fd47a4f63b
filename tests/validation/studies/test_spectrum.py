"""Spectra as a study: tiles that are kept, the law of impacts, refinement, the other models, the
command."""

import base64
import io
import json
from collections import Counter

import numpy as np
import pytest

from rockcheck.cm import ContinuousModel
from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import node_scene, overturning_spectrum
from rockcheck.scenes import Block, Ricker, Scene, Wall
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.paper import Panel, paper_panels
from rockcheck.validation.studies.spectrum import tiles
from rockcheck.validation.studies.spectrum.study import KEPT_AN_AXIS, Spectra
from rockcheck.validation.studies.spectrum.tiles import Book, Request, differing, nodes_of
from rockcheck.validation.study import run

SCENE = """duration = 1.0
block = { half_width = 0.2, half_height = 1.0 }
floor = { friction = 0.5 }
walls = [{ side = "left", gap = 0.02 }]
excitation = { kind = "ricker", amplitude = 1.0, period = 0.5 }
"""


@pytest.fixture(autouse=True)
def in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bookcase.toml").write_text(SCENE, encoding="utf-8")
    still = SCENE.replace(SCENE.splitlines()[-1], "")
    (tmp_path / "still.toml").write_text(still, encoding="utf-8")


def outcomes(found):
    """The grids of a finding's files, by name."""
    return {
        name.removesuffix(".npz"): dict(np.load(io.BytesIO(content)))
        for name, content in found.files.items()
        if name.endswith("npz")
    }


def panel_of(name):
    return next(panel for panel in paper_panels() if panel.name == name)


def on_grid(frequencies, amplitudes, **how):
    """A request of a grid of any axes."""
    request = Request(size=len(amplitudes), **how)
    request.__dict__.update(frequencies=np.asarray(frequencies), amplitudes=np.asarray(amplitudes))
    return request


def test_the_papers_28_spectra():
    walls = {}
    contacts = {(g, e) for g in (0.003, 0.053, 0.103) for e in (0.0, 1.0)}
    for figure in (6, 7, 8, 9):
        free, *panels = paper_panels(figure)
        assert free.wall is None
        assert {(p.wall.gap, p.wall.restitution) for p in panels} == contacts
        (walls[figure],) = {(p.wall.side, p.scene.floor.friction) for p in panels}
    assert walls == {6: ("left", 0.3), 7: ("left", 0.6), 8: ("right", 0.3), 9: ("right", 0.6)}
    assert len(paper_panels()) == 28


# Tiles


def test_what_is_finished_is_not_run_again(tmp_path, monkeypatch):
    monkeypatch.setattr(tiles, "TILE", 20)
    study = Spectra((panel_of("figure-8-gap-3-e-0"),), Request(8))
    runs, plain = [], tiles.play_nodes

    def killed_at_the_third(scene, a, f, **rest):
        assert rest["jobs"] == 1
        runs.append(len(a))
        if len(runs) == 3:
            raise KeyboardInterrupt
        return plain(scene, a, f, **rest)

    monkeypatch.setattr(tiles, "play_nodes", killed_at_the_third)
    stopped = run(study, tmp_path / "a", jobs=1)
    assert not stopped.complete
    assert outcomes(stopped) == {}
    resumed = run(study, tmp_path / "a", jobs=1)
    # two tiles, the one that was killed, then only that and the last one
    assert runs == [20, 20, 20, 20, 4]
    assert resumed.complete
    (mine,) = outcomes(resumed).values()
    axes = study.request.frequencies, study.request.amplitudes
    direct = overturning_spectrum(study.panels[0].scene, *axes)
    np.testing.assert_array_equal(mine["outcomes"], direct.outcomes)


def test_a_task_that_failed_leaves_its_nodes_undecided():
    panel, request = panel_of("figure-8-gap-3-e-0"), Request(4)
    (task,) = Spectra((panel,), request).tasks({})[:1]
    done = {task: Failure("crashed")}
    spectrum = Book(done).spectrum(panel, request)
    assert (len(spectrum.undecided), spectrum.safe_area) == (16, 0.0)
    assert Spectra((panel,), request).gather(done).exit_code == 3


def test_a_tile_depends_on_all_that_its_outcomes_do():
    scene, a = panel_of("figure-8-gap-3-e-0").scene, np.array([1.0, 2.0])

    def key(scene=scene, a=a, f=a, model="ebm", tolerance=1e-8, what="outcomes"):
        return nodes_of(scene, a, f, model, {"tolerance": tolerance}, what)[0].key

    assert key() == key(scene.replace(name="other", duration=9.0))
    others = [
        key(scene.replace(walls=())),
        key(a=2.0 * a),
        key(f=2.0 * a),
        key(tolerance=1e-9),
        key(model="ebm-unilateral"),
        key(what="motions"),
        key(scene.replace(excitation=Ricker(amplitude=1.0, period=1.0, symmetric=True))),
    ]
    assert len({key(), *others}) == 8


def test_another_model_plays_in_processes(tmp_path):
    request = on_grid([2.0, 6.0], [1.2, 3.0], model="cm", settings={"penetration": 1e-6})
    study = Spectra((panel_of("figure-8-gap-3-e-0"),), request)
    assert {task.where for task in study.tasks({})} == {"worker"}
    found = outcomes(run(study, tmp_path, jobs=1))
    assert found["figure-8-gap-3-e-0--cm"]["outcomes"].tolist() == [[0, 0], [-1, 0]]


def test_a_block_past_its_balance_is_not_safe_for_want_of_energy():
    """Fig. 6, 103 mm, e = 0: it overturns 0.2 s after the pulse and has lost much of its energy by
    sliding."""
    panel = panel_of("figure-6-gap-103-e-0")
    a, f = np.array([1.0 + 19 * 11.0 / 99.0]), np.array([0.5 + 32 * 7.5 / 99.0])
    ended = ContinuousModel().simulate(node_scene(panel.scene, a[0], f[0], settle=0.0))
    assert ended.outcome == "moving"
    assert abs(ended.channels["theta"][-1]) > panel.scene.block.alpha
    assert nodes_of(panel.scene, a, f, "cm", {})[0].play().letters == "R"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_gives_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(tiles, "TILE", 100)
    study = Spectra(paper_panels(8)[:2], Request(20, refine=True))
    alone, together = (
        outcomes(run(study, tmp_path / name, scheduler=where))
        for name, where in (("a", None), ("b", "local:2"))
    )
    for name, mine in alone.items():
        np.testing.assert_array_equal(mine["outcomes"], together[name]["outcomes"])


def test_motions_are_the_model_s_own_and_good_enough_to_be_looked_at(tmp_path):
    study = Spectra((panel_of("figure-7-gap-3-e-1"),), Request(20))
    plot = next(run(study, tmp_path, jobs=1).plots())
    (panel,) = plot.data["panels"]
    assert len(panel["nodes"]) == KEPT_AN_AXIS**2
    assert (panel["nodes"][0], panel["nodes"][-1]) == ([0, 0], [19, 19])
    (played,) = plot.played
    rows = np.frombuffer(base64.b64decode(played["rows"]), "<f4").reshape(-1, 4)
    parts = np.split(rows.astype(float), played["ends"][:-1])
    model = tiles.build("ebm", study.request.settings)
    for number in (0, 1, 100, 255):
        i, j = panel["nodes"][number]
        node = study.request.amplitudes[i], study.request.frequencies[j]
        scene = node_scene(study.panels[0].scene, *map(float, node))
        frame = model.simulate(scene.replace(output_step=scene.duration / tiles.PARTS)).frame
        shown = np.interp(frame.t, parts[number][:, 0], parts[number][:, 1])
        assert np.abs(shown - frame.theta).max() <= 1.001 * tiles.COARSE * scene.block.alpha
        assert len(parts[number]) < len(frame)


# Refinement


def test_a_refined_spectrum_is_the_whole_one_with_fewer_runs(tmp_path):
    panels = (panel_of("figure-8-gap-53-e-0"), panel_of("figure-7-unobstructed"))
    full, refined = (
        run(Spectra(panels, Request(64, refine=refine)), tmp_path) for refine in (False, True)
    )
    for name, mine in outcomes(full).items():
        np.testing.assert_array_equal(outcomes(refined)[name]["outcomes"], mine["outcomes"])
    runs = [row["runs"] for row in refined.table("spectra").records()]
    assert max(runs) < 0.6 * 64**2
    assert refined.complete


@pytest.mark.slow
def test_refinement_misses_hairs_only(tmp_path):
    panels = tuple(
        p for p in paper_panels() if p.name.endswith(("unobstructed", "53-e-1", "3-e-0"))
    )
    full, refined = (
        outcomes(run(Spectra(panels, Request(256, refine=r)), tmp_path)) for r in (False, True)
    )
    wrong = {
        name: int(np.sum(mine["outcomes"] != refined[name]["outcomes"]))
        for name, mine in full.items()
    }
    assert not any(count for name, count in wrong.items() if not name.endswith("e-1"))
    assert max(wrong.values()) < 60


# The law of impacts

#: A node of the spectrum beside a wall at 3 mm, e = 1, that falls under one law and stands under
#: the other, between two that do not.
OF_THE_LAW = [5.0, np.linspace(0.5, 8.0, 100)[73]], [6.0, 8.0]


@pytest.mark.parametrize("refine", [False, True])
def test_nodes_that_depend_on_the_law_of_impacts_are_known(tmp_path, refine):
    request = on_grid(*OF_THE_LAW, model="ebm-unilateral", refine=refine)
    found = run(Spectra((panel_of("figure-6-gap-3-e-1"),), request), tmp_path, jobs=1)
    (row,) = found.table("spectra").records()
    assert row["depends_on_law"] == 1
    (kept,) = outcomes(found).values()
    assert kept["depends_on_law"].tolist() == [[0, 1]]
    assert next(found.plots()).data["panels"][0]["law"] == [[0, 1]]


@pytest.mark.parametrize(
    ("name", "model"), [("gap-3-e-1", "ebm"), ("unobstructed", "ebm-unilateral")]
)
def test_without_a_wall_or_a_hop_no_second_law_is_played(name, model):
    panel = panel_of(f"figure-6-{name}")
    asked = Spectra((panel,), on_grid(*OF_THE_LAW, model=model)).tasks({})
    assert [task.what for task in asked] == ["outcomes", "motions"]


@pytest.mark.parametrize(("restitutions", "laws"), [((), 3), ((0.0,), 3), ((0.5,), 4)])
def test_nodes_whose_block_lands_flat_depend_on_the_law(tmp_path, restitutions, laws):
    """A block that is dropped while it moves overturns where its trailing corner is first; the
    pulses are next to nothing."""
    block = {"block": Block(half_width=0.3, half_height=1.0), "floor": {"friction": 0.9}}
    block["walls"] = [Wall(side="right", gap=9.0, restitution=e) for e in restitutions]
    start = {"initial_height": 0.05, "initial_velocity": -1.0, "duration": 1.0}
    pulse = Ricker(amplitude=1.0, period=1.0)
    panel = Panel("dropped", "Dropped", Scene(name="dropped", excitation=pulse, **block, **start))
    study = Spectra((panel,), on_grid([50.0, 60.0], [1e-9, 2e-9], model="ebm-unilateral"))
    assert Counter(task.what for task in study.tasks({})) == {"outcomes": laws, "motions": 1}
    (found,) = outcomes(run(study, tmp_path, jobs=1)).values()
    assert found["outcomes"].tolist() == [[0, 0], [0, 0]]
    assert len(found["depends_on_law"]) == 4


def test_an_undecided_node_does_not_depend_on_the_law():
    about = dict.fromkeys(("evaluations", "scene", "model"))
    one, other = (
        Spectrum(
            outcomes=np.array(sides, dtype=np.int8).reshape(-1, 1),
            undecided=np.array(undecided, dtype=np.int64).reshape(-1, 2),
            frequency_ratios=np.ones(1),
            amplitude_ratios=np.ones(2),
            **about,
        )
        for sides, undecided in (([0, 1], [0, 0]), ([1, 0], []))
    )
    assert (
        differing(one, [other, one]).tolist() == differing(one, [one, other]).tolist() == [[1, 0]]
    )


# The command


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fig5"], "fig5"),
        (["--size", "0"], "--size: 0 is not allowed"),
        (["--size", "31623"], "--size: 31623 is not allowed"),
        (["--size", "nan"], "--size"),
        (["--frequencies", "8", "0.5"], "--frequencies: 8 to 0.5 is not allowed"),
        (["--amplitudes", "nan", "2"], "--amplitudes: nan to 2"),
        (["--amplitudes", "0", "2"], "--amplitudes: 0 to 2"),
        (["--amplitudes", "1", "inf"], "--amplitudes: 1 to inf"),
        (["--model", "mujcoo"], "did you mean 'mujoco'"),
        (["--model", "cm", "--set", "tolerance"], "--set"),
        (["--set", "tolerance=0"], "ebm.tolerance"),
        (["gone.toml"], "gone.toml: cannot be read"),
        (["still.toml"], "excitation.kind: 'rest' is not allowed"),
        (["--agreement", "0"], "--agreement: 0 is not allowed"),
        (["--agreement", "9", "--model", "cm"], "--agreement"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(words, said, refused):
    assert said in refused("spectrum", *words)


def test_the_command_writes_figures_data_and_page(tmp_path, told):
    said = told("spectrum", "fig8", "--size", "9", "--out", "out")
    folder = tmp_path / "out"
    assert {f"figure-8.{kind}" for kind in ("svg", "json", "nodes.js", "histories.js")} == {
        path.name for path in (folder / "figures").iterdir()
    }
    with np.load(folder / "figure-8-gap-3-e-0.npz") as data:
        grid, settings = data["outcomes"], json.loads(str(data["settings"]))
    assert settings["scene"]["walls"] == [{"side": "right", "gap": 0.003, "restitution": 0.0}]
    assert settings["settings"] == {"tolerance": 4e-8} == said["settings"]
    table = np.loadtxt(folder / "figure-8-gap-3-e-0.csv", delimiter=",", skiprows=2)
    np.testing.assert_array_equal(table[:, 1:], grid)
    np.testing.assert_allclose(table[:, 0], np.linspace(1.0, 12.0, 9))
    rows = said["tables"]["spectra"]
    assert [row["runs"] for row in rows] == 7 * [81]
    assert rows[1]["safe"] == np.mean(grid == 0)


@pytest.mark.parametrize(
    ("wall", "words", "model"),
    [(True, [], "ebm-unilateral"), (False, [], "ebm"), (True, ["--model", "ebm"], "ebm")],
)
def test_beside_a_wall_of_ones_own_the_block_may_hop(tmp_path, wall, words, model, told):
    text = SCENE if wall else SCENE.replace("walls", "#")
    (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
    said = told("spectrum", "mine.toml", "--size", "3", "--refine", "--out", "out", *words)
    assert said["model"] == model
    stem = "mine" if model == "ebm" else "mine--ebm-unilateral"
    for name in (f"{stem}.npz", f"figures/{stem}.svg"):
        assert (tmp_path / "out" / name).exists()
