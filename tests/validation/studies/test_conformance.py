"""Conformance cards: planted faults fail just what they should, and outside engines take part."""

import dataclasses
import math
import os
import re
from importlib.util import find_spec
from types import SimpleNamespace

import mujoco
import numpy as np
import pandas as pd
import pytest
from junitparser import JUnitXml

from rockcheck import EventBasedModel, InputError, ModelFailure, MuJoCo, load_scene
from rockcheck.commands.cli import main
from rockcheck.ebm.ties import ties_of
from rockcheck.engines import registry
from rockcheck.scenes import writing
from rockcheck.validation.execute import models, pool
from rockcheck.validation.studies.conformance import cards
from rockcheck.validation.studies.conformance.cards import WORDINGS, Conformance
from rockcheck.validation.studies.conformance.changes import changes
from rockcheck.validation.studies.conformance.export import STATE
from rockcheck.validation.studies.conformance.phenomena import PHENOMENA, SCENES
from rockcheck.validation.studies.conformance.phenomenon import Motion
from rockcheck.validation.studies.conformance.players import (
    Player,
    named,
    written as written_in,
)
from rockcheck.validation.studies.conformance.trial import advice_of
from rockcheck.validation.studies.conformance.tuning import Tune

RIGHT, CONVEX = MuJoCo(time_step=1e-3), MuJoCo(time_step=1e-3, cone_correction=False)
HERE = [name for name in models.ENGINE_NAMES if not models.not_installed(name)]


def played(player):
    conformance = Conformance((player,))
    return conformance.gather({t: pool.guarded(Conformance.play, t) for t in conformance.tasks({})})


def verdicts(found, *wanted):
    (card,) = found.data["cards"]
    return {row["id"] for row in card["phenomena"] if row["verdict"] in wanted}


@pytest.fixture
def planted(monkeypatch):
    def gather(play):
        monkeypatch.setattr(
            "rockcheck.validation.execute.models.build",
            lambda *_: SimpleNamespace(simulate=play),
        )
        return played(
            Player(
                label="planted",
                family="planted:Planted",
                settings={},
                setup="best",
                step=1e-3,
                version="1",
            )
        )

    return gather


@pytest.fixture(scope="module")
def histories():
    return {name: RIGHT.simulate(scene) for name, scene in SCENES.items()}


def without_restitution(scene):
    walls = [wall.replace(restitution=0.0) for wall in scene.walls]
    return RIGHT.simulate(scene.replace(floor=scene.floor.replace(restitution=0.0), walls=walls))


def with_friction_doubled(scene):
    doubled = min(2.0 * scene.floor.friction, 1.333)  # above, a slipping pivot may jam
    return RIGHT.simulate(scene.replace(floor=scene.floor.replace(friction=doubled)))


def with_creep(scene):
    """Friction that gives way by 1 µm/s where it carries all it can."""
    history = RIGHT.simulate(scene)
    if scene.floor.friction == 0.0:
        return history
    t = history.channels["t"]
    share = -scene.excitation.acceleration(t) / (scene.floor.friction * scene.gravity)
    crept = 1e-6 * np.concatenate([[0.0], np.cumsum(np.diff(t) * share[1:])])
    return dataclasses.replace(
        history, channels=history.channels | {"x": history.channels["x"] + crept}
    )


class SinglePrecision(MuJoCo):
    def rigid_world(self, scene):
        world = super().rigid_world(scene)
        whole = world.step

        def step(felt, dt):
            whole(felt, dt)
            world.place(*np.array(world.state(), dtype=np.float32).tolist())

        world.step = step
        return world


@pytest.mark.parametrize(
    ("play", "failing"),
    [
        (without_restitution, {"RC-06", "RC-07"}),
        (CONVEX.simulate, {"RC-04"}),
        *(
            pytest.param(*fault, marks=pytest.mark.slow)
            for fault in (
                (with_friction_doubled, {"RC-01", "RC-02", "RC-20", "RC-24"}),
                (with_creep, {"RC-03"}),
                (SinglePrecision(time_step=1e-3).simulate, {"RC-05"}),
            )
        ),
    ],
    ids=["no restitution", "convex cone", "double friction", "creep", "single precision"],
)
def test_a_planted_fault_fails_just_what_it_should(planted, play, failing):
    assert verdicts(planted(play), "fail", "error") == failing


