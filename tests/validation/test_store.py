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
