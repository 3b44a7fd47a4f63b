"""The paper's section 5 as a table: each sentence about the spectra with a verdict computed from the 28 spectra."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from rockcheck.ebm import Spectrum
from rockcheck.ebm.spectrum import LEFT, RIGHT, SAFE, node_scene
from rockcheck.scenes import Scene
from rockcheck.validation.discrepancy.figures import Stored
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.models import Model, build
from rockcheck.validation.spectra.study import AMPLITUDES, FIGURES, GAPS, RESTITUTIONS, SpectrumRequest, paper_panels
from rockcheck.validation.spectra.tiles import Tiles, tile_key

ClaimVerdict = Literal["holds", "holds in part", "does not hold"]
#: A change of the safe area of less than this share of the nodes is no change: a band one node wide along the boundary.
SMALL = 0.01
#: "High frequency" of the paper's sentences, omega_p/p.
HIGH_FREQUENCY = 3.0
#: So many exceptions from a sentence are named beside its verdict.
MOST_NAMED = 3
#: "Greatly": by at least this share of the unobstructed safe area.
GREATLY = 0.25
#: End of the scan at omega_p/p = 6, beyond the spectra's own range.
HIGHEST_SCANNED = 20.0
#: Where the paper's example of overturning with one impact lies, omega_p/p.
ONE_IMPACT = (2.0, 3.0)


class Row(Stored):
    """One figure behind a claim; `holds` None where it only informs."""

    what: str
    value: str
    holds: bool | None = None


class Claim(Stored):
    """A sentence of the paper's section 5, what was computed for it, and the verdict."""

    name: str
    sentence: str
    verdict: ClaimVerdict
    finding: str
    #: How the words were made into figures.
    criterion: str
    #: The paper's figures that show it.
    figures: tuple[int, ...]
    rows: tuple[Row, ...]


class Claims(Stored):
    """`claims.json`."""

    format: int = 1
    grid: str
    model: str
    claims: tuple[Claim, ...]


@dataclass(frozen=True)
class ExtraRuns:
    """What the claims need beyond the 28 spectra.

    `least_amplitudes`: the lowest overturning a_p/(g tan alpha) at omega_p/p = 6, mu = 0.3, by (gap, e) of a right wall, None
    without one; infinite where none up to `HIGHEST_SCANNED` overturns. `one_impact`: by friction, the nodes around `ONE_IMPACT`
    at which the free block overturns clockwise after exactly one floor impact.
    """

    least_amplitudes: Mapping[tuple[float, float] | None, float]
    one_impact: Mapping[float, NDArray[np.bool_]]


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

    def area(self, spectrum: Spectrum, *, above: float = 0.0) -> float:
        """Share of safe nodes at omega_p/p > `above`."""
        return float(np.mean(spectrum.safe[:, self.frequencies > above]))


def check_claims(spectra: Sequence[Spectrum], extra: ExtraRuns) -> tuple[Claim, ...]:
    """The claims, judged by the 28 spectra on one grid and a closer look at one frequency."""
    paper = Paper(spectra)
    return (
        _lower_friction(paper),
        _lower_restitution(paper),
        _smaller_gap(paper),
        _left_wall_high_frequency(paper),
        _one_impact(paper, extra),
        _right_wall_near(paper),
        _right_wall_far(extra.least_amplitudes),
        _restitution_rules(paper),
        _high_friction_benefit(paper),
        _likelier_side(paper),
    )


def extra_runs(spectra: Sequence[Spectrum], tiles: Tiles, request: SpectrumRequest) -> ExtraRuns:
    """Plays what the claims need beyond the 28 spectra, by the model asked."""
    amplitudes = np.arange(AMPLITUDES[0], HIGHEST_SCANNED + 0.005, 0.01)
    least: dict[tuple[float, float] | None, float] = {}
    for panel in paper_panels(8):
        if panel.wall is None or panel.wall.gap == GAPS[-1]:
            sides, _ = tiles.play(panel.scene, amplitudes, np.full(len(amplitudes), 6.0), model=request.model, settings=request.settings)
            key = (panel.wall.gap, panel.wall.restitution) if panel.wall else None
            least[key] = float(amplitudes[np.argmax(sides != SAFE)]) if (sides != SAFE).any() else math.inf
    free = [spectrum for spectrum in spectra if not spectrum.scene.walls]
    return ExtraRuns(least, {one.scene.floor.friction: _with_one_impact(one, tiles, request) for one in free})


