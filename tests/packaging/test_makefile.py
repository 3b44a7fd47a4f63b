"""What `make` says of itself, and what it does in a container."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(shutil.which("make") is None, reason="needs make")


def made(*words: str, **environment: str) -> str:
    """What `make` prints in the folder of the sources, and nothing of an outer `make`."""
    inherited = {key: value for key, value in os.environ.items() if not key.startswith("MAKE")}
    inherited.pop("PYTHONDONTWRITEBYTECODE", None)
    done = subprocess.run(
        ["make", "--no-print-directory", *words],
        cwd=ROOT,
        env=inherited | environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    return done.stdout


def test_help_names_every_target():
    (phony,) = re.findall(r"^\.PHONY: (.*)$", (ROOT / "Makefile").read_text("utf-8"), re.MULTILINE)
    assert set(re.findall(r"^make (\S+) +\S", made("help"), re.MULTILINE)) == set(phony.split())


def test_where_python_writes_no_compiled_files_they_are_made_at_once():
    commands = made("--dry-run", "--always-make", "install", PYTHONDONTWRITEBYTECODE="1")
    assert "--compile-bytecode" in commands
    assert "compileall -q rockcheck" in commands


def test_elsewhere_they_are_made_as_they_are_needed():
    assert "compile" not in made("--dry-run", "--always-make", "install")
