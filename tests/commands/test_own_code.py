"""Nothing that is read is run: a model of the user's own is imported only where the command line
allows it, and only by a worker."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rockcheck.scenes import InputError
from rockcheck.validation.execute.models import build, build_own, check_allowed
from rockcheck.validation.suite.suites import load_suite

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
    return [
        path.name
        for path in folder.iterdir()
        if path.name == "ran" or path.name.startswith("imported-")
    ]


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
    "command", ["validate", "accept", "simulate", "spectrum", "conformance", "included"]
)
def test_a_suite_or_a_name_alone_runs_nothing(folder, model, command, refused):
    """One line that names the option; exit 2; nothing is imported."""
    before = set(sys.modules)
    (folder / "mine.toml").write_text(SUITE.replace("{model}", model) + SCENE)
    (folder / "outer.toml").write_text('reference = "ebm"\ninclude = ["mine.toml"]\n')
    words = {
        "included": ["validate", "outer.toml"],
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
    assert "spy" not in set(sys.modules) - before


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


def test_an_allowed_model_is_imported_by_a_worker_only(folder):
    """Its code is read to see whether it changed, not run, by the process of the command itself."""
    script = (
        "import os, sys; from rockcheck.commands.cli import main;"
        " code = main(sys.argv[1:]); print(os.getpid(), code)"
    )
    (folder / "mine.toml").write_text(SUITE.replace("{model}", "spy:Told") + SCENE)
    for n, words in enumerate(
        (
            ["simulate", "scene.toml", "--model", "spy:Told"],
            ["validate", "mine.toml", "--no-report"],
        )
    ):
        command = [sys.executable, "-c", script, *words, "--allow-code", "spy:Told", "--quiet"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
        process, code = done.stdout.split()
        assert int(code) == n, done.stderr  # the suite judges nothing, which is no pass
        assert traces(folder)
        assert f"imported-{process}" not in traces(folder)
        for name in traces(folder):
            (folder / name).unlink()


def test_what_is_allowed_is_named(folder):
    """Leave for one class is none for another of the same module."""
    (folder / "mine.toml").write_text(SUITE.replace("{model}", "spy:Told") + SCENE)
    with pytest.raises(InputError, match="--allow-code spy:Told"):
        load_suite(folder / "mine.toml", allow_code=["spy:Plain", "faulty:Still"])
    assert load_suite(folder / "mine.toml", allow_code=["spy:Told"]).models["a"].search_path == (
        str(folder),
    )
    check_allowed("ebm", ())
    with pytest.raises(InputError, match="one of your own"):
        build("spy:Told")
    with pytest.raises(InputError, match="standard library"):
        build_own("os:system", {"command": "touch ran"})
    assert traces(folder) == []


def test_a_fault_of_a_model_leaves_its_traceback(but_progress, folder, monkeypatch):
    """One's own model that raises what it may not is a failed model, 3; one of rockcheck's own that
    does is a fault, 70."""
    text = SUITE.replace("{model}", "faulty:Bug").replace(
        "[models.ebm]", '[models.ebm]\nmodel = "cm"'
    )
    text = text.replace('command = "touch ran"\n', "")
    (folder / "mine.toml").write_text(text + SCENE)
    command = [
        sys.executable,
        "-c",
        _BROKEN,
        "validate",
        "mine.toml",
        "--allow-code",
        "faulty:Bug",
        "--no-report",
        "--force",
    ]
    for broken, code in (("", 3), ("broken", 70)):
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
            env={**os.environ, "BROKEN": broken},
        )
        assert done.returncode == code, done.stderr
        lines = but_progress(done.stderr)
        own = [
            line
            for line in lines
            if line.startswith("rockcheck: short, a: ZeroDivisionError: a bug")
        ]
        assert len(own) == 1
        assert "traceback in rockcheck-report/faults/short--a--" in own[0]
        lines.remove(own[0])
        assert len(lines) == bool(broken)
        if broken:
            assert lines[0].startswith(
                "rockcheck: a fault of rockcheck itself, short, ebm: AttributeError"
            )
            assert "rockcheck-report/faults/short--ebm--" in lines[0]
        faults = [path.read_text() for path in sorted(Path("rockcheck-report/faults").iterdir())]
        assert any("ZeroDivisionError: a bug\nof two lines" in text for text in faults)
        assert any("AttributeError: broken" in text for text in faults) == bool(broken)


#: The command line with workers in this process, whose continuous model is broken where the
#: environment says so.
_BROKEN = """
import os, sys
from rockcheck.commands import cli, validate
from rockcheck.cm import ContinuousModel
play = validate.run_suite
validate.run_suite = lambda *given, **how: play(*given, **{**how, "jobs": 0})
if os.environ["BROKEN"]:
    def simulate(self, scene):
        raise AttributeError("broken")
    ContinuousModel.simulate = simulate
sys.exit(cli.main(sys.argv[1:]))
"""


#: Modules that may unpickle or import by a name, and why.
UNPICKLE = {
    "scenes/compiled.py": "the user's own private folder, owner and mode checked, each file hashed",
}
IMPORT = {
    "rockcheck/commands/cli.py": "rockcheck's own commands",
    "validation/execute/models.py": (
        "models by rockcheck's own names; one's own only as the command line allows, in a worker"
    ),
}


def test_no_code_is_made_of_what_is_read():
    """No pickle, no eval, no import of a name: whoever needs one is listed here with the reason."""
    unpickle, imports = set(), set()
    for path in (
        path
        for part in ("rockcheck", "scenes", "ebm", "cm", "engines", "validation", "reports")
        for path in (ROOT / part).rglob("*.py")
    ):
        name = path.relative_to(ROOT).as_posix()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            called = node.func if isinstance(node, ast.Call) else None
            if isinstance(called, ast.Name):
                assert called.id not in ("eval", "exec", "compile", "__import__", "input"), (
                    name,
                    called.id,
                )
            said = ast.unparse(called) if isinstance(called, ast.Attribute) else ""
            assert said not in (
                "os.system",
                "os.popen",
                "pd.read_pickle",
                "yaml.load",
                "pd.eval",
            ), (name, said)
            assert said not in ("np.load", "numpy.load") or name == "scenes/reading.py", name
            assert not any(
                k.arg in ("shell", "allow_pickle")
                for k in getattr(node, "keywords", ())
                if isinstance(node, ast.Call)
            ), name
            if said in ("importlib.import_module", "runpy.run_path", "runpy.run_module"):
                imports.add(name)
            if isinstance(node, ast.Import | ast.ImportFrom):
                modules = {alias.name for alias in node.names} | {getattr(node, "module", None)}
                if modules & {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib"}:
                    unpickle.add(name)
    assert unpickle == set(UNPICKLE)
    assert imports == set(IMPORT)
