"""What a study found, as data: an answer and blocks for terminal, page, Markdown and CSV.

A table is described once. `rockcheck.reports.document` renders it; nothing here draws.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar, Literal

Verdict = Literal["", "pass", "changed", "incomplete", "fail", "error"]


@dataclass(frozen=True)
class Mark:
    """A cell with a verdict, which colours it, and words that explain it under the pointer.

    `digits` override the column's. `more` is a remark that the page shows below the value.
    """

    value: Any
    verdict: Verdict = ""
    words: str = ""
    link: str = ""
    digits: int = 0
    more: str = ""


@dataclass(frozen=True)
class Column:
    """What a column means.

    `name` heads it in CSV and JSON, `label` and `unit` for readers. `kind` says how a value is
    shown: "number" with `digits` significant digits, "percent" (of a share), "used" (used share of
    a limit, 1 at the limit), "text", or "model" (a model's name, with its colour). Files keep all
    digits. A terminal shows `brief` columns only. Readers do not see an `optional` column that has
    no value. `empty` stands where a cell has none.
    """

    name: str
    label: str = ""
    unit: str = ""
    kind: Literal["number", "percent", "used", "text", "model"] = "number"
    digits: int = 3
    help: str = ""
    brief: bool = True
    optional: bool = False
    empty: str = ""

    @property
    def head(self) -> str:
        """The heading for readers: "step, s"."""
        label = self.label or self.name.replace("_", " ")
        return f"{label}, {self.unit}" if self.unit else label


def text(name: str, label: str = "", **more: Any) -> Column:
    """A column of words."""
    return Column(name, label, kind="text", **more)


@dataclass(frozen=True)
class Table:
    """Rows of cells in the order of the columns; None and NaN are empty cells.

    `note` is shown on the page and in Markdown, below the table; a terminal leaves it out.
    `on` says where it is shown besides its CSV: everywhere, on the page and in Markdown only, or in
    files only. `folded` tables are closed on the page until a reader opens them. A terminal shows
    the first `most` rows.
    """

    name: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[Any]]
    title: str = ""
    note: str = ""
    on: Literal["all", "page", "file"] = "all"
    folded: bool = False
    most: int = 40
    block: ClassVar[str] = "table"

    @property
    def shown(self) -> Table:
        """The table for readers: without optional columns that have no value."""
        kept = [
            k
            for k, column in enumerate(self.columns)
            if not column.optional or any(plain(row[k]) is not None for row in self.rows)
        ]
        return replace(
            self,
            columns=[self.columns[k] for k in kept],
            rows=[[row[k] for k in kept] for row in self.rows],
        )

    def records(self) -> list[dict[str, Any]]:
        """The rows by the names of the columns, without marks."""
        return [
            {one.name: plain(cell) for one, cell in zip(self.columns, row, strict=True)}
            for row in self.rows
        ]


def plain(cell: Any) -> Any:
    """A cell's value without its mark."""
    return cell.value if isinstance(cell, Mark) else cell


#: How a line of a panel is drawn.
Style = Literal[
    "line",
    "smooth",
    "dashed",
    "dotted",
    "points",
    "dots",
    "thin",
    "level",
    "marked",
    "step",
    "cross",
]


@dataclass(frozen=True)
class Series:
    """One line of a panel. `low` and `high` bound a band around it; `look` names a model's colour.

    `style`: a line, "smooth", "dashed" or "dotted" (without marks), points only, dots (a fit),
    "thin" (one of many behind the others), "level", a horizontal line at the only `y`, for
    reference, "step" (each value up to the next), or "cross" (points that stand out).
    """

    label: str
    x: Sequence[float] = ()
    y: Sequence[float | None] = ()
    low: Sequence[float | None] = ()
    high: Sequence[float | None] = ()
    look: str = ""
    style: Style = "line"


@dataclass(frozen=True)
class Axis:
    """An axis: label, scale, limits, and the words of ticks that replace the usual ones."""

    label: str
    log: bool = False
    limits: tuple[float, float] | None = None
    ticks: Mapping[float, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Panel:
    """Series over common axes."""

    title: str
    series: Sequence[Series]


@dataclass(frozen=True)
class Plot:
    """A figure.

    `kind` "lines" draws `panels`; any other kind is drawn from `data` by its drawer in
    `rockcheck.reports.drawers`. On the page, a `live` plot of one panel shows its values under the
    pointer. Panels have common scales if `shared`. `data` of "lines" may give the x axis in another
    unit, too: `per_unit`, `other_unit`, `other_label`. `played` is what only the page shows, at a
    click.
    """

    name: str
    title: str = ""
    kind: str = "lines"
    panels: Sequence[Panel] = ()
    x: Axis = Axis("")
    y: Axis = Axis("")
    note: str = ""
    live: bool = False
    data: Any = None
    played: Any = None
    shared: bool = True
    on: Literal["all", "page"] = "page"
    folded: bool = False
    block: ClassVar[str] = "plot"


@dataclass(frozen=True)
class Text:
    """A paragraph, a list of `items`, `facts` by their names; `verdict` colours it."""

    text: str = ""
    title: str = ""
    items: Sequence[str] = ()
    facts: Sequence[tuple[str, str]] = ()
    verdict: Verdict = ""
    on: Literal["all", "page"] = "all"
    block: ClassVar[str] = "text"


Block = Table | Plot | Text


@dataclass(frozen=True, kw_only=True)
class Made:
    """How a finding was made.

    `created` (UTC, ISO 8601), number of processes `jobs`, duration, versions of the libraries, and
    hardware.
    """

    created: str
    jobs: int
    wall_seconds: float
    versions: Mapping[str, str]
    hardware: Mapping[str, str]


@dataclass(frozen=True)
class Finding:
    """What a study found.

    `answer` is one sentence; `data` is added to the tables in the output of `--json`. `exit_code`
    is the command's: 0 where nothing is judged. `failures` give the reason by task. `complete` is
    False for a run that was interrupted or ran out of time. `files` are further files by name, such
    as JUnit's or `failures/NAME.toml`, and their content.
    """

    name: str
    title: str
    answer: str
    blocks: Sequence[Block] = ()
    data: Mapping[str, Any] = field(default_factory=dict)
    verdict: Verdict = ""
    exit_code: int = 0
    failures: Mapping[str, str] = field(default_factory=dict)
    complete: bool = True
    made: Made | None = None
    files: Mapping[str, str | bytes] = field(default_factory=dict)

    def tables(self) -> Iterator[Table]:
        """The tables among the blocks."""
        return (block for block in self.blocks if isinstance(block, Table))

    def plots(self) -> Iterator[Plot]:
        """The plots among the blocks."""
        return (block for block in self.blocks if isinstance(block, Plot))

    def table(self, name: str) -> Table:
        """A table by its name."""
        return next(table for table in self.tables() if table.name == name)

    def as_dict(self) -> dict[str, Any]:
        """For JSON: the study's own data, its tables by name, and how it was made."""
        return {
            "title": self.title,
            "answer": self.answer,
            "verdict": self.verdict,
            "exit_code": self.exit_code,
            **self.data,
            "tables": {table.name: table.records() for table in self.tables()},
            "failures": dict(self.failures),
            "complete": self.complete,
            "made": None if self.made is None else asdict(self.made),
        }
