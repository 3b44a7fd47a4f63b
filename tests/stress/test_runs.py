"""Runs of the stress study and its maps, of models that are made up: what they are given, what is
told of them, what becomes of failures."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from made_histories import BLOCK, STANDS, G, history

from rockcheck import Ricker, Wall
from rockcheck.scenes import files
from rockcheck.validation.execute import pool
from rockcheck.validation.studies.stress import maps, players, runs
from rockcheck.validation.studies.stress.invariants import CheckedRun
from rockcheck.validation.studies.stress.maps import (
    AXES,
    CASES,
    SETUPS,
    MapResult,
    fault_of,
    map_points,
    scene_at,
    stand_still,
)
from rockcheck.validation.studies.stress.players import PLAYERS
from rockcheck.validation.studies.stress.runs import Broken, Chunk, RunTotals, Shrinking, parts
from rockcheck.validation.studies.stress.study import Stress

UNIT = math.sqrt(BLOCK.radius / G)

# Players


def test_each_variant_has_the_settings_of_its_name():
    assert PLAYERS["ebm"].settings(STANDS, 1) == {}
    assert PLAYERS["ebm no-slip"].settings(STANDS, 1) == {"friction": "no-slip"}
    floor_first = PLAYERS["ebm-unilateral floor-first"].settings(STANDS, 2)
    assert floor_first == {"impacts": "floor-first"}
    yields = PLAYERS["ebm-bouc-wen"].settings(STANDS, 1)["yield_displacement"]
    assert yields == pytest.approx(1e-3 * BLOCK.radius)


def test_lengths_and_times_of_approximate_models_are_the_block_s():
    stiff = PLAYERS["cm"].settings(STANDS, 1)
    assert stiff == {"penetration": pytest.approx(1e-8 * BLOCK.radius)}
    assert PLAYERS["mujoco"].settings(STANDS, 1) == {"time_step": pytest.approx(2e-3 * UNIT)}


def test_every_other_unilateral_run_has_the_energy_cap():
    capped = ["energy_cap" in PLAYERS["ebm-unilateral"].settings(STANDS, n) for n in range(6)]
    assert capped == [False, True] * 3


def test_every_ninth_run_is_audited_and_each_has_numbers_of_its_own(monkeypatch):
    given = []
    monkeypatch.setattr(players, "check_run", lambda model, scene, **how: given.append(how))
    for number in range(19):
        PLAYERS["ebm"].check(STANDS, 4, number)
    assert [n for n, how in enumerate(given) if how["audit"]] == [0, 9, 18]
    assert [how["seed"] for how in given] == list(range(4, 23))


def test_a_run_of_an_engine_is_no_longer_than_affordable():
    scenes = [PLAYERS["mujoco"].scene(3, number) for number in range(50)]
    units = [math.sqrt(scene.block.radius / scene.gravity) for scene in scenes]
    lasts = [scene.duration / unit for scene, unit in zip(scenes, units, strict=True)]
    assert max(lasts) == pytest.approx(5.0)
    assert min(lasts) < 5.0
    rows = [scene.output_step / unit for scene, unit in zip(scenes, units, strict=True)]
    assert rows == pytest.approx([2e-3] * 50)


@pytest.fixture
def plays(monkeypatch):
    """The histories of all models are made up; returns the settings and scenes that they had."""

    def give(made):
        given = []

        def build(name, settings=None, search_path=None):
            def simulate(scene):
                given.append((settings, scene))
                return made

            return SimpleNamespace(simulate=simulate)

        monkeypatch.setattr("rockcheck.validation.execute.models.build", build)
        monkeypatch.setattr(maps, "build", build)
        return given

    return give


@pytest.mark.parametrize(("speed", "spin"), [(1.0, 0.0), (0.0, 1.5)])
def test_depth_is_told_of_the_way_of_a_step(plays, speed, spin):
    """At this speed and this acceleration: that of weight and turning."""
    sunk = history(
        [0.0, 0.1], y=BLOCK.half_height - 1e-3, x_dot=speed, theta_dot=spin, y_dot=0.5 * speed
    )
    plays(sunk)
    depth = PLAYERS["mujoco"].check(STANDS, 1, 1).figures["depth"]
    way = 2e-3 * (1.5 * speed / BLOCK.radius + spin) * UNIT + 2e-3**2 * (1.0 + (spin * UNIT) ** 2)
    assert depth == pytest.approx(1e-3 / BLOCK.radius / (2.0 * way + 1e-5))


def test_rows_of_an_approximate_model_are_looked_at_in_every_ninth_run(plays):
    plays(history(STANDS.output_times))
    found = ["rows" in PLAYERS["mujoco"].check(STANDS, 1, n).figures for n in (0, 1, 9)]
    assert found == [True, False, True]


@pytest.mark.parametrize(("label", "told"), [("cm", ""), ("mujoco", "source 0.08, with half")])
def test_of_an_engine_alone_half_the_step_is_told(plays, monkeypatch, label, told):
    plays(history(STANDS.output_times))
    monkeypatch.setattr(players, "energy_without_source", lambda motion: 0.08)
    played = PLAYERS[label].check(STANDS, 1, 1)
    assert played.broken == ["source"]
    assert played.failure[: len("source 0.08, with half")] == told


# Failures


@pytest.fixture
def fails(monkeypatch):
    """The event-based model fails as told, of every scene."""

    def so(check):
        monkeypatch.setattr(
            type(PLAYERS["ebm"]), "check", lambda self, scene, *rest: CheckedRun(**check(scene))
        )
        monkeypatch.setattr(
            type(PLAYERS["ebm"]),
            "scene",
            lambda *_: STANDS.replace(
                walls=[Wall(side="left", gap=0.5)],
                excitation=Ricker(amplitude=1.0, period=1.0),
                initial_velocity=1.0,
            ),
        )

    return so


def smallest(tmp_path, broken, trials=400):
    """The text of its file, and whether the scene has a wall."""
    text = Shrinking(broken, trials).play()
    (tmp_path / "small.toml").write_text(text, "utf-8")
    return text, bool(files.load_scene(tmp_path / "small.toml").walls)


def test_a_smaller_scene_may_fail_less_but_a_hundredfold_its_bound(fails, tmp_path):
    fails(lambda scene: {"figures": {"penetration": 1.0 if scene.walls else 5e-7}})
    assert not smallest(tmp_path, Broken("ebm", "penetration", 1, 1, 1.0))[1]
    fails(lambda scene: {"figures": {"penetration": 1.0 if scene.walls else 5e-8}})
    assert smallest(tmp_path, Broken("ebm", "penetration", 1, 1, 1.0))[1]


def test_what_does_not_fail_again_is_as_it_was_found(fails, tmp_path):
    fails(lambda scene: {"figures": {"ends": 1.0}})
    again, _ = smallest(tmp_path, Broken("ebm", "ends", 1, 1, 1.0))
    assert "as it was found" not in again
    fails(lambda scene: {"figures": {"ends": 0.0}})
    gone, has_wall = smallest(tmp_path, Broken("ebm", "ends", 1, 1, 1.0))
    assert "does not fail again" in gone
    assert has_wall


def test_a_fault_of_the_program_is_shrunk_to_the_same_fault(fails, tmp_path):
    def check(scene):
        kind = "ValueError" if scene.walls else "KeyError"
        return {"figures": {"ends": math.inf}, "failure": f"{kind}: {scene.duration}"}

    fails(check)
    text, has_wall = smallest(tmp_path, Broken("ebm", "ends", 1, 1, math.inf, "ValueError: 1"))
    assert has_wall
    assert "as it was found" not in text
    assert 'kind = "ricker"' not in text


def test_a_search_that_is_cut_short_says_so(fails, tmp_path):
    fails(lambda scene: {"figures": {"mirror": 1.0}})
    broken = Broken("ebm", "mirror", 1, 1, 1.0)
    assert "not the smallest" in smallest(tmp_path, broken, trials=2)[0]
    assert "not the smallest" not in smallest(tmp_path, broken)[0]


def test_a_slow_model_has_more_time_and_all_have_far_more_than_usual():
    slow, quick = runs.limits("cm", 10), runs.limits("ebm", 10)
    assert slow["seconds"] > 1.5 * quick["seconds"]
    assert slow["expected"] > quick["expected"]
    assert quick["expected"] < 0.1 * quick["seconds"]


def test_a_search_that_is_lost_is_tried_with_fewer_trials_if_it_had_some():
    broken = Broken("ebm", "mirror", 1, 3, 1.0)
    assert [len(parts(Shrinking(broken, trials))) for trials in (1, 2, 400)] == [0, 1, 1]


@pytest.mark.parametrize(("quick", "trials"), [(True, 160), (False, 400)])
def test_a_quick_run_shrinks_its_failures_in_fewer_trials(quick, trials):
    study = Stress("runs", quick=quick, runs=10, models=("ebm",))
    failures = [Broken("ebm", "mirror", 1, number, 1.0) for number in range(10)]
    totals = RunTotals(model="ebm", failures=failures)
    totals.counts["runs"] = 10
    (chunk,) = study.tasks({})
    shrinking = study.tasks({chunk: totals})[1:]
    assert [task.trials for task in shrinking] == [trials] * 10


def test_a_point_of_a_map_that_is_lost_stays_lost():
    study = Stress("maps", quick=True)
    points = study.tasks({})
    done = dict.fromkeys(points, MapResult(1.0, 0.1)) | {points[0]: pool.Failure("it hangs")}
    assert study.tasks(done) == points
    assert not any(isinstance(task, Chunk) for task in points)


# Maps


@pytest.mark.parametrize("axis", AXES)
def test_each_value_of_an_axis_is_a_scene_with_some_hundred_rows(axis):
    _, usual, values = AXES[axis]
    for value in (usual, *values):
        scene = scene_at(axis, value)
        assert len(scene.output_times) == 401
        assert scene.walls[0].restitution <= 0.95


def test_the_continuous_model_is_as_stiff_as_the_block_s_size_asks_for(plays):
    given = plays(history([0.0, 0.1]))
    scene = scene_at("size", 100.0)
    fault_of(SETUPS["cm"], scene, 0.01)
    (settings, _) = given[0]
    assert settings["penetration"] == pytest.approx(1e-5)


@pytest.mark.parametrize(("case", "kind"), [*zip(CASES, ("rest", "record", "sine"), strict=True)])
def test_a_block_that_should_stand_is_pushed_or_shaken_by_less_than_moves_it(plays, case, kind):
    given = plays(history([0.0, 0.1]))
    stand_still("mujoco", case, 300.0)
    (_, scene) = given[0]
    assert scene.excitation.kind == kind
    peak = np.max(np.abs(scene.excitation.acceleration(np.linspace(0.0, 300.0, 6001))))
    assert peak == pytest.approx(CASES[case] * G * math.tan(0.25), rel=1e-2)
    assert scene.excitation.quiet_after >= 299.0 * (kind != "rest")


@pytest.mark.parametrize(("duration", "step"), [(10.0, 5e-3), (3600.0, 0.9)])
def test_an_hour_has_no_more_than_four_thousand_rows(plays, duration, step):
    given = plays(history([0.0, 0.1]))
    stand_still("mujoco", "left alone", duration)
    assert given[0][1].output_step == pytest.approx(step)


def test_an_engine_stands_at_the_usual_step_and_the_continuous_model_at_its_own(plays):
    own = dataclasses.replace(history([0.0, 0.1]), settings={"time_step": 0.02})
    given = plays(own)
    assert stand_still("mujoco", "left alone", 10.0).step == 5e-3
    assert stand_still("cm", "left alone", 10.0).step == 0.02
    steps = ["time_step" in settings for settings, _ in given]
    assert steps == [True, False]


def test_movements_are_told_in_units_of_the_block(plays):
    t = [0.0, 1.0, 2.0]
    plays(history(t, y=BLOCK.half_height - 1e-3, x_dot=[9.0, 9.0, 0.1]))
    moves = stand_still("mujoco", "left alone", 2.0).moves
    assert moves["uplift"] == 0.0
    assert moves["sinking"] == pytest.approx(1e-3 / BLOCK.radius)
    assert moves["jitter"] == pytest.approx(0.1 / math.sqrt(G * BLOCK.radius))


def test_quick_maps_have_fewer_values_and_seconds():
    quick, whole = map_points(quick=True), map_points()
    assert {point.value for point in quick if point.map_name in CASES} == {10.0}
    assert {point.value for point in whole if point.map_name in CASES} == {300.0, 3600.0}
    sizes = [len({p.value for p in some if p.map_name == "size"}) for some in (quick, whole)]
    assert 1 < sizes[0] < sizes[1] == 7
    assert {point.quick for point in quick if point.map_name not in CASES} == {True}
    assert {point.quick for point in whole} == {False}
    assert quick[0].expected < whole[0].expected