def _with_one_impact(spectrum: Spectrum, tiles: Tiles, request: SpectrumRequest) -> NDArray[np.bool_]:
    """The nodes at omega_p/p from `ONE_IMPACT` to one more that overturn clockwise after exactly one floor impact."""
    near = (spectrum.frequency_ratios >= ONE_IMPACT[0]) & (spectrum.frequency_ratios <= ONE_IMPACT[1] + 1.0)
    nodes = np.argwhere((spectrum.outcomes == RIGHT) & near)
    amplitudes, frequencies = spectrum.amplitude_ratios[nodes[:, 0]], spectrum.frequency_ratios[nodes[:, 1]]

    def find() -> dict[str, Any]:
        model = build(request.model, request.settings)
        return {"one": [_impacts(model, spectrum.scene, a, f) == 1 for a, f in zip(amplitudes, frequencies, strict=True)]}

    key = tile_key(spectrum.scene, amplitudes, frequencies, request.model, request.settings)
    one = tiles.remembered(f"{key}--one-impact-{provenance.code_digest(__name__)}", find)["one"]
    found = np.zeros(spectrum.outcomes.shape, dtype=bool)
    found[tuple(nodes[np.array(one, dtype=bool)].T)] = True
    return found


def _impacts(model: Model, scene: Scene, amplitude: float, frequency: float) -> int:
    """Floor impacts until the outcome at a node is decided."""
    node = node_scene(scene, float(amplitude), float(frequency))
    history = model.simulate(node.replace(output_step=node.duration))
    return sum(event.kind == "floor impact" for event in history.event_list)


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


def _judged(name: str, sentence: str, finding: str, criterion: str, figures: Sequence[int], rows: Sequence[Row]) -> Claim:
    judged = [row.holds for row in rows if row.holds is not None]
    verdict: ClaimVerdict = "holds" if all(judged) else "holds in part" if any(judged) else "does not hold"
    against = [row.what for row in rows if row.holds is False]
    if any(judged) and 0 < len(against) <= MOST_NAMED:
        finding += f" Not so: {'; '.join(against)}."
    return Claim(
        name=name,
        sentence=sentence,
        verdict=verdict,
        finding=finding.format(held=sum(judged), all=len(judged)),
        criterion=criterion,
        figures=tuple(figures),
        rows=tuple(rows),
    )


def _lower_friction(paper: Paper) -> Claim:
    pairs = [("no wall", paper.free[0.3], paper.free[0.6])]
    for side, gap, e in itertools.product(("left", "right"), GAPS, RESTITUTIONS):
        pairs.append((_about(side=side, gap=gap, e=e), paper.walled[side, 0.3, gap, e], paper.walled[side, 0.6, gap, e]))
    return _judged(
        "lower friction",
        "Lower friction enlarges the safe area.",
        "Larger at μ = 0.3 than at 0.6 in {held} of {all} pairs.",
        "safe nodes at μ 0.3 against μ 0.6",
        tuple(FIGURES),
        _pairs(paper, pairs),
    )


def _lower_restitution(paper: Paper) -> Claim:
    pairs = [
        (_about(side=side, friction=mu, gap=gap), paper.walled[side, mu, gap, 0.0], paper.walled[side, mu, gap, 1.0])
        for (side, mu), gap in itertools.product(FIGURES.values(), GAPS)
    ]
    return _judged(
        "lower restitution",
        "A lower coefficient of restitution of the wall enlarges the safe area.",
        "Larger at e = 0 than at e = 1 in {held} of {all} pairs.",
        "safe nodes at e 0 against e 1",
        tuple(FIGURES),
        _pairs(paper, pairs),
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
        "A smaller gap enlarges the safe area.",
        "Larger at the smaller gap in {held} of {all} pairs.",
        "safe nodes at 3 against 53 mm, and 53 against 103 mm",
        tuple(FIGURES),
        _pairs(paper, pairs),
    )


def _compared(paper: Paper, walls: Sequence[tuple[str, float, float, float]], above: float, holds: Callable[[float], bool]) -> list[Row]:
    """Safe areas with a wall against none at omega_p/p > `above`; `holds` judges the gain (in shares of the nodes)."""
    rows = []
    for side, mu, gap, e in walls:
        with_wall, without = paper.area(paper.walled[side, mu, gap, e], above=above), paper.area(paper.free[mu], above=above)
        value = f"safe area {percent(with_wall)} with the wall, {percent(without)} without"
        rows.append(Row(what=_about(side=side, friction=mu, gap=gap, e=e), value=value, holds=holds(with_wall - without)))
    return rows


def _left_wall_high_frequency(paper: Paper) -> Claim:
    walls = [("left", mu, gap, e) for mu, gap, e in itertools.product((0.3, 0.6), GAPS, RESTITUTIONS)]
    return _judged(
        "left wall, high frequency",
        "A left wall shrinks the safe area at high frequency.",
        "Smaller than without a wall in {held} of {all} spectra.",
        f"safe nodes at ω_p/p > {HIGH_FREQUENCY:g}, with the wall against none",
        (6, 7),
        _compared(paper, walls, HIGH_FREQUENCY, lambda gain: gain < 0.0),
    )


