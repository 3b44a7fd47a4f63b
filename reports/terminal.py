"""A finding on a terminal: its tables fitted to the width, its text, its answer.

In: a `Finding` and rich's console. Out: lines. Words are never broken where a column can be wider
or a table can be shown in parts.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as Grid
from rich.text import Text as Line

from rockcheck.reports.table_text import SIGN_AND_COLOUR, failure_lines, row_cells
from rockcheck.scenes import errors
from rockcheck.validation.finding import Block, Column, Finding, Table, Text

#: Blanks between two columns.
GAP = 2
#: A column of longer texts is at least so wide.
TEXT_WIDTH = 16


@dataclass(frozen=True)
class TextColumn:
    """A column as text: its heading, its cells, and whether they stand at the left."""

    head: str
    cells: Sequence[Line]
    is_left: bool

    @property
    def natural_width(self) -> int:
        """The width without a line break."""
        return max(cell_len(line) for text in self._texts() for line in text.split("\n"))

    @property
    def least_width(self) -> int:
        """The least width in which no word is broken, and a longer text can be read."""
        words = [word for text in self._texts() for word in text.split()]
        longest_word = max(map(cell_len, words), default=0)
        return max(longest_word, min(self.natural_width, TEXT_WIDTH if self.is_left else 0))

    def _texts(self) -> Iterator[str]:
        yield self.head
        yield from (cell.plain for cell in self.cells)


def show(found: Finding, screen: Console) -> None:
    """The blocks that a terminal has room for, and the answer where no table has it."""
    blocks = [block for block in found.blocks if block.on == "all" and _has_content(block)]
    for number, block in enumerate(blocks):
        if isinstance(block, Table):
            if number:
                screen.print()
            _show_table(block, screen)
        elif isinstance(block, Text):
            _show_text(block, screen)
    for line in failure_lines(found.failures):
        _show_line(f"failed: {line}", "red", screen)
    if not found.complete:
        screen.print("not complete: the same command goes on where it ended", style="yellow")
    if found.answer and not any(_holds(block, found.answer) for block in blocks):
        _show_line(found.answer, "bold", screen)


def _has_content(block: Block) -> bool:
    if isinstance(block, Text):
        return bool(block.text or block.facts or block.items)
    return isinstance(block, Table)


def _holds(block: Block, answer: str) -> bool:
    """Whether a table shows the answer in one of its cells."""
    if not isinstance(block, Table):
        return False
    columns = _text_columns(block.shown)
    return any(answer in cell.plain for column in columns for cell in column.cells)


def _show_line(line: str, colour: str, screen: Console) -> None:
    """Print a line; only a terminal breaks it, between words: files and pipes are searched."""
    screen.print(line, style=colour, soft_wrap=not screen.is_terminal)


def _show_text(text: Text, screen: Console) -> None:
    facts = [f"{name}: {value}" for name, value in text.facts]
    for line in filter(None, (text.text, *facts, *text.items)):
        _show_line(line, SIGN_AND_COLOUR[text.verdict][1], screen)


def _show_table(table: Table, screen: Console) -> None:
    """Print a table, in parts below each other where it is too wide."""
    if table.title:
        screen.print(table.title, style="italic", soft_wrap=True)
    columns = _text_columns(table.shown)
    for number, part in enumerate(parts(columns, screen.width)):
        if number:
            screen.print()
        screen.print(_grid(part, screen.width))
    if len(table.rows) > table.most:
        screen.print(f"and {len(table.rows) - table.most} more rows: {table.name}.csv")


def _text_columns(table: Table) -> list[TextColumn]:
    """The columns of a table that a terminal shows."""
    cells: list[list[Line]] = [[] for _ in table.columns]
    for row in islice(table.rows, table.most):
        for number, (mark, _, words) in enumerate(row_cells(row, table.columns, "{:.{}g}".format)):
            cells[number].append(Line(errors.inert(words), SIGN_AND_COLOUR[mark.verdict][1]))
    return [
        TextColumn(column.head, column_cells, _is_left(column))
        for column, column_cells in zip(table.columns, cells, strict=True)
        if column.brief
    ]


def _is_left(column: Column) -> bool:
    return column.kind in ("text", "model")


def parts(columns: Sequence[TextColumn], room: int) -> list[list[TextColumn]]:
    """The columns in groups that fit into `room` characters, each with the first column before it.

    A group of two is never divided: if it has a word that is too long, that is broken.
    """
    if not columns:
        return []
    first, *others = columns
    groups = [[first]]
    for column in others:
        group = [*groups[-1], column]
        if len(group) > 2 and _total([each.least_width for each in group]) > room:
            groups.append([first, column])
        else:
            groups[-1] = group
    return groups


def widths_within(columns: Sequence[TextColumn], room: int) -> list[int]:
    """The widths of columns in `room` characters: the widest gives way first.

    None becomes narrower than its longest word while another can; what is still too wide is then
    taken from the widest.
    """
    widths = [column.natural_width for column in columns]
    least = [column.least_width for column in columns]
    while _total(widths) > room and max(widths) > 1:
        spare = [k for k in range(len(widths)) if widths[k] > least[k]] or range(len(widths))
        widest = max(spare, key=widths.__getitem__)
        widths[widest] -= 1
    return widths


def _total(widths: Sequence[int]) -> int:
    return sum(widths) + GAP * (len(widths) - 1)


def _grid(columns: Sequence[TextColumn], room: int) -> Grid:
    grid = Grid(box=None, pad_edge=False)
    for column, width in zip(columns, widths_within(columns, room), strict=True):
        grid.add_column(
            column.head,
            justify="left" if column.is_left else "right",
            overflow="fold",
            width=width,
        )
    for row in zip(*(column.cells for column in columns), strict=True):
        grid.add_row(*row)
    return grid
