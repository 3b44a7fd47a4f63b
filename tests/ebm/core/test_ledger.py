"""The pages say where in the event core a thing is done."""

import importlib
import inspect
import re
from pathlib import Path

from rockcheck.ebm.core import march, rules

DOCS = Path(__file__).parents[3] / "docs"


def test_a_modelling_choice_is_explained():
    page = (DOCS / "limits.md").read_text(encoding="utf-8")
    assert len(rules.Rule) == rules.RULES == len(rules.NAMES)
    assert [name for name in rules.NAMES if name not in page] == []


def test_the_theory_page_links_each_stage_to_its_function():
    page = (DOCS / "theory.md").read_text(encoding="utf-8")
    page = page[page.index("## How an event is handled") :]
    stages = re.findall(r"^\d\. \*\*(\w+)\.?\*\* \(`(\w+)\.(\w+)`\)", page, re.MULTILINE)
    words = ["Expand", "Locate", "Sample", "Advance", "Resolve", "Select"]
    assert [stage for stage, _, _ in stages] == words
    loop = inspect.getsource(march.loop_with)
    for _, module, name in stages:
        assert callable(getattr(importlib.import_module(f"rockcheck.ebm.core.{module}"), name))
        assert f"{name}(block" in loop
