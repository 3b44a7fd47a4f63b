"""The harness as a whole, on copies of the project: faults put in on purpose, and runs that are killed. Minutes, not seconds."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("scenes", "ebm", "cm", "engines", "validation", "reports")
pytestmark = pytest.mark.slow


class Copy:
    """A copy of the project's packages in which files can be changed and put back, compiled code and times kept."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for package in PACKAGES:
            shutil.copytree(ROOT / package, folder / package, ignore=shutil.ignore_patterns("__pycache__"))

    def start(self, *words: str) -> subprocess.Popen[str]:
        environment = {**os.environ, "PYTHONPATH": str(self.folder), "PYTHONDONTWRITEBYTECODE": "1"}
        command = [sys.executable, "-m", "validation.cli", *words, "--no-report"]
        return subprocess.Popen(
            command, cwd=self.folder, env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True
        )

    def run(self, *words: str) -> tuple[int, str]:
        process = self.start(*words)
        out, _ = process.communicate(timeout=900)
        return process.returncode, out

    def change(self, file: str, old: str, new: str) -> None:
        path = self.folder / file
        text = path.read_text(encoding="utf-8")
        assert len(re.findall(old, text)) >= 1, f"{old!r} is not in {file} any more: mend this test"
        path.write_text(re.sub(old, new, text, count=1), encoding="utf-8")

    def restore(self, file: str) -> None:
        shutil.copy2(ROOT / file, self.folder / file)


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    copy = Copy(tmp_path_factory.mktemp("project"))
    code, out = copy.run("validate", "smoke", "--strict")
    assert code == 0, out
    return copy
