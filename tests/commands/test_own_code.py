"""Nothing that is read is run: a model of the user's own is imported only where the command line
allows it, and only by a worker."""

import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCENE = """
name = "short"
duration = 0.2
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
"""
SUITE = """
reference = "ebm"
[models.ebm]
[models.a]
model = "{model}"
command = "touch ran"
[[scene]]
"""
#: A module that tells that it was imported, and by which process.
SPY = """
import os
from pathlib import Path
(Path(__file__).parent / f"imported-{os.getpid()}").write_text("")
from faulty import Still
from os import system
from posixpath import join
number = 3
class Plain:
    pass
class Told:
    def __init__(self, **settings):
        pass
    def simulate(self, scene):
        return Still().simulate(scene)
"""


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch, faulty):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "spy.py").write_text(SPY)
    return tmp_path


def traces(folder: Path) -> list[str]:
    return [path.name for kind in ("ran", "imported-*") for path in folder.glob(kind)]


@pytest.mark.parametrize(
    "model",
    [
        "os:system",
        "subprocess:run",
        "subprocess:Popen",
        "spy:Told",
        "builtins:exec",
        "faulty:Still",
    ],
)
@pytest.mark.parametrize(
    "command",
    ["validate", "accept", "simulate", "spectrum", "conformance", "included", "another"],
)
def test_a_suite_or_a_name_alone_runs_nothing(folder, model, command, refused):
    """One line that names the option; exit 2; nothing is imported. Leave for one class is none for
    another of the same module."""
    (folder / "mine.toml").write_text(SUITE.replace("{model}", model) + SCENE)
    (folder / "outer.toml").write_text('include = ["mine.toml"]\n')
    words = {
        "included": ["validate", "outer.toml"],
        "another": ["validate", "mine.toml", "--allow-code", "spy:Plain"],
        "simulate": ["simulate", "scene.toml", "--model", model, "--set", "command=touch ran"],
        "spectrum": ["spectrum", "scene.toml", "--size", "3", "--model", model],
        "conformance": ["conformance", "--engine", model],
    }
    line = refused(*words.get(command, [command, "mine.toml"]))
    assert model in line
    assert (
        f"--allow-code {model}" in line or "standard library" in line or "one of your own" in line
    )
    if command in ("validate", "accept"):
        assert "mine.toml: models.a: " in line
    assert traces(folder) == []
    assert "spy" not in sys.modules


