"""The paper's section 5 and conclusions as a table: each sentence about the spectra with a verdict computed from the 28 spectra."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE
from rockcheck.scenes import Scene
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.paper.panels import AMPLITUDES, FIGURES, GAPS, RESTITUTIONS

ClaimVerdict = Literal["holds", "holds in part", "does not hold"]
#: A change of the safe area of less than this share of the nodes is no change: a band one node wide along the boundary.
SMALL = 0.01
#: "High frequency" of the paper's sentences, omega_p/p.
HIGH_FREQUENCY = 3.0
#: So many exceptions from a sentence are named beside its verdict.
MOST_NAMED = 3
#: "Generally": in more than this share of the cases.
GENERALLY = 0.75
#: "Significantly": by more than this share of the unobstructed safe area.
SIGNIFICANTLY = 0.1
#: "Greatly": by at least this share of the unobstructed safe area.
GREATLY = 0.25
#: The amplitudes that are scanned, beyond the spectra's own range, and at which omega_p/p.
SCANNED, SCANNED_AT = np.arange(AMPLITUDES[0], 20.005, 0.01), 6.0
#: Where the paper says it: the paragraphs of its section 5 on the wall, on all parameters and on each, and of its conclusions.
WALL, PARAMETERS, EACH, CONCLUSIONS = (
    "section 5, 3rd paragraph",
    "section 5, 4th paragraph",
    "section 5, 5th paragraph",
    "conclusions, 3rd paragraph",
)
#: Where the paper's example of overturning with one impact lies, omega_p/p.
ONE_IMPACT = (2.0, 3.0)


class Row(Stored):
    """One figure behind a claim; `holds` None where it only informs."""

    what: str
    value: str
    holds: bool | None = None


class Claim(Stored):
    """A sentence of the paper, what was computed for it, and the verdict."""

    name: str
    sentence: str
    #: Where the paper says it.
    place: str = ""
    verdict: ClaimVerdict
    finding: str
    #: How the words were made into figures.
    criterion: str
    #: The paper's figures that show it.
    figures: tuple[int, ...]
    rows: tuple[Row, ...]


class Paper:
    """The 28 spectra by wall, friction, gap and restitution."""

    def __init__(self, spectra: Sequence[Spectrum]) -> None:
        self.walled: dict[tuple[str, float, float, float], Spectrum] = {}
        self.free: dict[float, Spectrum] = {}
        for spectrum in spectra:
            friction = spectrum.scene.floor.friction
            if not spectrum.scene.walls:
                self.free[friction] = spectrum
            else:
                wall = spectrum.scene.walls[0]
                self.walled[wall.side, friction, wall.gap, wall.restitution] = spectrum
        self.frequencies: NDArray[np.float64] = spectra[0].frequency_ratios
        self.amplitudes: NDArray[np.float64] = spectra[0].amplitude_ratios

    def walls(self, *, side: str | None = None) -> list[tuple[str, float, float, float]]:
        """All walls (side, mu, gap, e), or those on one side."""
        return [key for key in self.walled if side in (None, key[0])]

    def area(self, spectrum: Spectrum, *, above: float = 0.0) -> float:
        """Share of safe nodes at omega_p/p > `above`."""
        return float(np.mean(spectrum.safe[:, self.frequencies > above]))


def check_claims(
    spectra: Sequence[Spectrum],
    least: Mapping[tuple[float, float] | None, float],
    one_impact: Mapping[float, NDArray[np.bool_]],
) -> tuple[Claim, ...]:
    """The claims, judged by the 28 spectra on one grid, and by what they need beyond these.

    `least`: the lowest overturning a_p/(g tan alpha) of `SCANNED` by (gap, e) of a right wall, None
    without one; infinite where none overturns. `one_impact`: by friction, the nodes of
    `near_one_impact` at which the free block overturns after exactly one floor impact.
    """
    paper = Paper(spectra)
    return (
        _lower_friction(paper),
        _lower_restitution(paper),
        _smaller_gap(paper),
        _wall_side_prevented(paper),
        _side_matters_most(paper),
        _side_and_friction(paper),
        _left_wall(paper),
        _left_wall_high_frequency(paper),
        _one_impact(paper, one_impact),
        _right_wall_no_guarantee(paper),
        _right_wall_depends(paper),
        _right_wall_near(paper),
        _right_wall_far(least),
        _restitution_rules(paper),
        _high_friction_benefit(paper),
        _likelier_side(paper),
    )


def wall_of(scene: Scene) -> tuple[float, float] | None:
    """Gap and restitution of the wall, None without one."""
    return (scene.walls[0].gap, scene.walls[0].restitution) if scene.walls else None


def is_scanned(scene: Scene) -> bool:
    """Whether it is one of the scenes whose lowest overturning amplitude is looked for."""
    if scene.floor.friction != 0.3:
        return False
    return not scene.walls or (scene.walls[0].side, scene.walls[0].gap) == ("right", GAPS[-1])


def near_one_impact(spectrum: Spectrum) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The nodes (i, j) at omega_p/p from `ONE_IMPACT` to one more that overturn clockwise."""
    f = spectrum.frequency_ratios
    near = (f >= ONE_IMPACT[0]) & (f <= ONE_IMPACT[1] + 1.0)
    return np.nonzero((spectrum.outcomes == RIGHT) & near)  # type: ignore[return-value]


