"""The paper's sentences about its 28 spectra with their verdicts, and what it does not say, for
readers: `data/paper/sentences.toml`, evaluated."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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
from rockcheck.validation.paper import measures
from rockcheck.validation.paper.measures import AXES, Paper, Row, Shown
from rockcheck.validation.paper.panels import RESTITUTIONS

SENTENCES = tomllib.loads(
    (Path(__file__).parents[1] / "data" / "paper" / "sentences.toml").read_text(encoding="utf-8")
)
#: "Generally": in more than this share of the cases.
GENERALLY = 0.75
#: So many exceptions from a sentence are named beside its verdict.
MOST_NAMED = 3
VERDICTS: dict[str, Verdict] = {
    "holds": "pass",
    "holds in part": "changed",
    "does not hold": "fail",
    "": "",
}
#: Letters of the nodes of a finding's map.
FALLEN, STANDS, GAINED, LOST = "FTGX"


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, where it stands, what was computed for it, and the verdict."""

    name: str
    sentence: str
    place: str
    verdict: str
    finding: str
    criterion: str
    figures: tuple[int, ...]
    rows: Sequence[Row]


@dataclass(frozen=True)
class Beyond:
    """A finding that the paper does not tell of, and the case that shows it best."""

    name: str
    sentence: str
    words: str
    gained_means: str
    lost_means: str
    shown: Shown


def claims_of(paper: Paper) -> list[Claim]:
    """The paper's sentences, judged."""
    return [_judged(paper, **sentence) for sentence in SENTENCES["claim"]]


def _judged(
    paper: Paper,
    *,
    measure: str,
    finding: str,
    criterion: str,
    generally: bool = False,
    **more: Any,
) -> Claim:
    """A sentence holds where all rows do, or, of what is said to be so generally, most of them."""
    about = {name: more.pop(name) for name in ("name", "sentence", "place", "figures")}
    rows, says = getattr(measures, measure)(paper, **more)
    judged = [row.holds for row in rows if row.holds is not None]
    enough = sum(judged) > GENERALLY * len(judged) if generally else all(judged)
    said = finding.format(held=sum(judged), all=len(judged), **says)
    against = [row.what for row in rows if row.holds is False]
    if any(judged) and 0 < len(against) <= MOST_NAMED:
        said += f" Not so: {'; '.join(against)}."
    return Claim(
        **about,
        verdict="holds" if enough else "holds in part" if any(judged) else "does not hold",
        finding=said,
        criterion=criterion
        + (f"; generally: in more than {GENERALLY:.0%} of the cases" if generally else ""),
        rows=rows,
    )


def findings_of(paper: Paper) -> list[Beyond]:
    """What the spectra show and the paper does not say."""
    found = []
    for one in SENTENCES["finding"]:
        shown: Shown = getattr(measures, one["measure"])(paper)
        counts = {"gained": shown.gained.sum(), "lost": shown.lost.sum()}
        words = one["words"].format(**counts, **shown.says)
        means = one["gained"], one.get("lost", "")
        found.append(Beyond(one["name"], one["sentence"], words, *means, shown))
    return found


def blocks(paper: Paper, claims: Sequence[Claim]) -> Iterator[Block]:
    """The sentences with their verdicts, the safe areas behind most of them, and our findings."""
    columns = {
        "sentence": text("sentence", "sentence, restated"),
        "place": text("place", "where in the paper", brief=False),
        "verdict": text("verdict"),
        "finding": text("finding"),
        "criterion": text("criterion", "judged by", brief=False),
        "figures": text("figures", brief=False),
    }
    rows = [
        [
            *(getattr(claim, name) for name in ("sentence", "place")),
            Mark(claim.verdict, VERDICTS[claim.verdict]),
            *(claim.finding, claim.criterion, ", ".join(map(str, claim.figures))),
        ]
        for claim in claims
    ]
    size = f"{len(paper.amplitudes)} x {len(paper.frequencies)}"
    note = f"Each sentence of section 5 and the conclusions, judged by spectra of {size} nodes."
    title = "What the paper says of them, checked"
    yield Table("claims", list(columns.values()), rows, title, note)
    yield _areas(paper)
    yield _rows(
        "claim-figures", "The figures behind each verdict", {c.name: c.rows for c in claims}
    )
    yield from beyond(paper, findings_of(paper))


def beyond(paper: Paper, found: Sequence[Beyond]) -> Iterator[Block]:
    """Our findings, and a map of each."""
    yield Table(
        "findings",
        [text("sentence", "finding"), text("case", "where"), text("words", "nodes", brief=False)],
        [[one.sentence, f"{one.shown.case} (Fig. {one.shown.figure})", one.words] for one in found],
        "What the paper does not say",
    )
    gained, lost = (
        "; ".join(filter(None, means))
        for means in zip(*((one.gained_means, one.lost_means) for one in found), strict=True)
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
            "panels": [_map(one.shown, column) for column, one in enumerate(found)],
            "key": {FALLEN: "overturned", STANDS: "safe", GAINED: gained, LOST: lost},
        },
    )
    yield _rows("finding-figures", "All cases", {one.name: one.shown.rows for one in found})


def _map(one: Shown, column: int) -> dict[str, Any]:
    letters = np.where(one.safe, STANDS, FALLEN)
    letters[one.gained], letters[one.lost] = GAINED, LOST
    shown = "".join(letters.ravel())
    return {"title": one.case, "free": True, "outcomes": shown, "place": [0, 1, column]}


def _rows(name: str, title: str, of: Mapping[str, Sequence[Row]]) -> Table:
    words = {None: "", True: "holds", False: "does not hold"}
    rows = [
        [whose, row.what, row.value, Mark(words[row.holds], VERDICTS[words[row.holds]])]
        for whose, some in of.items()
        for row in some
    ]
    columns = [text("name", "of"), text("what"), text("value"), text("holds", "")]
    return Table(name, columns, rows, title, on="page", folded=True)


def _areas(paper: Paper) -> Plot:
    """Safe areas against the gap: what the claims about areas rest on."""
    gaps = AXES["gap"]
    areas, alone = (100.0 * safe.mean(axis=(-2, -1)) for safe in (paper.safe, paper.safe_alone))
    panels = []
    for side, of_side in zip(AXES["side"], areas, strict=True):
        series = []
        for mu, of_mu, free in zip(AXES["friction"], of_side, alone, strict=True):
            series += [
                Series(f"μ {mu:g}, e {e:g}", gaps, of_mu[:, n].tolist())
                for n, e in enumerate(RESTITUTIONS)
            ]
            level = [float(free)] * len(gaps)
            series.append(Series(f"μ {mu:g}, no wall", gaps, level, style="dots"))
        panels.append(Panel(f"Wall on the {side}", series))
    x, y = Axis("gap, mm"), Axis("safe nodes, %")
    return Plot("safe-areas", panels=panels, x=x, y=y, note="Safe areas of all spectra.")
