"""Spectra as a job: tiles that are kept, the command, claims, agreement, fragility."""

from __future__ import annotations

import csv
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rockcheck.cm import ContinuousModel
from rockcheck.commands.cli import main
from rockcheck.ebm import EventBasedModel, Spectrum
from rockcheck.ebm.spectrum import node_scene
from rockcheck.scenes import Block, Ricker, Scene, Wall
from rockcheck.scenes.progress import Count
from rockcheck.validation.spectra import agreement, claims, refinement
from rockcheck.validation.spectra import study as spectra
from rockcheck.validation.spectra import tiles as tiling
from rockcheck.validation.spectra.study import Panel, SpectrumRequest, axis, paper_panels, play_panels
from rockcheck.validation.spectra.tiles import Tiles, tile_key

EL_CENTRO = Path(__file__).parents[3] / "scenes" / "data" / "records" / "elcentro_1940_ns.csv"
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
    (tmp_path / "still.toml").write_text(SCENE.replace(SCENE.splitlines()[-1], ""), encoding="utf-8")


def small(size=8, **settings):
    return SpectrumRequest(axis(0.5, 8.0, size, "frequencies"), axis(1.0, 12.0, size, "amplitudes"), **settings)


def test_the_papers_28_spectra():
    walls = {}
    for figure in (6, 7, 8, 9):
        panels = paper_panels(figure)
        assert len(panels) == 7
        assert panels[0].wall is None
        assert {(p.wall.gap, p.wall.restitution) for p in panels[1:]} == {(g, e) for g in (0.003, 0.053, 0.103) for e in (0.0, 1.0)}
        walls[figure] = {(p.wall.side, p.scene.floor.friction) for p in panels[1:]}
    assert walls == {6: {("left", 0.3)}, 7: {("left", 0.6)}, 8: {("right", 0.3)}, 9: {("right", 0.6)}}


# Tiles


def test_what_is_finished_is_not_run_again(tmp_path, monkeypatch):
    monkeypatch.setattr(tiling, "TILE", 20)
    panel, request = paper_panels(8)[1], small()
    runs, play = [], tiling.play_nodes

    def killed_at_the_third(scene, a, f, **rest):
        runs.append(len(a))
        if len(runs) == 3:
            raise KeyboardInterrupt
        return play(scene, a, f, **rest)

    monkeypatch.setattr(tiling, "play_nodes", killed_at_the_third)
    with pytest.raises(KeyboardInterrupt):
        play_panels([panel], request, Tiles(tmp_path / "tiles"))
    tiles = Tiles(tmp_path / "tiles")
    resumed = play_panels([panel], request, tiles)[0]
    assert runs == [20, 20, 20, 20, 4]  # two tiles, the one that was killed, and then only that and the last one
    assert (tiles.read_back, tiles.played) == (40, 24)
    whole = play_panels([panel], request, Tiles(tmp_path / "other"))[0]
    np.testing.assert_array_equal(resumed.outcomes, whole.outcomes)


@pytest.mark.parametrize("damage", ["", "\x00" * 64, "[]", '{"outcomes": 64}', '{"outcomes": "L"}', json.dumps({"outcomes": "x" * 64})])
def test_a_damaged_tile_is_run_again(tmp_path, damage):
    panel, request = paper_panels(8)[0], small()
    whole = play_panels([panel], request, Tiles(tmp_path))[0]
    (tile,) = tmp_path.glob("tiles/*.json")
    tile.write_text(damage, encoding="utf-8")
    tiles = Tiles(tmp_path)
    np.testing.assert_array_equal(play_panels([panel], request, tiles)[0].outcomes, whole.outcomes)
    assert (tiles.played, tiles.read_back) == (64, 0)


def test_a_tile_depends_on_all_that_its_outcomes_do():
    scene, a = paper_panels(8)[1].scene, np.array([1.0, 2.0])
    key = tile_key(scene, a, a, "ebm", {"tolerance": 1e-8})
    assert key == tile_key(scene.replace(name="other", duration=9.0), a, a, "ebm", {"tolerance": 1e-8})
    others = [
        tile_key(scene.replace(walls=()), a, a, "ebm", {"tolerance": 1e-8}),
        tile_key(scene, 2.0 * a, a, "ebm", {"tolerance": 1e-8}),
        tile_key(scene, a, 2.0 * a, "ebm", {"tolerance": 1e-8}),
        tile_key(scene, a, a, "ebm", {"tolerance": 1e-9}),
        tile_key(scene, a, a, "ebm-unilateral", {"tolerance": 1e-8}),
        tile_key(scene.replace(excitation=Ricker(amplitude=1.0, period=1.0, symmetric=True)), a, a, "ebm", {"tolerance": 1e-8}),
    ]
    assert len({key, *others}) == 7


