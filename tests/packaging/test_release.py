"""What others use of the repository: the action, the pre-commit hook, the types, the citation; and
what CI does: the lock file, `.ci/nightly.py`, and the page that shows its last results."""

import importlib
import json
import os
import re
import runpy
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
import yaml

from rockcheck.commands.cli import main

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
ACTION = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
SUITE = """
reference = "ebm-unilateral"
[models.ebm-unilateral]
[require]
figures = ["peak_rotation"]
[[scene]]
name = "low"
duration = 0.5
initial_rotation = 0.05
block = { half_width = 0.2, half_height = 1.0 }
floor = { friction = 0.4 }
"""


@pytest.fixture
def project(tmp_path, monkeypatch):
    """A user's repository with a suite that passes."""
    folder = tmp_path / "project"
    folder.mkdir()
    monkeypatch.chdir(folder)
    (folder / "rockcheck.toml").write_text(SUITE, "utf-8")
    assert main(["accept", "--quiet", "rockcheck.toml", "--reason", "first"]) == 0
    return folder


def spoil(project):
    path = project / "rockcheck.tolerances.toml"
    spoilt = re.sub(r"expected = [0-9.e-]+", "expected = 0.1", path.read_text("utf-8"))
    path.write_text(spoilt, "utf-8")


def action(project, **given):
    """Runs the action's own commands after its installation, in order, as a job does; a later step
    runs after a failure only if it says `always()`. Returns exit codes and what was printed, by
    step, and the job's summary."""
    said = {name: project.parent / name for name in ("GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY")}
    environment = os.environ | {
        **{name: str(path) for name, path in said.items()},
        "GITHUB_ACTION_PATH": str(ROOT),
        "PATH": os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"])),
    }
    values = {
        f"inputs.{name}": given.get(name, about["default"])
        for name, about in ACTION["inputs"].items()
    }
    done = {}
    for path in said.values():
        path.write_text("", "utf-8")
    for step in ACTION["runs"]["steps"]:
        failed = any(code for code, _ in done.values())
        if "run" not in step or step["name"] == "install" or (failed and "if" not in step):
            continue
        for line in said["GITHUB_OUTPUT"].read_text().splitlines():
            name, _, text = line.partition("=")
            values[f"steps.validate.outputs.{name}"] = text
        own = {
            name: re.sub(r"\${{ (\S+) }}", lambda found: values[found[1]], text)
            for name, text in step["env"].items()
        }
        played = subprocess.run(
            ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]],
            env=environment | own,
            capture_output=True,
            text=True,
            cwd=project,
        )
        seen = played.stdout + played.stderr * bool(played.returncode)
        done[step["name"]] = (played.returncode, seen)
    return done, said["GITHUB_STEP_SUMMARY"].read_text("utf-8")


def test_the_action_installs_itself_and_keeps_the_report_whatever_happened():
    steps = {step.get("name", step.get("uses")): step for step in ACTION["runs"]["steps"]}
    assert re.search(r'pip install .*"\$GITHUB_ACTION_PATH" \$PACKAGES$', steps["install"]["run"])
    assert steps["install"]["env"] == {"PACKAGES": "${{ inputs.packages }}"}
    assert [
        (step["if"], step["with"]["path"])
        for step in steps.values()
        if "upload-artifact" in step.get("uses", "")
    ] == [("always()", "${{ inputs.out }}")]


def test_the_action_judges_marks_and_keeps(project):
    fine, _ = action(
        project, suite="rockcheck.toml", arguments="--strict worse --no-report", out="kept"
    )
    assert {name: code for name, (code, _) in fine.items()} == dict.fromkeys(
        ("validate", "annotate", "verdict"), 0
    ), fine
    assert fine["annotate"][1].strip() == ""
    spoil(project)
    bad, summary = action(project, suite="rockcheck.toml", out="kept")
    assert bad["validate"][0] == 0, bad
    assert bad["annotate"][0] == 0, bad
    assert bad["verdict"][0] == 1, bad
    (mark,) = bad["annotate"][1].split("\n")[:-1]
    assert re.match(r"::error title=low\.ebm-unilateral%3A peak_rotation::\S", mark)
    assert summary.startswith("## ❌")
    assert (project / "kept" / "index.html").is_file()
    none, summary = action(project, suite="nosuch.toml", out="kept")
    assert none["annotate"] == (0, "")
    assert none["verdict"][0] == 2
    assert summary == ""


def test_the_hook_holds_a_suite_of_the_user(project, monkeypatch):
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text("utf-8"))
    command, *arguments = [*hook["entry"].split(), *hook["args"]]
    assert command == "rockcheck"
    assert main(arguments) == 0
    spoil(project)
    assert main(arguments) == 1


@pytest.mark.parametrize(("marked", "code"), [(True, 0), (False, 1)])
def test_a_user_s_script_is_checked(tmp_path, marked, code):
    """Against the types of the installed package: with its marker no remark is one too many,
    without it one is."""
    site = tmp_path / "site"
    shutil.copytree(ROOT / "rockcheck", site / "rockcheck", symlinks=False)
    if not marked:
        (site / "rockcheck" / "py.typed").unlink()
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", str(ROOT / ".ci" / "user_script.py")],
        env=os.environ | {"PYTHONPATH": str(site), "MYPYPATH": ""},
        capture_output=True,
        text=True,
        cwd=tmp_path,
    )
    assert done.returncode == code, done.stdout + done.stderr


