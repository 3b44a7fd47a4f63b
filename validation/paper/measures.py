"""The paper's sentences about its 28 spectra with their verdicts, and further findings.

Evaluates `data/paper/sentences.toml`. The measures that it names come first. Each takes the spectra
and its arguments, and returns rows of figures and the values for the finding's text.
"""

import operator
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE
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
from rockcheck.validation.paper import AMPLITUDES, FIGURES, GAPS, KEPT, RESTITUTIONS

Mask = NDArray[np.bool_]
Place = tuple[int, ...]
#: The parameters of the walls: in this order a spectrum has its place. Gaps in mm.
AXES: dict[str, tuple[Any, ...]] = {
    "side": ("left", "right"),
    "friction": (0.3, 0.6),
    "gap": tuple(1000.0 * gap for gap in GAPS),
    "restitution": RESTITUTIONS,
}
SIZES = tuple(map(len, AXES.values()))
WALLS: list[Place] = list(np.ndindex(*SIZES))
SAID = ("{} wall", "μ {:g}", "{:g} mm", "e {:g}")
#: A change of the safe area by less than this share of the nodes is ignored: a band one node wide
#: along the boundary.
SMALL = 0.01
#: The bounds of a safe area that a part of `against_none` may have.
BOUNDS = {"below": operator.lt, "beyond": operator.gt}
#: Range of omega_p/p of the paper's example of overturning with one impact.
ONE_IMPACT = (2.0, 3.0)
#: The scanned amplitudes, beyond the spectra's own range, and the omega_p/p of the scan; and for
#: which spectra: gap and e, None without a wall.
SCANNED, SCANNED_AT = np.arange(AMPLITUDES[0], 20.005, 0.01), 6.0
SCANNED_WALLS: dict[str, tuple[float, float] | None] = {
    "figure-8-unobstructed": None,
    **{f"figure-8-gap-103-e-{e:g}": (GAPS[-1], e) for e in RESTITUTIONS},
}


@dataclass(frozen=True)
class Row:
    """One figure behind a sentence; `holds` None where it only informs."""

    what: str
    value: str
    holds: bool | None = None


Measured = tuple[list[Row], dict[str, Any]]


class Paper:
    """The 28 spectra on one grid: outcomes and safe nodes by place, and by friction without a wall.

    `spectra` come in the order of `paper_panels`.

    `falls` are the nodes that overturn: one whose run failed is neither safe nor overturned.
    `least`: the lowest overturning amplitude of `SCANNED` by (gap, e) of a right wall, None without
    one; infinite where none overturns. `tongues`: by friction, the nodes of `near_one_impact` at
    which the free block overturns after exactly one floor impact.
    """

    def __init__(
        self,
        spectra: Sequence[Spectrum],
        least: Mapping[tuple[float, float] | None, float] | None = None,
        tongues: Mapping[float, Mask] | None = None,
    ) -> None:
        self.frequencies, self.amplitudes = spectra[0].frequency_ratios, spectra[0].amplitude_ratios
        self.least, self.tongues = least or {}, tongues or {}
        # by side, friction and wall, of which the first is none
        grids = (np.array([getattr(one, what) for one in spectra]) for what in ("outcomes", "safe"))
        outcomes, safe = (grid.reshape(*SIZES[:2], -1, *grid.shape[1:]) for grid in grids)
        self.alone, self.safe_alone = outcomes[-1, :, 0], safe[-1, :, 0]
        self.outcomes, self.safe = (
            grid[:, :, 1:].reshape(*SIZES, *grid.shape[3:]) for grid in (outcomes, safe)
        )
        self.falls, self.falls_alone = self.outcomes != SAFE, self.alone != SAFE


def about(place: Sequence[int | None]) -> str:
    """The wall and friction of a place in words, without those that are None."""
    return ", ".join(
        said.format(axis[n])
        for said, axis, n in zip(SAID, AXES.values(), place, strict=True)
        if n is not None
    )


