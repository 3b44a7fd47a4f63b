"""A finding as words: the cells of its tables, CSV and Markdown.

In: a finding, or a block of one. Out: text. The terminal, pages and the documentation call it; it
draws nothing.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rockcheck.reports import style
from rockcheck.reports.show.words import (
    number,
)
from rockcheck.scenes import writing
from rockcheck.validation.finding import Column, Finding, Mark, Plot, Table, Text, plain

#: Of a verdict: its sign, and its colour on a terminal.
SIGN_AND_COLOUR = {
    "": ("", ""),
    "pass": ("✓", "green"),
    "changed": ("△", "yellow"),
    "incomplete": ("–", "yellow"),
    "fail": ("✕", "red"),
    "error": ("!", "red"),
}


def row_cells(
    row: Sequence[Any], columns: Sequence[Column], write: Callable[[float, int], str] = number
) -> list[tuple[Mark, Column, str]]:
    """The cells of a row: each as a mark, its column, and its words.

    `write` says how a number with so many digits is written.
    """
    marks = [cell if isinstance(cell, Mark) else Mark(cell) for cell in row]
    return [
        (mark, column, words_of(mark, column, write))
        for mark, column in zip(marks, columns, strict=True)
    ]


def words_of(mark: Mark, column: Column, write: Callable[[float, int], str]) -> str:
    """A cell's value for people; a sign before it where it has a verdict."""
    digits = mark.digits or column.digits
    match column.kind, mark.value:
        case _, value if value is None or value != value:  # NaN
            said = column.empty
        case "model", value:
            said = style.label_of(str(value))
        case _, bool(value):
            said = "yes" if value else "no"
        case "used", int(value) | float(value) if value > 1.0:
            said = f"{value:.3g}×" if value < math.inf else "beyond"
        case "used", int(value) | float(value):
            said = f"{100.0 * value:.0f} %"
        case "percent", int(value) | float(value):
            said = f"{100.0 * value:.{max(digits - 2, 0)}f} %"
        case "number", float(value):
            said = write(value, digits)
        case _, value:
            said = str(value)
    return f"{SIGN_AND_COLOUR[mark.verdict][0]} {said}".strip()


def failure_lines(failures: Mapping[str, str]) -> list[str]:
    """A line a reason: the first task that failed for it, and how many more."""
    tasks: dict[str, list[str]] = {}
    for task, reason in failures.items():
        tasks.setdefault(reason, []).append(task)
    return [
        f"{labels[0]} and {len(labels) - 1} more: {reason}"
        if len(labels) > 1
        else f"{labels[0]}: {reason}"
        for reason, labels in tasks.items()
    ]


def csv(table: Table) -> str:
    """A table as CSV with all digits."""
    return writing.table_text(
        [column.name for column in table.columns],
        ([plain(cell) for cell in row] for row in table.rows),
    )


def markdown(found: Finding) -> str:
    """The whole finding as Markdown."""
    parts = [f"# {found.title}", found.answer, *filter(None, map(block_markdown, found.blocks))]
    if found.failures:
        parts += ["## Failed", "\n".join(f"- {line}" for line in failure_lines(found.failures))]
    if found.made is not None:
        about = {"made": found.made.created, **found.made.versions, **found.made.hardware}
        parts.append(", ".join(f"{name} {value}" for name, value in about.items()))
    return "\n\n".join(parts) + "\n"


def block_markdown(block: Table | Plot | Text) -> str:
    """A block as Markdown, as the documentation and `summary.md` have it."""
    match block:
        case Text():
            lists = ([f"{name}: {value}" for name, value in block.facts], block.items)
            parts = [block.text, *("\n".join(f"- {item}" for item in items) for items in lists)]
        case Table() if block.on != "file":
            table = block.shown
            rows = ([said for *_, said in row_cells(row, table.columns)] for row in table.rows)
            parts = [writing.markdown_table([one.head for one in table.columns], rows), table.note]
        case _:
            return ""
    return "\n\n".join(filter(None, [block.title and f"## {block.title}", *parts]))