@pytest.mark.parametrize(
    ("model", "said"),
    [
        ("os:system", "os is part of Python's standard library"),
        ("subprocess:Popen", "subprocess is part of Python's standard library"),
        ("spy:system", "it must be a class with a method `simulate`"),
        ("spy:join", "it must be a class with a method `simulate`"),
        ("spy:number", "it must be a class with a method `simulate`"),
        ("spy:Plain", "it must be a class with a method `simulate`"),
        ("spy:Absent", "not available in this installation"),
        ("no_such_module:Class", "not available in this installation"),
    ],
)
def test_what_is_allowed_must_be_a_model(model, said, refused):
    assert said in refused(
        "simulate",
        "scene.toml",
        "--model",
        model,
        "--allow-code",
        model,
        "--set",
        "command=touch ran",
    )
    assert not Path("ran").exists()


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["simulate", "scene.toml", "--model", "spy:Told"], 0),
        (["validate", "mine.toml", "--no-report"], 1),  # it judges nothing, which is no pass
    ],
)
def test_an_allowed_model_is_imported_by_a_worker_only(folder, words, code):
    """Its code is read to see whether it changed, not run, by the process of the command itself."""
    script = (
        "import os, sys; from rockcheck.commands.cli import main;"
        " code = main(sys.argv[1:]); print(os.getpid(), code)"
    )
    (folder / "mine.toml").write_text(SUITE.replace("{model}", "spy:Told") + SCENE)
    done = subprocess.run(
        [sys.executable, "-c", script, *words, "--allow-code", "spy:Told", "--quiet"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    process, ended = done.stdout.split()
    assert int(ended) == code, done.stderr
    assert f"imported-{process}" not in traces(folder) != []


def test_a_model_that_raises_is_named(typed):
    words = ["simulate", "scene.toml", "--model", "faulty:Bug", "--allow-code", "faulty:Bug"]
    _, errors = typed(*words, code=3)
    assert "faulty:Bug: ZeroDivisionError: a bug" in errors


OWN = "rockcheck: short, a: ZeroDivisionError: a bug.*traceback in rockcheck-report/faults/short"


@pytest.mark.parametrize(
    ("broken", "code", "ours"),
    [
        ("", 3, []),
        (
            "yes",
            70,
            [
                "rockcheck: a fault of rockcheck itself, short, ebm: AttributeError"
                ".*rockcheck-report/faults/short--ebm--"
            ],
        ),
    ],
)
def test_a_fault_of_a_model_leaves_its_traceback(but_progress, folder, broken, code, ours):
    """One's own model that raises what it may not is a failed model, 3; one of rockcheck's own that
    does is a fault, 70."""
    text = SUITE.replace("{model}", "faulty:Bug").replace('command = "touch ran"\n', "")
    (folder / "mine.toml").write_text(
        text.replace("[models.ebm]", '[models.ebm]\nmodel = "cm"') + SCENE
    )
    words = ["validate", "mine.toml", "--allow-code", "faulty:Bug", "--no-report"]
    done = subprocess.run(
        [sys.executable, "-c", _BROKEN, *words],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        env={**os.environ, "BROKEN": broken},
    )
    assert done.returncode == code, done.stderr
    lines = zip([*ours, OWN], sorted(but_progress(done.stderr)), strict=True)
    assert [line for pattern, line in lines if not re.match(pattern, line)] == []
    faults = "".join(path.read_text() for path in Path("rockcheck-report/faults").iterdir())
    assert "ZeroDivisionError: a bug\nof two lines" in faults
    assert ("AttributeError: broken" in faults) == bool(broken)


#: The command line with workers in this process, whose continuous model is broken where the
#: environment says so.
_BROKEN = """
import os, sys
from rockcheck.commands import cli
from rockcheck.cm import ContinuousModel
from rockcheck.validation.suite import runner
play = runner.run_suite
runner.run_suite = lambda *given, **how: play(*given, **{**how, "jobs": 0})
if os.environ["BROKEN"]:
    def simulate(self, scene):
        raise AttributeError("broken")
    ContinuousModel.simulate = simulate
sys.exit(cli.main(sys.argv[1:]))
"""


#: What unpickles, runs text or imports by a name.
MAKES_CODE = {
    *("eval", "exec", "compile", "__import__", "input", "os.system", "os.popen", "shell="),
    *("pd.eval", "pd.read_pickle", "yaml.load", "np.load", "numpy.load", "allow_pickle="),
    *("pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib"),
    *("importlib.import_module", "pkgutil.resolve_name", "runpy.run_path", "runpy.run_module"),
}
#: Where it is needed, and why.
ALLOWED = {
    # the user's own private folder, owner and mode checked, each file hashed
    "pickle": {"scenes/compiled.py"},
    # arrays without objects
    # rockcheck's own commands
    "pkgutil.resolve_name": {"rockcheck/commands/cli.py"},
    # models by rockcheck's own names, one's own only as the command line allows, in a worker;
    # engines by the names of the files in their folder
    "importlib.import_module": {"validation/execute/models.py", "engines/registry.py"},
}


def words_of(node: ast.AST) -> set[str | None]:
    """What a node calls, and by which options; or what it imports."""
    if isinstance(node, ast.Call):
        return {ast.unparse(node.func), *(f"{one.arg}=" for one in node.keywords)}
    if isinstance(node, ast.Import | ast.ImportFrom):
        return {getattr(node, "module", None), *(alias.name for alias in node.names)}
    return set()


def test_no_code_is_made_of_what_is_read():
    found = {
        (word, path.relative_to(ROOT).as_posix())
        for folder in ("rockcheck", "scenes", "ebm", "cm", "engines", "validation", "reports")
        for path in (ROOT / folder).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        for word in words_of(node) & MAKES_CODE
    }
    assert found == {(word, path) for word, paths in ALLOWED.items() for path in paths}