def share(mask: Mask | float) -> str:
    """A share in percent, one decimal."""
    return f"{100.0 * float(np.mean(mask)):.1f} %"


def pairs(paper: Paper, axis: str, free: bool = False) -> Measured:
    """Compare each value of a parameter, which the paper calls safer, with the next one."""
    compared = [("no wall", *paper.safe_alone)] if free else []
    k = list(AXES).index(axis)
    for place in np.ndindex(*SIZES[:k], 1, *SIZES[k + 1 :]):
        before, after = place[:k], place[k + 1 :]
        along = paper.safe[(*before, slice(None), *after)]
        where = about((*before, None, *after))
        compared += [
            (where + (f": {one:g} against {other:g} mm" if len(along) > 2 else ""), *both)
            for (one, other), both in zip(pairwise(AXES[axis]), pairwise(along), strict=True)
        ]
    rows = []
    for what, safer, other in compared:
        i, j = np.nonzero(~safer & other)
        f, a = paper.frequencies[j], paper.amplitudes[i]
        opposite = (
            f"the opposite at {share(len(i) / safer.size)} of the nodes,"
            f" ω_p/p {f.min():.1f} to {f.max():.1f}, amplitude {a.min():.1f} to {a.max():.1f}"
            if len(i)
            else "nowhere the opposite"
        )
        rows.append(
            Row(
                what,
                f"safe area {share(safer)} against {share(other)}; {opposite}",
                bool(safer.mean() > other.mean()),
            )
        )
    return rows, {}


def against_none(
    paper: Paper, parts: Sequence[Mapping[str, Any]], above: float = 0.0, examples: str = ""
) -> Measured:
    """Safe areas with walls against none, at omega_p/p > `above`.

    A part has parameters of walls, and a bound (factor, share of the nodes): with the wall, the
    area is `below`, or `beyond`, the factor times the area without one plus the share. With
    `examples` some walls must help, and some harm.
    """
    areas, alone = (
        safe[..., paper.frequencies > above].mean(axis=(-2, -1))
        for safe in (paper.safe, paper.safe_alone)
    )
    compared = [
        (part, place, float(areas[place]), float(alone[place[1]]))
        for part in parts
        for place in product(  # the walls that have the parameters which the part names
            *(
                [axis.index(part[name])] if name in part else range(len(axis))
                for name, axis in AXES.items()
            )
        )
    ]
    rows = [
        Row(
            about(place),
            f"safe area {share(wall)} with the wall, {share(none)} without",
            _within(part, wall, none),
        )
        for part, place, wall, none in compared
    ]
    helped, harmed = (
        [part for part, _, wall, none in compared if sign * (wall - none) > SMALL]
        for sign in (1.0, -1.0)
    )
    if examples:
        rows[:0] = [
            Row(what, f"{len(some)} of {len(compared)} spectra", bool(some))
            for what, some in (
                (f"{examples} may enlarge the safe area", helped),
                ("it may shrink it", harmed),
            )
        ]
    ratios = [wall / none if none else 1.0 for *_, wall, none in compared]
    return rows, {
        "helped": len(helped),
        "harmed": len(harmed),
        "harmed_first": harmed.count(parts[0]),
        "spectra": len(compared),
        "least_loss": share(1.0 - max(ratios)),
        "most_loss": share(1.0 - min(ratios)),
        "gain": share(max(ratios) - 1.0),
    }


def _within(part: Mapping[str, Any], wall: float, none: float) -> bool | None:
    """Whether the safe area with the wall is within a part's bounds; None where it has none."""
    judged = [
        holds(wall - part[name][0] * none, part[name][1])
        for name, holds in BOUNDS.items()
        if name in part
    ]
    return all(judged) if judged else None


def towards_the_wall(paper: Paper) -> Measured:
    """Count the nodes that overturn towards the wall: there must be none."""
    counts = [(place, np.sum(paper.outcomes[place] == (LEFT, RIGHT)[place[0]])) for place in WALLS]
    return [Row(about(place), f"{n} nodes", bool(n == 0)) for place, n in counts], {}