def _pairs(paper: Paper, pairs: Sequence[tuple[str, Spectrum, Spectrum]]) -> tuple[Row, ...]:
    """Each pair (what, the one said to be safer, the other) as a row: areas, and the nodes where the opposite holds."""
    rows = []
    for what, safer, other in pairs:
        i, j = np.nonzero(~safer.safe & other.safe)
        gain = safer.safe_area - other.safe_area
        value = f"safe area {percent(safer.safe_area)} against {percent(other.safe_area)}; "
        if len(i):
            f, a = paper.frequencies[j], paper.amplitudes[i]
            value += f"the opposite at {percent(len(i) / safer.outcomes.size)} of the nodes, ω_p/p {f.min():.1f} to {f.max():.1f},"
            value += f" amplitude {a.min():.1f} to {a.max():.1f}"
        else:
            value += "nowhere the opposite"
        rows.append(Row(what=what, value=value, holds=gain > 0.0))
    return tuple(rows)


def _judged(
    name: str,
    sentence: str,
    place: str,
    finding: str,
    criterion: str,
    figures: Sequence[int],
    rows: Sequence[Row],
    *,
    generally: bool = False,
) -> Claim:
    """A claim with its verdict: "holds" where all rows do, or, of what is said to be so generally, more than `GENERALLY` of them."""
    judged = [row.holds for row in rows if row.holds is not None]
    enough = sum(judged) > GENERALLY * len(judged) if generally else all(judged)
    verdict: ClaimVerdict = "holds" if enough else "holds in part" if any(judged) else "does not hold"
    against = [row.what for row in rows if row.holds is False]
    if any(judged) and 0 < len(against) <= MOST_NAMED:
        finding += f" Not so: {'; '.join(against)}."
    return Claim(
        name=name,
        sentence=sentence,
        place=place,
        verdict=verdict,
        finding=finding.format(held=sum(judged), all=len(judged)),
        criterion=criterion + (f"; generally: in more than {GENERALLY:.0%} of the cases" if generally else ""),
        figures=tuple(figures),
        rows=tuple(rows),
    )


def _lower_friction(paper: Paper) -> Claim:
    pairs = [("no wall", paper.free[0.3], paper.free[0.6])]
    for side, gap, e in itertools.product(("left", "right"), GAPS, RESTITUTIONS):
        pairs.append((_about(side=side, gap=gap, e=e), paper.walled[side, 0.3, gap, e], paper.walled[side, 0.6, gap, e]))
    return _judged(
        "lower friction",
        "Lower friction generally enlarges the safe area.",
        f"{PARAMETERS}; {CONCLUSIONS}",
        "Larger at μ = 0.3 than at 0.6 in {held} of {all} pairs.",
        "safe nodes at μ 0.3 against μ 0.6",
        tuple(FIGURES),
        _pairs(paper, pairs),
        generally=True,
    )


def _lower_restitution(paper: Paper) -> Claim:
    pairs = [
        (_about(side=side, friction=mu, gap=gap), paper.walled[side, mu, gap, 0.0], paper.walled[side, mu, gap, 1.0])
        for (side, mu), gap in itertools.product(FIGURES.values(), GAPS)
    ]
    return _judged(
        "lower restitution",
        "A lower coefficient of restitution of the wall generally enlarges the safe area.",
        f"{PARAMETERS}; {CONCLUSIONS}",
        "Larger at e = 0 than at e = 1 in {held} of {all} pairs.",
        "safe nodes at e 0 against e 1",
        tuple(FIGURES),
        _pairs(paper, pairs),
        generally=True,
    )


