"""The stress study: its work, what its runs add up to, failures with their smallest scenes,
maps."""

import dataclasses
from collections import Counter
from unittest.mock import Mock

import numpy as np
import pytest

from rockcheck.commands.cli import main
from rockcheck.reports.document import publish
from rockcheck.scenes import Block, Floor, Record, Rest, Scene, Sine, Wall, files, writing
from rockcheck.validation.execute import models, pool
from rockcheck.validation.finding import Finding
from rockcheck.validation.studies.stress.generator import random_scene
from rockcheck.validation.studies.stress.invariants import INVARIANTS, CheckedRun
from rockcheck.validation.studies.stress.maps import (
    CASES,
    SETUPS,
    MapPoint,
    MapResult,
    fault_of,
    map_points,
    scene_at,
    stand_still,
)
from rockcheck.validation.studies.stress.players import PLAYERS
from rockcheck.validation.studies.stress.runs import (
    MOST_FILES,
    Broken,
    Chunk,
    RunTotals,
    Shrinking,
    parts,
)
from rockcheck.validation.studies.stress.shrinking import shrink
from rockcheck.validation.studies.stress.study import Stress
from rockcheck.validation.study import run


def test_shrinking_drops_all_that_does_not_matter(tmp_path):
    scene = random_scene(1, 0).replace(
        block=Block(
            half_width=0.4, half_height=1.2, centre_of_mass=(0.1, -0.3), moment_of_inertia=0.4
        ).scaled(30.0),
        floor=Floor(friction=0.25),
        walls=(Wall(side="left", gap=0.5, restitution=0.3), Wall(side="right", gap=0.7)),
        vertical=Sine(amplitude=1.234567, period=1.0),
        excitation=Record.from_samples(np.arange(50.0) / 7.0, time_step=0.0123456789),
        initial_rotation=0.0,
    )

    def shows(one: Scene) -> bool:
        return (
            isinstance(one.excitation, Record)
            and max(one.excitation.unscaled) > 2.0
            and one.wall("right") is not None
        )

    assert shrink(scene, shows, 0) == (scene, False)
    for trials, whole in ((3, False), (2000, True)):
        small, complete = shrink(scene, shows, trials)
        assert shows(small)
        assert complete == whole
    assert 0.5 < small.block.radius < 2.0
    assert len(small.excitation.unscaled) < 20
    assert small.block.homogeneous
    assert small.walls == (Wall(side="right", gap=0.0, restitution=0.0),)
    assert small.vertical == Rest()
    assert small.floor.restitution == small.initial_height == small.initial_angular_velocity == 0.0
    file = writing.write_whole(
        tmp_path / "small.toml", files.scene_text(files.tables_of(small), "a remark\nanother")
    )
    assert files.load_scene(file).replace(name=small.name) == small


def test_totals_count_what_was_seen():
    whole, halves = Chunk("ebm", 1, 0, 8).play(), RunTotals(model="ebm")
    for half in parts(Chunk("ebm", 1, 0, 8)):
        halves.add(half.play())
    assert vars(whole) | {"cpu_seconds": 0.0} == vars(halves) | {"cpu_seconds": 0.0}
    assert whole.counts["runs"] == whole.looked_at["ends"] == 8


def test_work_is_all_runs_once_and_what_is_lost_is_halved():
    for runs, quick in ((1003, False), (None, True)):
        work = Stress("runs", quick=quick, runs=runs).tasks({})
        here = {label for label in PLAYERS if not models.not_installed(label.split()[0])}
        numbers = [(one.model, n) for one in work for n in range(one.first, one.first + one.count)]
        every = [(label, n) for label in here for n in range(runs or PLAYERS[label].quick)]
        assert sorted(numbers) == sorted(every)
    study = Stress("runs", runs=5, models=("ebm",))
    (whole,) = study.tasks({})
    done: dict = {whole: pool.Failure("lost")}
    halves = study.tasks(done)[1:]
    assert [(half.first, half.count) for half in halves] == [(0, 2), (2, 3)]
    assert halves[1].seconds < whole.seconds
    shrinking = Shrinking(Broken("ebm", "mirror", 1, 3, 1.0), 400)
    small = Chunk("ebm", 1, 2, 1), dataclasses.replace(shrinking, trials=1), shrinking
    assert [[part.trials for part in parts(one)] for one in small] == [[], [], [100]]


@pytest.mark.parametrize("label", ["ebm", "ebm no-slip"])
def test_a_failure_is_shown_with_its_smallest_scene(tmp_path, monkeypatch, label):
    """An event-based model that breaks an invariant: exit 1, counted, and a scene file that a user
    can play as it says; kept for the next run."""
    monkeypatch.setattr(
        type(PLAYERS[label]),
        "check",
        lambda self, scene, seed, number, only="": CheckedRun(
            figures={"ends": 0.0, "mirror": 3.0 if scene.walls else 0.0},
            outcome="at rest",
            counts={"gaining": 1},
            rules={"settles": 2},
        ),
    )
    publish(Finding("stress", "of another run", "", files={"failures/old.toml": ""}), tmp_path)
    study = Stress("runs", models=(label,), runs=12)
    found = run(study, tmp_path, jobs=0)
    page = publish(found, tmp_path).read_text()
    failures, scenes = found.table("failures").records(), found.table("scenes").records()
    assert found.exit_code == 1
    assert found.verdict == "fail"
    assert found.complete is True
    assert 0 < len(failures) == len(scenes) < 12
    (mirror,) = (row for row in found.table("invariants").records() if row["invariant"] == "mirror")
    assert mirror["worst"] == 3.0
    assert mirror["failures"] == len(failures)
    assert found.table("models").records()[0]["gaining"] == 12
    assert found.table("choices").records() == [{"model": label, "choices": "settles 24"}]
    file = tmp_path / "failures" / scenes[0]["scene"]
    assert len(files.load_scene(file).walls) == 1
    assert len(list(file.parent.iterdir())) == len(scenes)
    assert f'href="failures/{file.name}"' in page
    monkeypatch.chdir(file.parent)
    line = next(line for line in file.read_text("utf-8").splitlines() if file.name in line)
    assert not (exec(line.split('"')[1], {}) if '"' in line else main(line.split()[2:]))
    monkeypatch.setattr(type(PLAYERS[label]), "check", None)  # all is read back
    assert run(study, tmp_path, jobs=0).files == found.files


