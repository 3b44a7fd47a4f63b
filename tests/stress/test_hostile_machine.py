"""Machines that fail: a full disk, folders that cannot be written, jumping clocks, lost workers,
Ctrl-C.

Each time: a clear end in one line, nothing that was computed is lost, and the next run is right.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from unittest.mock import Mock

import pytest
from hostile import LIMITED, ROCKCHECK
from pebble.pool.process import WorkerManager

from rockcheck.commands.cli import main
from rockcheck.scenes import writing
from rockcheck.validation.execute import pool
from rockcheck.validation.studies.stress import runs
from rockcheck.validation.study import run

#: They wait for processes that hang or are killed.
pytestmark = pytest.mark.long
STUDY = ("stress", "runs", "--model", "ebm no-slip", "--jobs", "1", "--runs")


def one_line(stderr: str) -> str:
    # Code that is not yet compiled, and cannot be kept where no file can be large, is announced,
    # and so are long work and how far it is.
    announced = ("rockcheck: compiling ", "rockcheck: stress: ", "rockcheck: smoke")
    (line,) = (said for said in stderr.splitlines() if not said.startswith(announced))
    assert line.startswith("rockcheck: ")
    return line


def limited(size: int, *words: str) -> str:
    """What rockcheck says as it ends with 2 where no file can be larger than `size` bytes; without
    coverage.py and Python's own caches (-B), which would be cut off at that size."""
    command = [sys.executable, "-B", "-c", LIMITED, "RLIMIT_FSIZE", str(size), *words]
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("COVERAGE_PROCESS")
    }
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=300, check=False, env=environment
    )
    assert done.returncode == 2
    return one_line(done.stderr)


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("old", [False, True])
def test_disk_full(tmp_path, old):
    """A history that does not fit: one line that names the file, exit 2, and the old history with
    its events as they were."""
    out = tmp_path / "out.csv"
    if old:
        assert main(["simulate", "fig5a", "--model", "ebm", "-o", str(out), "--quiet"]) == 0
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert before.keys() == ({out, tmp_path / "out.events.csv"} if old else set())
    said = limited(4096, "simulate", "fig4a", "--model", "ebm", "-o", str(out))
    assert "out.events.csv: cannot be used: File too large" in said
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize(
    ("size", "words"),
    [
        (100, ["new"]),
        (100, ["validate", "smoke", "--out"]),
        (2000, ["validate", "smoke", "--out"]),
        (7000, [*STUDY, "30", "--out"]),
        (30_000, ["validate", "smoke", "--out"]),
    ],
)
def test_disk_full_whatever_is_written(tmp_path, size, words):
    """A scene file, figures and pages: what was written is whole, the file that does not fit is
    named and leaves nothing, and the next run writes all."""
    out = tmp_path / "out.toml"
    assert re.search(f"{re.escape(str(out))}.*File too large", limited(size, *words, str(out)))
    written = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert all(path.name.startswith(".lock") or path.stat().st_size for path in written), written
    assert [path for path in written if path.suffix == ".part" or path.name == "index.html"] == []
    assert [
        path for path in written if path.suffix == ".csv" and not path.read_text().endswith("\n")
    ] == []
    assert main([*words, str(out), "--quiet"]) in (0, 1)
    assert out.is_file() or (out / "index.html").is_file()


def without_cost(text: str) -> list[str]:
    """The lines of a history's file but for that which says how long the run took."""
    return [line for line in text.splitlines() if not line.startswith("# cost: ")]


@pytest.mark.needs("POSIX")
def test_what_is_no_file_is_written_as_it_is(tmp_path):
    link, words = tmp_path / "link", ["simulate", "fig4a", "--model", "ebm", "--quiet", "-o"]
    link.symlink_to(tmp_path / "out.csv")
    assert main([*words, str(link)]) == 0
    said = subprocess.check_output([*ROCKCHECK, *words, "/dev/stdout"], text=True, timeout=300)
    written = (tmp_path / "out.csv").read_text()
    assert "\nt,x,y,theta," in written
    assert without_cost(said) == without_cost(written)
    assert [path.is_symlink() for path in (link, Path("/dev/stdout"))] == [True, True]