def _smaller_gap(paper: Paper) -> Claim:
    pairs = [
        (
            f"{_about(side=side, friction=mu, e=e)}: {1000 * near:g} against {1000 * far:g} mm",
            paper.walled[side, mu, near, e],
            paper.walled[side, mu, far, e],
        )
        for (side, mu), e, (near, far) in itertools.product(FIGURES.values(), RESTITUTIONS, itertools.pairwise(GAPS))
    ]
    return _judged(
        "smaller gap",
        "A smaller gap generally enlarges the safe area.",
        f"{PARAMETERS}; {CONCLUSIONS}",
        "Larger at the smaller gap in {held} of {all} pairs.",
        "safe nodes at 3 against 53 mm, and 53 against 103 mm",
        tuple(FIGURES),
        _pairs(paper, pairs),
        generally=True,
    )


def _compared(
    paper: Paper, walls: Sequence[tuple[str, float, float, float]], above: float, holds: Callable[[float, float], bool | None]
) -> list[Row]:
    """Safe areas with a wall against none at omega_p/p > `above`; `holds` judges both (shares of the nodes)."""
    rows = []
    for side, mu, gap, e in walls:
        with_wall, without = paper.area(paper.walled[side, mu, gap, e], above=above), paper.area(paper.free[mu], above=above)
        value = f"safe area {percent(with_wall)} with the wall, {percent(without)} without"
        rows.append(Row(what=_about(side=side, friction=mu, gap=gap, e=e), value=value, holds=holds(with_wall, without)))
    return rows


def _wall_side_prevented(paper: Paper) -> Claim:
    rows = []
    for (side, mu, gap, e), spectrum in paper.walled.items():
        count = int(np.sum(spectrum.outcomes == (LEFT if side == "left" else RIGHT)))
        rows.append(Row(what=_about(side=side, friction=mu, gap=gap, e=e), value=f"{count} nodes", holds=count == 0))
    return _judged(
        "overturning towards the wall",
        "A left wall prevents overturning counterclockwise, a right one clockwise.",
        WALL,
        "So in {held} of {all} spectra.",
        "nodes that overturn towards the wall: none",
        tuple(FIGURES),
        rows,
    )


def _side_matters_most(paper: Paper) -> Claim:
    safe = {key: one.safe for key, one in paper.walled.items()}
    changes: dict[str, list[float]] = {"side": [], "friction": [], "gap": [], "restitution": []}
    for one, other in itertools.combinations(safe, 2):
        differ = [name for name, a, b in zip(("side", "friction", "gap", "restitution"), one, other, strict=True) if a != b]
        if len(differ) == 1:
            changes[differ[0]].append(float(np.mean(safe[one] != safe[other])))
    means = {name: float(np.mean(found)) for name, found in changes.items()}
    rows = [Row(what="side", value=f"{percent(means['side'])} of the nodes")]
    rows += [Row(what=name, value=f"{percent(means[name])}", holds=means["side"] > means[name]) for name in list(means)[1:]]
    shown = ", ".join(f"{name} {percent(mean)}" for name, mean in means.items())
    return _judged(
        "side matters most",
        "Of all parameters of the wall and the floor the side of the wall affects the shape of the spectra most.",
        f"{PARAMETERS}; {CONCLUSIONS}",
        f"Nodes that change between safe and overturned, in the mean: {shown}.",
        "nodes that are safe in one of two spectra only, mean over all pairs of spectra that differ in this parameter alone",
        tuple(FIGURES),
        rows,
    )


def _side_and_friction(paper: Paper) -> Claim:
    rows = []
    for gap, e in itertools.product(GAPS, RESTITUTIONS):
        low, high = (float(np.mean(paper.walled["left", mu, gap, e].safe != paper.walled["right", mu, gap, e].safe)) for mu in (0.3, 0.6))
        value = f"the side decides at {percent(low)} of the nodes at μ 0.3, at {percent(high)} at μ 0.6"
        rows.append(Row(what=f"{1000 * gap:g} mm, e {e:g}", value=value, holds=low > high))
    return _judged(
        "side and friction",
        "The effects of the side are generally more evident at μ = 0.3 than at 0.6.",
        EACH,
        "More nodes depend on the side at μ = 0.3 in {held} of {all} pairs.",
        "nodes that are safe with the wall on one side only, at μ 0.3 against μ 0.6",
        tuple(FIGURES),
        rows,
        generally=True,
    )