def matters_most(paper: Paper, most: str) -> Measured:
    """Nodes safe in only one of two spectra that differ in one parameter: mean over all pairs.

    By parameter; the one called `most` must have the largest mean.
    """
    means = {
        axis: float(np.mean([np.mean(one != other) for one, other in combinations(safe, 2)]))
        for axis, safe in ((axis, np.moveaxis(paper.safe, k, 0)) for k, axis in enumerate(AXES))
    }
    return [
        Row(most, f"{share(means[most])} of the nodes"),
        *(Row(axis, share(n), means[most] > n) for axis, n in means.items() if axis != most),
    ], {"means": ", ".join(f"{axis} {share(mean)}" for axis, mean in means.items())}


def side_decides(paper: Paper) -> Measured:
    """Nodes that are safe with the wall on one side only, at either friction."""
    depends = np.mean(paper.safe[0] != paper.safe[1], axis=(-2, -1))
    return [
        Row(
            about((None, None, gap, e)),
            f"the side decides at {share(low)} of the nodes at μ 0.3, at {share(high)} at μ 0.6",
            bool(low > high),
        )
        for gap, e in np.ndindex(*SIZES[2:])
        for low, high in (depends[:, gap, e],)
    ], {}


def one_impact(paper: Paper) -> Measured:
    """Share of the nodes overturning with one impact without the wall that the wall makes safe."""
    rows, shares, f = [], [], paper.frequencies
    ranges = ONE_IMPACT, (ONE_IMPACT[1], ONE_IMPACT[1] + 1.0)
    for (mu, tongue), (low, high) in product(sorted(paper.tongues.items()), ranges):
        nodes = tongue & ((f >= low) & (f <= high))
        safe = paper.safe[0, AXES["friction"].index(mu), 0, 0][nodes]
        part, where = float(np.mean(safe)) if safe.size else 0.0, f"ω_p/p {low:g} to {high:g}"
        rows.append(
            Row(
                f"μ {mu:g}, {where}",
                f"{safe.size} nodes without the wall, of which it makes {share(part)} safe",
                part > 0.5 if low == ONE_IMPACT[0] else None,
            )
        )
        shares.append(f"{share(part)} at μ = {mu:g} and {where}")
    return rows, {"shares": ", ".join(shares)}


def turns(paper: Paper, side: str, axes: Sequence[str]) -> Measured:
    """Count pairs of walls that differ in one parameter alone, of which one helps and one harms."""
    areas, alone = (np.mean(safe, axis=(-2, -1)) for safe in (paper.safe, paper.safe_alone))
    gains = (areas - alone[None, :, None, None])[AXES["side"].index(side)]
    rows = []
    for axis in axes:
        both = [
            np.stack(pair)
            for pair in combinations(np.moveaxis(gains, list(AXES).index(axis) - 1, 0), 2)
        ]
        turn = sum(int(((one.min(0) < -SMALL) & (one.max(0) > SMALL)).sum()) for one in both)
        rows.append(
            Row(
                f"{axis} alone",
                f"turns a benefit into harm, or back, in {turn} of"
                f" {sum(one[0].size for one in both)} pairs",
                turn > 0,
            )
        )
    return rows, {"turns": "; ".join(f"{row.what} {row.value}" for row in rows).capitalize()}


def least_amplitude(paper: Paper) -> Measured:
    """The lowest overturning amplitude on the scan, with walls against none."""
    walls = {wall: value for wall, value in paper.least.items() if wall}
    none = paper.least[None]
    return [
        Row("no wall", f"overturns from a_p = {none:.2f} g tan α"),
        *(
            Row(f"right wall, {1000 * gap:g} mm, e {e:g}", f"from {v:.2f} g tan α", v < none)
            for (gap, e), v in walls.items()
        ),
    ], {
        "without": none,
        "walls": ", ".join(f"{value:.1f} (e = {e:g})" for (_, e), value in walls.items()),
    }


