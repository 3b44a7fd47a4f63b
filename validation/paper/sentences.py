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
    """A sentence of the paper, what was computed for it, and the verdict."""

    about: Mapping[str, Any]
    verdict: str
    finding: str
    rows: Sequence[Row]


@dataclass(frozen=True)
class Beyond:
    """A finding that the paper does not tell of, and the case that shows it best."""

    about: Mapping[str, Any]
    words: str
    shown: Shown


def claims_of(paper: Paper) -> list[Claim]:
    """The paper's sentences, judged: a sentence holds where all rows do, or, of what is said to be
    so generally, most of them."""
    found = []
    for about in SENTENCES["claim"]:
        rows, says = getattr(measures, about["measure"])(paper, **about.get("with", {}))
        judged = [row.holds for row in rows if row.holds is not None]
        held = sum(judged)
        enough = held > GENERALLY * len(judged) if "generally" in about else all(judged)
        said = about["finding"].format(held=held, all=len(judged), **says)
        against = [row.what for row in rows if row.holds is False]
        if held and 0 < len(against) <= MOST_NAMED:
            said += f" Not so: {'; '.join(against)}."
        verdict = "holds" if enough else "holds in part" if held else "does not hold"
        found.append(Claim(about, verdict, said, rows))
    return found


def findings_of(paper: Paper) -> list[Beyond]:
    """What the spectra show and the paper does not say."""
    found = []
    for about in SENTENCES["finding"]:
        shown: Shown = getattr(measures, about["measure"])(paper)
        counts = {"gained": shown.gained.sum(), "lost": shown.lost.sum()}
        found.append(Beyond(about, about["words"].format(**counts, **shown.says), shown))
    return found


def blocks(paper: Paper, claims: Sequence[Claim]) -> Iterator[Block]:
    """The sentences with their verdicts, the safe areas behind most of them, and our findings."""
    columns = [
        text("sentence", "sentence, restated"),
        text("place", "where in the paper", brief=False),
        text("verdict"),
        text("finding"),
        text("criterion", "judged by", brief=False),
        text("figures", brief=False),
    ]
    rows = [
        [
            *(claim.about[name] for name in ("sentence", "place")),
            Mark(claim.verdict, VERDICTS[claim.verdict]),
            claim.finding,
            claim.about["criterion"],
            ", ".join(map(str, claim.about["figures"])),
        ]
        for claim in claims
    ]
    size = f"{len(paper.amplitudes)} x {len(paper.frequencies)}"
    note = f"Each sentence of section 5 and the conclusions, judged by spectra of {size} nodes."
    title = "What the paper says of them, checked"
    yield Table("claims", columns, rows, title, note)
    yield _areas(paper)
    yield _rows(
        "claim-figures",
        "The figures behind each verdict",
        {c.about["name"]: c.rows for c in claims},
    )
    yield from beyond(paper, findings_of(paper))


def beyond(paper: Paper, found: Sequence[Beyond]) -> Iterator[Block]:
    """Our findings, and a map of each."""
    yield Table(
        "findings",
        [text("sentence", "finding"), text("case", "where"), text("words", "nodes", brief=False)],
        [
            [one.about["sentence"], f"{one.shown.case} (Fig. {one.shown.figure})", one.words]
            for one in found
        ],
        "What the paper does not say",
    )
    gained, lost = (
        "; ".join(one.about[key] for one in found if key in one.about) for key in ("gained", "lost")
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
    yield _rows(
        "finding-figures", "All cases", {one.about["name"]: one.shown.rows for one in found}
    )


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