def _left_wall(paper: Paper) -> Claim:
    return _judged(
        "left wall",
        "A wall on the left, the side to which the free block is less likely to overturn, harms stability.",
        CONCLUSIONS,
        "The safe area is smaller than without a wall in {held} of {all} spectra. Which side is likelier depends on the range: see there.",
        "safe nodes with the wall against none",
        (6, 7),
        _compared(paper, paper.walls(side="left"), 0.0, lambda with_wall, without: with_wall < without),
    )


def _right_wall_no_guarantee(paper: Paper) -> Claim:
    walls = paper.walls(side="right")
    gains = [paper.walled[key].safe_area - paper.free[key[1]].safe_area for key in walls]
    harm, help_ = sum(gain < -SMALL for gain in gains), sum(gain > SMALL for gain in gains)
    rows = [
        Row(what="a right wall may enlarge the safe area", value=f"{help_} of {len(gains)} spectra", holds=help_ > 0),
        Row(what="it may shrink it", value=f"{harm} of {len(gains)} spectra", holds=harm > 0),
        *_compared(paper, walls, 0.0, lambda *_: None),
    ]
    return _judged(
        "right wall, no guarantee",
        "A wall on the right, where one would expect it to help, does not necessarily improve stability.",
        f"{PARAMETERS}; {CONCLUSIONS}",
        f"The safe area is larger than without a wall in {help_} of {len(gains)} spectra, smaller in {harm}.",
        f"some spectra with more safe nodes than without a wall, and some with fewer, by over {SMALL:.0%} of all nodes",
        (8, 9),
        rows,
    )


def _right_wall_depends(paper: Paper) -> Claim:
    gains = {key[1:]: paper.walled[key].safe_area - paper.free[key[1]].safe_area for key in paper.walls(side="right")}
    rows = []
    for name, at in (("friction", 0), ("gap", 1)):
        pairs = [pair for pair in itertools.combinations(gains, 2) if [k for k in range(3) if pair[0][k] != pair[1][k]] == [at]]
        turns = sum(min(gains[a], gains[b]) < -SMALL and max(gains[a], gains[b]) > SMALL for a, b in pairs)
        value = f"turns a benefit into harm, or back, in {turns} of {len(pairs)} pairs"
        rows.append(Row(what=f"{name} alone", value=value, holds=turns > 0))
    return _judged(
        "right wall, what it depends on",
        "Whether a right wall helps depends on parameters such as friction and gap, together.",
        CONCLUSIONS,
        "; ".join(f"{row.what} {row.value}" for row in rows).capitalize() + ".",
        f"pairs of spectra that differ in this parameter alone: one safe area larger than without a wall, one smaller, by over {SMALL:.0%}",
        (8, 9),
        rows,
    )


def _left_wall_high_frequency(paper: Paper) -> Claim:
    walls = paper.walls(side="left")
    areas = [(paper.area(paper.walled[key], above=HIGH_FREQUENCY), paper.area(paper.free[key[1]], above=HIGH_FREQUENCY)) for key in walls]
    losses = [1.0 - with_wall / without if without > 0.0 else 0.0 for with_wall, without in areas]
    return _judged(
        "left wall, high frequency",
        "A left wall shrinks the safe area significantly at high frequency.",
        EACH,
        f"Smaller than without a wall in {{held}} of {{all}} spectra, by {percent(min(losses))} to {percent(max(losses))}.",
        f"safe nodes at ω_p/p > {HIGH_FREQUENCY:g}: more than {SIGNIFICANTLY:.0%} fewer than without a wall",
        (6, 7),
        _compared(paper, walls, HIGH_FREQUENCY, lambda with_wall, without: with_wall < (1.0 - SIGNIFICANTLY) * without),
    )


