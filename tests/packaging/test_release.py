"""What others use of the repository: the action, the pre-commit hook, the types, the citation."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import venv
from pathlib import Path

import pytest
import yaml

from rockcheck.commands.cli import main

ROOT = Path(__file__).parents[2]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text(encoding="utf-8"))
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
    (folder / "rockcheck.toml").write_text(SUITE, encoding="utf-8")
    assert main(["accept", "--quiet", "rockcheck.toml", "--reason", "first"]) == 0
    return folder


def spoil(project):
    """Expects of the peak half of what it is."""
    path = project / "rockcheck.tolerances.toml"
    text = path.read_text(encoding="utf-8")
    spoilt = re.sub(r"expected = [0-9.e-]+", "expected = 0.1", text)
    assert spoilt != text
    path.write_text(spoilt, encoding="utf-8")


@pytest.fixture
def runner(tmp_path, project):
    """Runs the action's own commands, in order, as a job does; a later step runs after a failure
    only if it says `always()`. Returns exit codes and what was printed, by step."""
    machine = tmp_path / "machine"
    venv.create(machine, with_pip=True, symlinks=True)
    site = next(machine.glob("lib/python*/site-packages"))
    (site / "outer.pth").write_text(sysconfig.get_path("purelib") + "\n", encoding="utf-8")
    source = tmp_path / "action"
    source.mkdir()
    tracked = subprocess.run(
        ["git", "ls-files", "-zco", "--exclude-standard"],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    )
    for name in filter(None, tracked.stdout.split("\0")):
        target = source / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if (ROOT / name).exists():
            shutil.copy2(ROOT / name, target, follow_symlinks=False)
    said = {name: tmp_path / name for name in ("GITHUB_OUTPUT", "GITHUB_STEP_SUMMARY")}
    paths = os.pathsep.join((str(machine / "bin"), os.environ["PATH"]))
    environment = {key: kept for key, kept in os.environ.items() if key != "PYTHONPATH"} | {
        **{name: str(path) for name, path in said.items()},
        "GITHUB_ACTION_PATH": str(source),
        "PATH": paths,
        "PIP_NO_BUILD_ISOLATION": "1",
        "PIP_NO_DEPS": "1",
    }

    def run(**given):
        inputs = {name: about["default"] for name, about in ACTION["inputs"].items()} | given
        done = {}
        for path in said.values():
            path.write_text("", encoding="utf-8")
        for step in ACTION["runs"]["steps"]:
            if "run" not in step or (any(c for c, _ in done.values()) and "if" not in step):
                continue
            outputs = dict(
                line.split("=", 1) for line in said["GITHUB_OUTPUT"].read_text().splitlines()
            )
            values = {f"inputs.{name}": text for name, text in inputs.items()} | {
                f"steps.validate.outputs.{name}": text for name, text in outputs.items()
            }
            own = {
                name: re.sub(r"\${{ (\S+) }}", lambda found, known=values: known[found[1]], text)
                for name, text in step.get("env", {}).items()
            }
            command = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
            played = subprocess.run(
                command, env=environment | own, capture_output=True, text=True, cwd=project
            )
            done[step["name"]] = (
                played.returncode,
                played.stdout + played.stderr * bool(played.returncode),
            )
        return done

    run.summary = said["GITHUB_STEP_SUMMARY"]
    return run


@pytest.mark.slow
def test_the_action_judges_marks_and_keeps(runner, project):
    """Its steps on a machine of their own: pass, then fail with an annotation a figure."""
    fine = runner(suite="rockcheck.toml", arguments="--strict --no-report", out="kept")
    assert {name: code for name, (code, _) in fine.items()} == dict.fromkeys(
        ("install", "validate", "annotate", "verdict"), 0
    ), fine
    assert fine["annotate"][1].strip() == ""
    spoil(project)
    bad = runner(suite="rockcheck.toml", out="kept")
    assert (bad["validate"][0], bad["annotate"][0], bad["verdict"][0]) == (0, 0, 1), bad
    (mark,) = bad["annotate"][1].split("\n")[:-1]
    assert re.match(r"::error title=low\.ebm-unilateral%3A peak_rotation::\S", mark)
    assert runner.summary.read_text(encoding="utf-8").startswith("## ❌")
    assert (project / "kept" / "index.html").is_file()
    none = runner(suite="nosuch.toml", out="none")
    assert (none["annotate"], none["verdict"][0]) == ((0, ""), 2)


def test_the_action_keeps_the_report_whatever_happened():
    kept = [step for step in ACTION["runs"]["steps"] if "upload-artifact" in step.get("uses", "")]
    assert [(step["if"], step["with"]["path"]) for step in kept] == [
        ("always()", "${{ inputs.out }}")
    ]


def test_the_hook_holds_a_suite_of_the_user(project, monkeypatch):
    (hook,) = yaml.safe_load((ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8"))
    command, *arguments = [*hook["entry"].split(), *hook["args"]]
    assert command == "rockcheck"
    assert main(arguments) == 0
    spoil(project)
    assert main(arguments) == 1


def test_a_user_s_script_is_checked(tmp_path):
    """Against the types of the installed package: with its marker no remark is one too many,
    without it one is."""
    for marked, code in ((True, 0), (False, 1)):
        site = tmp_path / f"site{marked}"
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
    for name in ("pyproject.toml", "CITATION.cff", ".ci/project_urls.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)

    def write(address):
        command = [sys.executable, tmp_path / ".ci" / "project_urls.py", address]
        return subprocess.run(command, capture_output=True, cwd=tmp_path).returncode

    assert write("ftp://example.org/a/b") == 1
    assert write("https://example.org/a/b/") == 0
    assert write("https://example.org/c/d") == 0
    project = tomllib.loads((tmp_path / "pyproject.toml").read_text(encoding="utf-8"))
    own = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "urls" not in own["project"]
    assert project["project"]["urls"]["Issues"] == "https://example.org/c/d/issues"
    assert {key: value for key, value in project["project"].items() if key != "urls"} == own[
        "project"
    ]
    citation = yaml.safe_load((tmp_path / "CITATION.cff").read_text(encoding="utf-8"))
    assert citation["repository-code"] == "https://example.org/c/d"


def test_the_citation_is_of_this_version():
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert (citation["version"], citation["license"], citation["authors"]) == (
        project["version"],
        project["license"],
        project["authors"],
    )
