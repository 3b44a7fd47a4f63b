"""What changed between two finished studies.

In go two folders, or `run.json` files; out comes a finding of the changed verdicts and values.
`rockcheck compare` calls it.
"""

from pathlib import Path
from typing import Any

from rockcheck.scenes import InputError, printable, reading
from rockcheck.validation.finding import Column, Finding, Table, Verdict, text

#: A value that moved by more than this share of its limit has changed.
SHARE = 0.1
#: Engine, settings and phenomenon, by which rows of two studies are matched.
Key = tuple[str, str, str]
Row = dict[str, Any]
COLUMNS = (
    Column("engine", kind="model"),
    text("settings"),
    text("id", "no."),
    text("phenomenon", brief=False),
    text("version_before", brief=False),
    text("version_after", brief=False),
    text("verdict_before"),
    text("verdict_after"),
    Column("value_before"),
    Column("value_after"),
    text("worse", brief=False),
)


def wrote(path: Path) -> bool:
    """Whether the path is a finished study: a folder or its `run.json`."""
    try:
        data = reading.read_json(path / "run.json" if path.is_dir() else path)
    except InputError:
        return False
    return isinstance(data, dict) and "cards" in data


def changes(before: Path, after: Path) -> Finding:
    """Changes between two finished studies, each a folder or its `run.json`.

    Listed are every changed verdict, and every value that moved by more than `SHARE` of its limit.
    Cards are matched by engine and settings. Exit code 1 where a phenomenon conformed before and
    does not any more. Raises `InputError` for what is no finished study.
    """
    old_rows, new_rows = _rows_of(before), _rows_of(after)
    not_there: Row = {"version": "", "value": None, "verdict": "absent"}
    table = []
    for key in {**old_rows, **new_rows}:
        old = old_rows.get(key) or new_rows[key] | not_there
        new = new_rows.get(key) or old_rows[key] | not_there
        if _changed(old, new):
            table.append(_change(key, old, new))
    worse = sum(row[-1] for row in table)
    verdict: Verdict = "pass"
    if table:
        verdict = "fail" if worse else "changed"
    return Finding(
        "conformance-changes",
        "Conformance: what changed",
        f"{len(table)} changes, {worse} for the worse",
        [Table("changes", list(COLUMNS), table)],
        verdict=verdict,
        exit_code=int(worse > 0),
    )


def _changed(old: Row, new: Row) -> bool:
    if old["verdict"] != new["verdict"]:
        return True
    if None in (old["value"], new["value"], old["limit"]):
        return False
    return bool(abs(new["value"] - old["value"]) > SHARE * old["limit"])


def _change(key: Key, old: Row, new: Row) -> list[Any]:
    """A row of the table: the change, and whether it is for the worse."""
    worse = old["verdict"] == "pass" and new["verdict"] != "pass"
    pairs = [row[name] for name in ("version", "verdict", "value") for row in (old, new)]
    return [*key, old["name"], *pairs, worse]


def _rows_of(path: Path) -> dict[Key, Row]:
    path = path / "run.json" if path.is_dir() else path
    try:
        rows = [_row(row) for row in reading.read_json(path)["tables"]["rows"]]
        return {(row["engine"], row["settings"], row["id"]): row for row in rows}
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{printable(path)}: not what `rockcheck conformance` wrote") from None


def _row(row: Row) -> Row:
    numbers = {name: None if row[name] is None else float(row[name]) for name in ("value", "limit")}
    return row | numbers | {name: str(row[name]) for name in ("name", "version", "verdict")}
