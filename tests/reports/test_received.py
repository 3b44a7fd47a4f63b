"""A run's folder that somebody sent: nothing of it is written through, waited for, or shown as
anything but text."""

import json
import os
import re
import shutil
import stat

import pytest

from rockcheck.reports.manifest import MANIFEST, hash_of
from rockcheck.reports.site import LOCK, keep, write_site
from rockcheck.validation.execute.store import HISTORIES, Store
from rockcheck.validation.suite import results


@pytest.fixture
def received(tmp_path, site):
    folder = tmp_path / "received"
    folder.mkdir()
    shutil.copy(site / results.RUN_FILE, folder)
    shutil.copytree(site / HISTORIES, folder / HISTORIES)
    return folder


def published(folder):
    keep(results.Run.load(folder), folder)
    write_site(folder)


@pytest.mark.needs("POSIX")
@pytest.mark.long
def test_no_file_of_a_run_is_written_through(tmp_path, received):
    whole = tmp_path / "whole"
    shutil.copytree(received, whole)
    published(whole)
    names = (path.relative_to(whole) for path in whole.rglob("*") if path.is_file())
    written = [name for name in names if name.parts[0] not in (HISTORIES, results.RUN_FILE, LOCK)]
    assert len(written) > 40
    suffixes = {".csv", ".xml", ".md", ".html", ".js", ".svg", ".css", ".toml", ".json"}
    assert {name.suffix for name in written} >= suffixes
    victim = tmp_path / "victim"
    victim.write_text("mine")
    for number, name in enumerate(written):
        (received / name).parent.mkdir(parents=True, exist_ok=True)
        (received / name).symlink_to(victim) if number % 2 else os.mkfifo(received / name)
    published(received)
    assert victim.read_text() == "mine"
    kinds = {name: (received / name).lstat().st_mode for name in written}
    assert [name for name, mode in kinds.items() if not stat.S_ISREG(mode)] == []


@pytest.mark.parametrize(
    ("part", "write"),
    [
        *((f"pages{part}", published) for part in ("", "/assets", "/figures", "/data")),
        ("pages/scene-files", published),
        (LOCK, published),
        ("histories", Store),
        ("comparisons", Store),
    ],
)
def test_no_folder_of_a_run_is_written_through(tmp_path, received, fault_of, part, write):
    (tmp_path / "elsewhere").mkdir()
    shutil.rmtree(received / part, ignore_errors=True)
    (received / part).parent.mkdir(exist_ok=True)
    (received / part).symlink_to(tmp_path / "elsewhere")
    assert f"{part}: a link" in str(fault_of(write, received))
    assert not list((tmp_path / "elsewhere").iterdir())


def test_no_file_outside_a_run_is_removed_for_its_list_of_pages(tmp_path, received):
    victim = tmp_path / "victim"
    victim.write_text("mine")
    (received / MANIFEST).parent.mkdir()
    (received / MANIFEST).write_text(json.dumps({"files": {"../victim": hash_of("mine")}}), "utf-8")
    published(received)
    assert victim.read_text() == "mine"


TRAPS = {
    "a pipe": lambda path, kept: os.mkfifo(path),
    "a link out": lambda path, kept: path.symlink_to(kept),
    "a folder": lambda path, kept: path.mkdir(),
}


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("trap", TRAPS)
@pytest.mark.parametrize("suffix", [".json", ".csv.gz", ".events.csv.gz"])
def test_a_kept_result_that_is_no_file_of_the_folder_is_none(tmp_path, trap, suffix):
    """It is neither read nor waited for; what takes its place is written beside, not through it."""
    store, kept = Store(tmp_path / "run"), tmp_path / "kept"
    files = {".csv.gz": b"1", ".events.csv.gz": b"2"}
    store.put(HISTORIES, "a", {"n": 1}, files)
    path = tmp_path / "run" / HISTORIES / f"a{suffix}"
    path.rename(kept)
    content, written = kept.read_bytes(), kept.stat().st_mtime_ns
    TRAPS[trap](path, kept)
    assert store.get(HISTORIES, "a") is None
    if trap != "a folder":
        store.put(HISTORIES, "a", {"n": 1}, files)
        assert store.get(HISTORIES, "a") == {"n": 1}
    store.prune(now=4e9)
    assert kept.read_bytes() == content
    assert kept.stat().st_mtime_ns == written


def changed(folder, **change):
    path = folder / results.RUN_FILE
    path.write_text(json.dumps(json.loads(path.read_text("utf-8")) | change), "utf-8")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"reference": "nobody"}, "reference: 'nobody' is not in the run"),
        ({"reference": ""}, "reference: '' is not in the run"),
        ({"models": ["ebm", "cm", "mujoco", "pybullet", "mine:Model"]}, "reference"),
        ({"scenes": {}}, "cells.scene"),
    ],
)
def test_a_run_that_names_what_it_has_not_is_bad_input(received, change, said, refused):
    changed(received, **change)
    assert re.search(f"{results.RUN_FILE}.*{said}", refused("report", str(received)))


@pytest.mark.parametrize("signs", ["\u202e\u2067\x9b", "\ud800"])
def test_text_that_turns_around_reaches_no_page(received, signs):
    """Also as JavaScript and JSON escape it; half of a pair of UTF-16 is no text at all."""
    evil = f"gnp{signs}.exe"
    run = results.Run.load(received)
    changed(
        received,
        suite=evil,
        description=evil,
        created=evil,
        scenes={name: {**scene, "description": evil} for name, scene in run.scenes.items()},
        cells=[
            {
                **cell.model_dump(mode="json"),
                "reason": evil,
                "notes": [evil],
                "settings": {evil: evil},
                "outcome": evil,
            }
            for cell in run.cells
        ],
        faults=[evil],
        versions={evil: evil},
    )
    published(received)
    forms = [form for sign in signs for form in (sign, f"\\u{ord(sign):04x}")]
    texts = {
        path: path.read_text("utf-8").lower()
        for path in received.rglob("*")
        if path.suffix in (".html", ".js", ".csv", ".md", ".xml", ".svg", ".toml", ".json")
        and path.parent.name != "assets"
    }
    found = [(path, form) for path, text in texts.items() for form in forms if form in text]
    assert found == []
    assert f"gnp{'?' * len(signs)}.exe" in (received / "index.html").read_text("utf-8")
