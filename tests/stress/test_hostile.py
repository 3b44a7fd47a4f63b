"""A tenth of the hostile cases of `hostile.py`; `make nightly` tries all."""

import pytest
from hostile import Case, cases, try_case

EVERY = list(cases())


def test_there_are_two_hundred():
    assert len({case.name for case in EVERY}) == len(EVERY) >= 200


@pytest.mark.needs("POSIX")
@pytest.mark.parametrize("case", EVERY[::10], ids=lambda case: case.name)
def test_a_hostile_case_ends_with_a_result_or_one_clear_line(case: Case):
    assert try_case(case) == ""
