"""The same cells on a Dask cluster of two local workers: the same run, and failures that stay in
their cells."""

import shutil
import sys
from pathlib import Path

import pytest

from rockcheck.validation.suite.runner import run_suite
from rockcheck.validation.suite.suites import load_suite

OWN = [
    f"faulty:{name}" for name in ("Still", "Segfault", "Hang", "Hog", "Fails", "Bug", "NotFinite")
]

MODELS = "\n".join(
    f'[models.{name}]\nmodel = "faulty:{name}"' for name in ("Segfault", "Hang", "Hog", "Fails")
)


@pytest.mark.long
@pytest.mark.filterwarnings("default")
def test_a_cluster_gives_the_same_run_and_survives_failures(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", list(sys.path))  # the suite's folder joins it
    monkeypatch.delitem(sys.modules, "faulty", raising=False)
    shutil.copy(Path(__file__).parents[1] / "models" / "faulty.py", tmp_path / "faulty.py")
    path = tmp_path / "mine.toml"
    path.write_text(
        f"""reference = "Still"
[limits]
seconds = 8.0
memory_mb = 600
[models.Still]
model = "faulty:Still"
{MODELS}
[[scene]]
name = "short"
duration = 0.5
block = {{ half_width = 0.4, half_height = 1.5 }}
floor = {{ friction = 0.5 }}
""",
        encoding="utf-8",
    )
    suite = load_suite(path, allow_code=OWN)
    run = run_suite(suite, tmp_path / "out", scheduler="local:2")
    reasons = {cell.model: cell.reason for cell in run.cells}
    assert reasons == {
        "Still": "",
        "Segfault": "crashed: SIGSEGV",
        "Hang": "did not end within 8 s",
        "Hog": "out of memory",
        "Fails": "more than 10 events",
    }
    at_home = run_suite(suite, tmp_path / "home", jobs=1)
    assert at_home.cell("short", "Still").figures == run.cell("short", "Still").figures
