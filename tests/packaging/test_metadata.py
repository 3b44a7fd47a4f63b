"""What goes into the wheel, and what it needs. That it installs and runs elsewhere is what
`.ci/wheel` shows."""

import ast
import importlib
import re
import subprocess
import sys
import tomllib
from functools import cache
from importlib.metadata import EntryPoint, packages_distributions
from pathlib import Path

import pytest
from setuptools import find_packages

import rockcheck

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
PACKAGES = find_packages(
    str(ROOT),
    **{key: PROJECT["tool"]["setuptools"]["packages"]["find"][key] for key in ["include"]},
)
FOLDERS = {
    f"rockcheck.{link.name}": link.name
    for link in (ROOT / "rockcheck").iterdir()
    if link.is_symlink()
} | {"rockcheck": "rockcheck"}


def names_of(requirements):
    return {re.split(r"[\[<>=!~; ]", text)[0].lower().replace("_", "-") for text in requirements}


def test_every_package_is_in_the_wheel_and_none_but_rockchecks():
    assert {
        ".".join((name, *init.parent.relative_to(ROOT / folder).parts))
        for name, folder in FOLDERS.items()
        for init in (ROOT / folder).rglob("__init__.py")
    } == set(PACKAGES)


def test_every_data_file_is_in_the_wheel():
    for name, folder in FOLDERS.items():
        named = PROJECT["tool"]["setuptools"]["package-data"].get(name, [])
        for path in (path for path in (ROOT / folder).rglob("*") if path.is_file()):
            if path.suffix == ".py" or "__pycache__" in path.parts:
                continue
            within = path.relative_to(ROOT / folder)
            if within.parts[0] == "data":
                assert "data/**/*" in named, path
            elif len(within.parts) == 1:
                assert any(path.match(pattern) for pattern in named), path


@pytest.mark.parametrize(
    ("group", "value"),
    [
        ("console_scripts", PROJECT["project"]["scripts"]["rockcheck"]),
        *(
            (group, points["rockcheck"])
            for group, points in PROJECT["project"]["entry-points"].items()
        ),
    ],
)
def test_the_command_the_plugin_and_the_views_are_there(group, value):
    assert EntryPoint("rockcheck", value, group).load()


def imported(nodes):
    return {
        (getattr(node, "module", None) or alias.name).partition(".")[0]
        for node in nodes
        if isinstance(node, ast.Import | ast.ImportFrom) and not getattr(node, "level", 0)
        for alias in node.names
    }


@cache
def sources(top: str) -> dict[Path, ast.Module]:
    found = {path: ast.parse(path.read_text("utf-8")) for path in (ROOT / top).rglob("*.py")}
    assert found
    return found


ENGINES = importlib.import_module("rockcheck.engines").__all__
DISTRIBUTIONS = packages_distributions()
#: Distributions of modules called otherwise, for where they are not installed.
ELSEWHERE = {"pydrake": "drake"}


def owners_of(name: str) -> set[str]:
    return {
        owner.lower().replace("_", "-")
        for owner in DISTRIBUTIONS.get(name, [ELSEWHERE.get(name, name)])
    }


@pytest.mark.parametrize("top", sorted(FOLDERS.values()))
def test_every_import_is_a_declared_dependency(top):
    """What a module needs to be imported comes with every installation; an extra is imported by the
    function that needs it."""
    everywhere = [
        one for one in PROJECT["project"]["dependencies"] if ";" not in one
    ]  # not of some versions of Python only
    declared = names_of(everywhere) | {"llvmlite"}  # which is numba's
    extras = {
        name
        for extra in ("iso", "cluster", "pybullet", "engines", "seismology")
        for name in names_of(PROJECT["project"]["optional-dependencies"][extra])
    }
    for path, tree in sources(top).items():
        of_pytest = {"pytest"} if path.name == "plugin.py" else set()  # which pytest loads
        # Inside a function, or for types only, it is not needed to be imported itself.
        at_once = imported(tree.body)
        for name in imported(ast.walk(tree)) - {"rockcheck"} - set(sys.stdlib_module_names):
            allowed = declared | of_pytest | (set() if name in at_once else extras)
            assert owners_of(name) & allowed, (
                f"{path.relative_to(ROOT)} imports {name}, of {owners_of(name)}"
            )


