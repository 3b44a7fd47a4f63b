"""Conformance cards: planted faults fail just the cards that they should, and outside engines take part."""

from __future__ import annotations

import dataclasses
import json
import math
import os
from importlib.util import find_spec

import numpy as np
import pytest
from junitparser import JUnitXml

from rockcheck import engines
from rockcheck.commands.cli import main
from rockcheck.engines import MuJoCo
from rockcheck.reports.scene_file import write_scene_file
from rockcheck.scenes import Floor, InputError, ModelFailure, Wall, load_scene
from rockcheck.validation.conformance import cards as cards_module
from rockcheck.validation.conformance.cards import as_json, changes, junit, make_card, markdown, read_cards
from rockcheck.validation.conformance.phenomena import PHENOMENA, SCENES
from rockcheck.validation.conformance.study import Asked, card_of, engines_here, slug_of

RIGHT = MuJoCo(time_step=1e-3)


def card(play, **about):
    return make_card(play, **{"engine": "planted", "version": "1", "settings": "best", "step": 1e-3, **about})


@pytest.fixture(scope="session")
def histories():
    """The histories of an engine that conforms, which is played once."""
    return {name: RIGHT.simulate(scene) for name, scene in SCENES.items()}


@pytest.fixture(scope="session")
def right(histories):
    return card(lambda scene: histories[scene.name])


def without_restitution(scene):
    walls = [Wall(side=wall.side, gap=wall.gap) for wall in scene.walls]
    return RIGHT.simulate(scene.replace(floor=Floor(friction=scene.floor.friction), walls=walls))


def with_convex_cone(scene):
    return MuJoCo(time_step=1e-3, cone_correction=False).simulate(scene)


def with_friction_doubled(scene):
    floor = Floor(friction=2.0 * scene.floor.friction, restitution=scene.floor.restitution)
    return RIGHT.simulate(scene.replace(floor=floor))


def with_creep(scene):
    """Friction that gives way by 1 µm/s where it carries all it can."""
    history = RIGHT.simulate(scene)
    if scene.floor.friction == 0.0:
        return history
    t, x = history.channels["t"], history.channels["x"]
    share = -scene.excitation.acceleration(t) / (scene.floor.friction * scene.gravity)
    crept = x + 1e-6 * np.concatenate([[0.0], np.cumsum(np.diff(t) * share[1:])])
    return dataclasses.replace(history, channels={**history.channels, "x": crept})


class SinglePrecision(MuJoCo):
    """Keeps its state in float32."""

    def rigid_world(self, scene):
        world = super().rigid_world(scene)
        whole = world.step

        def step(felt, dt):
            whole(felt, dt)
            world.place(np.array(world.state(), dtype=np.float32).astype(float))

        world.step = step
        return world


def in_single_precision(scene):
    return SinglePrecision(time_step=1e-3).simulate(scene)


@pytest.mark.parametrize(
    ("play", "failing"),
    [
        (without_restitution, {"RC-06", "RC-07"}),
        (with_convex_cone, {"RC-04"}),
        (with_friction_doubled, {"RC-01", "RC-02"}),
        (with_creep, {"RC-03"}),
        (in_single_precision, {"RC-05"}),
    ],
    ids=lambda one: getattr(one, "__name__", ""),
)
def test_a_planted_fault_fails_just_its_cards(play, failing):
    assert {row.id for row in card(play).failed} == failing


def test_an_engine_at_its_best_conforms(right):
    assert [row.id for row in right.failed] == []
    assert [row.verdict for row in right.phenomena].count("reported") == 1


def test_the_engines_here_are_those_that_are_installed():
    """`ROCKCHECK_ENGINES` names those that must be, so that no machine that should have them skips their tests unseen."""
    installed = {one.name for one in map(engines.__dict__.get, engines.__all__) if not one.module or find_spec(one.module)}
    assert set(engines_here()) == installed
    assert set(os.environ.get("ROCKCHECK_ENGINES", "mujoco").split()) <= set(engines_here())


@pytest.mark.parametrize(
    ("name", "failing"),
    [("mujoco", set()), ("pymunk", set()), ("dart", {"RC-03"}), pytest.param("drake", set(), marks=pytest.mark.slow)],
)
def test_an_engine_gets_a_card(name, failing):
    """What fails at the best settings is known and listed in the documentation."""
    if name not in engines_here():
        pytest.skip(f"{name} is not installed")
    found = card_of(Asked(name, "best", 1e-3), lambda *told: None)
    assert {row.id for row in found.failed} == failing
    assert found.version


def test_stock_engines_fail_what_they_are_known_for():
    found = card_of(Asked("mujoco", "default", 1e-3), lambda *told: None)
    assert {"RC-03", "RC-04", "RC-08"} <= {row.id for row in found.failed}
    assert {row.id for row in found.phenomena if row.verdict == "lacks"} == {"RC-06", "RC-07"}


def test_a_model_that_fails_a_scene_fails_the_cards_that_need_it(histories):
    def play(scene):
        if scene.name == "coast":
            raise ModelFailure("it blew up")
        return histories[scene.name]

    found = card(play)
    assert [(row.id, row.verdict, row.reason) for row in found.failed] == [("RC-05", "error", "it blew up")]


def test_a_history_without_the_columns_is_an_error_of_its_cards(histories):
    def play(scene):
        history = histories[scene.name]
        return dataclasses.replace(history, channels={name: history.channels[name] for name in ("t", "theta")})

    found = {row.id: row for row in card(play).phenomena}
    assert "no column x" in found["RC-01"].reason
    assert found["RC-11"].verdict == "pass"