def restitution_rules(paper: Paper) -> Measured:
    """Largest share of nodes that differ between two gaps, against that between e, at mu = 0.6."""
    safe = paper.safe[:, 1]
    by_gap, by_e = (
        [np.max([np.mean(a != b, axis=(-2, -1)) for a, b in combinations(one, 2)]) for one in some]
        for some in (safe, safe.swapaxes(1, 2))
    )
    return [
        Row(
            f"{side} wall, μ 0.6",
            f"the safe region differs at up to {share(gaps)} of the nodes between gaps,"
            f" at up to {share(e)} between e",
            bool(gaps < e),
        )
        for side, gaps, e in zip(AXES["side"], by_gap, by_e, strict=True)
    ], {"gaps": share(max(by_gap)), "e": share(max(by_e))}


def likelier_side(paper: Paper) -> Measured:
    """Nodes that overturn clockwise against counterclockwise without a wall.

    Up to an amplitude, up to a frequency, and in all.
    """
    rows, ends, whole, a = [], [], [], paper.amplitudes
    for mu, outcomes, falls in zip(AXES["friction"], paper.alone, paper.falls_alone, strict=True):
        left, right = (np.mean(outcomes == side, axis=1) for side in (LEFT, RIGHT))
        gain = np.cumsum(right - left) > 0.0  # over amplitudes from the lowest up to each
        until = a[np.flatnonzero(gain)[-1]] if gain.any() else 0.0
        # the lowest overturning by frequency, up to that at which the lead of one side is largest
        some = np.flatnonzero(falls.any(axis=0))
        clockwise = outcomes[np.argmax(falls, axis=0)[some], some] == RIGHT
        lead = np.cumsum(np.where(clockwise, 1, -1))
        count = int(np.argmax(lead)) + 1
        rows += [
            Row(
                f"μ {mu:g}, lower amplitudes",
                f"clockwise up to a_p of {until:.1f} g tan α",
                bool(until > 0.0),
            ),
            Row(
                f"μ {mu:g}, the lowest overturning",
                f"clockwise at {np.sum(clockwise[:count])} of {count} frequencies, up to ω_p/p of"
                f" {paper.frequencies[some[count - 1]]:.1f}",
                bool(lead[count - 1] > 0),
            ),
            Row(
                f"μ {mu:g}, a_p from {a[0]:g} to {a[-1]:g} g tan α",
                f"clockwise {share(right)} of the nodes, counterclockwise {share(left)}",
                bool(right.mean() > left.mean()),
            ),
        ]
        ends.append(f"{until:.1f} g tan α (μ = {mu:g})")
        whole.append(f"{share(right)} against {share(left)} of the nodes (μ = {mu:g})")
    # The mirror image: a right wall under the reversed pulse is a left wall under the pulse.
    wall, none = paper.safe[0, 0, 0, 0], paper.safe_alone[0]
    rows.append(
        Row(
            "with the pulse reversed: right wall, μ 0.3, 3 mm, e 0",
            f"safe area {share(wall)}, {share(none)} without",
        )
    )
    return rows, {
        "ends": " and ".join(ends),
        "whole": ", ".join(whole),
        "reversed": " With the pulse reversed it would be so over all of them, but then a right"
        " wall would shrink the safe area."
        if wall.mean() < none.mean()
        else "",
    }


def near_one_impact(spectrum: Spectrum) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The nodes (i, j) at omega_p/p from `ONE_IMPACT` to one more that overturn clockwise."""
    (low, high), f = ONE_IMPACT, spectrum.frequency_ratios
    return np.nonzero(  # type: ignore[return-value]
        (spectrum.outcomes == RIGHT) & (f >= low) & (f <= high + 1.0)
    )


# Findings beyond the paper: nodes that are gained, lost and otherwise safe, by place.


@dataclass(frozen=True)
class Beyond:
    """A finding that is not in the paper, the case that shows it best, and the nodes of its map.

    `case` is its place or friction in words, `figure` the paper's figure; `safe` excludes marked
    nodes. `rows` and `says` are as of any measure.
    """

    about: Mapping[str, Any]
    case: str
    figure: int
    gained: Mask
    lost: Mask
    safe: Mask
    rows: list[Row]
    says: dict[str, Any]

    @property
    def words(self) -> str:
        """The finding's text, filled in."""
        return str(
            self.about["words"].format(gained=self.gained.sum(), lost=self.lost.sum(), **self.says)
        )


