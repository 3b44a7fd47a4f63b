"""Suites end to end: cells in workers that crash, hang and eat memory; results kept and read
back."""

import gzip
import json
import math
import re
import shutil
import subprocess
import sys
from collections import deque
from pathlib import Path
from xml.etree import ElementTree

import pytest

from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import FAMILIES
from rockcheck.validation.execute.pool import Call, Pool
from rockcheck.validation.suite.results import Run
from rockcheck.validation.suite.runner import SuiteStudy, in_order, run_suite
from rockcheck.validation.suite.suites import load_suite
from rockcheck.validation.suite.tables import junit, verdict_lines

OWN = [
    f"faulty:{name}" for name in ("Still", "Segfault", "Hang", "Hog", "Fails", "Bug", "NotFinite")
]

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


def write_suite(
    folder: Path, models: dict[str, str], tolerances: str = "", seconds: float = 60.0
) -> Path:
    tables = "\n".join(f"[models.{label}]\n{lines}" for label, lines in models.items())
    path = folder / "mine.toml"
    path.write_text(
        SUITE.format(models=tables, tolerances=tolerances, seconds=seconds), encoding="utf-8"
    )
    return path


@pytest.fixture
def run(tmp_path, faulty):
    def run(path: Path, jobs: int = 0, **options: object) -> Run:
        return run_suite(load_suite(path, allow_code=OWN), tmp_path / "out", jobs=jobs, **options)

    return run


def test_figures_are_the_same_from_memory_and_from_files(tmp_path):
    """A history is compared as its worker gave it; read back from its files, where the comparisons
    are lost, it gives the same."""
    folder = tmp_path / "out"
    first = run_suite(load_suite("smoke"), folder, jobs=2)
    shutil.rmtree(folder / "comparisons")
    again = run_suite(load_suite("smoke"), folder, jobs=2)
    assert again.up_to_date == sum(cell.status == "done" for cell in again.cells) > 0
    assert [cell.figures for cell in again.cells] == [cell.figures for cell in first.cells]


@pytest.mark.long
def test_every_kind_of_failure_fails_its_cell_alone(tmp_path, run):
    faults = {
        name: f'model = "faulty:{name}"'
        for name in ("Segfault", "Hang", "Hog", "Fails", "Bug", "NotFinite")
    }
    path = write_suite(
        tmp_path,
        {**faults, "again": 'model = "faulty:Still"'},
        FINE.format(model="again"),
        seconds=15.0,
    )
    done = run(path, jobs=2)
    reasons = {cell.model: cell.reason for cell in done.cells}
    assert reasons["Segfault"] == "crashed: SIGSEGV"
    assert reasons["Hang"] == "did not end within 15 s"
    assert "memory" in reasons["Hog"].lower()
    assert reasons["Fails"] == "more than 10 events"
    assert reasons["Bug"] == "ZeroDivisionError: a bug?of two lines"
    assert reasons["NotFinite"] == "theta is nan at t = 0.5 s"
    assert {cell.model for cell in done.cells if cell.status == "done"} == {"still", "again"}
    assert done.cell("short", "again").verdict == "pass"
    assert done.exit_code == 3


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize(("python", "status"), [((3, 99), "absent"), ((3, 10), "unavailable")])
def test_a_model_that_is_not_installed_is_named(tmp_path, run, monkeypatch, strict, python, status):
    """Its cells are not played, all others are; the run is incomplete, which `--strict` does not
    accept. What has no wheel for this Python is named too, and weighs nothing."""
    monkeypatch.setattr("rockcheck.engines.PyBullet.last_python", python)
    monkeypatch.setattr(
        "rockcheck.validation.suite.runner.not_installed",
        lambda name: "not installed: so" * (name == "pybullet"),
    )
    path = write_suite(
        tmp_path,
        {"a": 'model = "faulty:Still"', "pybullet": "time_step = 1e-3"},
        FINE.format(model="a"),
    )
    path.write_text(path.read_text() + FINE.format(model="pybullet"))
    done = run(path, strict=strict)
    assert done.cell("short", "a").verdict == "pass"
    absent = done.cell("short", "pybullet")
    assert (absent.status, absent.verdict, absent.reason) == (
        status,
        "incomplete",
        "not installed: so",
    )
    missed = status == "absent"
    assert done.verdict == ("incomplete" if missed else "pass")
    assert done.exit_code == int(strict and missed)
    assert list(verdict_lines(done)) == ["pybullet: not installed: so"]
    (suite,) = ElementTree.fromstring(junit(done))
    assert (suite.get("skipped"), suite.get("failures")) == (
        ("0", "1") if strict and missed else ("1", "0")
    )