@pytest.mark.parametrize(
    ("id", "value", "said"),
    [("RC-05", 1.00003, "1.00003, 1 ± 1e-05"), ("RC-02", math.nan, "never")],
)
def test_a_wrong_value_is_not_shown_as_the_right_one(id, value, said):
    verdict, reason = PHENOMENA[id].judge(value)
    assert (verdict, reason[: len(said)]) == ("fail", said)


def test_the_engines_here_are_those_that_are_installed():
    # `ROCKCHECK_ENGINES` names those that must be, so that none is skipped unseen.
    known = [facts.engine for facts in registry.every()]
    assert set(HERE) == {one.name for one in known if not one.module or find_spec(one.module)}
    assert set(os.environ.get("ROCKCHECK_ENGINES", "mujoco").split()) <= set(HERE)


@pytest.mark.parametrize(
    ("name", "settings", "lacks", "failing"),
    [
        ("mujoco", "best", 0, set()),
        (
            "mujoco",
            "default",
            3,
            {"RC-03", "RC-04", "RC-05", "RC-08", "RC-14", "RC-21", "RC-22", "RC-28"},
        ),
        *(
            pytest.param(*row, marks=[pytest.mark.slow, pytest.mark.needs(row[0])])
            for row in (
                ("pymunk", "best", 0, set()),
                ("dart", "best", 0, {"RC-03"}),
                ("box2d", "best", 0, {"RC-03", "RC-05", "RC-06", "RC-07", "RC-22", "RC-26"}),
            )
        ),
        *(
            pytest.param(*row, marks=pytest.mark.needs(row[0]))
            for row in (
                (
                    *("box2d", "default", 0),
                    {
                        "RC-02",
                        "RC-05",
                        "RC-06",
                        "RC-07",
                        "RC-09",
                        "RC-21",
                        "RC-24",
                        "RC-26",
                        "RC-27",
                    },
                ),
            )
        ),
        pytest.param(
            "drake", "best", 3, set(), marks=[pytest.mark.slow, pytest.mark.needs("drake")]
        ),
    ],
)
def test_an_engine_gets_a_card_on_which_what_fails_is_known(name, settings, lacks, failing):
    found = played(named(name, settings, {}))
    wrong, reported = verdicts(found, "fail", "error"), verdicts(found, "reported")
    assert (wrong, reported, found.exit_code) == (failing, {"RC-18", "RC-29"}, bool(failing))
    (engine,) = found.table("engines").records()
    assert sum(engine.get(verdict, 0) for verdict in WORDINGS) == engine["total"]
    assert engine["total"] == len(PHENOMENA)
    assert (engine["lacks"], bool(engine["version"])) == (lacks, True)


def test_the_strike_of_both_walls_is_a_tie():
    assert [tie.what for tie in ties_of(SCENES["both-walls"])] == ["both walls are equally far"]


@pytest.mark.parametrize("nearer", [0, 1])
def test_of_two_walls_the_nearer_by_any_little_is_struck_first(nearer):
    scene = SCENES["both-walls"]
    walls = list(scene.walls)
    walls[nearer] = walls[nearer].replace(gap=walls[nearer].gap * (1.0 - 1e-7))
    histories = [
        EventBasedModel(pivot="unilateral").simulate(one)
        for one in (scene, scene.replace(walls=walls))
    ]
    both, first = (PHENOMENA["RC-29"].value(Motion(history)) for history in histories)
    assert both == pytest.approx(0.0, abs=1e-9)
    assert first < -0.1


