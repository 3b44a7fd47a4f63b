"""The last result of `make nightly`, from docs/nightly.json, as tables of the page "Reliability" (a
hook of MkDocs)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from rockcheck.scenes import writing

KEPT = Path(__file__).parents[1] / "nightly.json"
PLACE = "<!-- the last nights -->"
KINDS = {"whole": "The whole night", "short": "Its short form"}


def on_page_markdown(markdown: str, **_: Any) -> str:
    """The page with the tables in their place."""
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    return markdown.replace(PLACE, tables(kept))


def tables(kept: dict[str, Any]) -> str:
    """A table a kind of night, a row a part."""
    lines: list[str] = []
    for kind, words in KINDS.items():
        if kind not in kept:
            lines += [f"{words}: no result is kept yet.", ""]
            continue
        night = kept[kind]
        rows = [
            (
                part["name"],
                part["result"],
                f"{part['seconds']:.0f}",
                part["figures"].replace("<", "&lt;"),
            )
            for part in night["parts"]
        ]
        lines += [
            f"{words}: {night['date']}, commit {night['commit']}, seed {night['seed']}, Python"
            f" {night['python']}, {night['machine']}.",
            "",
            writing.markdown_table(("part", "result", "time, s", "figures"), rows),
            "",
        ]
    return "\n".join(lines)
