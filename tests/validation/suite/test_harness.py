"""The harness as a whole, on copies of the project: faults put in on purpose, what runs
again, and two runs at once. Minutes, not seconds."""

import os
import random
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]


def start(folder: Path, *words: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "rockcheck", "validate", "smoke", *words, "--no-report"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"},
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )


def run(folder: Path, *words: str) -> tuple[int, str]:
    process = start(folder, *words)
    out, _ = process.communicate(timeout=900)
    return process.returncode, out


def run_changed(folder: Path, file: str, old: str, new: str, *words: str) -> tuple[int, str]:
    path = folder / "rockcheck" / file
    text = path.read_text("utf-8")
    path.write_text(re.sub(old, new, text, count=1), "utf-8")
    try:
        return run(folder, *words)
    finally:
        path.write_text(text, "utf-8")


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """The folder of a copy in which files can be changed and put back, compiled code and times
    kept."""
    folder = tmp_path_factory.mktemp("project")
    shutil.copytree(
        ROOT / "rockcheck", folder / "rockcheck", ignore=shutil.ignore_patterns("__pycache__")
    )
    code, out = run(folder, "--strict", "worse")
    assert code == 0, out
    return folder


#: What is done wrong, in which file, by replacing what (a regular expression) with what, and how
#: many of the 30 cells cannot depend on that file. Compiled code last: it takes a minute.
FAULTS = [
    ("gravity 9.8", "scenes/scene.py", r"gravity: Positive = 9\.81", "gravity: Positive = 9.8", 0),
    (
        "the record's last sample dropped",
        "scenes/excitations.py",
        r"recording\.samples\.tolist\(\)",
        "recording.samples[:-1].tolist()",
        0,
    ),
    (
        "output shifted by one sample",
        "scenes/observation.py",
        r"zip\(STATE, state\[:on_grid\]\.T,",
        "zip(STATE, np.roll(state, 1, axis=0)[:on_grid].T,",
        0,
    ),
    (
        "NaN at the end",
        "scenes/observation.py",
        r"    channels: dict",
        "    state[rows - 1] = np.nan\n    channels: dict",
        0,
    ),
    (
        "wall 1 mm off",
        "engines/contacts.py",
        r"distance=b \+ wall\.gap",
        "distance=b + wall.gap + 0.001 / 1.605",
        18,
    ),
    ("e ignored", "engines/contacts.py", r"restitution=wall\.restitution", "restitution=0.0", 18),
    (
        "a swapped left and right",
        "engines/contacts.py",
        r'1\.0 if wall\.side == "left"',
        '1.0 if wall.side == "right"',
        18,
    ),
    (
        "dt off by 1e-3",
        "engines/steps.py",
        r"\(vx, vy, w\), dt,",
        "(vx, vy, w), 1.001 * dt,",
        18,
    ),
    ("a lost impact", "engines/events.py", r"= _rises\(closed\)", "= _rises(closed)[1:]", 18),
    (
        "friction 5 % low",
        "ebm/natural.py",
        r"mu_k=scene\.floor\.friction",
        "mu_k=0.95 * scene.floor.friction",
        18,
    ),
    (
        "Housner's ratio off by 1 %",
        "ebm/core/impacts.py",
        r"w2 = \(1\.0 - k2",
        "w2 = 1.01 * (1.0 - k2",
        18,
    ),
    (
        "a sign in (3)",
        "ebm/core/motion.py",
        r"share \* r \* \(push - weight\)",
        "share * r * (push + weight)",
        18,
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "file", "old", "new", "untouched"), FAULTS, ids=[fault[0] for fault in FAULTS]
)
def test_a_deliberate_fault_fails_the_smoke_suite(project, fault, file, old, new, untouched):
    code, out = run_changed(project, file, old, new, "--strict", "worse")
    assert code in (1, 3), f"{fault}: {out}"
    assert f"{untouched} of 30 simulations were up to date" in out
    assert "Traceback" not in out


CHANGES = [
    ("an engine's module", "engines/pybullet_engine.py", r"\Z", "\nUNUSED = 1\n", 24),
    ("a remark", "engines/pybullet_engine.py", r"\Z", "\n# unused\n", 30),
    (
        "an engine's setting",
        "validation/data/suites/smoke.toml",
        r"(\[models\.mujoco\]\n)",
        r"\g<1>largest_step = 4.9e-4\n",
        24,
    ),
    ("the continuous model's", "cm/integrate.py", r"\Z", "\nUNUSED = 1\n", 24),
    ("a measure", "validation/discrepancy/measures.py", r"\Z", "\nUNUSED = 1\n", 30),
    ("a page", "reports/site.py", r"\Z", "\nUNUSED = 1\n", 30),
]


@pytest.mark.parametrize(("file", "old"), [(fault[1], fault[2]) for fault in FAULTS + CHANGES])
def test_what_is_to_be_changed_is_there(file: str, old: str) -> None:
    """Each day, not each night only: else a fault that cannot be planted any more is not missed."""
    assert re.search(old, (ROOT / file).read_text("utf-8")), "mend this test"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "old", "new", "untouched"),
    [change[1:] for change in CHANGES],
    ids=[change[0] for change in CHANGES],
)
def test_exactly_what_depends_on_a_change_runs_again(project, file, old, new, untouched):
    run(project)
    assert "30 of 30 simulations were up to date" in run(project)[1]
    _, out = run_changed(project, file, old, new)
    assert f"{untouched} of 30 simulations were up to date" in out


@pytest.mark.slow
def test_a_killed_run_goes_on_and_ends_the_same(project, tmp_path):
    def tables(folder: Path) -> list[bytes]:
        return [(folder / name).read_bytes() for name in ("checks.csv", "figures.csv")]

    began = time.perf_counter()
    run(project, "--out", str(tmp_path / "undisturbed"))
    length = time.perf_counter() - began
    expected = tables(tmp_path / "undisturbed")
    chance = random.Random(20)
    killed = 0
    for attempt in range(20):
        out = tmp_path / f"killed-{attempt}"
        process = start(project, "--out", str(out))
        time.sleep(chance.uniform(0.0, 1.1) * length)
        killed += process.poll() is None
        process.kill()
        process.communicate()
        code, text = run(project, "--out", str(out))
        assert code == 0, text
        assert tables(out) == expected
        assert not _alive(process.pid), "its workers outlive a killed run"
        shutil.rmtree(out)
    assert killed >= 10


@pytest.mark.slow
def test_two_runs_on_one_folder(project, tmp_path):
    both = [start(project, "--out", str(tmp_path / "shared")) for _ in range(2)]
    texts = [process.communicate(timeout=900)[0] for process in both]
    assert [process.returncode for process in both] == [0, 0], texts


def _alive(group: int) -> list[str]:
    """Processes of a process group, after half a minute's grace."""
    listing = ["ps", "-o", "pid=,args=", "--sort=pid", "-g", str(group)]
    for _ in range(60):
        done = subprocess.run(listing, capture_output=True, text=True, check=False)
        listed = [line for line in done.stdout.splitlines() if "<defunct>" not in line]
        if not listed:
            break
        time.sleep(0.5)
    return listed
