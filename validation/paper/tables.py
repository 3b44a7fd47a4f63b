"""Tables and figures of the paper's sentences and of the findings beyond them.

In: `Paper`, its claims and findings. Out: blocks of a page. Called by the study of spectra.
"""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

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
from rockcheck.validation.paper.findings import FurtherFinding, findings_of
from rockcheck.validation.paper.measures import area
from rockcheck.validation.paper.sentences import Claim, Evidence
from rockcheck.validation.paper.spectra import (
    FRICTIONS,
    MILLIMETRES,
    RESTITUTIONS,
    SIDES,
    Paper,
    panels_with,
)

CLAIM_COLOURS: dict[str, Verdict] = {
    "holds": "pass",
    "holds in part": "changed",
    "does not hold": "fail",
    "": "",
}
#: Letters of the nodes of a finding's map.
FALLEN, STANDS, GAINED, LOST = "FTGX"


def blocks(paper: Paper, claims: Sequence[Claim]) -> Iterator[Block]:
    """The sentences with their verdicts, the safe areas behind most of them, and our findings."""
    yield _claims(paper, claims)
    yield _safe_areas(paper)
    yield _evidence(
        "claim-figures",
        "The figures behind each verdict",
        {claim.about["name"]: claim.evidence for claim in claims},
    )
    yield from finding_blocks(paper, findings_of(paper))


def _claims(paper: Paper, claims: Sequence[Claim]) -> Table:
    return Table(
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
                claim.about["sentence"],
                claim.about["place"],
                Mark(claim.verdict, CLAIM_COLOURS[claim.verdict]),
                claim.finding,
                claim.about["criterion"],
                ", ".join(map(str, claim.about["figures"])),
            ]
            for claim in claims
        ],
        "What the paper says of them, checked",
        "Each sentence of section 5 and the conclusions, judged by spectra of"
        f" {len(paper.amplitudes)} x {len(paper.frequencies)} nodes.",
    )


def _safe_areas(paper: Paper) -> Plot:
    return Plot(
        "safe-areas",
        panels=[Panel(f"Wall on the {side}", _safe_area_lines(paper, side)) for side in SIDES],
        x=Axis("gap, mm"),
        y=Axis("safe nodes, %"),
        note="Safe areas of all spectra.",
    )


def _safe_area_lines(paper: Paper, side: str) -> list[Series]:
    lines = []
    for friction in FRICTIONS:
        for e in RESTITUTIONS:
            panels = panels_with(side=side, friction=friction, restitution=e)
            areas = [100.0 * area(paper.safe[panel]) for panel in panels]
            lines.append(Series(f"μ {friction:g}, e {e:g}", MILLIMETRES, areas))
        free = [100.0 * area(paper.safe_alone[friction])] * len(MILLIMETRES)
        lines.append(Series(f"μ {friction:g}, no wall", MILLIMETRES, free, style="dots"))
    return lines


def finding_blocks(paper: Paper, findings: Sequence[FurtherFinding]) -> Iterator[Block]:
    """Our findings, and a map of each."""
    yield Table(
        "findings",
        [text("sentence", "finding"), text("case", "where"), text("words", "nodes", brief=False)],
        [
            [finding.about["sentence"], f"{finding.case} (Fig. {finding.figure})", finding.words]
            for finding in findings
        ],
        "What the paper does not say",
    )
    yield Plot(
        "findings",
        kind="spectra",
        note="The nodes that each finding rests on.",
        data={
            "frequencies": paper.frequencies.tolist(),
            "amplitudes": paper.amplitudes.tolist(),
            "record": False,
            "height": 3.0,
            "panels": [
                {
                    "title": finding.case,
                    "free": True,
                    "outcomes": _letters(finding),
                    "place": [0, 1, column],
                }
                for column, finding in enumerate(findings)
            ],
            "key": {
                FALLEN: "overturned",
                STANDS: "safe",
                GAINED: _legend(findings, "gained"),
                LOST: _legend(findings, "lost"),
            },
        },
    )
    yield _evidence(
        "finding-figures",
        "All cases",
        {finding.about["name"]: finding.evidence for finding in findings},
    )


def _letters(finding: FurtherFinding) -> str:
    masks = [finding.lost, finding.gained, finding.safe]
    return "".join(np.select(masks, [LOST, GAINED, STANDS], FALLEN).ravel())


def _legend(findings: Sequence[FurtherFinding], key: str) -> str:
    return "; ".join(finding.about[key] for finding in findings if key in finding.about)


def _evidence(name: str, title: str, by_sentence: Mapping[str, Sequence[Evidence]]) -> Table:
    words = {None: "", True: "holds", False: "does not hold"}
    rows = []
    for sentence, evidence in by_sentence.items():
        for figure in evidence:
            verdict = words[figure.holds]
            rows.append(
                [sentence, figure.case, figure.value, Mark(verdict, CLAIM_COLOURS[verdict])]
            )
    return Table(
        name,
        [text("name", "of"), text("what"), text("value"), text("holds", "")],
        rows,
        title,
        on="page",
        folded=True,
    )