def test_what_goes_wrong_in_a_scene_costs_what_needs_it(planted, histories):
    raised = {"coast": ModelFailure("it blew up"), "cone": RuntimeError("no such road")}
    kept = {name: histories["slide"].channels[name] for name in ("t", "theta")}
    played = histories | {"slide": dataclasses.replace(histories["slide"], channels=kept)}

    def play(scene):
        if scene.name in raised:
            raise raised[scene.name]
        return played[scene.name]

    found = planted(play)
    errors = [row for row in found.table("rows").records() if row["verdict"] == "error"]
    said = ("no column x", "no such road", "no column y", "it blew up")
    assert [
        (row["id"], words in row["reason"]) for words, row in zip(said, errors, strict=True)
    ] == [("RC-01", True), ("RC-02", True), ("RC-04", True), ("RC-05", True)]
    (suite,) = JUnitXml.fromstring(found.files["junit.xml"].encode())
    counts = (suite.tests, suite.failures, suite.errors, suite.skipped)
    assert (counts, found.exit_code) == ((len(PHENOMENA), 0, 4, 2), 1)


def test_what_changed_between_versions(planted, histories, written, tmp_path):
    run = planted(lambda scene: histories[scene.name]).as_dict()
    path = written("run.json", writing.json_text(run))
    assert changes(tmp_path, path).table("changes").rows == []
    rows = run["tables"]["rows"]
    for number, change in (
        (0, {"version": "2", "value": 2.0, "verdict": "fail"}),
        (5, {"value": None, "verdict": "lacks"}),
        (8, {"value": rows[8]["value"] + 0.5 * rows[8]["limit"]}),
    ):
        rows[number] |= change
    newer = written("newer.json", writing.json_text(run))
    found = changes(tmp_path, newer)
    wanted = ("id", "verdict_before", "verdict_after", "version_before", "version_after", "worse")
    assert [tuple(row[name] for name in wanted) for row in found.table("changes").records()] == [
        ("RC-01", "pass", "fail", "1", "2", True),
        ("RC-06", "pass", "lacks", "1", "1", True),
        ("RC-09", "pass", "pass", "1", "1", False),
    ]
    assert main(["compare", str(tmp_path), str(newer), "--quiet"]) == found.exit_code == 1
    gone = (
        changes(newer, written("run.json", '{"tables": {"rows": []}}')).table("changes").records()
    )
    assert [row["verdict_after"] for row in gone] == ["absent"] * len(PHENOMENA)


@pytest.mark.parametrize("text", ["", "[]", '{"tables": {"rows": [{"engine": [1]}]}}', None])
def test_what_is_no_finished_study_is_told(text, tmp_path, fault_of):
    if text is not None:
        (tmp_path / "run.json").write_text(text, "utf-8")
    assert re.search("run.json: (not|cannot be read)", str(fault_of(changes, tmp_path, tmp_path)))


@pytest.fixture
def exported(tmp_path):
    assert main(["conformance", "--export", str(tmp_path / "mine"), "--quiet"]) == 0
    return tmp_path / "mine"


def test_the_scenes_are_exported_as_plain_columns(exported):
    rows = pd.read_csv(exported / "scenes.csv", dtype=str).set_index("scene")
    assert list(rows.index) == list(SCENES)
    for name, scene in SCENES.items():
        row, path = rows.loc[name], exported / f"{name}-base.csv"
        np.testing.assert_allclose(row[list(STATE)].astype(float), scene.initial_state)
        sizes = row[["half_width_m", "left_wall_gap_m"]].astype(float).tolist()
        gap = scene.walls[0].gap if scene.walls else math.nan
        np.testing.assert_array_equal(sizes, [scene.block.half_width, gap])
        assert load_scene(exported / f"{name}.toml").initial_state == scene.initial_state
        assert path.exists() == (scene.excitation.kind != "rest" or scene.vertical.kind != "rest")
        if path.exists():
            base = pd.read_csv(path).astype(float)
            assert base["t_s"].iloc[-1] == pytest.approx(scene.duration)
            # The velocity is the integral of the acceleration, but for steps in which it jumps.
            gained = np.diff(base["x_velocity_m_s"])
            means = base["x_acceleration_m_s2"].rolling(2).mean().to_numpy()[1:]
            off = np.abs(gained - 1e-3 * means)
            assert np.sum(off > 1e-3 * max(np.max(np.abs(gained)), 1e-9)) <= 3
    told = (exported / "README.md").read_text("utf-8")
    assert [id for id in PHENOMENA if id not in told] == []


