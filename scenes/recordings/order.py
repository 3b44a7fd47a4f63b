"""Whether the numbers of a table without times run along its lines, or down its columns.

| lines | reading | why |
|---|---|---|
| 4, each of 5 numbers | asked for | both are possible |
| 3 of 5 numbers, a last one of 2 | along the lines | no column is that short |
| 4 of 5 numbers, the header states 20 samples | along the lines | the count |
| 4 of 5 numbers, the header states 4 samples | down the columns | the count |
| 0.00 1 / 0.01 2 / 0.02 3 | down the columns | the first one holds times |
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rockcheck.scenes.errors import InputError
from rockcheck.scenes.recordings.recording import Contradiction, Reading, fault, option
from rockcheck.scenes.recordings.stated import Fact

Order = Literal["rows", "columns"]
#: Fewest lines whose first numbers can be told to be times where a time step is given.
_FEWEST_TIMES = 10


@dataclass(frozen=True)
class Shape:
    """How many numbers stand on each line; `first_line` is the number of the first one."""

    widths: Sequence[int]
    first_line: int

    @property
    def along(self) -> int:
        """Number of samples where they run along the lines."""
        return sum(self.widths)

    @property
    def down(self) -> int:
        """Number of samples of a column."""
        return len(self.widths)

    @property
    def is_even(self) -> bool:
        """Whether all lines but the last hold equally many numbers, and that no more."""
        width = self.widths[0]
        return all(other == width for other in self.widths[:-1]) and self.widths[-1] <= width


def runs_along_rows(shape: Shape) -> bool:
    """Whether the last line alone is shorter, so that no columns can be meant."""
    return shape.is_even and shape.widths[-1] < shape.widths[0]


def are_times(values: Sequence[float], *, is_step_given: bool) -> bool:
    """Whether the numbers are times: they increase, nearly all along a straight line.

    Where a time step is given, only a longer column is taken for one of times.
    """
    if len(values) < (_FEWEST_TIMES if is_step_given else 2):
        return False
    column = np.asarray(values)
    steps = np.diff(column)
    length = column[-1] - column[0]
    if not length > 0.0 or np.mean(steps >= 0.0) < 0.9:
        return False
    line = np.linspace(column[0], column[-1], len(column))
    return bool(np.mean(np.abs(column - line) <= 0.1 * length) >= 0.9)


def settled_order(
    shape: Shape, count: Fact[int] | None, step: float | None, reading: Reading
) -> tuple[Order, list[str]]:
    """The order of the numbers of a table without times, and notes on it.

    `count` is that of the header, `step` the time step in s, where they are known. Raises
    `InputError` where the order is not clear.
    """
    if count is not None and "order" not in reading.overriding:
        return _order_of_count(shape, count, reading), [
            f"the header states {count.value} samples; the table has them"
            f" {'along its lines' if count.value == shape.along else 'down a column'}"
        ]
    if reading.order is not None:
        return reading.order, []
    if runs_along_rows(shape):
        if reading.column is not None:
            raise fault(
                f"{shape.widths[-1]} numbers where the first line has {shape.widths[0]}: numbers"
                f" run along the lines; leave the column out: {option('order', 'rows')}",
                shape.first_line + shape.down - 1,
            )
        return "rows", ["the last line is shorter: numbers are taken along the lines"]
    if not shape.is_even:
        return "columns", []  # whoever reads them names the uneven line
    if reading.column is not None:
        return "columns", [
            f"column {reading.column} of {shape.widths[0]}, {_samples(shape.down, step)}; along"
            f" the lines there are {_samples(shape.along, step)}: order = rows"
        ]
    raise _ambiguous(shape, step)


def _order_of_count(shape: Shape, count: Fact[int], reading: Reading) -> Order:
    """The order that the header's count decides; it must not contradict `reading`."""
    orders: dict[int, Order] = {shape.down: "columns", shape.along: "rows"}
    if count.value not in orders:
        raise fault(
            f"the header states {count.value} samples; along the lines there are {shape.along},"
            f" down a column {shape.down}; to read them all the same: {option('order', 'rows!')}",
            count.line,
        )
    order = orders[count.value]
    if reading.order not in (None, order):
        raise Contradiction(
            f"the header states {count.value} samples, which is order = {order}, not"
            f" {reading.order}; leave the option order out, or override the file:"
            f" {option('order', f'{reading.order}!')}",
            "order",
        )
    if order == "rows" and reading.column is not None:
        raise Contradiction(
            f"the header states {count.value} samples, which run along the lines; leave the option"
            " column out",
            "column",
        )
    return order


def _samples(count: int, step: float | None) -> str:
    if step is None:
        return f"{count:,} samples"
    return f"{count:,} samples, {count * step:.6g} s at {step:g} s"


def _ambiguous(shape: Shape, step: float | None) -> InputError:
    return fault(
        f"{shape.widths[0]} numbers a line and no times; along the lines:"
        f" {_samples(shape.along, step)}; the column 2: {_samples(shape.down, step)}; give"
        f" {option('order', 'rows')} or {option('column', 2)}",
        shape.first_line,
    )
