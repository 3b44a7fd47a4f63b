"""A made-up study that workers can import: it squares numbers, and fails at some."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rockcheck.scenes import ModelFailure
from rockcheck.validation.finding import Column, Finding, Table
from rockcheck.validation.study import Study, Task

FAULTS = {
    13.0: ModelFailure("no square of 13"),
    14.0: ZeroDivisionError("a bug \udcff"),
    16.0: KeyboardInterrupt(),
}


@dataclass(frozen=True)
class Square(Task):
    value: float
    log: str

    def depends(self) -> Any:
        return self.value


@dataclass(frozen=True)
class Squared:
    value: float
    process: int


class Squares(Study):
    """Squares numbers; what is above 100 is squared in a second wave."""

    name = "squares"
    record = Squared

    def __init__(self, values: Sequence[float], log: Path, **how: Any) -> None:
        self.first = [Square(value, str(log), **how) for value in values]

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Square]:
        squares = (one.value for one in done.values() if isinstance(one, Squared))
        larger = (value for value in squares if 100.0 < value < 1e6)
        return [*self.first, *(Square(value, self.first[0].log) for value in larger)]

    @staticmethod
    def play(task: Square) -> Squared:
        with Path(task.log).open("a") as file:
            file.write(f"{task.value:g}\n")
        if task.value in FAULTS:
            raise FAULTS[task.value]
        if task.value in (15.0, 17.0):
            os._exit({15.0: 3}.get(task.value, 0))
        return Squared(task.value**2, os.getpid())

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        rows = [[task.value, one.value] for task, one in done.items() if isinstance(one, Squared)]
        columns = [Column("value"), Column("square", unit="m")]
        blocks = [Table("squares", columns, rows)]
        return Finding(self.name, "Squares", "", blocks, {"count": len(rows)}, "pass")
