"""Findings on a terminal of 80 columns: no broken word, tables apart, the answer once."""

import io

import pytest
import whole_runs
from rich.console import Console
from rich.text import Text as Line

from rockcheck.reports import terminal
from rockcheck.validation.finding import Column, Finding, Table, Text, text

RUNS = sorted(path.stem for path in whole_runs.RUNS.glob("*.json"))


def shown(found: Finding, columns: int = 80, *, is_terminal: bool = False) -> str:
    """What a terminal, or a pipe, of so many columns shows of a finding."""
    stream = io.StringIO()
    screen = Console(
        file=stream,
        width=columns,
        force_terminal=is_terminal,
        no_color=True,
        markup=False,
        emoji=False,
        highlight=False,
    )
    terminal.show(found, screen)
    return stream.getvalue()


def finding(*blocks, answer: str = "") -> Finding:
    return Finding("study", "title", answer, list(blocks))


def wide(count: int) -> Table:
    """A table of so many columns that have long words in their heads."""
    columns = [text("scene"), *(Column(f"displacement_{k}", "displacement") for k in range(count))]
    return Table("wide", columns, [["bookcase", *map(float, range(count))]])


def test_no_word_of_a_wide_table_is_broken():
    words = shown(finding(wide(12))).split()
    assert words.count("displacement") == 12


def test_the_parts_of_a_wide_table_begin_with_its_first_column():
    parts = shown(finding(wide(12))).split("\n\n")
    assert len(parts) == 3
    assert [part.split()[0] for part in parts] == ["scene"] * 3


def test_no_line_of_a_wide_table_is_longer_than_the_terminal():
    assert max(map(len, shown(finding(wide(12))).splitlines())) <= 80


@pytest.mark.parametrize("columns", [60, 80])
def test_a_long_text_gives_way_to_short_words(columns):
    """Beside it the heads stay whole."""
    table = Table(
        "stress",
        [text("model"), text("what broke"), Column("top_displacement", "top displacement", "m")],
        [["ebm-unilateral", "the block sinks into the floor and stays there " * 4, 0.25]],
    )
    words = shown(finding(table), columns).split()
    assert "displacement," in words
    assert "ebm-unilateral" in words
    assert words.count("floor") == 4


def test_a_word_longer_than_the_terminal_is_shown_whole_over_several_lines():
    path = "folder/" * 30
    rows = shown(finding(Table("paths", [text("name"), text("path")], [["a", path]])), 40)
    assert "".join(rows.split()[3:]) == path


@pytest.mark.parametrize("run", RUNS)
def test_the_words_of_whole_runs_stay_whole(run):
    """Those that a terminal of 400 columns shows."""
    tables = [block for block in whole_runs.load(run).blocks if isinstance(block, Table)]
    found = finding(*tables)
    at_80 = shown(found).split()
    assert {*shown(found, 400).split()} - {*at_80} == set()


def test_a_blank_line_stands_before_each_table_but_the_first():
    table = Table("short", [text("scene")], [["fig5a"]])
    said = shown(finding(table, Text("between"), table, table))
    assert said.splitlines() == [
        "scene",
        "fig5a",
        "between",
        "",
        "scene",
        "fig5a",
        "",
        "scene",
        "fig5a",
    ]


def test_the_answer_is_not_repeated_below_a_table_that_has_it():
    answers = Table("answers", [text("question"), text("answer")], [["Does it fall?", "It stays."]])
    assert shown(finding(answers, answer="It stays.")).count("It stays.") == 1


def test_the_answer_stands_below_tables_that_lack_it():
    table = Table("short", [text("scene")], [["fig5a"]])
    assert shown(finding(table, answer="It stays.")).splitlines()[-1] == "It stays."


LONG = "the rotations are apart " * 8


def test_a_terminal_breaks_a_sentence_between_words():
    lines = shown(finding(Text(LONG)), is_terminal=True).splitlines()
    assert max(map(len, lines)) <= 80
    assert "".join(lines).replace(" ", "") == LONG.replace(" ", "")


def test_a_pipe_has_a_sentence_in_one_line():
    assert shown(finding(Text(LONG))).splitlines() == [LONG]


@pytest.mark.parametrize(("on", "count"), [("all", 1), ("page", 0), ("file", 0)])
def test_a_table_for_pages_or_files_is_not_on_a_terminal(on, count):
    table = Table("t", [text("name")], [["bookcase"]], on=on)
    assert shown(finding(table)).count("bookcase") == count


def test_a_column_without_a_word_takes_no_room():
    assert terminal.TextColumn("", [Line("")], is_left=True).least_width == 0


@pytest.mark.parametrize(("is_left", "width"), [(True, 16), (False, 4)])
def test_a_longer_text_at_the_left_has_room_to_be_read(is_left, width):
    column = terminal.TextColumn("head", [Line("ab cd " * 9)], is_left=is_left)
    assert column.least_width == width