def test_failures_of_the_program_and_of_engines():
    """A run whose process was lost does not end, and is not shrunk; an engine's failure fails no
    command; most are only counted."""
    study = Stress("runs", runs=30, models=("ebm", "cm"))
    lost, other = Chunk("ebm", 1, 7, 1), Chunk("cm", 1, 0, 30)
    failures = [Broken("cm", "source", 1, number, 0.1) for number in range(30)]
    done: dict = dict.fromkeys(study.tasks({}), RunTotals(model="ebm")) | {
        other: RunTotals(model="cm", failures=failures, counts=Counter(runs=30))
    }
    done = {task: one for task, one in done.items() if one.model == task.model}
    assert study.gather(done).exit_code == 0
    assert len(study.gather(done).files) == MOST_FILES
    done[lost] = pool.Failure("it hangs")
    found = study.gather(done)
    assert found.exit_code == 1
    assert found.table("failures").records()[0]["words"] == "it hangs"
    assert "not shrunk" in found.files["failures/ebm-ends-1-7.toml"]


def test_of_an_interrupted_search_for_smaller_scenes_all_failures_are_told(tmp_path, monkeypatch):
    """The first ones with their scenes, as they were found."""
    broken = CheckedRun(figures={"ends": 0.0, "mirror": 1.0}, outcome="at rest")
    monkeypatch.setattr(type(PLAYERS["ebm"]), "check", lambda *_: broken)
    monkeypatch.setattr(Shrinking, "play", Mock(side_effect=KeyboardInterrupt))
    found = run(Stress("runs", models=("ebm",), runs=30), tmp_path, jobs=0)
    assert not found.complete
    assert len(found.table("failures").rows) == 30
    assert len(found.files) == MOST_FILES
    assert [name for name, text in found.files.items() if "not shrunk" not in text] == []


def test_where_an_engine_breaks_is_found():
    """MuJoCo's own contact lets a block of a millimetre sink; at its best it holds it. Creep under
    a push is seen, too."""
    assert [
        fault_of(SETUPS[setup], scene_at("size", 1e-3), 0.01)
        for setup in ("mujoco default", "mujoco")
    ] == ["sinks", ""]
    found = MapPoint("mujoco default", "size", 1e-3, quick=True).play()
    assert found.step == 0.0
    assert found.fault == "sinks"
    assert stand_still("mujoco default", "pushed", 5.0).moves["creep"] > 1e-4
    assert stand_still("mujoco adaptive", "pushed", 5.0).moves["creep"] < 1e-6
    assert stand_still("cm", "left alone", 5.0).moves["jitter"] < 1e-9


def test_the_maps_are_tables_and_a_picture(tmp_path):
    """Of what was played; where a process was lost there is no cell."""
    study = Stress("maps", quick=True)
    work = study.tasks({})
    assert work == map_points(quick=True)
    assert study.gather({}).verdict == ""
    only = Stress("all", quick=True, runs=1, models=("ebm", "cm")).tasks({})
    assert {one.line for one in only if isinstance(one, MapPoint)} == {"cm", "cm paper"}
    done: dict = {
        task: MapResult(5.0, 5e-3, {"creep": 1e-3})
        if task.map_name in CASES
        else MapResult(task.value, 0.1, fault="sinks")
        for task in work
    }
    done[work[-1]] = pool.Failure("did not end")
    found = study.gather(done)
    publish(found, tmp_path)
    assert [
        {row[column] for row in found.table(name).records()}
        for name, column in (("steps-size", "0.001"), ("stand-still", "creep"))
    ] == [{"0.1 sinks"}, {1e-3}]
    assert list(found.table("steps-shaking").records()[-1].values())[-1] is None
    assert "nan" not in (tmp_path / "figures" / "stable-steps.svg").read_text()
    assert "(0.001, with adaptive steps 0.01)" in (tmp_path / "index.html").read_text()
    rows = (tmp_path / "stable-steps.csv").read_text().splitlines()
    assert len(rows) == 1 + sum(
        isinstance(one, MapResult) and task.map_name not in CASES for task, one in done.items()
    )


def test_the_command(tmp_path, told):
    words = ["--runs", "6", "--jobs", "1", "--out", str(tmp_path), "--seed", "4"]
    found = told("stress", "runs", "--model", "ebm", *words)
    assert found["seed"] == 4
    assert found["batches"]["ebm"]["counts"]["runs"] == 6
    assert [row["invariant"] for row in found["tables"]["invariants"]] == list(INVARIANTS)
    assert "| ebm | " in (tmp_path / "summary.md").read_text()
