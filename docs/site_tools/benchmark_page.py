"""Puts one whole run of `rockcheck benchmark` into docs/benchmark.md: its machine, its tables and
its diagrams.

`python docs/site_tools/benchmark_page.py rockcheck-report/benchmark`; what the page says in words
is held against the tables by the tests.
"""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

DOCS = Path(__file__).parents[1]
DIAGRAMS = ("without-wall", "with-wall", "records", "ratios", "batches")


def publish(run: Path) -> None:
    """Writes what stands between the page's marks."""
    head, *sections = re.split(
        r"^## ", (run / "summary.md").read_text(encoding="utf-8"), flags=re.M
    )
    league = next(text for text in sections if text.startswith("League of engines"))
    table = league[league.index("| engine |") :]
    heads = "| engine | cost at 1e-3 α | error at 20 ms | least error | at a cost of |"
    rest = "".join(f"## {text}" for text in sections if text is not league)
    page = DOCS / "benchmark.md"
    text = page.read_text(encoding="utf-8")
    for mark, content in (
        ("league", table.replace(table.splitlines()[0], heads)),
        ("machine", head),
        ("tables", rest),
    ):
        text = re.sub(
            rf"(<!-- {mark} -->\n).*?(\n<!-- end -->)",
            lambda m, new=content: f"{m[1]}\n{new.strip()}\n{m[2]}",
            text,
            flags=re.S,
        )
    page.write_text(text, encoding="utf-8")
    for name in DIAGRAMS:
        shutil.copyfile(
            run / "pages" / "figures" / f"{name}.png", DOCS / "images" / "benchmark" / f"{name}.png"
        )


if __name__ == "__main__":
    publish(Path(sys.argv[1]))