def workers(running: subprocess.Popen, settled: float = 3.0) -> list[str]:
    """Process ids of the children, `settled` s after they were started: a worker, and
    multiprocessing's tracker."""
    children: list[str] = []
    until = time.monotonic() + 60.0
    while len(children) < 2 and time.monotonic() < until:
        time.sleep(0.02)
        children = Path(f"/proc/{running.pid}/task/{running.pid}/children").read_text().split()
    time.sleep(settled)
    return children


@pytest.mark.needs("Linux")
@pytest.mark.parametrize(
    "later", [0.0, 0.2, 0.6, *(pytest.param(t, marks=pytest.mark.slow) for t in (0.4, 3.0))]
)
def test_interrupted(tmp_path, later):
    """Ctrl-C ends a study in one line; what was finished is written, and says that it is not all.
    It reaches a worker, too, before that can say that it is not meant."""
    # What is started hears SIGINT, also where these tests run in the background of a shell, which
    # makes it ignore that.
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    running = subprocess.Popen(
        [*ROCKCHECK, *STUDY, "60000", "--out", str(tmp_path)],
        start_new_session=True,
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    try:
        assert len(workers(running, settled=later)) >= 2
        os.killpg(running.pid, signal.SIGINT)
        _, said = running.communicate(timeout=60)
    finally:
        running.kill()
        signal.signal(signal.SIGINT, before)
    assert running.returncode == 130
    assert "interrupted" in one_line(said)
    data = json.loads((tmp_path / "run.json").read_text())
    assert sum(batch["counts"]["runs"] for batch in data["batches"].values()) < 60000
    assert data["complete"] is False
    assert (tmp_path / "index.html").is_file()
    assert [*tmp_path.rglob("*.part")] == []


def test_a_process_that_starts_as_its_pool_ends_says_nothing(tmp_path, monkeypatch, capfd):
    """What it is to share with the run is still there when it looks for it."""
    (tmp_path / "sitecustomize.py").write_text("import time\ntime.sleep(1.0)  # a slow start\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    end = WorkerManager.force_stop_workers

    def end_late(manager: WorkerManager) -> None:
        until = time.monotonic() + 30.0
        while any(worker.is_alive() for worker in manager.workers.values()):
            if time.monotonic() > until:
                break
            time.sleep(0.02)  # till it has seen that its pool has gone
        end(manager)

    monkeypatch.setattr(WorkerManager, "force_stop_workers", end_late)
    with pytest.raises(KeyboardInterrupt), pool.Pool(1):
        raise KeyboardInterrupt
    assert capfd.readouterr().err == ""


def test_a_file_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    """A crash between writing and naming leaves the old content."""
    path = writing.write_whole(tmp_path / "a.json", "old")
    monkeypatch.setattr(os, "replace", Mock(side_effect=OSError(28, "No space left on device")))
    with pytest.raises(OSError, match="No space"):
        writing.write_whole(path, "new")
    assert [(one.name, one.read_text()) for one in tmp_path.iterdir()] == [("a.json", "old")]


def test_of_runs_whose_process_dies_or_hangs_only_that_one_fails(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parent / "runs"))
    for module, name, value in (
        (pool, "COMPILING", 0.0),
        (runs, "A_RUN", 0.0),
        (runs, "PATIENCE", 4.0),
    ):
        monkeypatch.setattr(module, name, value)
    from deadly import Deadly

    found = run(Deadly("runs", models=("ebm",), runs=16), tmp_path, jobs=2)
    # each lost chunk is told, down to the two runs
    assert found.data["batches"]["ebm"]["counts"]["runs"] == 16
    assert len(found.failures) == 9
    assert {one["number"]: one["words"] for one in found.table("failures").records()} == {
        3: "the process ended with code 9",
        13: "did not end within 4 s",
    }
    for text in found.files.values():
        assert "not shrunk" in text
