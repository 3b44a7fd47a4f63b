"""What the paper says of its 28 spectra, and what it does not say, for readers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rockcheck.ebm import Spectrum
from rockcheck.validation.finding import (
    Axis,
    Block,
    Mark,
    Panel,
    Plot,
    Series,
    Table,
    Verdict,
    text,
)
from rockcheck.validation.paper.claims import Claim, Paper
from rockcheck.validation.paper.findings import Finding, findings
from rockcheck.validation.paper.panels import GAPS, RESTITUTIONS

VERDICTS: dict[str, Verdict] = {
    "holds": "pass",
    "holds in part": "changed",
    "does not hold": "fail",
    "": "",
}
#: Letters of the nodes of a finding's map.
FALLEN, STANDS, GAINED, LOST = "FTGX"


def blocks(claims: Sequence[Claim], spectra: Sequence[Spectrum]) -> Iterator[Block]:
    """The sentences with their verdicts, the safe areas behind most of them, and our findings."""
    size = " x ".join(map(str, spectra[0].outcomes.shape))
    yield Table(
        "claims",
        [
            text("sentence", "sentence, restated"),
            text("place", "where in the paper", brief=False),
            text("verdict"),
            text("finding"),
            text("criterion", "judged by", brief=False),
            text("figures", brief=False),
        ],
        [
            [
                claim.sentence,
                claim.place,
                Mark(claim.verdict, VERDICTS[claim.verdict]),
                claim.finding,
                claim.criterion,
                ", ".join(map(str, claim.figures)),
            ]
            for claim in claims
        ],
        "What the paper says of them, checked",
        f"Each sentence of section 5 and the conclusions, judged by the spectra of {size} nodes.",
    )
    yield _areas(Paper(spectra))
    yield _rows("claim-figures", "The figures behind each verdict", claims)
    yield from beyond(findings(spectra))


def beyond(found: Sequence[Finding]) -> Iterator[Block]:
    """Our findings, and a map of each."""
    yield Table(
        "findings",
        [text("sentence", "finding"), text("case", "where"), text("words", "nodes", brief=False)],
        [[one.sentence, f"{one.case} (Fig. {one.figure})", one.words] for one in found],
        "What the paper does not say",
    )
    yield Plot(
        "findings",
        kind="spectra",
        note="The nodes that each finding rests on.",
        data={
            "frequencies": found[0].frequencies.tolist(),
            "amplitudes": found[0].amplitudes.tolist(),
            "record": False,
            "height": 3.0,
            "panels": [_map(one, column) for column, one in enumerate(found)],
            "key": {
                FALLEN: "overturned",
                STANDS: "safe",
                GAINED: "gained: " + "; ".join(one.gained_means for one in found),
                LOST: "lost: " + "; ".join(filter(None, (one.lost_means for one in found))),
            },
        },
    )
    yield _rows("finding-figures", "All cases", found)


def _map(one: Finding, column: int) -> dict[str, Any]:
    letters = np.where(one.safe, STANDS, FALLEN)
    letters[one.gained], letters[one.lost] = GAINED, LOST
    shown = "".join(letters.ravel())
    return {"title": one.case, "free": True, "outcomes": shown, "place": [0, 1, column]}


def _rows(name: str, title: str, of: Sequence[Any]) -> Table:
    words = {None: "", True: "holds", False: "does not hold"}
    rows = [
        [one.name, row.what, row.value, Mark(words[row.holds], VERDICTS[words[row.holds]])]
        for one in of
        for row in one.rows
    ]
    columns = [text("name", "of"), text("what"), text("value"), text("holds", "")]
    return Table(name, columns, rows, title, on="page", folded=True)


def _areas(paper: Paper) -> Plot:
    """Safe areas against the gap: what the claims about areas rest on."""
    gaps = [1000.0 * gap for gap in GAPS]
    panels = []
    for side in ("left", "right"):
        series = []
        for mu, free in paper.free.items():
            level = [100.0 * free.safe_area] * len(gaps)
            series.append(Series(f"μ {mu:g}, no wall", gaps, level, style="dots"))
            for e in RESTITUTIONS:
                areas = [100.0 * paper.walled[side, mu, gap, e].safe_area for gap in GAPS]
                series.append(Series(f"μ {mu:g}, e {e:g}", gaps, areas))
        panels.append(Panel(f"Wall on the {side}", series))
    x, y = Axis("gap, mm"), Axis("safe nodes, %")
    return Plot("safe-areas", panels=panels, x=x, y=y, note="Safe areas of all spectra.")