def written_by(folder, histories, names, units):
    for name in SCENES:
        frame = histories[name].frame[list(names)].rename(columns=names) * units
        frame.to_csv(folder / f"{name}.csv", index=False)


def test_another_program_takes_part_by_files(exported, histories, tmp_path, told):
    names = {"t": "t_s", "x": "x_mm", "y": "y_m", "theta": "theta_deg"}
    written_by(exported, histories, names, [1.0, 1e3, 1.0, 180.0 / math.pi])
    words = ["conformance", "--histories", str(exported), "--out", str(tmp_path), "--jobs", "1"]
    (card,) = told(*words)["cards"]
    assert (card["engine"], card["settings"], card["counts"]["pass"], card["counts"]["total"]) == (
        "my engine",
        "as it comes",
        len(PHENOMENA) - 2,
        len(PHENOMENA),
    )
    (exported / "coast.csv").unlink()
    (exported / "engine.toml").write_text('engine = "bell\\u0007"\n')  # which XML does not allow
    (card,) = told(*words, code=1)["cards"]
    assert [row["id"] for row in card["phenomena"] if row["verdict"] == "absent"] == ["RC-05"]


def test_counts_add_up_where_files_are_missing(exported, histories):
    names = {"t": "t_s", "x": "x_m", "y": "y_m", "theta": "theta_rad"}
    there = histories | {"wake": with_wake_too_far(histories["wake"])}
    for name in ("slide", "rock", "wake"):
        there[name].frame[list(names)].rename(columns=names).to_csv(exported / f"{name}.csv")
    found = played(written_in(exported))
    (engine,) = found.table("engines").records()
    missing = engine["total"] - engine["pass"] - engine["fail"]
    assert engine["total"] == len(PHENOMENA)
    assert engine["fail"] == 1
    assert engine["absent"] == missing
    assert engine["error"] == 0
    assert found.answer.endswith(f"1 fails, {missing} have no file.")


def with_wake_too_far(history):
    x = history.channels["x"]
    return dataclasses.replace(history, channels=history.channels | {"x": 10.6 * x})


def test_a_folder_without_histories_is_refused(exported, fault_of):
    assert "no histories here; write slide.csv" in str(fault_of(written_in, exported))


@pytest.mark.parametrize(("value", "words"), [(10.6, "slides too far"), (0.0, "sleeps")])
def test_the_words_of_a_failure_are_of_its_side(value, words):
    _, reason = PHENOMENA["RC-24"].judge(value)
    assert words in reason
    assert ("sleeps" in reason) == (words == "sleeps")


#: Names that only one engine has.
SETTINGS_OF = {
    "mujoco": ("impratio", "solref"),
    "drake": ("stiction", "TAMSI"),
    "pybullet": ("contactERP",),
    "pymunk": ("collision_bias",),
}


@pytest.mark.parametrize("engine", models.ENGINE_NAMES)
@pytest.mark.parametrize("id", PHENOMENA)
def test_advice_names_no_other_engines_settings(engine, id):
    phenomenon = PHENOMENA[id]
    _, reason = phenomenon.judge(math.nan, advice_of(engine, phenomenon.theme))
    others = [word for name, words in SETTINGS_OF.items() if name != engine for word in words]
    assert [word for word in others if word in reason] == []


def test_advice_names_the_engines_settings():
    assert "collision_bias" in PHENOMENA["RC-03"].judge(9.0, advice_of("pymunk", "creep"))[1]
    assert advice_of("my engine", "creep") == ""


#: Where the best settings of an engine are worse at a user's step, and why.
WORSE = {
    # Contacts as stiff as a step allows give way later than soft ones: both are off the threshold.
    ("box2d", "RC-22"),
}
#: What positions in single precision may lose in 2,400 steps over 50 m: half a digit a step.
ROUNDED = {("box2d", "RC-05"): 2400 * 2.0**-19 / 50.0}


