"""Makes the table of the paper's sentences in docs/spectra.md, from the spectra that come with the package.

`python docs/site_tools/claims.py`, some seconds.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path

from rockcheck.scenes.writing import markdown_table
from rockcheck.validation.spectra.claims import Claim, check_claims, extra_runs
from rockcheck.validation.spectra.findings import kept_spectra
from rockcheck.validation.spectra.study import SpectrumRequest
from rockcheck.validation.spectra.tiles import Tiles

PAGE = Path(__file__).parents[1] / "spectra.md"
PLACE = re.compile(r"(?<=<!-- claims -->\n\n).*?(?=\n\n<!-- end -->)", flags=re.S)


def claims_found(folder: Path) -> Sequence[Claim]:
    """The claims on the grid that is kept; what they need beyond it is played, and kept in `folder`."""
    spectra = kept_spectra()
    request = SpectrumRequest(spectra[0].frequency_ratios, spectra[0].amplitude_ratios)
    return check_claims(spectra, extra_runs(spectra, Tiles(folder), request))


def table(claims: Sequence[Claim]) -> str:
    """A row a sentence."""
    rows = [(claim.sentence, claim.place, claim.verdict, claim.finding) for claim in claims]
    return markdown_table(("sentence, restated", "where in the paper", "verdict", "finding"), rows)


def main() -> None:
    """Write it into the page."""
    text = PAGE.read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        made = table(claims_found(Path(folder)))
    PAGE.write_text(PLACE.sub(lambda _: made, text), encoding="utf-8")


if __name__ == "__main__":
    main()
