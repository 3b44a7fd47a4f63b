"""The event core stays small: few numbers, a name for each, few modelling choices; its stages are
those of the page of theory."""

import ast
import collections
import enum
import importlib
import itertools
import re
from pathlib import Path

import rockcheck.ebm
from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.core import names
from rockcheck.scenes import PAPER_BLOCK, Floor, Scene, compiled, progress

ROOT = Path(__file__).parents[3]
FOLDER = Path(rockcheck.ebm.__file__).parent
#: Each node of the sources' syntax, with its file.
NODES = [
    (path, node)
    for path in sorted(FOLDER.rglob("*.py"))
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
]


def test_small_numbers_are_few():
    values = (node.value for _, node in NODES if isinstance(node, ast.Constant))
    assert sum(isinstance(one, float) and 0.0 < abs(one) < 2e-3 for one in values) <= 20


def test_modelling_choices_are_few():
    assert len(names.Rule) == names.RULES == len(names.RULE_NAMES) <= 15


def stages_of_the_theory_page():
    """Each stage of an event, with the module and the name of its function."""
    page = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    page = page[page.index("## How an event is handled") :]
    return re.findall(r"^\d\. \*\*(\w+)\.?\*\* \(`(\w+)\.(\w+)`\)", page, re.MULTILINE)


def test_the_theory_page_links_each_stage_to_its_function():
    stages = stages_of_the_theory_page()
    names_of_stages = [stage for stage, _, _ in stages]
    assert names_of_stages == ["Expand", "Locate", "Sample", "Advance", "Resolve", "Select"]
    for _, module, name in stages:
        assert callable(getattr(importlib.import_module(f"rockcheck.ebm.core.{module}"), name))


def test_stages_follow_each_other_as_the_theory_page_says(monkeypatch):
    """From one expansion to the next, in a run that is interpreted."""
    order = [name for _, _, name in stages_of_the_theory_page()]
    called = []
    monkeypatch.setattr(
        compiled._Inner,
        "__call__",
        lambda kernel, *given, **named: (
            called.append(kernel.__name__) or kernel.py_func(*given, **named)
        ),
    )
    monkeypatch.setattr(natural, "is_ready", lambda *given: False)
    tilted = Scene(
        name="tilted",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.3),
        initial_rotation=0.1 * PAPER_BLOCK.alpha,
        duration=0.5,
        output_step=0.1,
    )
    with progress.within(progress.ONE_RUN, True):
        EventBasedModel(tolerance=1e-6).simulate(tilted)
    rounds = []
    for name in called:
        if name == order[0]:
            rounds.append([])
        if name in order and rounds:
            rounds[-1].append(order.index(name))
    assert [places for places in rounds if places != sorted(places)] == []
    assert set(itertools.chain(*rounds)) == set(range(len(order)))


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