def readings(name, settings):
    found = played(named(name, settings, {"time_step": 1.0 / 240.0}))
    return {row["id"]: row for row in found.data["cards"][0]["phenomena"]}


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.slow] if name in ("drake", "physx", "jolt") else [])
        for name in HERE
    ],
)
def test_best_settings_are_never_worse_than_default_at_a_users_step(name):
    """At 1/240 s: within the limit, or no further off than the engine as it comes."""
    best, default = (readings(name, settings) for settings in ("best", "default"))
    worse = {}
    for id, row in best.items():
        if row["verdict"] in ("pass", "reported", "lacks") or default[id]["verdict"] == "lacks":
            continue
        off, off_default = (
            math.inf if each["value"] is None else abs(each["value"] - each["target"])
            for each in (row, default[id])
        )
        if off > 1.01 * off_default + ROUNDED.get((name, id), 0.0):
            worse[id] = (row["value"], default[id]["value"])
    assert worse.keys() == {id for engine, id in WORSE if engine == name}, worse


@pytest.mark.parametrize("units", [[1.0, 1e3, 1.0, 1.0], [1e3, 1.0, 1.0, 1.0], [1, 1, 1, 57.3]])
def test_a_column_in_other_units_is_told(exported, histories, units):
    written_by(
        exported, histories, {"t": "t_s", "y": "y_m", "x": "x_m", "theta": "theta_rad"}, units
    )
    rows = played(written_in(exported)).table("rows").records()
    told = {row["id"] for row in rows if row["verdict"] == "error" and "unit?" in row["reason"]}
    assert {"RC-10", "RC-11", "RC-14", "RC-25"} <= told
    assert not any(row["value"] and abs(row["value"]) > 50.0 for row in rows if row["id"] in told)


HALFWAY = """from pathlib import Path
from typing import ClassVar
from rockcheck.engines import MuJoCo


class Halfway(MuJoCo):
    version: ClassVar[str] = '7'
    def simulate(self, scene):
        Path('played').open('a').write(scene.name + '\\n')
        if scene.name == 'coast':
            raise RuntimeError('no such road')
        return super().simulate(scene)
"""


def test_code_of_ones_own_is_played_by_a_worker_and_again_where_it_failed(
    tmp_path, monkeypatch, told
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "halfway.py").write_text(HALFWAY, "utf-8")
    own = ["conformance", "--engine", "halfway:Halfway", "--allow-code", "halfway:Halfway"]
    flawed = [*own, "--set", "cone_correction=false", "--jobs", "1"]
    found, _ = (told(*flawed, code=1) for _ in range(2))
    (card,) = found["cards"]
    settings = "as it comes, cone_correction=False"
    assert (card["version"], card["settings"]) == ("7", settings)
    failed = {row["id"]: row["verdict"] for row in card["phenomena"] if row["verdict"] != "pass"}
    assert (failed, list(found["failures"])) == (
        {"RC-04": "fail", "RC-05": "error", "RC-18": "reported", "RC-29": "reported"},
        [f"halfway:Halfway, {settings}: RC-05"],
    )
    scenes = (tmp_path / "played").read_text("utf-8").splitlines()
    assert [scenes.count(name) for name in ("coast", "rest", "uplift")] == [2, 1, 1]


#: The largest restitution at a drop of 0.2 m of engines that have not all: one applies it corner by
#: corner, the other not below 2 m/s.
MOST = {"box2d": 0.67, "physx": 0.0}


@pytest.mark.parametrize("restitution", [0.0, 0.25, 0.5, 0.75])
@pytest.mark.parametrize("engine", [name for name in HERE if name != "drake"])
def test_the_wanted_restitution_is_reached(engine, restitution):
    if restitution > MOST.get(engine, 1.0):
        with pytest.raises(InputError, match="cannot be reached"):
            Tune(engine, restitution).play()
        return
    found = Tune(engine, restitution).play()
    assert (found.reached, found.restitution, found.friction) == (
        True,
        pytest.approx(restitution, abs=5e-3),
        pytest.approx(0.3, rel=1e-2),
    )
    assert 0.0 <= found.penetration < 5e-3


@pytest.mark.slow
@pytest.mark.needs("drake")
def test_drake_bounces_by_its_dissipation_and_says_how_deep():
    found = Tune("drake", 0.5).play()
    assert found.reached
    assert found.penetration > 5e-3
    assert "speed of approach" in found.parameters["remark"]
    assert not Tune("drake", 0.5, penetration=1e-3).play().reached


