"""A tenth of the hostile cases of `hostile.py`; `make nightly` tries all."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from hostile import Case, cases, try_case

sys.path.pop(0)


def test_there_are_two_hundred():
    assert len(list(cases())) >= 200
    assert len({case.name for case in cases()}) == len(list(cases()))


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("case", list(cases())[::10], ids=lambda case: case.name)
def test_a_hostile_case_ends_with_a_result_or_one_clear_line(case: Case):
    assert try_case(case) == ""
