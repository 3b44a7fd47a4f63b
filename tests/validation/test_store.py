"""What a store gives back is what was put into it."""

import os
import time
from dataclasses import replace

import numpy as np
import pytest

from rockcheck.validation.execute.store import COMPARISONS, HISTORIES, Store


def test_a_history_that_is_read_back_keeps_the_extremes_of_its_model(made, tmp_path):
    rows = made(np.array([0.0, 0.1, 0.2]))
    extremes = replace(rows.extremes, rotation_left=0.123, hop=0.045, source="model")
    history = replace(rows, model_extremes=extremes)
    Store(tmp_path).put(HISTORIES, "run", {}, history.packed())
    assert Store(tmp_path).load("run").extremes == extremes


TEN_YEARS = 10.0 * 365 * 86400.0


@pytest.mark.parametrize("jump", [0.0, TEN_YEARS, -TEN_YEARS])
def test_what_was_just_used_is_kept_whatever_the_clock_says(tmp_path, jump):
    store, now = Store(tmp_path), time.time() + jump
    store.put(HISTORIES, "run", {"outcome": "at rest"}, {".csv.gz": b"rows"})
    for path in (tmp_path / HISTORIES).iterdir():
        os.utime(path, (now, now))
    store.prune(now=now)
    assert store.get(HISTORIES, "run") == {"outcome": "at rest"}


def test_what_no_run_has_used_for_two_weeks_is_removed(tmp_path):
    store = Store(tmp_path)
    store.put(HISTORIES, "run", {"outcome": "at rest"}, {".csv.gz": b"rows"})
    store.prune(now=time.time() + 15 * 86400.0)
    assert list((tmp_path / HISTORIES).iterdir()) == []


def test_two_versions_share_a_store(tmp_path):
    """Each reads what it wrote, of whatever layout, and the other one's files stay."""
    old, new = Store(tmp_path), Store(tmp_path)
    old.put(COMPARISONS, "shelf--1111", {"outcome": "at rest"})
    new.put(COMPARISONS, "shelf--2222", {"outcome": "moving", "more": {"new": [1]}})
    assert old.get(COMPARISONS, "shelf--1111") == {"outcome": "at rest"}
    assert new.get(COMPARISONS, "shelf--2222") == {"outcome": "moving", "more": {"new": [1]}}


def test_a_record_of_another_layout_is_none(tmp_path):
    store = Store(tmp_path)
    store.put(COMPARISONS, "run", {"outcome": "at rest"})
    (tmp_path / COMPARISONS / "run.json").write_text('{"version": 9, "files": ["a", "list"]}')
    assert store.get(COMPARISONS, "run") is None


def test_a_history_has_a_table_and_may_have_events(tmp_path):
    store = Store(tmp_path)
    both = {".csv.gz": b"rows", ".events.csv.gz": b"events"}
    store.put(HISTORIES, "both", {"outcome": "at rest"}, both)
    assert store.get(HISTORIES, "both") == {"outcome": "at rest"}
    store.put(HISTORIES, "none", {"outcome": "at rest"})
    assert store.get(HISTORIES, "none") is None


def test_a_table_is_as_old_as_its_record(tmp_path):
    """What is read is the record, whose use keeps its tables; a table alone is old by itself."""
    store, now = Store(tmp_path), time.time()
    both = {".csv.gz": b"rows", ".events.csv.gz": b"events"}
    store.put(HISTORIES, "used", {"outcome": "at rest"}, both)
    store.put(HISTORIES, "lost", {"outcome": "at rest"}, both)
    (tmp_path / HISTORIES / "lost.json").unlink()
    for path in (tmp_path / HISTORIES).glob("*.csv.gz"):
        os.utime(path, (now - 15 * 86400.0,) * 2)
    store.prune()
    assert {path.name.partition(".")[0] for path in (tmp_path / HISTORIES).iterdir()} == {"used"}
    assert store.get(HISTORIES, "used") is not None


@pytest.mark.parametrize(("days", "left"), [(0.9, 1), (1.1, 0)])
def test_a_temporary_file_is_removed_after_a_day(tmp_path, days, left):
    store, part = Store(tmp_path), tmp_path / HISTORIES / "half.part"
    part.write_text("")
    os.utime(part, (time.time() - days * 86400.0,) * 2)
    store.prune()
    assert len(list((tmp_path / HISTORIES).iterdir())) == left


def test_a_history_put_lately_is_in_memory_and_another_is_read(made, tmp_path):
    rows, store = made(np.array([0.0, 0.1, 0.2])), Store(tmp_path)
    store.put(HISTORIES, "run", {}, rows.packed(), rows)
    assert store.load("run") is rows
    read = Store(tmp_path)
    assert read.load("run") is read.load("run")


def test_the_seal_of_a_history_is_of_its_content_and_its_files(tmp_path):
    store, seals = Store(tmp_path), []
    for outcome, rows in (("at rest", b"1"), ("at rest", b"1"), ("moving", b"1"), ("moving", b"2")):
        store.put(HISTORIES, "run", {"outcome": outcome}, {".csv.gz": rows})
        seals.append(store.seal_of(HISTORIES, "run"))
    assert seals[0] == seals[1]
    assert len(set(seals)) == 3
