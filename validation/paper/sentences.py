"""The paper's sentences about its spectra, each with a verdict and the figures behind it.

In: `Paper` and `data/paper/sentences.toml`. Out: `Claim`. Called by the study of spectra.
"""

import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rockcheck.validation.paper import KEPT, measures
from rockcheck.validation.paper.spectra import FRICTIONS, PANELS, SIDES, Mask, Paper

SENTENCES = tomllib.loads((KEPT.parent / "paper" / "sentences.toml").read_text(encoding="utf-8"))
#: "Generally": in more than this share of the cases.
GENERALLY = 0.75
#: Most exceptions from a sentence that are named beside its verdict.
MOST_NAMED = 3


@dataclass(frozen=True)
class Evidence:
    """One figure behind a sentence; `holds` None where it only informs."""

    case: str
    value: str
    holds: bool | None = None


@dataclass(frozen=True)
class Reading:
    """What a measure gives for a sentence: figures, and the values for the finding's text."""

    evidence: list[Evidence]
    values: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, the figures computed for it, and the verdict."""

    about: Mapping[str, Any]
    verdict: str
    finding: str
    evidence: Sequence[Evidence]


def percent(share: float) -> str:
    """A share in percent, one decimal."""
    return f"{100.0 * share:.1f} %"


def pairs(paper: Paper, axis: str, free: bool = False) -> Reading:
    """Each value of a parameter, which the paper calls safer, against the next one."""
    compared = measures.neighbours(paper, axis)
    if free:
        compared.insert(0, measures.free_pair(paper))
    return Reading([_pair(paper, pair, axis) for pair in compared])


def _pair(paper: Paper, pair: measures.SafePair, axis: str) -> Evidence:
    case = "no wall"
    if pair.first and pair.second:
        case = pair.first.words(axis)
        if axis == "gap":
            case += f": {pair.first.gap:g} against {pair.second.gap:g} mm"
    safer, other = percent(measures.area(pair.safer)), percent(measures.area(pair.other))
    value = f"safe area {safer} against {other}; {_opposite(paper, ~pair.safer & pair.other)}"
    return Evidence(case, value, pair.agrees)


def _opposite(paper: Paper, nodes: Mask) -> str:
    """Where in the spectrum the opposite of a sentence is true."""
    i, j = np.nonzero(nodes)
    if not i.size:
        return "nowhere the opposite"
    f, a = paper.frequencies[j], paper.amplitudes[i]
    return (
        f"the opposite at {percent(i.size / nodes.size)} of the nodes,"
        f" ω_p/p {f.min():.1f} to {f.max():.1f}, amplitude {a.min():.1f} to {a.max():.1f}"
    )


def against_none(
    paper: Paper, parts: Sequence[Mapping[str, Any]], above: float = 0.0, examples: str = ""
) -> Reading:
    """Safe areas with walls against none, at omega_p/p > `above`.

    `parts` are tables of `measures.WallGroup`. With `examples`, words for the walls, one at least
    must help, and one harm.
    """
    groups = [measures.WallGroup.from_table(part) for part in parts]
    changes = measures.area_changes(paper, groups, above)
    helped = [change for change in changes if change.gain > measures.SMALL]
    harmed = [change for change in changes if -change.gain > measures.SMALL]
    evidence = []
    if examples:
        evidence = [
            Evidence(
                f"{examples} may enlarge the safe area",
                f"{len(helped)} of {len(changes)} spectra",
                bool(helped),
            ),
            Evidence("it may shrink it", f"{len(harmed)} of {len(changes)} spectra", bool(harmed)),
        ]
    evidence += [_area_change(change) for change in changes]
    largest = max(change.ratio for change in changes)
    smallest = min(change.ratio for change in changes)
    return Reading(
        evidence,
        {
            "helped": str(len(helped)),
            "harmed": str(len(harmed)),
            "harmed_first": str(sum(change.group is groups[0] for change in harmed)),
            "spectra": str(len(changes)),
            "least_loss": percent(1.0 - largest),
            "most_loss": percent(1.0 - smallest),
            "gain": percent(largest - 1.0),
        },
    )


def _area_change(change: measures.AreaChange) -> Evidence:
    return Evidence(
        change.panel.words(),
        f"safe area {percent(change.with_wall)} with the wall, {percent(change.without)} without",
        change.group.is_met(change.with_wall, change.without),
    )


def towards_the_wall(paper: Paper) -> Reading:
    """No node overturns towards the wall."""
    counts = measures.overturned_towards_the_wall(paper)
    return Reading(
        [Evidence(panel.words(), f"{count} nodes", count == 0) for panel, count in counts.items()]
    )


def matters_most(paper: Paper, most: str) -> Reading:
    """A change of the parameter `most` changes more nodes than that of any other."""
    means = measures.mean_changes(paper)
    evidence = [Evidence(most, f"{percent(means[most])} of the nodes")]
    evidence += [
        Evidence(axis, percent(mean), means[most] > mean)
        for axis, mean in means.items()
        if axis != most
    ]
    words = ", ".join(f"{axis} {percent(mean)}" for axis, mean in means.items())
    return Reading(evidence, {"means": words})


def side_decides(paper: Paper) -> Reading:
    """The side decides at more nodes at the lower friction."""
    return Reading(
        [
            Evidence(
                effect.panel.words("side", "friction"),
                f"the side decides at {percent(effect.low)} of the nodes at μ 0.3,"
                f" at {percent(effect.high)} at μ 0.6",
                effect.low > effect.high,
            )
            for effect in measures.side_effects(paper)
        ]
    )


def one_impact(paper: Paper) -> Reading:
    """The near left wall makes safe most nodes that overturn with one impact without it."""
    evidence, shares = [], []
    for result in measures.one_impact_nodes(paper):
        where = f"ω_p/p {result.low:g} to {result.high:g}"
        made_safe = percent(result.made_safe)
        evidence.append(
            Evidence(
                f"μ {result.friction:g}, {where}",
                f"{result.nodes} nodes without the wall, of which it makes {made_safe} safe",
                result.made_safe > 0.5 if result.is_example else None,
            )
        )
        shares.append(f"{made_safe} at μ = {result.friction:g} and {where}")
    return Reading(evidence, {"shares": ", ".join(shares)})


def turns(paper: Paper, side: str, axes: Sequence[str]) -> Reading:
    """Each of these parameters alone turns a wall that helps into one that harms, somewhere."""
    evidence = []
    for axis in axes:
        turning, compared = measures.turning_pairs(paper, side, axis)
        value = f"turns a benefit into harm, or back, in {turning} of {compared} pairs"
        evidence.append(Evidence(f"{axis} alone", value, turning > 0))
    words = "; ".join(f"{figure.case} {figure.value}" for figure in evidence)
    return Reading(evidence, {"turns": words.capitalize()})


def least_amplitude(paper: Paper) -> Reading:
    """The lowest overturning amplitude on the scan is lower with walls than without."""
    without = paper.least[None]
    evidence = [Evidence("no wall", f"overturns from a_p = {without:.2f} g tan α")]
    words = []
    for wall, amplitude in paper.least.items():
        if wall is None:
            continue
        gap, e = wall
        case = f"right wall, {1000 * gap:g} mm, e {e:g}"
        evidence.append(Evidence(case, f"from {amplitude:.2f} g tan α", amplitude < without))
        words.append(f"{amplitude:.1f} (e = {e:g})")
    return Reading(evidence, {"without": f"{without:.1f}", "walls": ", ".join(words)})


def restitution_rules(paper: Paper) -> Reading:
    """At the high friction restitution changes more nodes than the gap does."""
    friction = FRICTIONS[-1]
    by_gap = {side: measures.largest_change(paper, "gap", side, friction) for side in SIDES}
    by_e = {side: measures.largest_change(paper, "restitution", side, friction) for side in SIDES}
    evidence = [
        Evidence(
            f"{side} wall, μ {friction:g}",
            f"the safe region differs at up to {percent(by_gap[side])} of the nodes between gaps,"
            f" at up to {percent(by_e[side])} between e",
            by_gap[side] < by_e[side],
        )
        for side in SIDES
    ]
    largest = {"gaps": percent(max(by_gap.values())), "e": percent(max(by_e.values()))}
    return Reading(evidence, largest)


def likelier_side(paper: Paper) -> Reading:
    """Without a wall more nodes overturn clockwise than counterclockwise.

    Up to an amplitude, up to a frequency, and in all.
    """
    evidence, ends, whole = [], [], []
    for result in measures.likelier_sides(paper):
        evidence += _likelier_side(paper, result)
        mu = f"(μ = {result.friction:g})"
        ends.append(f"{result.amplitude:.1f} g tan α {mu}")
        whole.append(f"{percent(result.right)} against {percent(result.left)} of the nodes {mu}")
    # The mirror image: a right wall under the reversed pulse is a left wall under the pulse.
    nearest = PANELS[0]
    with_wall = measures.area(paper.safe[nearest])
    without = measures.area(paper.safe_alone[nearest.friction])
    evidence.append(
        Evidence(
            f"with the pulse reversed: right wall, {nearest.words('side')}",
            f"safe area {percent(with_wall)}, {percent(without)} without",
        )
    )
    is_harmed = (
        " With the pulse reversed it would be so over all of them, but then a right wall would"
        " shrink the safe area."
    )
    return Reading(
        evidence,
        {
            "ends": " and ".join(ends),
            "whole": ", ".join(whole),
            "reversed": is_harmed if with_wall < without else "",
        },
    )


def _likelier_side(paper: Paper, result: measures.LikelierSide) -> list[Evidence]:
    mu, a = f"μ {result.friction:g}", paper.amplitudes
    return [
        Evidence(
            f"{mu}, lower amplitudes",
            f"clockwise up to a_p of {result.amplitude:.1f} g tan α",
            result.amplitude > 0.0,
        ),
        Evidence(
            f"{mu}, the lowest overturning",
            f"clockwise at {result.clockwise} of {result.frequencies} frequencies,"
            f" up to ω_p/p of {result.frequency:.1f}",
            result.lead > 0,
        ),
        Evidence(
            f"{mu}, a_p from {a[0]:g} to {a[-1]:g} g tan α",
            f"clockwise {percent(result.right)} of the nodes,"
            f" counterclockwise {percent(result.left)}",
            result.right > result.left,
        ),
    ]


#: The measures of a sentence, by their names in `sentences.toml`. Each takes the spectra and the
#: arguments of the table `with`.
MEASURES: dict[str, Callable[..., Reading]] = {
    "pairs": pairs,
    "against_none": against_none,
    "towards_the_wall": towards_the_wall,
    "matters_most": matters_most,
    "side_decides": side_decides,
    "one_impact": one_impact,
    "turns": turns,
    "least_amplitude": least_amplitude,
    "restitution_rules": restitution_rules,
    "likelier_side": likelier_side,
}


def claims_of(paper: Paper) -> Iterator[Claim]:
    """The paper's sentences with their verdicts.

    A sentence holds if all its figures hold, or, where it says "generally", more than `GENERALLY`
    of them.
    """
    for about in SENTENCES["claim"]:
        measure = MEASURES[about["measure"]]
        reading = measure(paper, **about.get("with", {}))
        yield _claim(about, reading)


def _claim(about: Mapping[str, Any], reading: Reading) -> Claim:
    judged = [figure for figure in reading.evidence if figure.holds is not None]
    exceptions = [figure.case for figure in judged if not figure.holds]
    held = len(judged) - len(exceptions)
    finding = about["finding"].format(held=held, all=len(judged), **reading.values)
    if held and 0 < len(exceptions) <= MOST_NAMED:
        finding += f" Not so: {'; '.join(exceptions)}."
    is_enough = held > GENERALLY * len(judged) if "generally" in about else not exceptions
    verdict = "does not hold"
    if is_enough:
        verdict = "holds"
    elif held:
        verdict = "holds in part"
    return Claim(about, verdict, finding, reading.evidence)