def test_another_model_plays_in_processes(tmp_path):
    panel = paper_panels(8)[1]
    a, f = np.array([1.2, 3.0, 8.0]), np.array([6.0, 2.0, 2.0])
    with Tiles(tmp_path, jobs=1) as tiles:
        sides, failed = tiles.play(panel.scene, a, f, model="cm", settings={"penetration": 1e-6})
    assert sides.tolist() == [0, -1, -1]
    assert not failed.any()


def test_a_block_past_its_balance_is_not_safe_for_want_of_energy(tmp_path):
    """Fig. 6, 103 mm, e = 0: it overturns 0.2 s after the pulse and has lost much of its energy by sliding."""
    panel = next(p for p in paper_panels(6) if p.name == "figure-6-gap-103-e-0")
    a, f = np.array([1.0 + 19 * 11.0 / 99.0]), np.array([0.5 + 32 * 7.5 / 99.0])
    ended = ContinuousModel().simulate(node_scene(panel.scene, a[0], f[0], settle=0.0))
    assert ended.outcome == "moving"
    assert abs(ended.channels["theta"][-1]) > panel.scene.block.alpha
    with Tiles(tmp_path, jobs=1) as tiles:
        sides, _ = tiles.play(panel.scene, a, f, model="cm", settings={})
    assert sides.tolist() == [1]


@pytest.mark.slow
def test_a_killed_run_goes_on_where_it_was(tmp_path, capsys):
    words = ["spectrum", "--figure", "8", "--size", "150", "--out", "out"]
    tiles = tmp_path / "out" / "spectra" / "tiles"
    command = [sys.executable, "-c", "import sys; from rockcheck.commands.cli import main; sys.exit(main())", *words]
    with subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL) as run:
        while len(list(tiles.glob("*.json"))) < 4:
            assert run.poll() is None
            time.sleep(0.002)
        run.kill()
    finished = sum(len(json.loads(tile.read_text(encoding="utf-8"))["content"]["outcomes"]) for tile in tiles.glob("*.json"))
    assert 0 < finished < 7 * 150**2
    assert main(words) == 0
    assert f"{7 * 150**2} runs, {finished} read back" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_cluster_that_loses_a_worker_gives_the_same(tmp_path, monkeypatch):
    import distributed

    monkeypatch.setattr(tiling, "TILE", 100)
    panels, request = paper_panels(8)[:3], small(40)
    alone = play_panels(panels, request, Tiles(tmp_path / "alone"))
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert len(client.run(os.getpid)) == 2
        first = threading.Event()
        killed = []

        def kill():
            first.wait(300.0)
            killed.append(next(iter(client.run(os.getpid).values())))
            os.kill(killed[0], signal.SIGKILL)

        killer = threading.Thread(target=kill)
        killer.start()
        tiles = Tiles(tmp_path / "cluster", client=client, count=Count(lambda done, total, what="": first.set()))
        together = play_panels(panels, request, tiles)
        killer.join()
        deadline = time.monotonic() + 60.0
        while killed[0] in client.run(os.getpid).values() and time.monotonic() < deadline:
            time.sleep(0.5)
        assert killed[0] not in client.run(os.getpid).values()
    assert tiles.played == 3 * 1600
    for mine, theirs in zip(together, alone, strict=True):
        np.testing.assert_array_equal(mine.outcomes, theirs.outcomes)


