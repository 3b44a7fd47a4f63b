"""What goes into the wheel, and what it needs. That it installs and runs elsewhere is what `.ci/wheel` shows."""

from __future__ import annotations

import ast
import importlib
import re
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
PACKAGES = PROJECT["tool"]["setuptools"]["packages"]
OWN = {name.partition(".")[0] for name in PACKAGES}


def names_of(requirements: list[str]) -> set[str]:
    """Names of distributions, normalised."""
    return {re.split(r"[\[<>=!~ ]", text)[0].lower().replace("_", "-") for text in requirements}


def test_every_package_is_in_the_wheel():
    found = {".".join(init.parent.relative_to(ROOT).parts) for top in OWN for init in (ROOT / top).rglob("__init__.py")}
    assert found == set(PACKAGES)


def test_every_data_file_is_in_the_wheel():
    """Files that are not code lie in data/, which package-data names."""
    for top in OWN:
        others = [path for path in (ROOT / top).rglob("*") if path.is_file() and path.suffix != ".py" and "__pycache__" not in path.parts]
        assert all(path.relative_to(ROOT).parts[1] == "data" for path in others), others
        assert not others or PROJECT["tool"]["setuptools"]["package-data"][top] == ["data/**/*"]


def test_the_command_and_the_plugin_are_there():
    for point in (PROJECT["project"]["scripts"]["rockcheck"], PROJECT["project"]["entry-points"]["pytest11"]["rockcheck"]):
        module, _, function = point.partition(":")
        assert not function or callable(getattr(importlib.import_module(module), function))
        importlib.import_module(module)


def imported(path: Path) -> set[str]:
    """Top-level names that a file imports, wherever in it."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    found = {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    found |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and node.module and not node.level}
    return {name.partition(".")[0] for name in found}


@pytest.mark.parametrize("top", sorted(OWN))
def test_every_import_is_a_declared_dependency(top):
    declared = names_of(PROJECT["project"]["dependencies"])
    for extra in ("iso", "cluster"):
        declared |= names_of(PROJECT["project"]["optional-dependencies"][extra])
    distributions = packages_distributions()
    allowed_unlisted = {"pytest", "llvmlite"}  # the plugin is imported by pytest only; llvmlite is numba's
    for path in (ROOT / top).rglob("*.py"):
        for name in imported(path) - OWN - set(sys.stdlib_module_names):
            owners = {owner.lower().replace("_", "-") for owner in distributions.get(name, [name])}
            assert owners & (declared | allowed_unlisted), f"{path.relative_to(ROOT)} imports {name}, of {owners}"


@pytest.mark.parametrize("requirement", sorted(names_of(PROJECT["project"]["dependencies"])))
def test_every_dependency_is_imported(requirement):
    names = {name for name, owners in packages_distributions().items() if requirement in {o.lower().replace("_", "-") for o in owners}}
    used = {name for top in OWN for path in (ROOT / top).rglob("*.py") for name in imported(path)}
    assert used & names, f"nothing imports {requirement}"


def test_the_changelog_is_of_this_version():
    newest = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert newest
    assert newest[1] == PROJECT["project"]["version"]


def test_imports_point_one_way():
    """scenes <- ebm, cm, engines <- validation; reports is called from inside of functions only."""
    below = {"scenes": set(), "ebm": {"scenes"}, "cm": {"scenes"}, "engines": {"scenes"}}
    for top, allowed in below.items():
        for path in (ROOT / top).rglob("*.py"):
            assert imported(path) & OWN <= allowed | {top}, path