def _one_impact(paper: Paper, extra: ExtraRuns) -> Claim:
    rows = []
    for mu, tongue in sorted(extra.one_impact.items()):
        safe = paper.walled["left", mu, GAPS[0], 0.0].safe
        for low, high in (ONE_IMPACT, (ONE_IMPACT[1], ONE_IMPACT[1] + 1.0)):
            there = tongue & ((paper.frequencies >= low) & (paper.frequencies <= high))
            share = float(np.mean(safe[there])) if there.any() else 0.0
            value = f"{np.sum(there)} nodes without the wall, of which it makes {percent(share)} safe"
            rows.append(Row(what=f"μ {mu:g}, ω_p/p {low:g} to {high:g}", value=value, holds=share > 0.5 if low == ONE_IMPACT[0] else None))
    return _judged(
        "overturning with one impact",
        "A left wall that is near enough takes away overturning with one impact in places, such as ω_p/p of 2 to 3 at 3 mm and e = 0.",
        "Most of it becomes safe with {held} of {all} coefficients of friction.",
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
        "At ω_p/p = 6 and μ = 0.3 a right wall at 103 mm lowers the least overturning amplitude.",
        "Lower with {held} of {all} coefficients of restitution.",
        "the lowest overturning amplitude on a scan by 0.01 at ω_p/p = 6, with the wall against none",
        (8,),
        rows,
    )


def _restitution_rules(paper: Paper) -> Claim:
    rows = []
    for side in ("left", "right"):
        safe = {(gap, e): paper.walled[side, 0.6, gap, e].safe for gap in GAPS for e in RESTITUTIONS}
        by_gap = max(float(np.mean(safe[a, e] != safe[b, e])) for a, b in itertools.combinations(GAPS, 2) for e in RESTITUTIONS)
        by_e = max(float(np.mean(safe[gap, 0.0] != safe[gap, 1.0])) for gap in GAPS)
        value = f"the safe region differs at up to {percent(by_gap)} of the nodes between gaps, at up to {percent(by_e)} between e"
        rows.append(Row(what=f"{side} wall, μ 0.6", value=value, holds=by_gap < by_e))
    return _judged(
        "restitution gives the shape",
        "At μ = 0.6 little but the coefficient of restitution affects the shape of the spectra.",
        "e changes the shape more than the gap does on {held} of {all} sides.",
        "nodes that are safe in one of two spectra only: the most between two gaps (at one e) against the most between e (at one gap)",
        (7, 9),
        rows,
    )


def _high_friction_benefit(paper: Paper) -> Claim:
    free = paper.area(paper.free[0.6], above=HIGH_FREQUENCY)
    soft, hard = ([("right", 0.6, gap, e) for gap in GAPS] for e in RESTITUTIONS)
    rows = [
        *_compared(paper, soft, HIGH_FREQUENCY, lambda gain: gain < 2.0 * SMALL),
        *_compared(paper, hard, HIGH_FREQUENCY, lambda gain: gain < -SMALL),
    ]
    harmed = sum(paper.area(paper.walled["right", 0.6, gap, 0.0], above=HIGH_FREQUENCY) < free - SMALL for gap in GAPS)
    return _judged(
        "high friction, high frequency",
        "At μ = 0.6 and ω_p/p > 3 a right wall is of almost no benefit with e = 0, and harmful with e = 1.",
        f"So in {{held}} of {{all}} spectra; with e = 0, too, it harms at {harmed} of {len(GAPS)} gaps.",
        f"safe nodes at ω_p/p > 3 against none: e 0 at most {2 * SMALL:.0%} of the nodes more, e 1 fewer by over {SMALL:.0%}",
        (9,),
        rows,
    )


def _likelier_side(paper: Paper) -> Claim:
    rows = []
    for mu, spectrum in sorted(paper.free.items()):
        left, right = (np.mean(spectrum.outcomes == side, axis=1) for side in (LEFT, RIGHT))
        gain = np.cumsum(right - left)  # over amplitudes from the lowest up to each
        until = paper.amplitudes[np.flatnonzero(gain > 0.0)[-1]] if np.any(gain > 0.0) else 0.0
        rows.append(Row(what=f"μ {mu:g}, lower amplitudes", value=f"clockwise up to a_p of {until:.1f} g tan α", holds=bool(until > 0.0)))
        rows.append(_lowest(mu, spectrum))
        value = f"clockwise {percent(float(np.mean(right)))} of the nodes, counterclockwise {percent(float(np.mean(left)))}"
        where = f"μ {mu:g}, a_p from {paper.amplitudes[0]:g} to {paper.amplitudes[-1]:g} g tan α"
        rows.append(Row(what=where, value=value, holds=bool(np.mean(right) > np.mean(left))))
    # The mirror image: a right wall under the reversed pulse is a left wall under the pulse.
    reversed_wall, free = paper.walled["left", 0.3, GAPS[0], 0.0].safe_area, paper.free[0.3].safe_area
    value = f"safe area {percent(reversed_wall)}, {percent(free)} without"
    rows.append(Row(what="with the pulse reversed: right wall, μ 0.3, 3 mm, e 0", value=value))
    finding = "It depends on the range, which the sentence does not give: so at lower amplitudes, not over all that are drawn."
    if reversed_wall < free:
        finding += " With the pulse reversed it would be so over all of them, but then a right wall would shrink the safe area."
    return _judged(
        "likelier side",
        "Without a wall the block overturns clockwise more often than counterclockwise.",
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