def _figure(side: int, mu: int) -> int:
    shown = AXES["side"][side], AXES["friction"][mu]
    return next(figure for figure, one in FIGURES.items() if one == shown)


def _case(place: Place) -> str:
    side, mu, gap, e = (axis[n] for axis, n in zip(AXES.values(), place, strict=True))
    return f"{side} wall, {gap:g} mm, e = {e:g}, μ = {mu:g}"


def exchange(paper: Paper, sentence: Mapping[str, Any]) -> Beyond:
    """The wall that changes the safe area least, with the nodes that it saves and overturns."""
    alone, falls_alone = (
        mask[None, :, None, None] for mask in (paper.safe_alone, paper.falls_alone)
    )
    saved, lost = paper.safe & falls_alone, paper.falls & alone
    counts = {place: (int(saved[place].sum()), int(lost[place].sum())) for place in WALLS}
    place = min(counts, key=lambda one: abs(counts[one][0] - counts[one][1]))
    return Beyond(
        sentence,
        _case(place),
        _figure(*place[:2]),
        saved[place],
        lost[place],
        paper.safe[place] & ~saved[place],
        [
            Row(_case(one), f"saves at {m} nodes, overturns at {n}")
            for one, (m, n) in counts.items()
        ],
        {
            "with_wall": share(paper.safe[place]),
            "without": share(paper.safe_alone[place[1]]),
            "both": sum(m > 0 and n > 0 for m, n in counts.values()),
            "all": len(counts),
        },
    )


def either_side(paper: Paper, sentence: Mapping[str, Any]) -> Beyond:
    """Nodes at which the block stands alone, but falls beside a wall on either side."""
    alone, falls_alone = (mask[:, None, None] for mask in (paper.safe_alone, paper.falls_alone))
    harmed, helped = alone & paper.falls.all(axis=0), falls_alone & paper.safe.all(axis=0)
    places = list(np.ndindex(*SIZES[1:]))
    place = mu, gap, e = max(places, key=lambda one: int(harmed[one].sum()))
    return Beyond(
        sentence,
        f"{AXES['gap'][gap]:g} mm, e = {RESTITUTIONS[e]:g}, μ = {AXES['friction'][mu]:g}",
        _figure(1, mu),
        helped[place],
        harmed[place],
        paper.safe_alone[mu] & ~harmed[place],
        [
            Row(
                about((None, *one)),
                f"falls on either side at {harmed[one].sum()} nodes, saved at {helped[one].sum()}",
            )
            for one in places
        ],
        {},
    )


def stronger_is_safe(paper: Paper, sentence: Mapping[str, Any]) -> Beyond:
    """Nodes that are safe though a weaker pulse of the same frequency overturns the block."""
    above = paper.safe & np.logical_or.accumulate(paper.falls, axis=-2)
    alone = paper.safe_alone & np.logical_or.accumulate(paper.falls_alone, axis=-2)
    place = max(WALLS, key=lambda one: int(above[one].sum()))
    free = alone[place[1]]
    masks = [
        *((f"no wall, μ {mu:g}", mask) for mu, mask in zip(AXES["friction"], alone, strict=True)),
        *((_case(one), above[one]) for one in WALLS),
    ]
    return Beyond(
        sentence,
        _case(place),
        _figure(*place[:2]),
        above[place],
        np.zeros_like(free),
        paper.safe[place] & ~above[place],
        [
            Row(what, f"{mask.sum()} nodes, at {mask.any(axis=0).sum()} frequencies")
            for what, mask in masks
        ],
        {
            "frequencies": above[place].any(axis=0).sum(),
            "all": len(paper.frequencies),
            "free": free.sum(),
            "free_frequencies": free.any(axis=0).sum(),
        },
    )