# The command


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--figure", "5"], "--figure: unknown figure '5'"),
        (["--figure", "8", "--scene", "bookcase.toml"], "--figure"),
        (["--size", "0"], "--size: 0 is not allowed"),
        (["--size", "31623"], "--size: 31623 is not allowed"),
        (["--size", "nan"], "--size"),
        (["--frequencies", "8", "0.5"], "--frequencies: 8 to 0.5 is not allowed: the lower end comes first"),
        (["--amplitudes", "nan", "2"], "--amplitudes: nan to 2"),
        (["--amplitudes", "0", "2"], "--amplitudes: 0 to 2"),
        (["--amplitudes", "1", "inf"], "--amplitudes: 1 to inf"),
        (["--pivot", "unilatral"], "did you mean 'unilateral'"),
        (["--model", "mujcoo"], "did you mean 'mujoco'"),
        (["--model", "cm", "--pivot", "unilateral"], "--pivot"),
        (["--model", "cm", "--tolerance", "1e-8"], "--tolerance"),
        (["--tolerance", "0"], "ebm.tolerance"),
        (["--tolerance", "nan"], "--tolerance"),
        (["--scene", "gone.toml"], "gone.toml: cannot be read"),
        (["--scene", "still.toml"], "excitation.kind: 'rest' is not allowed"),
        (["x.AT2"], "records: need --fragility"),
        (["--read", "unit=g"], "records: need --fragility"),
        (["--fragility"], "--fragility: needs --scene"),
        (["--fragility", "--scene", "bookcase.toml", "gone.AT2"], "gone.AT2"),
        (["--fragility", "--scene", "bookcase.toml", str(EL_CENTRO)], "records: 1 is too few"),
        (["--agreement", "0"], "--agreement: 0 is not allowed"),
        (["--scheduler", "local:0"], "--scheduler"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(words, said, capsys):
    assert main(["spectrum", *words]) == 2
    captured = capsys.readouterr()
    assert said in captured.err
    assert captured.err.count("\n") == 1
    assert captured.err.startswith("rockcheck: ")


def test_the_command_writes_figures_data_and_page(tmp_path, capsys):
    assert main(["spectrum", "--figure", "8", "--size", "9", "--print", "--out", "out"]) == 0
    folder = tmp_path / "out" / "spectra"
    assert {f"figure-8.{kind}" for kind in ("svg", "png", "pdf")} <= {path.name for path in folder.iterdir()}
    with np.load(folder / "figure-8-gap-3-e-0.npz") as data:
        outcomes = data["outcomes"]
        settings = json.loads(str(data["settings"]))
    assert settings["scene"]["walls"] == [{"side": "right", "gap": 0.003, "restitution": 0.0}]
    assert settings["settings"] == {"tolerance": 4e-8}
    table = np.loadtxt(folder / "figure-8-gap-3-e-0.csv", delimiter=",", skiprows=2)
    np.testing.assert_array_equal(table[:, 1:], outcomes)
    np.testing.assert_allclose(table[:, 0], np.linspace(1.0, 12.0, 9))
    out = capsys.readouterr().out
    assert "567 runs, 0 read back" in out
    assert "right-hand-side evaluation" in out
    assert "Fig. 8" in (tmp_path / "out" / "spectra.html").read_text(encoding="utf-8")
    assert main(["spectrum", "--figure", "8", "--size", "9", "--print", "--out", "out"]) == 0
    assert "567 read back" in capsys.readouterr().out


def test_ones_own_scene_and_fragility(tmp_path):
    grid = ["--scene", "bookcase.toml", "--size", "10", "--amplitudes", "1", "6", "--out", "out"]
    assert main(["spectrum", *grid, "--refine", "--pivot", "unilateral"]) == 0
    assert (tmp_path / "out" / "spectra" / "bookcase--ebm-unilateral.svg").exists()
    assert main(["spectrum", *grid, "--fragility"]) == 0
    fits = json.loads((tmp_path / "out" / "fragility" / "run.json").read_text(encoding="utf-8"))["tables"]["fits"]
    assert [fit["case"] for fit in fits] == ["with the wall", "without a wall"]
    assert (tmp_path / "out" / "fragility" / "index.html").exists()


# The law of impacts

#: A node of the spectrum beside a wall at 3 mm, e = 1, that falls under one law and stands under the other, between two that do not.
OF_THE_LAW = np.array([5.0, np.linspace(0.5, 8.0, 100)[73]]), np.array([6.0, 8.0])


@pytest.mark.parametrize("refine", [False, True])
def test_nodes_that_depend_on_the_law_of_impacts_are_known(tmp_path, refine):
    panel = next(panel for panel in paper_panels(6) if panel.name == "figure-6-gap-3-e-1")
    request = SpectrumRequest(*OF_THE_LAW, model="ebm-unilateral", refine=refine)
    with Tiles(tmp_path, jobs=1) as tiles:
        (alone,) = play_panels([panel], request, tiles)
        (found,) = play_panels([panel], request, tiles, all_laws=True)
    assert alone.depends_on_law is None
    assert found.depends_on_law.tolist() == [[0, 1]]
    np.testing.assert_array_equal(found.outcomes, alone.outcomes)
    spectra.save([panel], [found], request, tmp_path)
    assert spectra.read_index(tmp_path).spectra[0].depends_on_law == 1
    with np.load(tmp_path / "figure-6-gap-3-e-1--ebm-unilateral.npz") as data:
        assert data["depends_on_law"].tolist() == [[0, 1]]


@pytest.mark.parametrize(("name", "model"), [("gap-3-e-1", "ebm"), ("unobstructed", "ebm-unilateral")])
def test_without_a_wall_or_a_hop_no_second_law_is_played(tmp_path, name, model):
    panel = next(panel for panel in paper_panels(6) if panel.name == f"figure-6-{name}")
    with Tiles(tmp_path, jobs=1) as tiles:
        (found,) = play_panels([panel], SpectrumRequest(*OF_THE_LAW, model=model), tiles, all_laws=True)
        assert tiles.played == 4
    assert found.depends_on_law is None


@pytest.mark.parametrize(("restitutions", "laws"), [((), 3), ((0.0,), 3), ((0.5,), 4)])
def test_nodes_whose_block_lands_flat_depend_on_the_law(tmp_path, restitutions, laws):
    """A block that is dropped while it moves overturns where its trailing corner is first; the pulses are next to nothing."""
    block = {"block": Block(half_width=0.3, half_height=1.0), "floor": {"friction": 0.9}}
    block["walls"] = [Wall(side="right", gap=9.0, restitution=e) for e in restitutions]
    start = {"initial_height": 0.05, "initial_velocity": -1.0, "duration": 1.0}
    panel = Panel("dropped", "Dropped", Scene(name="dropped", excitation=Ricker(amplitude=1.0, period=1.0), **block, **start))
    request = SpectrumRequest(np.array([50.0, 60.0]), np.array([1e-9, 2e-9]), model="ebm-unilateral")
    with Tiles(tmp_path, jobs=1) as tiles:
        (found,) = play_panels([panel], request, tiles, all_laws=True)
        assert tiles.played == 4 * laws
    assert found.outcomes.tolist() == [[0, 0], [0, 0]]
    assert len(found.depends_on_law) == 4


def test_an_undecided_node_does_not_depend_on_the_law():
    about = {"frequency_ratios": np.ones(1), "amplitude_ratios": np.ones(2), "evaluations": 2, "scene": None, "model": None}
    one = Spectrum(outcomes=np.array([[0], [1]], dtype=np.int8), undecided=np.array([[0, 0]]), **about)
    other = Spectrum(outcomes=np.array([[1], [0]], dtype=np.int8), undecided=np.empty((0, 2), dtype=np.int64), **about)
    assert spectra.differing(one, [other, one]).tolist() == spectra.differing(one, [one, other]).tolist() == [[1, 0]]


def test_the_command_counts_and_marks_nodes_that_depend_on_the_law(tmp_path, capsys):
    text = SCENE.replace("half_width = 0.2, half_height = 1.0", "half_width = 0.397, half_height = 1.555").replace("0.5 }", "0.3 }", 1)
    (tmp_path / "near.toml").write_text(text.replace("gap = 0.02", "gap = 0.003, restitution = 1.0"), encoding="utf-8")
    (low, high), (weak, strong) = (map(str, map(float, values)) for values in OF_THE_LAW)
    grid = ["--frequencies", low, high, "--amplitudes", weak, strong, "--size", "2", "--out", "out"]
    assert main(["spectrum", "--scene", "near.toml", *grid]) == 0
    assert capsys.readouterr().out.splitlines()[1].split()[-1] == "1"
    page = (tmp_path / "out" / "spectra.html").read_text(encoding="utf-8")
    assert "depends on the impact law" in page
    assert main(["spectrum", "--scene", "bookcase.toml", *grid, "--pivot", "bilateral"]) == 0
    assert "impact law" not in capsys.readouterr().out


# Claims


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


def synthetic(height, size=40):
    """The 28 spectra, safe below a horizontal line at the share of the grid that `height` gives for (side, mu, gap, e) or (mu,)."""
    spectra_made = []
    for figure, (side, mu) in spectra.FIGURES.items():
        for panel in paper_panels(figure):
            key = (mu,) if panel.wall is None else (side, mu, panel.wall.gap, panel.wall.restitution)
            outcomes = np.ones((size, size), dtype=np.int8)
            outcomes[: round(size * height(*key))] = 0
            spectra_made.append(made(panel, outcomes, size))
    return spectra_made


def judged(spectra_made, least=None):
    least = least or {None: 10.0, (0.103, 0.0): 9.0, (0.103, 1.0): 8.0}
    tongues = {one.scene.floor.friction: tongue(one) for one in spectra_made if not one.scene.walls}
    return {claim.name: claim for claim in claims.check_claims(spectra_made, claims.ExtraRuns(least, tongues))}


def tongue(spectrum):
    """Nodes that are said to overturn after one impact: just above the line, at omega_p/p from 2 to 3."""
    found = np.zeros(spectrum.outcomes.shape, dtype=bool)
    lowest = int(np.argmax(~spectrum.safe[:, 0]))
    found[lowest : lowest + 3, (spectrum.frequency_ratios >= 2.0) & (spectrum.frequency_ratios <= 3.0)] = True
    return found


def verdicts(spectra_made, least=None):
    return {name: claim.verdict for name, claim in judged(spectra_made, least).items()}


def test_claims_about_areas_hold_where_made_to():
    def height(*key):
        if len(key) == 1:
            return {0.3: 0.5, 0.6: 0.4}[key[0]]
        side, mu, gap, e = key
        return 0.2 - 0.3 * (mu - 0.3) - 0.05 * e - 0.5 * gap + (0.5 if (side, gap, e) == ("right", 0.003, 0.0) else 0.0)

    found = verdicts(synthetic(height, size=1000))
    assert found["lower friction"] == found["lower restitution"] == found["smaller gap"] == "holds"
    assert found["left wall, high frequency"] == found["right wall, near"] == found["right wall, far"] == "holds"
    assert found["likelier side"] == "holds"  # all that overturns was made clockwise
    assert found["overturning with one impact"] == "does not hold"  # less is safe beside the left wall
    assert found["left wall"] == "holds"
    assert found["overturning towards the wall"] == "holds in part"  # beside the right walls, too, all was made to fall clockwise


def test_claims_about_areas_fail_where_made_to():
    def height(*key):
        if len(key) == 1:
            return {0.3: 0.4, 0.6: 0.5}[key[0]]
        _, mu, gap, e = key
        return 0.45 + 0.3 * (mu - 0.3) + 0.05 * e + 0.5 * gap

    found = verdicts(synthetic(height, size=1000), {None: 8.0, (0.103, 0.0): 9.0, (0.103, 1.0): math.inf})
    names = ("lower friction", "lower restitution", "smaller gap", "left wall, high frequency", "right wall, near", "right wall, far")
    assert found["left wall"] == "does not hold"
    assert {name: found[name] for name in names} == dict.fromkeys(names, "does not hold")


def test_the_side_decides_where_made_to():
    """Left walls leave 0.2 of the nodes safe; right ones more, the more the lower the friction is, with harm at mu 0.6 only."""

    def height(*key):
        return 0.5 if len(key) == 1 else 0.2 if key[0] == "left" else {0.3: 0.8, 0.6: 0.4}[key[1]]

    found = judged(synthetic(height, size=100))
    assert found["side matters most"].verdict == "holds"
    assert "side 40.0 %, friction 20.0 %, gap 0.0 %, restitution 0.0 %" in found["side matters most"].finding
    assert found["side and friction"].verdict == "holds"
    assert found["right wall, no guarantee"].verdict == "holds"
    assert "larger than without a wall in 6 of 12 spectra, smaller in 6" in found["right wall, no guarantee"].finding
    depends = found["right wall, what it depends on"]
    assert (depends.verdict, [row.holds for row in depends.rows]) == ("holds in part", [True, False])  # the gap was made to matter not


def test_the_side_does_not_matter_where_made_so():
    """All walls alike, and better than none: what depends on friction only does not depend on the side."""
    found = verdicts(synthetic(lambda *key: 0.2 if len(key) == 1 else {0.3: 0.4, 0.6: 0.6}[key[1]], size=100))
    assert found["side matters most"] == found["side and friction"] == "does not hold"
    assert found["right wall, no guarantee"] == "holds in part"
    assert found["right wall, what it depends on"] == "does not hold"


def test_what_holds_generally_may_have_exceptions():
    rows = [claims.Row(what="", value="", holds=k > 0) for k in range(5)]
    about = ("name", "sentence", "place", "{held} of {all}", "criterion", (6,), rows)
    assert claims._judged(*about, generally=True).verdict == "holds"
    assert claims._judged(*about).verdict == "holds in part"
    assert claims._judged(*about[:-1], rows[:4], generally=True).verdict == "holds in part"  # three in four are not more


def test_overturning_with_one_impact_is_taken_away_where_made_so():
    found = judged(synthetic(lambda *key: 0.5 if len(key) == 1 else 0.7 if key[2:] == (0.003, 0.0) else 0.4))
    claim = found["overturning with one impact"]
    assert claim.verdict == "holds"
    assert claim.rows[0].value.endswith("of which it makes 100.0 % safe")


def test_impacts_before_the_fall_are_counted(tmp_path):
    panel = next(p for p in paper_panels(6) if p.wall is None)
    request = SpectrumRequest(np.array([2.5]), np.linspace(1.0, 12.0, 23))
    spectrum = play_panels([panel], request, Tiles(tmp_path))[0]
    counted = claims._with_one_impact(spectrum, Tiles(tmp_path), request)
    assert 0 < counted.sum() <= np.sum(spectrum.outcomes == 1)
    for i, _ in np.argwhere(counted):
        history = EventBasedModel().simulate(node_scene(panel.scene, float(request.amplitudes[i]), 2.5))
        before = [event.kind for event in history.event_list if event.kind in ("floor impact", "overturned right")]
        assert before == ["floor impact", "overturned right"]


def test_a_shape_is_not_an_area():
    """Two safe regions of one area that lie elsewhere differ in shape."""
    spectra_made = synthetic(lambda *key: 0.5)
    for one in spectra_made:
        if one.scene.walls and one.scene.floor.friction == 0.6 and one.scene.walls[0].gap == 0.003:
            one.outcomes[:] = one.outcomes[::-1].copy()
    claim = judged(spectra_made)["restitution gives the shape"]
    assert claim.verdict == "does not hold"
    assert claim.rows[0].value == "the safe region differs at up to 100.0 % of the nodes between gaps, at up to 0.0 % between e"


def test_exceptions_are_named_and_found():
    def height(*key):
        return 0.5 if len(key) == 1 else 0.4 - 0.1 * key[3] - key[2] * (1.0 if key[:2] != ("right", 0.6) else 0.0)

    spectra_made = synthetic(height)
    claim = judged(spectra_made)["smaller gap"]
    assert claim.verdict == "holds in part"
    assert claim.finding == "Larger at the smaller gap in 12 of 16 pairs."  # four exceptions are too many to name
    odd = next(s for s in spectra_made if s.scene.name == "figure-8-gap-53-e-0")
    odd.outcomes[:, 10:] = 1  # less safe at high frequency
    claim = judged(spectra_made)["lower restitution"]
    assert claim.finding.endswith("Not so: right wall, μ 0.3, 53 mm.")
    row = next(row for row in claim.rows if not row.holds)
    assert "ω_p/p 2.4 to 8.0, amplitude 1.0 to 3.5" in row.value


def test_sides_that_the_pulse_turns_round():
    def height(*key):
        return 0.5 if len(key) == 1 else 0.3

    spectra_made = synthetic(height)
    for spectrum in spectra_made:
        if not spectrum.scene.walls:
            spectrum.outcomes[spectrum.outcomes == 1] = -1
    claim = judged(spectra_made)["likelier side"]
    assert claim.verdict == "does not hold"
    assert "With the pulse reversed it would be so over all of them" in claim.finding


def test_a_range_is_named_up_to_which_a_side_is_likelier():
    spectra_made = synthetic(lambda *key: 0.25)
    for spectrum in spectra_made:
        if not spectrum.scene.walls:
            spectrum.outcomes[20:] = -1  # clockwise from amplitude 10 to 19 of 40 only
    claim = judged(spectra_made)["likelier side"]
    assert claim.verdict == "holds in part"
    values = {row.what: row.value for row in claim.rows}
    assert values["μ 0.3, the lowest overturning"] == "clockwise at 40 of 40 frequencies, up to ω_p/p of 8.0"
    assert values["μ 0.3, lower amplitudes"] == "clockwise up to a_p of 8.9 g tan α"  # as many rows again


def test_the_documentation_says_what_is_found(tmp_path, monkeypatch):
    docs = Path(__file__).parents[3] / "docs"
    monkeypatch.syspath_prepend(docs / "site_tools")
    from claims import PLACE, claims_found, table

    found = claims_found(tmp_path)
    assert PLACE.findall((docs / "spectra.md").read_text(encoding="utf-8")) == [table(found)]
    assert all(claim.place for claim in found)


# Agreement


def test_half_of_the_nodes_lie_near_the_boundary():
    outcomes = np.zeros((60, 60), dtype=np.int8)
    outcomes[:, 30:] = 1
    nodes, near = agreement.choose_nodes(made(paper_panels(8)[0], outcomes, 60), 50, "name")
    assert len(np.unique(nodes, axis=0)) == 50
    assert near.sum() == 25
    np.testing.assert_array_equal(near, (nodes[:, 1] >= 28) & (nodes[:, 1] <= 31))
    again, _ = agreement.choose_nodes(made(paper_panels(8)[0], outcomes, 60), 50, "name")
    np.testing.assert_array_equal(nodes, again)
    whole, _ = agreement.choose_nodes(made(paper_panels(8)[0], outcomes, 60), 3600, "name")
    assert len(np.unique(whole, axis=0)) == 3600


def test_agreement_counts_equal_outcomes(tmp_path, monkeypatch):
    monkeypatch.setattr(agreement, "CANDIDATES", ("ebm-unilateral", "cm"))
    monkeypatch.setattr(agreement, "MAP_SIZE", 5)
    panel, request = paper_panels(8)[0], small(20)
    spectrum = play_panels([panel], request, Tiles(tmp_path))[0]

    class Player(Tiles):
        def play(self, scene, amplitudes, frequencies, *, model, settings):
            i, j = np.searchsorted(request.amplitudes, amplitudes), np.searchsorted(request.frequencies, frequencies)
            sides, failed = spectrum.outcomes[i, j].copy(), np.zeros(len(i), dtype=bool)
            if model == "cm":
                sides[0], failed[-1] = 1 - abs(sides[0]), True  # one wrong, near the boundary, and one failed, away from it
            return sides, failed

    found = agreement.agree([panel], [spectrum], request, 40, Player(tmp_path))
    assert {(s.model, s.near): (s.equal["ebm"], s.nodes, s.failed) for s in found.shares} == {
        ("ebm-unilateral", True): (20, 20, 0),
        ("ebm-unilateral", False): (20, 20, 0),
        ("cm", True): (19, 20, 0),
        ("cm", False): (19, 20, 1),
    }
    assert found.rows[0] == ("all", "ebm-unilateral", "100.0 %", "100.0 %", "–", "–", "40", "0")
    assert found.rows[1] == ("all", "cm", "95.0 %", "95.0 %", "95.0 %", "95.0 %", "40", "1")
    again = agreement.Agreement.model_validate_json(found.model_dump_json())
    assert again == found
    maps = {one.model: one for one in found.maps}
    assert {name: (one.equal, one.nodes) for name, one in maps.items()} == {"ebm": (25, 25), "ebm-unilateral": (25, 25), "cm": (24, 25)}
    (drawn,) = agreement.map_spectra(found, maps["cm"], [panel])
    assert agreement.encoded(drawn) == maps["cm"].outcomes[panel.name]
    assert drawn.undecided.tolist() == [[4, 4]]


def test_slow_engines_play_fewer_nodes_and_only_contacts_that_they_have(tmp_path, monkeypatch):
    monkeypatch.setattr(agreement, "candidates", lambda: ("ebm-unilateral", "cm", "dart", "drake"))
    monkeypatch.setattr(agreement, "PLAYED_SHARE", {"dart": 0.2, "drake": 0.2})
    monkeypatch.setattr(agreement, "MAP_SIZE", 3)
    request = small(20)
    panels = [panel for panel in paper_panels(8) if panel.name.endswith(("gap-3-e-0", "gap-3-e-1"))]
    played = {}

    class Player(Tiles):
        def play(self, scene, amplitudes, frequencies, *, model, settings):
            played.setdefault((scene.name, model), set()).update(zip(amplitudes, frequencies, strict=True))
            return np.zeros(len(amplitudes), dtype=np.int8), np.zeros(len(amplitudes), dtype=bool)

    with Player(tmp_path) as tiles:
        spectra = [play_panels([panel], request, Tiles(tmp_path))[0] for panel in panels]
        found = agreement.agree(panels, spectra, request, 40, tiles)
    counted = {name: [(s.near, s.nodes) for s in found.shares if (s.spectrum, s.model) == name] for name in played}
    flat, bouncing = "figure-8-gap-3-e-0", "figure-8-gap-3-e-1"
    assert counted[flat, "cm"] == [(True, 20), (False, 20)]
    assert counted[flat, "dart"] == counted[flat, "drake"] == counted[bouncing, "dart"] == [(True, 4), (False, 4)]
    assert played[flat, "dart"] == played[flat, "drake"] < played[flat, "cm"]
    assert (bouncing, "drake") not in played
    assert {one.model for one in found.maps} == {"ebm", "ebm-unilateral", "cm"}
    assert "fewer of the nodes: dart, drake" in found.about
    assert [(row[1], row[6]) for row in found.rows[:4]] == [("ebm-unilateral", "80"), ("cm", "80"), ("dart", "16"), ("drake", "8")]


def test_the_command_compares_models_and_refinement(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(agreement, "CANDIDATES", ("ebm-unilateral",))
    monkeypatch.setattr(agreement, "MAP_SIZE", 5)
    grid = ["--figure", "8", "--size", "12", "--out", "out"]
    assert main(["spectrum", *grid, "--agreement", "6"]) == 0
    assert main(["spectrum", *grid, "--verify"]) == 0
    folder = tmp_path / "out" / "spectra"
    assert {"agreement.json", "agreement.csv", "models.svg", "refinement.json", "refinement.csv"} <= {
        path.name for path in folder.iterdir()
    }
    page = (tmp_path / "out" / "spectra.html").read_text(encoding="utf-8")
    assert page.count("Computed on") == 2
    assert "ebm-unilateral" in capsys.readouterr().out
    with (folder / "agreement.csv").open(newline="", encoding="utf-8") as stream:
        rows = list(csv.reader(stream))
    assert tuple(rows[0]) == agreement.COLUMNS
    assert {len(row) for row in rows} == {len(agreement.COLUMNS)}


# Refinement


@pytest.mark.parametrize(
    ("inside", "dimension"),
    [
        (lambda i, j: i**2 + j**2 < 300**2, 1.0),
        (lambda i, j: j > 0.37 * i + 20, 1.0),
        (lambda i, j: (i & j) == 0, math.log2(3.0)),  # Sierpinski's triangle
        (lambda i, j: (i + j) % 2 == 0, 2.0),
        (lambda i, j: i < 0, 0.0),
    ],
)
def test_the_dimension_of_a_boundary(inside, dimension):
    outcomes = inside(*np.indices((512, 512))).astype(np.int8)
    assert refinement.boundary_dimension(outcomes) == pytest.approx(dimension, abs=0.05)


def test_wrong_nodes_are_counted(tmp_path):
    request = small(33)
    found = refinement.verify(paper_panels(8)[:2], request, Tiles(tmp_path))
    assert [one.wrong for one in found.spectra] == [0, 0]
    assert found.rows[0][:2] == ("all", str(found.runs))
    assert 0 < found.runs < found.nodes == 2 * 33**2
    full = play_panels(paper_panels(8)[:1], request, Tiles(tmp_path))[0]
    other = replace(full, outcomes=np.where(np.arange(33) == 3, 7, full.outcomes).astype(np.int8))
    assert refinement.compared("x", full, other).wrong == 33
