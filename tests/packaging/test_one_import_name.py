"""The folders of the sources have one import name, below `rockcheck`."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("name", ["scenes", "ebm", "cm", "engines", "validation", "reports"])
def test_a_folder_refuses_to_be_imported_by_its_bare_name(name):
    run = subprocess.run(
        [sys.executable, "-c", f"import {name}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 1
    assert run.stderr.splitlines()[-1] == (
        f"ImportError: {name} is a part of rockcheck: import rockcheck.{name}"
    )
