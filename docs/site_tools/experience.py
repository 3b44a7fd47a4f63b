"""What the suites have found about each model: `python docs/site_tools/experience.py RUN ...` from
the folders of finished runs.

Writes bias and scatter of the figures and the domain of the scenes to scenes/data/experience.json,
which `History.expected` and the report read, and the tables of docs/theory.md.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from rockcheck.scenes.experience import Experience
from rockcheck.scenes.writing import markdown_table, write_whole
from rockcheck.validation.suite.across import experience_of
from rockcheck.validation.suite.results import Run

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "scenes" / "data" / "experience.json"
PAGE = ROOT / "docs" / "theory.md"
BEGIN, END = "<!-- experience: begin -->\n", "<!-- experience: end -->\n"


def tables(found: Experience) -> str:
    """Bias and scatter by model, and the domain, as Markdown."""
    rows = [
        (f"`{model}`", f"{trust.bias:.4f}", f"{trust.scatter:.2g}", str(trust.count))
        for model, figures in found.trust.items()
        for trust in (figures["peak_rotation"],)
    ]
    covered = [(axis, f"{one.low:.3g}", f"{one.high:.3g}") for axis, one in found.domain.items()]
    first = markdown_table(("model", "bias", "scatter", "scenes"), rows)
    return f"\n{first.strip()}\n\n{markdown_table(('axis', 'from', 'to'), covered).strip()}\n\n"


def main(folders: Sequence[str]) -> None:
    """Learns from the runs in these folders."""
    found = experience_of([Run.load(Path(folder)) for folder in folders])
    write_whole(KEPT, found.model_dump_json(indent=1) + "\n")
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    write_whole(PAGE, before + BEGIN + tables(found) + END + rest.split(END)[1])
    print(tables(found))


if __name__ == "__main__":
    main(sys.argv[1:])
