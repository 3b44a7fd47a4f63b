"""Reports of whole runs: kept as data, rendered with the site, quoted by the pages.

`python docs/site_tools/whole_runs.py keep NAME COMMAND ...` runs a rockcheck command and keeps what
it found as docs/runs/NAME.json. `... fill` writes the tables between the markers of the pages anew,
from these files. As a hook of MkDocs it publishes each as reports/NAME/index.html, by the renderer
that users have, beside the reports that are made when the site is built.

A marker names a run, a table, patterns of its columns, and patterns that the cells of a column
match (no blanks: ? stands for one):

    <!-- table: conformance cards columns=phenomenon,mujoco*best where=phenomenon:RC-0[1-4]* -->
    ...
    <!-- end -->
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
from dataclasses import asdict, replace
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from rockcheck.reports import document, table_text
from rockcheck.scenes import writing
from rockcheck.validation.finding import Finding, Made, Mark, Plot, Table, Text, plain

DOCS = Path(__file__).parents[1]
RUNS, BUILD = DOCS / "runs", DOCS.parent / "build" / "reports"
#: Made when the site is built: what they need takes seconds, and they have pages of their own.
COMMANDS = {
    "smoke": ("validate", "smoke"),
    "assess": ("assess", "bookcase", "--gaps", "0,0.02,0.05,0.1"),
    "fig8": ("spectrum", "fig8", "--size", "40"),
}
#: What the pages show, and what they offer to keep.
SHOWN = {".html", ".css", ".js", ".svg", ".png", ".pdf", ".csv", ".json", ".xml", ".toml", ".md"}
#: Folders of results that wait for the next run.
STORES = {"comparisons", "records", "tiles"}
BLOCKS = {kind.block: TypeAdapter(kind) for kind in (Table, Plot, Text)}
#: Blocks whose data take more characters are not kept: maps of 10,000 nodes, single runs.
MOST = 300_000
PLACE = re.compile(r"(<!-- table: ([^>]*?) -->\n).*?(?=\n<!-- end -->)", re.DOTALL)


def keep(name: str, found: Finding) -> None:
    """Write a finding as docs/runs/NAME.json."""
    blocks = [{"block": block.block, **asdict(block)} for block in found.blocks]
    blocks = [one for one in blocks if one["on"] != "file" and len(writing.json_text(one)) < MOST]
    about = {"name": found.name, "title": found.title, "answer": found.answer, "made": found.made}
    lines = writing.json_text(
        {**about, "made": found.made and asdict(found.made), "blocks": blocks}
    )
    (RUNS / f"{name}.json").write_text(lines + "\n", encoding="utf-8")


@cache
def load(name: str) -> Finding:
    """The finding that is kept under a name."""
    kept = json.loads((RUNS / f"{name}.json").read_text(encoding="utf-8"))
    blocks = [BLOCKS[one.pop("block")].validate_python(one) for one in kept.pop("blocks")]
    made = kept.pop("made")
    return Finding(**kept, blocks=list(map(_marked, blocks)), made=made and Made(**made))


def _marked(block: Any) -> Any:
    if not isinstance(block, Table):
        return block
    rows = [[Mark(**c) if isinstance(c, dict) else c for c in row] for row in block.rows]
    return replace(block, rows=rows)


def quoted(what: str) -> str:
    """The table that a marker asks for, as Markdown without its title and note."""
    run, name, *options = what.split()
    given = dict(option.split("=", 1) for option in options)
    table = load(run).table(name)
    names = [column.name for column in table.columns]
    rows = list(table.rows)
    for condition in filter(None, given.get("where", "").split(",")):
        column, patterns = condition.split(":")
        rows = [row for row in rows if _like(row[names.index(column)], patterns)]
    wanted = [
        place
        for pattern in given.get("columns", "*").split(",")
        for place, column in enumerate(names)
        if fnmatchcase(column, pattern)
    ]
    columns = [table.columns[place] for place in wanted]
    chosen = Table(name, columns, [[row[place] for place in wanted] for row in rows])
    return table_text.block_markdown(chosen).strip()


def _like(cell: Any, patterns: str) -> bool:
    return any(fnmatchcase(str(plain(cell)), pattern) for pattern in patterns.split("|"))


def filled(page: str) -> str:
    """A page's text with the tables of today's runs between its markers."""
    return PLACE.sub(lambda found: f"{found[1]}\n{quoted(found[2])}\n", page)


def on_files(files: Any, config: Any, **_: Any) -> Any:
    """The site's files, and those of the reports."""
    from mkdocs.exceptions import PluginError
    from mkdocs.structure.files import File

    for path in sorted(RUNS.glob("*.json")):
        (BUILD / path.stem).mkdir(parents=True, exist_ok=True)
        document.publish(load(path.stem), BUILD / path.stem)
    for name, command in COMMANDS.items():
        words = [sys.executable, "-m", "rockcheck", *command, "--out", str(BUILD / name), "-q"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode:
            raise PluginError(f"the report {name}: exit {done.returncode}: {done.stderr.strip()}")
    names = [*(path.stem for path in RUNS.glob("*.json")), *COMMANDS]
    for path in sorted(path for name in names for path in (BUILD / name).rglob("*")):
        place = path.relative_to(BUILD)
        if path.suffix in SHOWN and not STORES & set(place.parts):
            files.append(
                File.generated(config, f"reports/{place.as_posix()}", abs_src_path=str(path))
            )
    return files


def main(what: str, *words: str) -> None:
    """Keep what a command finds, or fill the pages."""
    if what == "fill":
        for page in (*DOCS.glob("*.md"), DOCS.parent / "README.md"):
            page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")
        return
    from rockcheck.__main__ import main as command

    publish = document.publish

    def kept(found: Finding, folder: Path, **how: Any) -> Path:
        keep(words[0], found)
        return publish(found, folder, **how)

    document.publish = kept
    sys.argv = ["rockcheck", *words[1:]]
    command()


if __name__ == "__main__":
    main(*sys.argv[1:])