def test_cards_read_back(right, tmp_path):
    path = tmp_path / "cards.json"
    path.write_text(json.dumps(as_json([right]), allow_nan=False), encoding="utf-8")
    (again,) = read_cards(path)
    assert [row.verdict for row in again.phenomena] == [row.verdict for row in right.phenomena]
    assert changes([right], [again]) == []


def test_what_changed_between_versions(right):
    rows = list(right.phenomena)
    rows[0] = dataclasses.replace(rows[0], value=2.0, verdict="fail")
    rows[8] = dataclasses.replace(rows[8], value=rows[8].value + 0.5 * rows[8].limit)
    newer = dataclasses.replace(right, version="2", phenomena=tuple(rows))
    found = changes([right], [newer])
    assert [(one.id, one.verdicts, one.worse) for one in found] == [
        ("RC-01", ("pass", "fail"), True),
        ("RC-09", ("pass", "pass"), False),
    ]
    assert found[0].versions == ("1", "2")
    assert len(changes([right], [])) == len(PHENOMENA)


@pytest.mark.parametrize("text", ["", "[]", '{"cards": [{}]}', '{"cards": [{"engine": 1, "phenomena": [{"id": 1}]}]}'])
def test_what_is_no_file_of_cards_is_told(text, tmp_path):
    path = tmp_path / "cards.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match="no cards"):
        read_cards(path)


def test_junit_and_markdown(right):
    broken = dataclasses.replace(
        right, engine="broken", phenomena=tuple(dataclasses.replace(row, verdict="fail", value=math.nan) for row in right.phenomena)
    )
    suites = list(JUnitXml.fromstring(junit([right, broken]).encode()))
    assert [suite.failures for suite in suites] == [0, len(PHENOMENA)]
    text = markdown([right, broken])
    assert text.count("| RC-") == 2 * len(PHENOMENA)
    assert "17 of 17 conform" in text
    assert text.count("Look at:") == len(PHENOMENA)


def test_another_program_takes_part_by_files(histories, tmp_path, capsys):
    folder = tmp_path / "mine"
    assert main(["conformance", "--export", str(folder), "--quiet"]) == 0
    for name, scene in SCENES.items():
        assert load_scene(folder / f"{slug_of(name)}.toml").initial_state == scene.initial_state
        columns = (
            histories[name].frame[["t", "x", "y", "theta"]].rename(columns={"t": "t_s", "x": "x_mm", "y": "y_m", "theta": "theta_deg"})
        )
        columns["x_mm"] *= 1e3
        columns["theta_deg"] *= 180.0 / math.pi
        columns.to_csv(folder / f"{slug_of(name)}.csv", index=False)
    out = tmp_path / "out"
    assert main(["conformance", "--histories", str(folder), "--out", str(out)]) == 0
    assert "17 of 17" in capsys.readouterr().out
    (folder / "coast.csv").unlink()
    assert main(["conformance", "--histories", str(folder), "--out", str(tmp_path / "less"), "--json"]) == 1
    (found,) = json.loads(capsys.readouterr().out)["cards"]
    assert [row["id"] for row in found["phenomena"] if row["verdict"] == "error"] == ["RC-05"]
    assert main(["conformance", "--compare", str(out / "conformance.json"), str(tmp_path / "less" / "conformance.json")]) == 1
    assert "1 changes, 1 for the worse" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--engine", "ebm"], "--engine: 'ebm' is not allowed: give one of mujoco"),
        (["--step", "2"], "--step: 2 is not allowed"),
        (["--histories", "nowhere"], "engine.toml: cannot be read"),
        (["--compare", "nowhere", "nowhere"], "nowhere: cannot be read"),
    ],
)
def test_wrong_input_is_one_line(arguments, words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["conformance", *arguments]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_the_page_says_what_goes_wrong(right, tmp_path):
    from rockcheck.reports.studies.conformance import write_conformance

    rows = [dataclasses.replace(row, verdict="fail", reason=row.phenomenon.means) for row in right.phenomena[:1]]
    broken = dataclasses.replace(right, engine="<broken>", phenomena=(*rows, *right.phenomena[1:]))
    page = write_conformance([right, broken], tmp_path).read_text(encoding="utf-8")
    assert "1 of 2 cards fail" in page
    assert "&lt;broken&gt;" in page
    assert rows[0].phenomenon.cure in page


def test_scene_files_of_all_phenomena_are_apart(tmp_path):
    assert len({slug_of(name) for name in SCENES}) == len(SCENES)
    for name, scene in SCENES.items():
        write_scene_file(scene, tmp_path, slug_of(name))
    assert len(list(tmp_path.glob("*.toml"))) == len(SCENES)
    assert set(cards_module.VERDICTS) == {"pass", "fail", "lacks", "error", "reported"}


def test_a_fault_in_code_of_ones_own_costs_its_cards_only(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "halfway.py").write_text(
        "from rockcheck.engines import MuJoCo\n\n\nclass Halfway(MuJoCo):\n"
        "    def simulate(self, scene):\n"
        "        if scene.name == 'coast':\n"
        "            raise RuntimeError('no such road')\n"
        "        return super().simulate(scene)\n",
        encoding="utf-8",
    )
    own = "halfway:Halfway"
    assert main(["conformance", "--engine", own, "--allow-code", own, "--settings", "default", "--json"]) == 1
    (found,) = json.loads(capsys.readouterr().out)["cards"]
    rows = {row["id"]: row for row in found["phenomena"]}
    assert "no such road" in rows["RC-05"]["reason"]
    assert rows["RC-06"]["verdict"] == "lacks"
    assert rows["RC-11"]["verdict"] == "pass"
