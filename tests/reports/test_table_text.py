"""A finding in words: how cells, tables and failures read in Markdown and CSV."""

import math

import pytest

from rockcheck.reports import table_text
from rockcheck.validation.finding import Column, Finding, Made, Mark, Plot, Table, Text, text


def words(value, **of_column):
    """A cell's words, in a column of these."""
    ((_, _, said),) = table_text.row_cells([value], [Column("a", **of_column)])
    return said


@pytest.mark.parametrize(
    ("value", "of_column", "said"),
    [
        (None, {"empty": "–"}, "–"),
        (math.nan, {"empty": "–"}, "–"),
        (True, {}, "yes"),
        (False, {}, "no"),
        (12, {}, "12"),
        ("left", {"kind": "text"}, "left"),
        (0.5, {"kind": "used"}, "50 %"),
        (1.0, {"kind": "used"}, "100 %"),
        (1.25, {"kind": "used"}, "1.25×"),
        (math.inf, {"kind": "used"}, "beyond"),
        ("-", {"kind": "used"}, "-"),
        (0.123456, {"kind": "percent", "digits": 3}, "12.3 %"),
        (0.123456, {"kind": "percent", "digits": 1}, "12 %"),
        (1.23456, {"digits": 3}, "1.23"),
    ],
)
def test_a_cell_reads_as_its_column_says(value, of_column, said):
    assert words(value, **of_column) == said


def test_the_digits_of_a_mark_come_before_those_of_its_column():
    assert words(Mark(1.23456, digits=2), digits=5) == "1.2"


def test_a_mark_has_the_sign_of_its_verdict():
    assert words(Mark("moving", "fail"), kind="text") == "✕ moving"


TABLE = Table(
    "t", [text("name"), Column("size")], [["a", 1], ["b", Mark(2, "pass")]], "Sizes", "So."
)


def test_a_table_has_its_title_and_its_note_in_markdown():
    blocks = table_text.block_markdown(TABLE).split("\n\n")
    assert blocks[0] == "## Sizes"
    assert blocks[1].splitlines()[-1].split() == ["|", "b", "|", "✓", "2", "|"]
    assert blocks[2] == "So."


@pytest.mark.parametrize(("on", "shown"), [("all", True), ("page", True), ("file", False)])
def test_a_table_that_is_a_file_alone_is_not_in_markdown(on, shown):
    table = Table("t", [text("name")], [["a"]], on=on)
    assert bool(table_text.block_markdown(table)) == shown


def test_a_plot_is_not_in_markdown():
    assert table_text.block_markdown(Plot("p", "A plot")) == ""


def test_a_text_has_its_facts_and_items_as_lists():
    block = Text("Words.", items=["one", "two"], facts=[("gap", "3 mm")])
    assert table_text.block_markdown(block) == "Words.\n\n- gap: 3 mm\n\n- one\n- two"


def test_csv_has_values_without_marks():
    assert table_text.csv(TABLE).splitlines() == ["name,size", "a,1", "b,2"]


def test_a_reason_of_many_tasks_is_a_line():
    failures = {"a": "no end", "b": "no end", "c": "crashed", "d": "no end"}
    assert table_text.failure_lines(failures) == ["a and 2 more: no end", "c: crashed"]


def test_a_reason_of_two_tasks_is_a_line():
    failures = {"a": "no end", "b": "no end"}
    assert table_text.failure_lines(failures) == ["a and 1 more: no end"]


def finding(**more):
    return Finding("f", "Title", "Answer.", [TABLE], **more)


def test_a_finding_begins_with_title_and_answer_and_ends_with_a_line():
    said = table_text.markdown(finding())
    assert said.startswith("# Title\n\nAnswer.\n\n## Sizes")
    assert said.endswith("So.\n")


def test_what_failed_has_a_heading_of_its_own():
    assert table_text.markdown(finding(failures={"a": "no end"})).endswith(
        "## Failed\n\n- a: no end\n"
    )


def test_without_a_failure_there_is_no_such_heading():
    assert "## Failed" not in table_text.markdown(finding())


def test_how_it_was_made_comes_last():
    made = Made(
        created="today", jobs=1, wall_seconds=1.0, versions={"numpy": "2"}, hardware={"cpu": "x"}
    )
    assert table_text.markdown(finding(made=made)).endswith("made today, numpy 2, cpu x\n")
