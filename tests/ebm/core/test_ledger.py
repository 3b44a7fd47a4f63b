"""The event core stays small: few numbers, one zero of a kind, few modelling choices with a home
and a paragraph each; short functions."""

import ast
import collections
import enum
import importlib
import inspect
import re
from pathlib import Path

import pytest

import rockcheck.ebm
from rockcheck.ebm.core import march, names

ROOT = Path(__file__).parents[3]
FOLDER = Path(rockcheck.ebm.__file__).parent
#: Each node of the sources' syntax, with its file.
NODES = [
    (path, node)
    for path in sorted(FOLDER.rglob("*.py"))
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
]
#: The zeros of position, velocity and time: where each is defined.
ZEROS = {"CLOSED": "core/contacts.py", "SLOW": "core/contacts.py", "INSTANT": "core/series.py"}


def test_small_numbers_are_few():
    values = (node.value for _, node in NODES if isinstance(node, ast.Constant))
    assert sum(isinstance(one, float) and 0.0 < abs(one) < 2e-3 for one in values) <= 20


@pytest.mark.parametrize("name", ZEROS)
def test_there_is_one_zero_of_a_kind(name):
    assert (FOLDER / ZEROS[name]).read_text(encoding="utf-8").count(f"\n{name} = ") == 1


def test_modelling_choices_are_few():
    assert len(names.Rule) == names.RULES == len(names.RULE_NAMES) <= 15


@pytest.mark.parametrize("rule", names.Rule, ids=lambda rule: rule.name)
def test_a_modelling_choice_is_counted_and_explained(rule):
    homes = {
        name
        for name, node in NODES
        if isinstance(node, ast.AugAssign)
        and isinstance(node.target, ast.Subscript)
        and f".{rule.name}" in ast.unparse(node.target.slice)
    }
    assert len(homes) in (1, 2, 3)
    assert names.RULE_NAMES[rule] in (ROOT / "docs" / "limits.md").read_text(encoding="utf-8")


def test_the_theory_page_links_each_stage_to_its_function():
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
    loop = inspect.getsource(march)
    places = []
    for _, module, name in stages:
        assert callable(getattr(importlib.import_module(f"rockcheck.ebm.core.{module}"), name))
        call = re.search(rf"\b{name}\(block", loop)
        assert call, name
        places.append(call.start())
    # A mode that has ended is followed at the head of the loop.
    assert [places[-1], *places[:-1]] == sorted(places)


def test_a_name_has_one_value():
    """Members of the enumerations, and public constants of the package's modules."""
    values = collections.defaultdict(set)
    for path in sorted(FOLDER.rglob("*.py")):
        name = ".".join(path.relative_to(FOLDER).with_suffix("").parts)
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
