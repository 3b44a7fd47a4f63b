"""Suites end to end: cells in workers that crash, hang and eat memory; results kept and read
back."""

import dataclasses
import json
import math
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures.process import BrokenProcessPool
from importlib.machinery import EXTENSION_SUFFIXES
from xml.etree import ElementTree

import pytest

from rockcheck.validation.execute import models
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.suite import junit, reasons, results, suites
from rockcheck.validation.suite.playing import SuiteTasks
from rockcheck.validation.suite.runner import run_suite

OWN_NAMES = ("Still", "Segfault", "Hang", "Hog", "Fails", "Bug", "NotFinite")
OWN = [f"faulty:{name}" for name in OWN_NAMES]
STILL = {"a": 'model = "faulty:Still"'}

SUITE = """
reference = "still"
[limits]
seconds = {seconds}
memory_mb = 500
[models.still]
model = "faulty:Still"
{models}
[require]
difference = ["theta_rms"]
[[scene]]
name = "short"
duration = 0.5
block = {{ half_width = 0.4, half_height = 1.5 }}
floor = {{ friction = 0.5 }}
{tolerances}
"""
FINE = (
    "[tolerances.short.{model}.still]\n"
    'theta_rms = {{ expected = 0.0, limit = 1e-9, drift = 0.0, why = "the same" }}\n'
)


def write_suite(folder, models, tolerances="", seconds=60.0):
    path = folder / "mine.toml"
    tables = "\n".join(f"[models.{label}]\n{lines}" for label, lines in models.items())
    path.write_text(SUITE.format(models=tables, tolerances=tolerances, seconds=seconds))
    return path


@pytest.fixture
def run(tmp_path, faulty):
    """Runs a suite, in which its models are imported anew."""

    def run(path, jobs=0, **options):
        sys.modules.pop("faulty", None)
        return run_suite(
            suites.load_suite(path, allow_code=OWN), tmp_path / "out", jobs=jobs, **options
        )

    return run


def test_figures_are_the_same_from_memory_and_from_files(tmp_path):
    first = run_suite(suites.load_suite("smoke"), tmp_path, jobs=2)
    shutil.rmtree(tmp_path / "comparisons")
    again = run_suite(suites.load_suite("smoke"), tmp_path, jobs=2)
    assert again.up_to_date == sum(cell.status == "done" for cell in again.cells) > 0
    assert [cell.figures for cell in again.cells] == [cell.figures for cell in first.cells]


@pytest.mark.long
@pytest.mark.filterwarnings("default")
@pytest.mark.parametrize("where", [{"jobs": 2}, {"scheduler": "local:2"}], ids=["here", "cluster"])
def test_every_kind_of_failure_fails_its_cell_alone(tmp_path, run, where):
    models = {name: f'model = "faulty:{name}"' for name in OWN_NAMES} | {
        "Odd": 'model = "faulty:NotFinite"\nend = ["t", 0.0]'
    }
    done = run(write_suite(tmp_path, models, FINE.format(model="Still"), seconds=15.0), **where)
    reasons = {cell.model: cell.reason for cell in done.cells}
    assert "memory" in reasons.pop("Hog").lower()
    assert reasons == {
        "still": "",
        "Still": "",
        "Segfault": "crashed: SIGSEGV",
        "Hang": "did not end within 15 s",
        "Fails": "more than 10 events",
        "Bug": "ZeroDivisionError: a bug?of two lines",
        "NotFinite": "theta is nan at t = 0.5 s",
        "Odd": "its history cannot be read back: column 't' does not increase",
    }
    assert done.by_scene["short"]["Still"].verdict == "pass"
    assert done.exit_code == 3


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize(("python", "status"), [((3, 99), "absent"), ((3, 10), "unavailable")])
def test_a_model_that_is_not_installed_is_named(tmp_path, run, monkeypatch, strict, python, status):
    """Its cells are not played, all others are; the run is incomplete, which `--strict worse` does
    not accept. What has no wheel for this Python is named too, and weighs nothing."""
    monkeypatch.setattr("rockcheck.engines.PyBullet.last_python", python)
    monkeypatch.setattr(
        "rockcheck.validation.execute.models.not_installed",
        lambda name: "not installed: so" * (name == "pybullet"),
    )
    fine = FINE.format(model="a") + FINE.format(model="pybullet")
    done = run(write_suite(tmp_path, STILL | {"pybullet": "time_step = 1e-3"}, fine), strict=strict)
    assert {cell.model: (cell.status, cell.verdict, cell.reason) for cell in done.cells[1:]} == {
        "a": ("done", "pass", ""),
        "pybullet": (status, "incomplete", "not installed: so"),
    }
    failed = int(strict and status == "absent")
    verdict = "incomplete" if status == "absent" else "pass"
    assert done.verdict == verdict
    assert done.exit_code == failed
    assert list(reasons.verdict_lines(done)) == ["pybullet: not installed: so"]
    (suite,) = ElementTree.fromstring(junit.junit(done))
    assert [int(suite.get(name)) for name in ("skipped", "failures")] == [1 - failed, failed]