def test_mujocos_parameters_do_it_in_a_file_that_owes_nothing_else_to_rockcheck():
    found = Tune("mujoco", 0.5).play().parameters
    model = mujoco.MjModel.from_xml_string(f"""
<mujoco><option timestep="0.001" integrator="Euler" cone="elliptic"/>
<default><geom solref="{found["geom solref"]}" solimp="{found["geom solimp"]}"/></default>
<worldbody><geom type="plane" size="1 1 1"/>
<body pos="0 0 0.6"><freejoint/><geom type="sphere" size="0.1"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    heights = []
    while data.time < 0.8:
        mujoco.mj_step(model, data)
        heights.append(data.qpos[2] - 0.1)
    assert max(heights[400:]) == pytest.approx(0.25 * 0.5, abs=0.01)


def test_the_command(tmp_path, told):
    words = ["conformance", "--tune", "0.5", "--engine", "mujoco", "--out", str(tmp_path)]
    found = told(*words, "--set", "penetration=1e-6", code=1)
    assert found["engines"]["mujoco"]["reached"] is False
    assert {
        row["where"] for row in found["tables"]["parameters"]
    } == MuJoCo.contact_parameters.words.keys()
    assert (tmp_path / "tuned" / "index.html").is_file()


MISTAKES = """
class Bare:
    def simulate(self, scene):
        return None


class Nothing:
    def __init__(self, **settings):
        pass

    def simulate(self, scene):
        return None


class Hangs(Nothing):
    def simulate(self, scene):
        while True:
            pass
"""


@pytest.mark.parametrize(
    ("name", "code", "words"),
    [
        ("Bare", 2, "takes no such settings: got an unexpected keyword argument 'time_step'"),
        ("Nothing", 3, "returned NoneType; `simulate` must return a rockcheck.History"),
    ],
)
def test_a_fault_of_a_class_is_one_line_once(name, code, words, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mistakes.py").write_text(MISTAKES, "utf-8")
    model = f"mistakes:{name}"
    ends = main(["conformance", "--models", model, "--allow-code", model, "--jobs", "1"])
    assert ends == code
    out, err = capfd.readouterr()
    assert (out + err).count(words) == 1
    assert "Traceback" not in out + err


def test_a_broken_class_costs_no_other_card(tmp_path, monkeypatch, told, planted, histories):
    broken = Player(label="b", family="b:B", settings={}, setup="best", step=1e-3, version="1")
    right = planted(lambda scene: histories[scene.name]).data["cards"][0]
    study = Conformance((broken, dataclasses.replace(broken, label="c")))
    failure = pool.Failure("b:B is no model", refused=True)
    done = {
        task: failure if task.player == broken else pool.guarded(Conformance.play, task)
        for task in study.tasks({})
    }
    cards = study.gather(done).data["cards"]
    assert [card["counts"]["pass"] for card in cards] == [0, right["counts"]["pass"]]
    assert study.gather(done).blocks[2].items[0] == "b 1, best: plays nothing: b:B is no model"


def test_an_engine_that_hangs_is_ended_and_named(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mistakes.py").write_text(MISTAKES, "utf-8")
    phenomena = {id: PHENOMENA[id] for id in ("RC-01", "RC-16")}
    monkeypatch.setattr(cards, "PHENOMENA", phenomena)
    model = "mistakes:Hangs"
    words = ["conformance", "--engine", model, "--allow-code", model, "--limit", "2"]
    assert main([*words, "--jobs", "1"]) == 3
    err = capfd.readouterr().err
    assert err.count("did not end within 2 s") == 1


def test_engines_may_be_named_in_one_word(tmp_path, told, monkeypatch):
    monkeypatch.setattr(cards, "PHENOMENA", {"RC-01": PHENOMENA["RC-01"]})
    names = ",".join(HERE[:2])
    words = ["conformance", "--out", str(tmp_path), "--jobs", "1"]
    found = told(*words, "--engine", names)
    assert [card["engine"] for card in found["cards"]] == HERE[:2]