def _one_impact(paper: Paper, tongues: Mapping[float, NDArray[np.bool_]]) -> Claim:
    rows, shares = [], []
    for mu, tongue in sorted(tongues.items()):
        safe = paper.walled["left", mu, GAPS[0], 0.0].safe
        for low, high in (ONE_IMPACT, (ONE_IMPACT[1], ONE_IMPACT[1] + 1.0)):
            there = tongue & ((paper.frequencies >= low) & (paper.frequencies <= high))
            share = float(np.mean(safe[there])) if there.any() else 0.0
            value = f"{np.sum(there)} nodes without the wall, of which it makes {percent(share)} safe"
            rows.append(Row(what=f"μ {mu:g}, ω_p/p {low:g} to {high:g}", value=value, holds=share > 0.5 if low == ONE_IMPACT[0] else None))
            shares.append(f"{percent(share)} at μ = {mu:g} and ω_p/p {low:g} to {high:g}")
    return _judged(
        "overturning with one impact",
        "A left wall that is near enough takes away overturning with one impact in places, such as ω_p/p of 2 to 3 at 3 mm and e = 0.",
        EACH,
        f"Of the nodes that overturn so without the wall it makes safe {', '.join(shares)}.",
        "nodes that overturn clockwise after one floor impact without a wall: more than half of those at ω_p/p 2 to 3 are safe with it",
        (6, 7),
        rows,
    )


def _right_wall_near(paper: Paper) -> Claim:
    with_wall, without = paper.walled["right", 0.3, GAPS[0], 0.0].safe_area, paper.free[0.3].safe_area
    gain = with_wall / without - 1.0
    row = Row(
        what="right wall, μ 0.3, 3 mm, e 0", value=f"safe area {percent(with_wall)}, {percent(without)} without", holds=gain > GREATLY
    )
    return _judged(
        "right wall, near",
        "A right wall at 3 mm with e = 0 and μ = 0.3 enlarges the safe area greatly.",
        EACH,
        f"Larger by {percent(gain)}.",
        f"by more than {GREATLY:.0%} of the area without a wall",
        (8,),
        [row],
    )


def _right_wall_far(least: Mapping[tuple[float, float] | None, float]) -> Claim:
    rows = [Row(what="no wall", value=f"overturns from a_p = {least[None]:.2f} g tan α")]
    for key, value in least.items():
        if key is not None:
            rows.append(
                Row(what=f"right wall, {1000 * key[0]:g} mm, e {key[1]:g}", value=f"from {value:.2f} g tan α", holds=value < least[None])
            )
    return _judged(
        "right wall, far",
        "At high frequency, such as ω_p/p = 6, and μ = 0.3 a right wall at 103 mm lowers the least overturning amplitude.",
        EACH,
        f"From {least[None]:.1f} g tan α to {', '.join(f'{value:.1f} (e = {key[1]:g})' for key, value in least.items() if key)}.",
        "the lowest overturning amplitude on a scan by 0.01 at ω_p/p = 6, with the wall against none",
        (8,),
        rows,
    )


def _restitution_rules(paper: Paper) -> Claim:
    rows, most = [], {"gaps": 0.0, "e": 0.0}
    for side in ("left", "right"):
        safe = {(gap, e): paper.walled[side, 0.6, gap, e].safe for gap in GAPS for e in RESTITUTIONS}
        by_gap = max(float(np.mean(safe[a, e] != safe[b, e])) for a, b in itertools.combinations(GAPS, 2) for e in RESTITUTIONS)
        by_e = max(float(np.mean(safe[gap, 0.0] != safe[gap, 1.0])) for gap in GAPS)
        value = f"the safe region differs at up to {percent(by_gap)} of the nodes between gaps, at up to {percent(by_e)} between e"
        rows.append(Row(what=f"{side} wall, μ 0.6", value=value, holds=by_gap < by_e))
        most = {"gaps": max(most["gaps"], by_gap), "e": max(most["e"], by_e)}
    return _judged(
        "restitution gives the shape",
        "At μ = 0.6 little but the coefficient of restitution affects the shape of the spectra.",
        EACH,
        f"Between gaps the safe region differs at up to {percent(most['gaps'])} of the nodes, between e at up to {percent(most['e'])}.",
        "nodes that are safe in one of two spectra only: the most between two gaps (at one e) against the most between e (at one gap)",
        (7, 9),
        rows,
    )