def test_hints_name_packages_that_there_are():
    """Nothing called rockcheck is released: who asks for it by name, or for an extra of it, may get
    a stranger's package."""
    assert [
        str(path)
        for path in [
            *ROOT.glob("*.md"),
            *(ROOT / "docs").rglob("*.md"),
            *(path for top in FOLDERS.values() for path in (ROOT / top).rglob("*.py")),
        ]
        if re.search(r"pip install [^`\n]*rockcheck\[", path.read_text("utf-8"))
    ] == []
    extras = PROJECT["project"]["optional-dependencies"].values()
    declared = {name for extra in extras for name in names_of(extra)}
    for engine in (getattr(rockcheck, name) for name in ENGINES):
        if engine.module:
            assert (engine.package or engine.module) in declared & owners_of(engine.module)


def test_every_package_has_its_layer():
    """A folder that no layer names could import anything: `lint-imports` would not notice."""
    (layers,) = (
        one["layers"]
        for one in PROJECT["tool"]["importlinter"]["contracts"]
        if one["type"] == "layers"
    )
    named = {name for line in layers for name in re.split(r" *[:|] *", line)}
    parents = {name.rpartition(".")[0] for name in named}
    assert [
        name
        for name in PACKAGES
        if not any(name == one or name.startswith(f"{one}.") for one in named)
        and name not in parents
    ] == []
    assert named <= {
        *PACKAGES,
        *{name for name in named if ROOT.joinpath(*name.split(".")).with_suffix(".py").is_file()},
    }


def test_every_dependency_is_imported():
    assert names_of(PROJECT["project"]["dependencies"]) <= {
        owner
        for top in FOLDERS.values()
        for tree in sources(top).values()
        for name in imported(ast.walk(tree))
        for owner in owners_of(name)
    }


def test_the_facade_has_every_public_name():
    parts = {
        name: importlib.import_module(f"rockcheck.{name}")
        for name in ("scenes", "ebm", "cm", "engines", "validation")
    }
    assert set(rockcheck.__all__) == {"__version__"} | {
        name for part in parts.values() for name in part.__all__
    }
    other = [
        name
        for part in parts.values()
        for name in part.__all__
        if getattr(rockcheck, name) is not getattr(part, name)
    ]
    assert other == []
    assert rockcheck.__version__ == PROJECT["project"]["version"]
    with pytest.raises(AttributeError, match="Blok"):
        rockcheck.Blok  # noqa: B018


@pytest.mark.parametrize(
    ("call", "key", "wanted"),
    [
        (lambda: rockcheck.compare(1, 2), "reference", "History"),
        (lambda: rockcheck.EventBasedModel().simulate("fig5a"), "scene", "Scene"),
        (lambda: rockcheck.ContinuousModel().simulate("fig5a"), "scene", "Scene"),
        (lambda: rockcheck.MuJoCo().simulate("fig5a"), "scene", "Scene"),
        (lambda: rockcheck.overturning_spectrum("fig5a", [1.0, 2.0], [1.0, 2.0]), "scene", "Scene"),
        (lambda: rockcheck.predictability_horizon("fig5a"), "scene", "Scene"),
        (
            lambda: rockcheck.overturning_spectrum(
                rockcheck.load_scene("fig4a"), [1.0], [1.0], model=rockcheck.MuJoCo()
            ),
            "model",
            "EventBasedModel",
        ),
    ],
)
def test_what_is_no_scene_or_history_is_named(call, key, wanted):
    with pytest.raises(rockcheck.InputError, match=f"{key}: .* is not allowed: give an? {wanted}"):
        call()


# In order: the workers of a test run must collect the same names of tests.
HEAVY = sorted(
    {"numba", "pandas", "matplotlib", "scipy", "mujoco", "pybullet"}
    | {getattr(rockcheck, name).module for name in ENGINES}
)


@pytest.mark.parametrize(
    ("module", "shown", "wanted"),
    [
        ("rockcheck", "dir(rockcheck) == sorted(rockcheck.__all__)", True),
        ("rockcheck", f"sorted(loaded.intersection({[*HEAVY, 'numpy', 'pydantic']}))", []),
        *(
            (f"rockcheck.{part}", f"sorted(loaded.intersection({HEAVY}))", [])
            for part in ("ebm", "scenes", "cm", "engines")
        ),
        (
            "rockcheck.plugin",
            "sorted(name for name in loaded if name.startswith('rockcheck'))",
            ["rockcheck", "rockcheck.plugin"],
        ),
    ],
)
def test_an_import_shows_what_is_public_and_loads_nothing_heavy(module, shown, wanted):
    code = f"import sys, {module}; loaded = set(sys.modules); print({shown})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ast.literal_eval(done.stdout) == wanted