def test_only_what_changed_runs_again(tmp_path, run, written, monkeypatch):
    path = write_suite(
        tmp_path,
        STILL | {"b": 'model = "faulty:Still"\noffset = 1e-12\nfiles = ["other"]'},
        FINE.format(model="a"),
    )
    code = tmp_path / "faulty.py"
    for file, old, new, played in (
        (path, "1e-12", "1e-12", ["still", "a", "b"]),
        (path, "1e-12", "1e-12", []),
        (path, "1e-12", "2e-12", ["b"]),
        (code, "= self.offset", "= 1.0 * self.offset", ["still", "a", "b"]),
        (code, "import time", "import time, beside", ["still", "a", "b"]),
        (written("beside.py", "a = 0\nif a:\n    import core\n"), "0", "0.0", ["still", "a", "b"]),
        (written(f"core{EXTENSION_SUFFIXES[0]}", "\0a"), "a", "b", ["still", "a", "b"]),
        (written("other.py", "number = 1\n"), "1", "2", []),  # which nothing imports
    ):
        file.write_text(file.read_text().replace(old, new))
        assert [cell.model for cell in run(path).cells if not cell.read_back] == played, new
    monkeypatch.setenv("STANDS_AT", "0.1")  # no key knows of it
    again = run(path, force=True).cells
    assert [(one.read_back, results.value_of(one.figures, "peak_rotation")) for one in again] == [
        (False, pytest.approx(0.1 / math.atan(0.4 / 1.5)))
    ] * 3


def test_a_run_that_is_forced_is_judged_by_what_it_played(tmp_path, monkeypatch):
    """Also where no key knows why it plays otherwise, such as another processor."""
    suite = suites.load_suite("smoke").only("smoke-rocking", "ebm")

    def peaks(**options):
        cells = run_suite(suite, tmp_path, jobs=0, **options).cells
        return [results.value_of(cell.figures, "peak_rotation") for cell in cells]

    simulate = models._simulate

    def tilted(work, scene):
        history = simulate(work, scene)
        channels = {**history.channels, "theta": 1.5 * history.channels["theta"]}
        return dataclasses.replace(history, channels=channels, model_extremes=None)

    before = peaks()
    monkeypatch.setattr(models, "_simulate", tilted)
    assert peaks() == before
    assert peaks(force=True) == pytest.approx([1.5 * peak for peak in before], rel=1e-3)


def test_a_failed_reference_fails_what_needs_it(tmp_path, run):
    path = write_suite(tmp_path, STILL, FINE.format(model="a"))
    path.write_text(path.read_text().replace("Still", "Fails", 1))
    (check,) = run(path).by_scene["short"]["a"].checks
    assert check.verdict == "fail"
    assert check.reason == "nothing of still to compare with here"
    assert check.figure.value is None
    assert check.figure.unit == "alpha"


FORM = """
reference = "ebm-unilateral"
[models.ebm-unilateral]
[models.ebm]
[[scene]]
name = "hit"
duration = 5.0
block = { half_width = 0.397, half_height = 1.555 }
floor = { friction = 0.6 }
WALL
excitation = { kind = "ricker", amplitude = 9.0, period = 0.5 }
[tolerances.hit.ebm.ebm-unilateral]
outcome_agrees = { expected = 0.0, limit = 1.0, drift = 0.0, why = "without flight it falls" }
"theta_rms@5s" = { expected = 2.0, limit = 2.1, drift = 1.0, why = "without flight it falls" }
"""


@pytest.mark.parametrize(
    ("text", "outcomes", "kind", "verdict"),
    [
        (
            FORM.replace("WALL", 'walls = [{ side = "left", gap = 0.053, restitution = 1.0 }]'),
            ["at rest", "overturned right"],
            "model form",
            "pass",
        ),
        # Models of one form may not.
        (
            FORM.replace("WALL", "initial_rotation = -0.3").replace(
                "[models.ebm]", '[models.ebm]\nmodel = "faulty:Still"'
            ),
            ["overturned right", "at rest"],
            "numerical",
            "fail",
        ),
    ],
)
def test_models_of_different_form_may_fall_apart_where_that_is_accepted(
    written, run, text, outcomes, kind, verdict
):
    done = run(written("mine.toml", text))
    assert [cell.outcome for cell in done.cells] == outcomes
    assert [(check.kind, check.verdict) for _, check in done.checks()] == [(kind, verdict)] * 2


@pytest.mark.parametrize(
    ("models", "tolerances", "reasons", "faults", "missing", "words"),
    [
        (STILL, "", ["no tolerance yet"], (), 1, "no tolerance yet"),
        ({}, "", [], (), 0, "fail"),
        (
            STILL,
            FINE.format(model="a") + FINE.format(model="a").replace("short", "long"),
            [""],
            ("tolerance [long.a.still: theta_rms] has no cell in the suite",),
            0,
            "fail",
        ),
    ],
)
def test_missing_tolerance_missing_cell_and_nothing_judged_do_not_pass(
    tmp_path, run, models, tolerances, reasons, faults, missing, words
):
    done = run(write_suite(tmp_path, models, tolerances))
    assert [check.reason for _, check in done.checks()] == reasons
    assert done.faults == faults
    assert done.without_tolerance == missing
    assert done.verdict_words == words
    assert done.exit_code == 1


