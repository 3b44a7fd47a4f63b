"""What CI installs and what a night tells: the lock file, `.ci/nightly.py`, and the page that shows
its last results."""

import importlib.util
import json
import re
import sys
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def loaded(path: str):
    spec = importlib.util.spec_from_file_location(Path(path).stem, ROOT / path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def nightly(tmp_path, monkeypatch):
    module = loaded(".ci/nightly.py")
    monkeypatch.setattr(module, "KEPT", module.ROOT / "build" / tmp_path.name / "nightly.json")
    module.KEPT.parent.mkdir(parents=True, exist_ok=True)
    monkeypatch.setenv("NIGHTLY_OUT", str(tmp_path))
    monkeypatch.setenv("NIGHTLY_SEED", "7")
    yield module
    module.KEPT.unlink(missing_ok=True)
    module.KEPT.parent.rmdir()


def test_all_that_ci_installs_is_locked_by_hash():
    lock = (ROOT / ".ci/requirements.txt").read_text(encoding="utf-8")
    entries = re.split(r"\n(?=\S)", lock.strip())
    assert all("--hash=sha256:" in entry for entry in entries)
    assert "://" not in lock
    locked = {entry.partition("==")[0] for entry in entries}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    asked = [
        *project["dependencies"],
        *(
            one
            for extra in ("test", "docs", "lint")
            for one in project["optional-dependencies"][extra]
        ),
    ]
    names = {re.split(r"[\[<>=!~; ]", text)[0].lower().replace("_", "-") for text in asked} | {
        "setuptools"
    }
    assert names <= locked, f"`make lock` is due: {names - locked}"


def test_a_night_runs_all_parts_whatever_one_does(nightly, monkeypatch, tmp_path):
    """A part that fails fails the night, after all others; what cannot be run is told as such, and
    never as passed."""
    python = sys.executable
    parts = [
        nightly.Part(
            "broken", (python, "-c", "print('1 failed'); raise SystemExit(3)"), nightly.last_line
        ),
        nightly.Part(
            "absent", (python, "-c", "print()"), nightly.last_line, "a_module_that_nobody_has"
        ),
        nightly.Part("fine", (python, "-c", "print('=== 5 passed in 2 s ===')"), nightly.last_line),
    ]
    monkeypatch.setattr(nightly, "parts", lambda *_: parts)
    monkeypatch.setenv("NIGHTLY_QUICK", "1")
    assert nightly.main() == 1
    monkeypatch.delenv("NIGHTLY_QUICK")
    parts.pop(0)
    assert nightly.main() == 0
    kept = json.loads(nightly.KEPT.read_text(encoding="utf-8"))
    assert [(part["name"], part["result"]) for part in kept["short"]["parts"]] == [
        ("broken", "failed"),
        ("absent", "not run"),
        ("fine", "passed"),
    ]
    assert kept["whole"]["parts"][1]["figures"] == "5 passed in 2 s"
    assert kept["whole"]["seed"] == 7
    shown = loaded("docs/site_tools/nightly.py").tables(kept)
    assert "| broken | failed |" in shown
    assert "| absent | not run | 0 | a_module_that_nobody_has is not installed |" in shown


def test_parts_cover_the_readers_and_the_stress_run(nightly, tmp_path):
    names = [part.name for part in nightly.parts(False, 7, tmp_path)]
    assert {
        "slow tests",
        "stress",
        "known weaknesses of dependencies",
        *(f"fuzz {reader}" for reader in nightly.READERS),
    } <= set(names)
    source = (ROOT / "tests/stress/test_hostile_input.py").read_text(encoding="utf-8")
    assert all(f'    "{reader}": (' in source for reader in nightly.READERS)


def test_an_audit_that_reaches_no_list_has_not_passed(nightly, tmp_path):
    found = {
        "dependencies": [
            {"name": "a", "skip_reason": "not found"},
            {"name": "b", "version": "1", "vulns": [{"id": "X-1"}]},
        ]
    }
    assert nightly.audited("words\n" + json.dumps(found)) == "1 of 2 packages looked up; b 1: X-1"
    nothing = json.dumps({"dependencies": found["dependencies"][:1]})
    part = nightly.Part(
        "known weaknesses", (sys.executable, "-c", f"print({nothing!r})"), nightly.audited
    )
    assert nightly.play(part, tmp_path).result == "not run"


pytest_plugins = ["pytester"]

CONFTEST = Path(__file__).parents[1] / "conftest.py"
SKIPS = """
import pytest

@pytest.mark.skip(reason="no mood")
def test_marked(): pass

@pytest.mark.skipif(True, reason="needs pybullet: it is played")
def test_listed(): pass

def test_inside():
    pytest.skip("no mood either")

@pytest.fixture
def absent():
    pytest.importorskip("a_library_that_nobody_has")

def test_fixture(absent): pass

@pytest.mark.xfail(strict=True)
def test_known_fault():
    assert False

def test_fine(): pass
"""


@pytest.fixture
def project(pytester):
    pytester.makeconftest(CONFTEST.read_text(encoding="utf-8"))
    pytester.makepyfile(
        test_some=SKIPS,
        test_file='import pytest\npytest.importorskip("another_one_that_nobody_has")\n',
    )
    return pytester


def run(project, monkeypatch, ci):
    monkeypatch.delenv("CI", raising=False)
    if ci:
        monkeypatch.setenv("CI", "true")
    return project.runpytest_subprocess("-rs", "-p", "no:cacheprovider", "-n0")


def test_outside_of_ci_a_skip_is_a_skip(project, monkeypatch):
    run(project, monkeypatch, ci=False).assert_outcomes(passed=1, xfailed=1, skipped=5)


def test_in_ci_a_skip_that_is_not_listed_fails(project, monkeypatch):
    result = run(project, monkeypatch, ci=True)
    result.stdout.fnmatch_lines(["*lists no such reason: could not import 'another_one*"])
    chosen = project.runpytest_subprocess("-rs", "-p", "no:cacheprovider", "-n0", "test_some.py")
    listed = int(sys.version_info >= (3, 12))
    chosen.assert_outcomes(passed=1, xfailed=1, skipped=listed, failed=1, errors=3 - listed)
    chosen.stdout.fnmatch_lines_random(
        ["*lists no such reason: no mood", "*lists no such reason: no mood either"]
    )
    assert result.ret != 0
    assert chosen.ret != 0