def test_only_what_changed_runs_again(tmp_path, run):
    path = write_suite(
        tmp_path,
        {"a": 'model = "faulty:Still"', "b": 'model = "faulty:Still"\noffset = 1e-12'},
        FINE.format(model="a"),
    )
    assert run(path).up_to_date == 0
    again = run(path)
    assert again.up_to_date == 3
    path.write_text(path.read_text().replace("1e-12", "2e-12"))
    changed = run(path)
    assert [cell.model for cell in changed.cells if not cell.read_back] == ["b"]
    assert run(path, force=True).up_to_date == 0
    code = tmp_path / "faulty.py"
    code.write_text(
        code.read_text().replace('"""A block that stands', '"""A block that stays')
        + "\n# a remark\n"
    )
    assert _reread(run, path).up_to_date == 3, "documentation is not code"
    code.write_text(code.read_text().replace("= self.offset", "= 1.0 * self.offset"))
    assert _reread(run, path).up_to_date == 0


def test_the_digest_of_our_code_is_kept_and_a_damaged_one_is_not_believed(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    module, digest = "rockcheck.scenes.writing", provenance.code_digest.__wrapped__
    expected = digest(module)
    (kept,) = (tmp_path / "rockcheck" / "code").iterdir()
    assert kept.read_text() == f"{expected}\n"
    kept.write_text("0123456789abcdef\n")
    assert digest(module) == "0123456789abcdef"
    assert digest("rockcheck.scenes.reading") != expected
    kept.write_text("no digest")
    assert digest(module) == expected == kept.read_text().strip()
    monkeypatch.setenv("XDG_CACHE_HOME", str(kept))
    assert digest(module) == expected


def _reread(run, path):
    """Run as a new process would, which has not read the code before."""
    sys.modules.pop("faulty", None)
    provenance.code_digest.cache_clear()
    provenance._source_of.cache_clear()
    return run(path)


@pytest.mark.parametrize("suffix", [".csv.gz", ".events.csv.gz", ".json"])
@pytest.mark.parametrize("damage", ["gone", "cut short", "empty"])
def test_a_damaged_result_is_not_read(tmp_path, run, suffix, damage):
    path = write_suite(tmp_path, {})
    run(path)
    (target,) = (
        file
        for file in (tmp_path / "out" / "histories").iterdir()
        if file.name.partition(".")[2] == suffix[1:]
    )
    content = target.read_bytes()
    shown = _lines(content)
    target.unlink() if damage == "gone" else target.write_bytes(
        content[: len(content) // 2] if damage == "cut short" else b""
    )
    assert run(path).up_to_date == 0
    assert _lines(target.read_bytes())[1:] == shown[1:]
    assert run(path).up_to_date == 1


def _lines(content):
    """The lines of a stored file; the first holds what the run took."""
    return (gzip.decompress(content) if content.startswith(b"\x1f\x8b") else content).splitlines()


def test_a_failed_reference_fails_what_needs_it(tmp_path, run):
    path = write_suite(tmp_path, {"a": 'model = "faulty:Still"'}, FINE.format(model="a"))
    path.write_text(path.read_text().replace('model = "faulty:Still"', 'model = "faulty:Fails"', 1))
    cell = run(path).cell("short", "a")
    assert cell.verdict == "fail"
    assert cell.checks[0].reason == "still failed in this scene"


FORM = """
reference = "ebm-unilateral"
[models.ebm-unilateral]
[models.ebm]
[[scene]]
name = "hit"
duration = 5.0
block = { half_width = 0.397, half_height = 1.555 }
floor = { friction = 0.6 }
walls = [{ side = "left", gap = 0.053, restitution = 1.0 }]
excitation = { kind = "ricker", amplitude = 9.0, period = 0.5 }
[tolerances.hit.ebm.ebm-unilateral]
outcome_agrees = { expected = 0.0, limit = 1.0, drift = 0.0, why = "without flight it falls" }
"theta_rms@5s" = { expected = 2.0, limit = 2.1, drift = 1.0, why = "without flight it falls" }
"""


def test_models_of_different_form_may_fall_apart_where_that_is_accepted(tmp_path, run):
    path = tmp_path / "mine.toml"
    path.write_text(FORM, encoding="utf-8")
    done = run(path)
    assert [cell.outcome for cell in done.cells] == ["at rest", "overturned right"]
    assert [(check.kind, check.verdict) for _, check in done.checks()] == [
        ("model form", "pass")
    ] * 2
    falling = re.sub(r"walls = .*", "initial_rotation = -0.3", FORM)
    path.write_text(
        falling.replace("[models.ebm]", '[models.ebm]\nmodel = "faulty:Still"'), encoding="utf-8"
    )
    done = run(path)
    assert [cell.outcome for cell in done.cells] == ["overturned right", "at rest"]
    assert [(check.kind, check.verdict) for _, check in done.checks()] == [
        ("numerical", "fail")
    ] * 2


def test_missing_tolerance_missing_cell_and_nothing_judged_do_not_pass(tmp_path, run):
    missing = run(write_suite(tmp_path, {"a": 'model = "faulty:Still"'}))
    assert missing.cell("short", "a").checks[0].reason == "no tolerance yet"
    assert missing.words == "no tolerance yet"
    assert missing.exit_code == 1
    assert missing.without_tolerance == 1
    alone = run(write_suite(tmp_path, {}))
    assert not any(cell.checks for cell in alone.cells)
    assert alone.without_tolerance == 0
    assert alone.exit_code == 1
    absent = FINE.format(model="a") + FINE.format(model="a").replace("short", "long")
    faulty = run(write_suite(tmp_path, {"a": 'model = "faulty:Still"'}, absent))
    assert faulty.faults == ("tolerance [long.a.still: theta_rms] has no cell in the suite",)
    assert faulty.cell("short", "a").verdict == "pass"
    assert faulty.exit_code == 1


def test_a_run_is_saved_whole_and_says_what_it_is(tmp_path, run):
    done = run(write_suite(tmp_path, {"a": 'model = "faulty:Still"'}, FINE.format(model="a")))
    done.save(tmp_path / "out")
    assert Run.load(tmp_path / "out") == done
    schema = json.loads((tmp_path / "out" / "run.schema.json").read_text())
    assert set(json.loads((tmp_path / "out" / "run.json").read_text())) == set(schema["properties"])
    assert done.exit_code == 0
    assert not list((tmp_path / "out").glob("**/*.part"))


@pytest.mark.parametrize("name", sorted(FAMILIES))
def test_how_things_look_plays_no_cell_again(name):
    code = provenance.reachable(provenance.home(name))
    assert "rockcheck.scenes.base" in code
    assert not [module for module in code if module.startswith("rockcheck.reports")]


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
        found = [ended.result for ended in pool.run(deque(calls))]
    assert [one.returncode for one in found if one != 2.0] == [0, 0]


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
    study = SuiteStudy(load_suite(path, allow_code=OWN), tmp_path / "out")
    assert {cell.compiles for cell in study.items if cell.variant.label == "a"} == {compiled}


def test_what_takes_longest_begins_before_the_quick_rest(tmp_path):
    """One cell of each code that is compiled, and the engines before the quick models; walls take
    longer."""
    study = SuiteStudy(load_suite("paper"), tmp_path)
    begun = [(cell.variant.label, cell.place) for cell in in_order(study.items)]
    first = ("mujoco", "ebm-unilateral", "cm")
    assert begun[:3] == [(model, "fig4a") for model in first]
    engines = begun[3:10]
    assert {model for model, _ in engines} == {"mujoco", "pybullet"}
    assert [scene[:4] for _, scene in engines] == 4 * ["fig5"] + 3 * ["fig4"]


MODELS = "\n".join(
    f'[models.{name}]\nmodel = "faulty:{name}"' for name in ("Segfault", "Hang", "Hog", "Fails")
)


@pytest.mark.long
@pytest.mark.filterwarnings("default")
def test_a_cluster_gives_the_same_run_and_survives_failures(tmp_path, faulty):
    path = tmp_path / "mine.toml"
    path.write_text(
        f"""reference = "Still"
[limits]
seconds = 8.0
memory_mb = 600
[models.Still]
model = "faulty:Still"
{MODELS}
[[scene]]
name = "short"
duration = 0.5
block = {{ half_width = 0.4, half_height = 1.5 }}
floor = {{ friction = 0.5 }}
""",
        encoding="utf-8",
    )
    suite = load_suite(path, allow_code=OWN)
    run = run_suite(suite, tmp_path / "out", scheduler="local:2")
    reasons = {cell.model: cell.reason for cell in run.cells}
    assert reasons == {
        "Still": "",
        "Segfault": "crashed: SIGSEGV",
        "Hang": "did not end within 8 s",
        "Hog": "out of memory",
        "Fails": "more than 10 events",
    }
    at_home = run_suite(suite, tmp_path / "home", jobs=1)
    assert at_home.cell("short", "Still").figures == run.cell("short", "Still").figures
