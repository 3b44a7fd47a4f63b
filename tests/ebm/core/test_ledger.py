"""The event core stays small: few numbers, one zero of a kind, few modelling choices with a home
and a paragraph each; short functions."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from rockcheck.ebm.core import rules

ROOT = Path(__file__).parents[3]
spec = importlib.util.spec_from_file_location("ledger", Path(__file__).with_name("ledger.py"))
assert spec is not None
assert spec.loader is not None
ledger = importlib.util.module_from_spec(spec)
spec.loader.exec_module(ledger)


def test_small_numbers_are_few():
    assert len(ledger.small_numbers()) <= 20


@pytest.mark.parametrize(("file", "name"), ledger.ZEROS.values(), ids=ledger.ZEROS)
def test_there_is_one_zero_of_a_kind(file, name):
    text = (ledger.FOLDER / file).read_text(encoding="utf-8")
    assert text.count(f"\n{name} = ") == 1


def test_modelling_choices_are_few():
    assert len(ledger.names_of_rules()) == rules.RULES == len(rules.NAMES) <= 15


@pytest.mark.parametrize("rule", ledger.names_of_rules())
def test_a_modelling_choice_is_counted_and_explained(rule):
    assert len(ledger.homes(rule)) in (1, 2, 3)
    assert rules.NAMES[getattr(rules, rule)] in (ROOT / "docs" / "limits.md").read_text(
        encoding="utf-8"
    )


def test_functions_are_short_of_branches():
    most, where = ledger.complexities()[0]
    assert most <= 12, where


def test_the_ledger_is_printed():
    assert len(list(ledger.lines())) > 20
