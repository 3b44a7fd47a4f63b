"""The event core stays small: few numbers, one zero of a kind, few modelling choices with a home
and a paragraph each; short functions."""

from __future__ import annotations

import collections
import enum
import importlib
import importlib.util
import inspect
import re
from pathlib import Path

import pytest

from rockcheck.ebm.core import march, rules

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
    assert rules.NAMES[rules.Rule[rule]] in (ROOT / "docs" / "limits.md").read_text(
        encoding="utf-8"
    )


def test_functions_are_short_of_branches():
    most, where = ledger.complexities()[0]
    assert most <= 12, where


def test_the_ledger_is_printed():
    assert len(list(ledger.lines())) > 20


def test_the_theory_page_links_each_stage_to_its_function():
    """In the order in which the loop calls them."""
    page = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    page = page[page.index("## How an event is handled") :]
    stages = re.findall(r"^\d\. \*\*(\w+)\.?\*\* \(`(\w+)\.(\w+)`\)", page, re.MULTILINE)
    assert [stage for stage, _, _ in stages] == [
        "Expand",
        "Locate",
        "Sample",
        "Advance",
        "Resolve",
        "Select",
    ]
    loop = inspect.getsource(march.loop_with)
    places = []
    for _, module, name in stages:
        assert callable(getattr(importlib.import_module(f"rockcheck.ebm.core.{module}"), name))
        call = re.search(rf"\b{name}\(block", loop)
        assert call, name
        places.append(call.start())
    after = places.pop()  # a mode that has ended is followed at the head of the loop
    assert after < places[0]
    assert places == sorted(places)


def test_a_name_has_one_value():
    """Members of the enumerations, and public constants of the package's modules."""
    values = collections.defaultdict(set)
    for path in sorted(ledger.FOLDER.rglob("*.py")):
        name = ".".join(path.relative_to(ledger.FOLDER).with_suffix("").parts)
        module = importlib.import_module(f"rockcheck.ebm.{name}".removesuffix(".__init__"))
        for key, value in vars(module).items():
            number = isinstance(value, int | float) and not isinstance(value, bool)
            if key.isupper() and not key.startswith("_") and number:
                values[key].add(float(value))
            if isinstance(value, enum.EnumType):
                for member in value:
                    values[member.name].add(float(member))
    assert {key: found for key, found in values.items() if len(found) > 1} == {}
    assert len(values) > 100