def test_a_run_is_saved_whole_and_says_what_it_is(tmp_path, run):
    done = run(write_suite(tmp_path, STILL, FINE.format(model="a")))
    out = tmp_path / "out"
    done.save(out)
    assert results.Run.load(out) == done
    assert done.exit_code == 0
    text = (out / "run.json").read_text()
    assert set(json.loads(text)) == set(
        json.loads((out / "run.schema.json").read_text())["properties"]
    )
    assert text.count('\n{"scene":') == len(done.cells), "a line a cell"
    assert not list(out.glob("**/*.part"))


#: Ends when a file is there; fails after a minute.
WAITS = """
import pathlib, sys, time
for _ in range(600):
    if pathlib.Path(sys.argv[1]).exists():
        sys.exit(0)
    time.sleep(0.1)
sys.exit(1)
"""


def test_only_calls_that_compile_wait_for_each_other(tmp_path):
    """The second call can end only while the third one runs, which begins as the first one ends."""
    there = str(tmp_path / "there")
    plain = [
        [sys.executable, "-c", WAITS, there],
        [sys.executable, "-c", "import pathlib, sys; pathlib.Path(sys.argv[1]).touch()", there],
    ]
    calls = [
        Call(math.sqrt, (4.0,), compiles="a package"),
        *(Call(subprocess.run, (command,)) for command in plain),
    ]
    with Pool(2) as pool:
        found = [ended.result for ended in pool.run(calls)]
    assert [one.returncode for one in found if one != 2.0] == [0, 0]


def test_a_pool_whose_processes_are_lost_begins_anew():
    """One is lost before it has a call; all are lost by the pool itself while calls are waiting."""
    with Pool(2) as pool:
        os.kill(min(pool._pool._pool_manager.worker_manager.workers), signal.SIGKILL)
        while pool._pool.active:
            time.sleep(0.01)
        ended = pool.run(Call(math.sqrt, (n * n,)) for n in range(20))
        first = next(ended).outcome
        pool._pool._pool_manager.handle_broken_pool(BrokenProcessPool("made up"))
        assert {first, *(one.outcome for one in ended)} == set(range(20))


MEASURED = """
reference = "first"
[models.first]
model = "measured"
files = { swing = "first.csv" }
[models.second]
model = "measured"
files = { swing = "second.csv" }
[require]
difference = ["theta_rms"]
[[scene]]
name = "swing"
duration = 3.0
output_step = 0.01
block = { half_width = 0.3, half_height = 1.0 }
floor = { friction = 0.9 }
"""


def test_a_measured_history_that_starts_late_is_advised_an_offset(written, run):
    for name, start in (("first", 1.0), ("second", 1.2)):
        swing = [(n / 100, 0.1 * math.exp(-((n / 20 - 5 * start) ** 2))) for n in range(301)]
        written(f"{name}.csv", "\n".join(["t,theta", *(f"{t},{theta}" for t, theta in swing)]))
    (line,) = run(written("mine.toml", MEASURED)).by_scene["swing"]["second"].notes
    assert line.endswith("offset = -0.2")


@pytest.mark.needs("pybullet")
def test_what_takes_longest_begins_before_the_quick_rest(tmp_path):
    """One cell of each code that is compiled, and the engines before the quick models; walls take
    longer."""
    cells = SuiteTasks(suites.load_suite("paper"), tmp_path).tasks({})
    begun = [(cell.variant.label, cell.scene_name) for cell in cells]
    assert begun[:3] == [(model, "fig4a") for model in ("mujoco", "ebm-unilateral", "cm")]
    assert {model for model, _ in begun[3:10]} == {"mujoco", "pybullet"}
    assert [scene[:4] for _, scene in begun[3:10]] == 4 * ["fig5"] + 3 * ["fig4"]


@pytest.mark.parametrize(
    ("model", "settings", "compiled"),
    [
        ("ebm", "", "event loop"),
        ("ebm-unilateral", "", "event loop"),
        ("mujoco", "", "adaptive"),
        ("pymunk", "largest_step = 1e-3", "adaptive"),
        ("mujoco", 'settings = "default"', ""),
        ("mujoco", "time_step = 1e-3", ""),
        ("box2d", "", ""),
    ],
)
def test_time_to_compile_does_not_count_for_a_cells_limit(
    tmp_path, faulty, model, settings, compiled
):
    """Of the cells whose model compiles the same code the first has `COMPILING` s more."""
    path = write_suite(tmp_path, {"a": f'model = "{model}"\n{settings}'})
    suite = suites.load_suite(path, allow_code=OWN)
    cells = SuiteTasks(suite, tmp_path / "out").plan.tasks()
    assert {cell.compiles for cell in cells if cell.variant.label == "a"} == {compiled}