def test_a_release_says_where_it_comes_from(tmp_path):
    """The address is written in where a release is built, and nowhere else."""
    (tmp_path / ".ci").mkdir()
    for name in ("pyproject.toml", "CITATION.cff", ".ci/project_urls.py"):
        shutil.copy(ROOT / name, tmp_path / name)
    tool = tmp_path / ".ci" / "project_urls.py"
    assert [
        subprocess.run([sys.executable, tool, one], capture_output=True, cwd=tmp_path).returncode
        for one in ("ftp://example.org/a/b", "https://example.org/a/b/", "https://example.org/c/d")
    ] == [1, 0, 0]
    project = tomllib.loads((tmp_path / "pyproject.toml").read_text("utf-8"))
    urls = project["project"].pop("urls")
    assert urls["Issues"] == "https://example.org/c/d/issues"
    assert project == PROJECT
    citation = yaml.safe_load((tmp_path / "CITATION.cff").read_text("utf-8"))
    assert citation["repository-code"] == "https://example.org/c/d"


def test_the_citation_and_the_changelog_are_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    project = PROJECT["project"]
    keys = ("version", "license", "authors")
    assert [citation[key] for key in keys] == [project[key] for key in keys]
    changes = (ROOT / "CHANGELOG.md").read_text("utf-8")
    assert re.search(r"^## (\S+)", changes, re.MULTILINE)[1] == project["version"]


# --- what CI installs and what a night tells


@pytest.fixture
def nightly(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / ".ci")
    monkeypatch.delitem(sys.modules, "nightly", raising=False)
    module = importlib.import_module("nightly")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "KEPT", tmp_path / "nightly.json")
    monkeypatch.setenv("NIGHTLY_OUT", str(tmp_path))
    monkeypatch.setenv("NIGHTLY_SEED", "7")
    return module


def test_all_that_ci_installs_is_locked_by_hash():
    lock = (ROOT / ".ci/requirements.txt").read_text("utf-8")
    entries = re.split(r"\n(?=\S)", lock.strip())
    odd = [entry for entry in entries if "--hash=sha256:" not in entry or "://" in entry]
    assert odd == []
    locked = {entry.partition("==")[0] for entry in entries}
    project = PROJECT["project"]
    extras = (project["optional-dependencies"][name] for name in ("test", "docs", "lint"))
    asked = sum(extras, ["setuptools", *project["dependencies"]])
    names = {re.split(r"[\[<>=!~; ]", text)[0].lower().replace("_", "-") for text in asked}
    assert names <= locked, f"`make lock` is due: {names - locked}"


def test_a_night_fuzzes_every_reader(nightly):
    tested = runpy.run_path(str(ROOT / "tests/stress/test_hostile_input.py"))["READERS"]
    assert set(nightly.READERS) == set(tested)


@pytest.mark.parametrize("quick", [True, False])
def test_a_night_has_the_slow_tests_the_stress_run_and_the_audit(nightly, quick, tmp_path):
    names = {part.name for part in nightly.parts(quick, 7, tmp_path)}
    assert names >= {
        *("slow tests", "stress", "known weaknesses of dependencies"),
        *(f"fuzz {reader}" for reader in nightly.READERS[: 2 if quick else None]),
    }


def test_a_night_runs_all_parts_whatever_one_does(nightly, monkeypatch, tmp_path):
    """A part that fails fails the night, after all others; what cannot be run is told as such, and
    never as passed."""
    parts = [
        nightly.Part(name, (sys.executable, "-c", code), nightly.last_line, needs)
        for name, code, needs in (
            ("broken", "print('1 failed'); raise SystemExit(3)", ""),
            ("absent", "print()", "a_module_that_nobody_has"),
            ("fine", "print('=== 5 passed in 2 s ===')", ""),
        )
    ]
    monkeypatch.setattr(nightly, "parts", lambda *_: parts)
    monkeypatch.setenv("NIGHTLY_QUICK", "1")
    assert nightly.main() == 1
    monkeypatch.delenv("NIGHTLY_QUICK")
    parts.pop(0)
    assert nightly.main() == 0
    kept = json.loads(nightly.KEPT.read_text("utf-8"))
    assert [(part["name"], part["result"]) for part in kept["short"]["parts"]] == [
        ("broken", "failed"),
        ("absent", "not run"),
        ("fine", "passed"),
    ]
    assert kept["whole"]["parts"][1]["figures"] == "5 passed in 2 s"
    assert kept["whole"]["seed"] == 7
    shown = runpy.run_path(str(ROOT / "docs/site_tools/nightly.py"))["tables"](kept)
    absent = "| absent | not run | 0 | a_module_that_nobody_has is not installed |"
    assert [row for row in ("| broken | failed |", absent) if row not in shown] == []


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

#: Whether PyBullet may be missing.
LISTED = int(sys.version_info >= (3, 12))
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


@pytest.mark.parametrize(
    ("ci", "outcomes"),
    [
        ("", {"skipped": 5}),
        ("true", {"skipped": LISTED, "failed": 1, "errors": 4 - LISTED}),
    ],
)
def test_a_skip_that_is_not_listed_fails_in_ci(pytester, monkeypatch, ci, outcomes):
    monkeypatch.setenv("CI", ci)
    pytester.makeconftest((ROOT / "tests" / "conftest.py").read_text("utf-8"))
    pytester.makepyfile(
        test_some=SKIPS,
        test_file='import pytest\npytest.importorskip("another_one_that_nobody_has")\n',
    )
    words = ("-rs", "-p", "no:cacheprovider", "-n0", "--continue-on-collection-errors")
    result = pytester.runpytest_subprocess(*words)
    result.assert_outcomes(passed=1, xfailed=1, **outcomes)
    told = set(re.findall("lists no such reason: ([a-z ]+)", result.stdout.str()))
    assert told >= ({"could not import ", "no mood", "no mood either"} if ci else set())