SENTENCES = tomllib.loads((KEPT.parent / "paper" / "sentences.toml").read_text(encoding="utf-8"))
#: "Generally": in more than this share of the cases.
GENERALLY = 0.75
#: Most exceptions from a sentence that are named beside its verdict.
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
    """A sentence of the paper, the figures computed for it, and the verdict."""

    about: Mapping[str, Any]
    verdict: str
    finding: str
    rows: Sequence[Row]


def claims_of(paper: Paper) -> Iterator[Claim]:
    """The paper's sentences with their verdicts.

    A sentence holds if all its rows hold, or, where it says "generally", more than `GENERALLY` of
    them.
    """
    for about in SENTENCES["claim"]:
        rows, says = globals()[about["measure"]](paper, **about.get("with", {}))
        counts = Counter(map(operator.attrgetter("holds"), rows))
        held, judged = counts[True], counts[True] + counts[False]
        enough = held > GENERALLY * judged if "generally" in about else held == judged
        against = [row.what for row in rows if row.holds is False]
        said = about["finding"].format(held=held, all=judged, **says)
        if held and 0 < len(against) <= MOST_NAMED:
            said += f" Not so: {'; '.join(against)}."
        verdict = "holds" if enough else "holds in part" if held else "does not hold"
        yield Claim(about, verdict, said, rows)


def findings_of(paper: Paper) -> list[Beyond]:
    """Findings from the spectra that are not in the paper."""
    return [globals()[about["measure"]](paper, about) for about in SENTENCES["finding"]]


def blocks(paper: Paper, claims: Sequence[Claim]) -> Iterator[Block]:
    """The sentences with their verdicts, the safe areas behind most of them, and our findings."""
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
                *(claim.about[name] for name in ("sentence", "place")),
                Mark(claim.verdict, VERDICTS[claim.verdict]),
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
    gaps = AXES["gap"]
    areas, alone = (100.0 * safe.mean(axis=(-2, -1)) for safe in (paper.safe, paper.safe_alone))
    yield Plot(
        "safe-areas",
        panels=[
            Panel(
                f"Wall on the {side}",
                [
                    series
                    for mu, of_mu, free in zip(AXES["friction"], of_side, alone, strict=True)
                    for series in (
                        *(
                            Series(f"μ {mu:g}, e {e:g}", gaps, line)
                            for e, line in zip(RESTITUTIONS, of_mu.T.tolist(), strict=True)
                        ),
                        Series(f"μ {mu:g}, no wall", gaps, [float(free)] * len(gaps), style="dots"),
                    )
                ],
            )
            for side, of_side in zip(AXES["side"], areas, strict=True)
        ],
        x=Axis("gap, mm"),
        y=Axis("safe nodes, %"),
        note="Safe areas of all spectra.",
    )
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
        [[one.about["sentence"], f"{one.case} (Fig. {one.figure})", one.words] for one in found],
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
            "panels": [
                {
                    "title": one.case,
                    "free": True,
                    "outcomes": "".join(
                        np.select(
                            [one.lost, one.gained, one.safe], [LOST, GAINED, STANDS], FALLEN
                        ).ravel()
                    ),
                    "place": [0, 1, column],
                }
                for column, one in enumerate(found)
            ],
            "key": {FALLEN: "overturned", STANDS: "safe", GAINED: gained, LOST: lost},
        },
    )
    yield _rows("finding-figures", "All cases", {one.about["name"]: one.rows for one in found})


def _rows(name: str, title: str, of: Mapping[str, Sequence[Row]]) -> Table:
    words = {None: "", True: "holds", False: "does not hold"}
    return Table(
        name,
        [text("name", "of"), text("what"), text("value"), text("holds", "")],
        [
            [whose, row.what, row.value, Mark(words[row.holds], VERDICTS[words[row.holds]])]
            for whose, some in of.items()
            for row in some
        ],
        title,
        on="page",
        folded=True,
    )