def _high_friction_benefit(paper: Paper) -> Claim:
    free = paper.area(paper.free[0.6], above=HIGH_FREQUENCY)
    soft, hard = ([("right", 0.6, gap, e) for gap in GAPS] for e in RESTITUTIONS)
    rows = [
        *_compared(paper, soft, HIGH_FREQUENCY, lambda with_wall, without: with_wall - without < 2.0 * SMALL),
        *_compared(paper, hard, HIGH_FREQUENCY, lambda with_wall, without: with_wall - without < -SMALL),
    ]
    harmed = sum(paper.area(paper.walled["right", 0.6, gap, 0.0], above=HIGH_FREQUENCY) < free - SMALL for gap in GAPS)
    return _judged(
        "high friction, high frequency",
        "At μ = 0.6 and ω_p/p > 3 a right wall is of almost no benefit with e = 0, and harmful with e = 1.",
        EACH,
        f"So in {{held}} of {{all}} spectra. With e = 0, too, it harms at {harmed} of {len(GAPS)} gaps.",
        f"safe nodes at ω_p/p > 3 against none: e 0 at most {2 * SMALL:.0%} of the nodes more, e 1 fewer by over {SMALL:.0%}",
        (9,),
        rows,
    )


def _likelier_side(paper: Paper) -> Claim:
    rows, ends, whole = [], [], []
    for mu, spectrum in sorted(paper.free.items()):
        left, right = (np.mean(spectrum.outcomes == side, axis=1) for side in (LEFT, RIGHT))
        gain = np.cumsum(right - left)  # over amplitudes from the lowest up to each
        until = paper.amplitudes[np.flatnonzero(gain > 0.0)[-1]] if np.any(gain > 0.0) else 0.0
        rows.append(Row(what=f"μ {mu:g}, lower amplitudes", value=f"clockwise up to a_p of {until:.1f} g tan α", holds=bool(until > 0.0)))
        rows.append(_lowest(mu, spectrum))
        clockwise, other = (percent(float(np.mean(side))) for side in (right, left))
        where = f"μ {mu:g}, a_p from {paper.amplitudes[0]:g} to {paper.amplitudes[-1]:g} g tan α"
        value = f"clockwise {clockwise} of the nodes, counterclockwise {other}"
        rows.append(Row(what=where, value=value, holds=bool(np.mean(right) > np.mean(left))))
        ends.append(f"{until:.1f} g tan α (μ = {mu:g})")
        whole.append(f"{clockwise} against {other} of the nodes (μ = {mu:g})")
    # The mirror image: a right wall under the reversed pulse is a left wall under the pulse.
    reversed_wall, free = paper.walled["left", 0.3, GAPS[0], 0.0].safe_area, paper.free[0.3].safe_area
    value = f"safe area {percent(reversed_wall)}, {percent(free)} without"
    rows.append(Row(what="with the pulse reversed: right wall, μ 0.3, 3 mm, e 0", value=value))
    finding = f"It depends on the range, which the sentence does not give. Clockwise is likelier up to a_p of {' and '.join(ends)}."
    finding += f" Over all that is drawn it is clockwise {', '.join(whole)}."
    if reversed_wall < free:
        finding += " With the pulse reversed it would be so over all of them, but then a right wall would shrink the safe area."
    return _judged(
        "likelier side",
        "Without a wall the block is likelier to overturn clockwise than counterclockwise.",
        PARAMETERS,
        finding,
        "nodes that overturn clockwise against counterclockwise; signs as in (34), whose first strong lobe tips the block counterclockwise",
        (6, 7),
        rows,
    )


def _lowest(mu: float, spectrum: Spectrum) -> Row:
    """At how many frequencies the lowest overturning is clockwise, up to the one at which that side leads by most."""
    falls = spectrum.outcomes != SAFE
    some = np.flatnonzero(falls.any(axis=0))
    clockwise = spectrum.outcomes[np.argmax(falls, axis=0)[some], some] == RIGHT
    lead = np.cumsum(np.where(clockwise, 1, -1))
    count = int(np.argmax(lead)) + 1
    value = (
        f"clockwise at {np.sum(clockwise[:count])} of {count} frequencies, up to ω_p/p of {spectrum.frequency_ratios[some[count - 1]]:.1f}"
    )
    return Row(what=f"μ {mu:g}, the lowest overturning", value=value, holds=bool(lead[count - 1] > 0))


def percent(share: float) -> str:
    """A share in percent, one decimal."""
    return f"{100.0 * share:.1f} %"


def _about(*, side: str, friction: float | None = None, gap: float | None = None, e: float | None = None) -> str:
    parts = [f"{side} wall"]
    parts += [f"μ {friction:g}"] if friction is not None else []
    parts += [f"{1000 * gap:g} mm"] if gap is not None else []
    parts += [f"e {e:g}"] if e is not None else []
    return ", ".join(parts)
