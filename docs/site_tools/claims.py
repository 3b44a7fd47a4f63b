"""Makes the table of the paper's sentences in docs/spectra.md, by a run of the 28 spectra.

`python docs/site_tools/claims.py`, some seconds.
"""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

from rockcheck.scenes.writing import markdown_table
from rockcheck.validation.paper.panels import paper_panels
from rockcheck.validation.studies.spectrum.study import Spectra
from rockcheck.validation.study import run

PAGE = Path(__file__).parents[1] / "spectra.md"
PLACE = re.compile(r"(?<=<!-- claims -->\n\n).*?(?=\n\n<!-- end -->)", flags=re.S)
COLUMNS = {
    "sentence": "sentence, restated",
    "place": "where in the paper",
    "verdict": "verdict",
    "finding": "finding",
}


def made(folder: Path) -> str:
    """The table, a row a sentence; what is played is kept in `folder`."""
    rows = run(Spectra(paper_panels()), folder).table("claims").records()
    return markdown_table(list(COLUMNS.values()), [[row[key] for key in COLUMNS] for row in rows])


def main() -> None:
    """Write it into the page."""
    text = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        table = made(Path(folder))
    PAGE.write_text(PLACE.sub(lambda _: table, text), encoding="utf-8")


if __name__ == "__main__":
    main()
