"""A run's folder that somebody sent: nothing of it is written through, waited for, or shown as
anything but text."""

import json
import os
import shutil
from pathlib import Path

import pytest

from rockcheck.commands.report import LOCK, keep
from rockcheck.reports.site import write_site
from rockcheck.scenes import InputError
from rockcheck.validation.execute.store import HISTORIES, Store
from rockcheck.validation.suite.results import RUN_FILE, Run


@pytest.fixture
def received(tmp_path: Path, site: Path) -> Path:
    """The run as it was sent: run.json and the histories."""
    folder = tmp_path / "received"
    folder.mkdir()
    shutil.copy(site / RUN_FILE, folder)
    shutil.copytree(site / HISTORIES, folder / HISTORIES)
    return folder


def published(folder: Path) -> None:
    keep(Run.load(folder), folder)
    write_site(folder)


@pytest.mark.needs("POSIX")
@pytest.mark.long
def test_no_file_of_a_run_is_written_through(tmp_path: Path, received: Path) -> None:
    """Every file that a run writes (tables, pages, data, figures, scripts), as a link and as a
    pipe."""
    shutil.copytree(received, tmp_path / "whole")
    published(tmp_path / "whole")
    written = [
        path.relative_to(tmp_path / "whole")
        for path in (tmp_path / "whole").rglob("*")
        if path.is_file()
    ]
    written = [name for name in written if name.parts[0] not in (HISTORIES, RUN_FILE, LOCK)]
    assert len(written) > 40
    assert {name.suffix for name in written} >= {
        ".csv",
        ".xml",
        ".md",
        ".html",
        ".js",
        ".svg",
        ".css",
        ".toml",
        ".json",
    }
    victim = tmp_path / "victim"
    victim.write_text("mine")
    for number, name in enumerate(written):
        (received / name).parent.mkdir(parents=True, exist_ok=True)
        (received / name).symlink_to(victim) if number % 2 else os.mkfifo(received / name)
    published(received)
    assert victim.read_text() == "mine"
    assert not [
        name
        for name in written
        if (received / name).is_symlink() or not (received / name).is_file()
    ]


@pytest.mark.parametrize(
    "part", ["pages", "pages/assets", "pages/figures", "pages/data", "pages/scene-files", LOCK]
)
def test_no_folder_of_a_run_is_written_through(tmp_path: Path, received: Path, part: str) -> None:
    (tmp_path / "elsewhere").mkdir()
    (received / part).parent.mkdir(parents=True, exist_ok=True)
    (received / part).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match=f"{part}: a link"):
        published(received)
    assert not list((tmp_path / "elsewhere").iterdir())


@pytest.mark.parametrize("part", ["histories", "comparisons"])
def test_no_folder_of_kept_results_is_a_link(tmp_path: Path, part: str) -> None:
    (tmp_path / "elsewhere").mkdir()
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / part).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match=f"{part}: a link"):
        Store(folder)


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("trap", ["a pipe", "a link out", "a folder"])
@pytest.mark.parametrize("suffix", [".json", ".csv.gz", ".events.csv.gz"])
def test_a_kept_result_that_is_no_file_of_the_folder_is_none(
    tmp_path: Path, trap: str, suffix: str
) -> None:
    """It is neither read nor waited for; what takes its place is written beside, not through it."""
    store = Store(tmp_path / "run")
    files = {".csv.gz": b"1", ".events.csv.gz": b"2"}
    store.put("a", files, {"n": 1})
    assert store.get("a") == {"n": 1}
    path = tmp_path / "run" / HISTORIES / f"a{suffix}"
    kept = tmp_path / "kept"
    path.rename(kept)
    before = kept.read_bytes(), kept.stat().st_mtime_ns
    {"a pipe": os.mkfifo, "a link out": lambda one: one.symlink_to(kept), "a folder": Path.mkdir}[
        trap
    ](path)
    assert store.get("a") is None
    if trap != "a folder":
        store.put("a", files, {"n": 1})
        assert store.get("a") == {"n": 1}
    store.prune(now=4e9)
    assert (kept.read_bytes(), kept.stat().st_mtime_ns) == before


def changed(folder: Path, **change: object) -> None:
    path = folder / RUN_FILE
    data = json.loads(path.read_text(encoding="utf-8"))
    path.write_text(json.dumps(data | change), encoding="utf-8")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"reference": "nobody"}, "reference: 'nobody' is not in the run"),
        ({"reference": ""}, "reference: '' is not in the run"),
        ({"models": ["ebm", "cm", "mujoco", "pybullet", "mine:Model"]}, "reference"),
        ({"scenes": {}}, "cells.scene"),
    ],
)
def test_a_run_that_names_what_it_has_not_is_bad_input(
    received: Path, change: dict[str, object], said: str, refused
) -> None:
    changed(received, **change)
    told = refused("report", str(received))
    assert len(told.splitlines()) == 1
    assert RUN_FILE in told
    assert said in told


@pytest.mark.parametrize("signs", ["\u202e\u2067\x9b", "\ud800"])
def test_text_that_turns_around_reaches_no_page(received: Path, signs: str) -> None:
    """Also as JavaScript and JSON escape it; half of a pair of UTF-16 is no text at all."""
    evil = f"gnp{signs}.exe"
    run = Run.load(received)
    scenes = {name: {**scene, "description": evil} for name, scene in run.scenes.items()}
    cells = [
        {
            **cell.model_dump(mode="json"),
            "reason": evil,
            "notes": [evil],
            "settings": {evil: evil},
            "outcome": evil,
        }
        for cell in run.cells
    ]
    changed(
        received,
        suite=evil,
        description=evil,
        created=evil,
        scenes=scenes,
        cells=cells,
        faults=[evil],
        versions={evil: evil},
    )
    published(received)
    forms = [form for sign in signs for form in (sign, f"\\u{ord(sign):04x}")]
    for path in received.rglob("*"):
        if (
            path.suffix in (".html", ".js", ".csv", ".md", ".xml", ".svg", ".toml", ".json")
            and path.parent.name != "assets"
        ):
            text = path.read_text(encoding="utf-8").lower()
            assert [form for form in forms if form in text] == [], path
    assert f"gnp{'?' * len(signs)}.exe" in (received / "index.html").read_text(encoding="utf-8")
