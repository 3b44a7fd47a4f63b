"""Answers from the runs of an assessment, led by a sentence for an engineer's report."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes.experience import WIDTH, known, outside
from rockcheck.scenes.files import UncertainScene
from rockcheck.validation.criteria import CRITERIA
from rockcheck.validation.discrepancy.motion import QUANTITIES, spread
from rockcheck.validation.finding import (
    Axis,
    Block,
    Column,
    Finding,
    Mark,
    Panel,
    Plot,
    Series,
    Table,
    Text,
    text,
)
from rockcheck.validation.studies.population.runs import Played, Ran, Side, Sure
from rockcheck.validation.uncertainty.population import inputs_blocks, quantities_of, share_of

#: Name of the runs by the other law of impacts, among the models.
LAW = "impact law"
OUTCOMES = ("at rest", "moving", "overturned left", "overturned right")
#: A slip (m) or rotation (alpha) below this is none.
MOVED = 1e-9
#: Points of a history on the page.
POINTS = 400
#: What would change the answer, by the largest contribution.
WHAT_WOULD = {
    "records": "other records would change the answer most",
    "inputs": "knowing {} better would change the answer most",
    "numerical error": "a smaller step or tolerance would change the answer most",
    "model form": "another model would change the answer most",
    LAW: "another law of impacts would change the answer most",
}
#: What each contribution is, and what asks for it.
CONTRIBUTIONS = {
    "records": ("scatter between the records", "two records or more"),
    "inputs": ("draws of the scene's uncertain numbers", "--samples"),
    "numerical error": ("u_num of the model's own step or tolerance", "a model with a step"),
    "model form": ("difference of the other models", "--models"),
    LAW: ("half the difference between the laws of impacts", "a wall"),
}


#: The questions whose answers lead, as one would write them in a report.
LEADS = ("Does it fall?", "How far does it move?", "Which gap is safe?")
#: What is said where there is no answer.
ASKS = {
    "How far does it move?": "No run stands.",
    "Which gap is safe?": "Not asked for: --gaps 0,0.05,0.1.",
    "At which intensity does it fall?": "Not asked for: --levels pga:0.05:2:40.",
}


@dataclass(frozen=True, kw_only=True)
class Found:
    """The runs of an assessment, by the case: the scene under each of its motions.

    `drawn` has the draws of each case (empty: none were asked for) with the numbers in `inputs`, by
    name; `at_gaps` the runs at each gap (m), `free` those without the wall on `sides`; `others` the
    runs by other models; `sure` how sure a run is, "" the scene's own.
    """

    own: UncertainScene
    model: str
    swift: str
    recorded: bool
    shown: Mapping[str, Played]
    drawn: Mapping[str, Sequence[Ran]]
    inputs: Mapping[str, Sequence[float]]
    at_gaps: Mapping[float, Sequence[Ran]]
    free: Sequence[Ran]
    sides: Sequence[Side]
    others: Mapping[str, Mapping[str, Ran]]
    sure: Mapping[str, Sure]
    levels: Finding | None
    left_out: Sequence[str]

    @property
    def runs(self) -> dict[str, list[Ran]]:
        """By case, the runs that count: its draws, or itself."""
        return {
            case: [run for run in self.drawn.get(case) or played.runs[:1] if not run.reason]
            for case, played in self.shown.items()
        }

    @property
    def nominal(self) -> dict[str, Ran]:
        """By case, the run as it is, where it has a motion."""
        return {
            case: played.runs[0] for case, played in self.shown.items() if not played.runs[0].reason
        }


def finding_of(found: Found) -> Finding:
    """All answers, and what `--json` says."""
    everything = [(case, run) for case, runs in found.runs.items() for run in runs]
    overturning = overturning_of(found.runs)
    quantities = {q.name: quantity_of(q.name, everything) for q in QUANTITIES}
    gaps = gaps_of(found)
    contributions = contributions_of(found)
    criteria = criteria_of(found)
    own = found.sure.get("")
    numerical, certainty = quantities_of(
        found.own.scene.name,
        found.model,
        own.numerical if own else None,
        own.inputs if own else None,
        own.depends_on_law_from_s if own else None,
    )
    answers = {
        "Does it fall?": fall_sentences(found, everything, overturning),
        "How far does it move?": move_sentences(quantities),
        "Which gap is safe?": gap_sentences(gaps),
        "At which intensity does it fall?": [found.levels.answer] if found.levels else [],
        "How sure is that?": [
            *certainty_sentences(found, own),
            *change_sentences(found, contributions),
        ],
        "What do hand methods say?": hand_sentences(criteria),
    }
    blocks: list[Block] = [
        answers_table(answers),
        outcomes_table(everything, overturning),
        quantities_table(quantities, found),
        criteria_table(criteria),
        *strips(found),
        *gap_blocks(gaps),
        *(found.levels.blocks if found.levels else ()),
        contributions_table(contributions, found),
        *model_blocks(found),
        *[
            replace(block, folded=True) if isinstance(block, Table) else block
            for block in certainty
        ],
        *(inputs_blocks(own.inputs) if own and own.inputs else ()),
        Table(
            "methods",
            [text("name", "method"), text("formula"), text("source"), text("holds", "range")],
            [[row[key] for key in ("name", "formula", "source", "holds")] for row in criteria],
            "The hand methods",
            on="page",
            folded=True,
        ),
        *run_blocks(found),
        *notes_of(found),
    ]
    data = {
        "scene": found.own.scene.name,
        "model": found.model,
        "runs": len(everything),
        "outcomes": {name: sum(run.outcome == name for _, run in everything) for name in OUTCOMES},
        "overturning": overturning,
        "quantities": quantities,
        "motion": quantities,
        **gaps,
        "numerical": {key: numerical[key] for key in ("converged", "quantities")},
        "contributions": contributions,
        "criteria": criteria,
        "left_out": list(found.left_out),
    }
    if found.levels is not None:
        data = {**found.levels.data, **data}
    if not found.recorded:
        data |= numerical | {"inputs": own.inputs.model_dump() if own and own.inputs else None}
    reasons = {
        case: played.runs[0].reason for case, played in found.shown.items() if played.runs[0].reason
    }
    failed = bool(reasons) or bool(found.levels and found.levels.exit_code)
    unsure = not found.recorded and not numerical["converged"]
    return Finding(
        "assess",
        f"Assessment: {found.own.scene.name}",
        " ".join(said for question in LEADS for said in answers[question]),
        blocks,
        data,
        exit_code=3 if failed else 1 if unsure and found.levels is None else 0,
        failures=reasons,
        files={
            f"histories/{file_of(case)}": played.history
            for case, played in found.shown.items()
            if played.history
        },
    )


def overturning_of(runs: Mapping[str, Sequence[Ran]]) -> dict[str, Any]:
    """How many runs overturn, and the probability with its interval (`share_of`)."""
    some = [each for each in runs.values() if each]
    hits = np.array([[sum(run.fell for run in each)] for each in some]).reshape(-1, 1)
    decided = np.array([[len(each)] for each in some]).reshape(-1, 1)
    share, low, high = share_of(hits, decided) if some else ([math.nan],) * 3
    return {
        "count": int(hits.sum()),
        **{
            key: None if math.isnan(end[0]) else min(max(float(end[0]), 0.0), 1.0)
            for key, end in (("probability", share), ("low", low), ("high", high))
        },
    }


def quantity_of(name: str, runs: Sequence[tuple[str, Ran]]) -> dict[str, Any]:
    """One of the four figures over the runs that stand and have it."""
    unit = next(q.unit for q in QUANTITIES if q.name == name)
    known_of: list[tuple[float, str]] = [
        (getattr(run.motion, name), case)
        for case, run in runs
        if run.motion is not None and not run.fell and getattr(run.motion, name) is not None
    ]
    values = [value for value, _ in known_of]
    record = max(known_of, key=lambda one: one[0])[1] if known_of else None
    return {"unit": unit, **spread(values), "record": record, "of": len(values)}


def gaps_of(found: Found) -> dict[str, Any]:
    """Outcomes at each gap, the clearance that is needed, and the largest safe gap.

    `clearance` (m) is the largest reach without the wall: nearer than that a block would strike.
    It has the reach of blocks that fall, `free_overturned` of the runs without the wall.
    `none_overturns_up_to` (m) is the largest gap up to which no run overturns. `monotonic` tells
    whether a wider gap never lets fewer runs overturn.
    """
    rows: list[dict[str, Any]] = []
    for gap, runs in found.at_gaps.items():
        known_of = [run for run in runs if not run.reason]
        speeds = [
            run.motion.wall_speed
            for run in known_of
            if run.motion and run.motion.wall_speed is not None
        ]
        speed = spread(speeds)
        rows.append(
            {
                "gap": gap,
                "runs": len(known_of),
                "overturned": sum(run.fell for run in known_of),
                "struck": len(speeds),
                "wall_speed": {key: speed[key] for key in ("median", "largest")},
            }
        )
    safe = [
        row["gap"]
        for k, row in enumerate(rows)
        if not any(before["overturned"] for before in rows[: k + 1])
    ]
    reaches = [run.reach[side] for run in found.free if not run.reason for side in found.sides]
    return {
        "gaps": rows,
        "clearance": max(reaches, default=None),
        "free_overturned": sum(run.fell for run in found.free),
        "none_overturns_up_to": max(safe, default=None),
        "monotonic": [row["overturned"] for row in rows]
        == sorted(row["overturned"] for row in rows),
    }


def contributions_of(found: Found) -> list[dict[str, Any]]:
    """Shares of the variance of the peak rotation by source, the largest first.

    A block that falls counts as 1 alpha.
    """
    nominal = found.nominal
    peaks = {case: [run.peak for run in runs] for case, runs in found.runs.items() if runs}
    means = [float(np.mean(some)) for some in peaks.values()]
    variance: dict[str, float] = {}
    if len(means) > 1:
        variance["records"] = float(np.var(means, ddof=1))
    own = found.sure.get("")
    if any(found.drawn.values()):
        variance["inputs"] = float(np.mean([np.var(some) for some in peaks.values()]))
    elif own and own.inputs:
        peak = own.inputs.figures[0]
        variance["inputs"] = ((peak.high - peak.low) / (2.0 * WIDTH)) ** 2
    errors = [
        0.0 if (run := nominal.get(case)) and run.fell else one.numerical.u_num("peak_rotation")
        for case, one in found.sure.items()
        if one.numerical is not None and (bool(case) == found.recorded)
    ]
    sure = [error for error in errors if error is not None]
    if sure:
        variance["numerical error"] = float(np.mean([(error / WIDTH) ** 2 for error in sure]))
    apart = {
        model: [
            runs[case].peak - nominal[case].peak
            for case in nominal
            if case in runs and not runs[case].reason
        ]
        for model, runs in found.others.items()
    }
    if laws := apart.pop(LAW, None):
        variance[LAW] = float(np.mean([(0.5 * d) ** 2 for d in laws]))
    if forms := [d for some in apart.values() for d in some]:
        variance["model form"] = float(np.mean(np.square(forms)))
    total = sum(variance.values())
    return [
        {
            "source": name,
            "share": value / total if total > 0.0 else 0.0,
            "sd": math.sqrt(value),
            "unit": "alpha",
        }
        for name, value in sorted(variance.items(), key=lambda one: -one[1])
    ]


def criteria_of(found: Found) -> list[dict[str, Any]]:
    """Predictions of hand methods for the cases, and how often they agree with the simulation."""
    cases = [
        (played.runs[0], played.said)
        for played in found.shown.values()
        if played.said and not played.runs[0].reason
    ]
    rows = []
    for k, criterion in enumerate(CRITERIA):
        says = [said[k][0] for _, said in cases]
        happens = [HAPPENS[criterion.event](run) for run, _ in cases]
        pairs = [
            (said[k][1], run.slid if criterion.event == "slides" else _turned(run))
            for run, said in cases
            if said[k][1] is not None
        ]
        rows.append(
            {
                "name": criterion.name,
                "formula": criterion.formula,
                "event": criterion.event,
                "source": criterion.source,
                "holds": criterion.holds,
                "predicts": sum(says),
                "of": len(cases),
                "simulated": sum(happens),
                "agrees": sum(a == b for a, b in zip(says, happens, strict=True)),
                "estimate": _median([a for a, _ in pairs]),
                "motion": _median([b for _, b in pairs]),
                "unit": "m" if criterion.event == "slides" else "alpha",
                "unsafe": sum(b > a * (1.0 + MOVED) + MOVED for a, b in pairs if a is not None)
                if pairs
                else None,
            }
        )
    return rows


#: Whether an event of a hand method happens in a run.
HAPPENS = {
    "uplifts": lambda run: run.fell or run.peak > MOVED,
    "slides": lambda run: run.slid > MOVED,
    "overturns": lambda run: run.fell,
}


def _turned(run: Ran) -> float:
    return math.inf if run.fell else run.peak


def _median(values: Sequence[float | None]) -> float | None:
    """The median; None where there is none, or it is infinite."""
    known_of = sorted(value for value in values if value is not None)
    middle = known_of[(len(known_of) - 1) // 2] if known_of else math.inf
    return middle if math.isfinite(middle) else None


# The sentences.


def fall_sentences(
    found: Found, runs: Sequence[tuple[str, Ran]], overturning: Mapping[str, Any]
) -> list[str]:
    """How the runs end."""
    name, count = found.own.scene.name, overturning["count"]
    if not runs:
        return [f"{name}: no run has a result."]
    if len(runs) == 1:
        return [f"{name} {_fate(runs[0][1])}."]
    under = f"{len(found.shown)} records" if found.recorded else "its own base motion"
    draws = f", {len(runs)} runs," if len(runs) > len(found.shown) else ""
    share, low, high = (overturning[key] for key in ("probability", "low", "high"))
    return [
        f"{name} under {under}{draws} overturns in {count} of {len(runs)}"
        f" ({_percent(share)}; 95 %: {_percent(low)} to {_percent(high)})."
    ]


def move_sentences(quantities: Mapping[str, Any]) -> list[str]:
    """How far it moves."""
    told = [
        f"{q.label} {quantities[q.name]['largest']:.3g} {_unit(q.unit)}"
        for q in QUANTITIES
        if quantities[q.name]["largest"] is not None
    ]
    return [f"Where it stands, at most: {', '.join(told)}."] if told else []


def _fate(run: Ran) -> str:
    return {"at rest": "stays", "moving": "stays, and still moves at the end"}.get(
        run.outcome, run.outcome.replace("overturned ", "overturns to the ")
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _unit(unit: str) -> str:
    return "α" if unit == "alpha" else unit


def gap_sentences(gaps: Mapping[str, Any]) -> list[str]:
    """Which gap is safe."""
    said = []
    if gaps["gaps"]:
        safe = gaps["none_overturns_up_to"]
        first = gaps["gaps"][0]["gap"]
        said.append(
            f"None overturns up to a gap of {safe:g} m."
            if safe is not None
            else f"Some overturn already at the smallest gap, {first:g} m."
        )
        if not gaps["monotonic"]:
            said.append("A larger gap is not always worse: see each.")
    if gaps["clearance"] is not None:
        falls = f"; {gaps['free_overturned']} fall" if gaps["free_overturned"] else ""
        said.append(f"Without the wall the largest reach is {gaps['clearance']:.3g} m{falls}.")
    return said


def hand_sentences(criteria: Sequence[Mapping[str, Any]]) -> list[str]:
    """In how many runs hand methods let the block overturn."""
    said = [
        f"{row['name']} in {row['predicts']} of {row['of']}"
        for row in criteria
        if row["event"] == "overturns" and row["of"]
    ]
    return [f"Hand methods let it overturn: {', '.join(said)}."] if said else []


def certainty_sentences(found: Found, own: Sure | None) -> list[str]:
    """How sure the runs are."""
    if found.recorded:
        judged = [one for case, one in found.sure.items() if case and one.numerical]
        unsure = [one for one in judged if one.numerical and not one.numerical.converged]
        laws = sum(
            one.depends_on_law_from_s is not None for case, one in found.sure.items() if case
        )
        said = [f"{len(judged) - len(unsure)} of {len(judged)} runs are numerically converged."]
        return said + ([f"The law of impacts matters in {laws}."] if laws else [])
    if own is None or own.numerical is None:
        return [f"{found.model} has no step or tolerance: its numerical error is not known."]
    converged = own.numerical.converged and own.depends_on_law_from_s is None
    return ["Numerically converged." if converged else "Not converged: no figure of it is sure."]


def change_sentences(found: Found, contributions: Sequence[Mapping[str, Any]]) -> list[str]:
    """What would change the answer."""
    if not contributions or contributions[0]["sd"] <= MOVED:
        return []
    said = WHAT_WOULD[contributions[0]["source"]].format(_matters_most(found))
    return [said[0].upper() + said[1:] + "."]


def _matters_most(found: Found) -> str:
    """The uncertain number that the peak depends on most."""
    own = found.sure.get("")
    if own and own.inputs and own.inputs.sensitivities:
        return own.inputs.sensitivities[0].name
    shares = input_shares(found)
    return max(shares, key=lambda name: shares[name]) if shares else "the uncertain numbers"


def input_shares(found: Found) -> dict[str, float]:
    """Squared correlation of the peak with each number that was drawn, within the cases."""
    whole = [runs for runs in found.drawn.values() if runs and not any(run.reason for run in runs)]
    if not whole:
        return {}
    peaks = np.array([[run.peak for run in runs] for runs in whole])
    peaks -= peaks.mean(axis=1, keepdims=True)
    shares = {}
    for name, values in found.inputs.items():
        x = np.asarray(values) - np.mean(values)
        norm = float(np.sum(peaks**2) * np.sum(x**2) * len(whole))
        shares[name] = float(np.sum(peaks @ x)) ** 2 / norm if norm > 0.0 else 0.0
    return shares


# The blocks.


def answers_table(answers: Mapping[str, Sequence[str]]) -> Table:
    """The questions with their answers, or what asks for one."""
    rows = [
        [question, " ".join(said) or ASKS.get(question, "")] for question, said in answers.items()
    ]
    return Table("answers", [text("question"), text("answer")], rows)


def outcomes_table(runs: Sequence[tuple[str, Ran]], overturning: Mapping[str, Any]) -> Table:
    """How the runs end."""
    rows: list[list[Any]] = [
        [name, sum(run.outcome == name for _, run in runs), None, None, None] for name in OUTCOMES
    ]
    rows.append(["overturned", *(overturning[k] for k in ("count", "probability", "low", "high"))])
    return Table(
        "outcomes",
        [
            text("outcome"),
            Column("runs"),
            *(
                Column(name, label, kind="percent", digits=4)
                for name, label in (
                    ("probability", "probability"),
                    ("low", "95 % from"),
                    ("high", "to"),
                )
            ),
        ],
        [row for row in rows if row[1] or row[0] == "overturned"],
        "What happens",
        note="The interval is Wilson's; draws of one record count as one record.",
        on="all" if len(runs) > 1 else "file",
    )


def quantities_table(quantities: Mapping[str, Any], found: Found) -> Table:
    """The four figures."""
    several = len(found.shown) > 1 or any(found.drawn.values())
    spread_of = [
        Column(name, label, digits=4, brief=several)
        for name, label in (("median", ""), ("p16", "16 %"), ("p84", "84 %"))
    ]
    columns = [
        text("quantity", "how far it moves"),
        *spread_of,
        Column("largest", "largest" if several else "value", digits=4),
        text("unit"),
        text("record", "its record", brief=several),
        Column("of", "of runs", help="Runs that stand and have the figure.", brief=several),
    ]
    shown = {q.name: quantities[q.name] | {"unit": _unit(q.unit)} for q in QUANTITIES}
    rows = [[q.label, *(shown[q.name][c.name] for c in columns[1:])] for q in QUANTITIES]
    meant = "; ".join(f"{q.label}: {q.help}" for q in QUANTITIES)
    return Table("quantities", columns, rows, note=f"{meant}.")


def strips(found: Found) -> list[Block]:
    """The four figures with their records."""
    strip = [
        {
            "label": f"{q.label}, {_unit(q.unit)}",
            "values": [
                getattr(run.motion, q.name)
                for runs in found.runs.values()
                for run in runs
                if run.motion and not run.fell and getattr(run.motion, q.name) is not None
            ],
        }
        for q in QUANTITIES
    ]
    known_of = [one for one in strip if len(one["values"]) > 1]
    if not known_of:
        return []
    return [
        Plot(
            "motion",
            "How far each run moves",
            kind="strips",
            data=known_of,
            note="A point a run that stands; the bar goes from 16 to 84 %, its line is the median.",
        )
    ]


def gap_blocks(gaps: Mapping[str, Any]) -> list[Block]:
    """Outcomes at each gap."""
    rows = gaps["gaps"]
    if not rows:
        return []
    across = [row["gap"] for row in rows]
    shares = {
        name: [row[name] / max(row["runs"], 1) for row in rows] for name in ("struck", "overturned")
    }
    speeds = {name: [row["wall_speed"][name] for row in rows] for name in ("median", "largest")}
    table = Table(
        "gaps",
        [
            Column("gap", "clear gap", "m"),
            Column("runs"),
            Column("overturned"),
            Column("struck"),
            Column("median", "speed, median", "m/s"),
            Column("largest", "largest", "m/s"),
        ],
        [
            [
                row["gap"],
                row["runs"],
                Mark(row["overturned"], "fail" if row["overturned"] else "pass"),
                row["struck"],
                row["wall_speed"]["median"],
                row["wall_speed"]["largest"],
            ]
            for row in rows
        ],
        note="Runs that strike the wall, also those that then overturn.",
    )
    plot = Plot(
        "gaps",
        "Which gap is safe",
        panels=[
            Panel("share of the runs", [Series(k, across, v) for k, v in shares.items()]),
            Panel("speed at the wall, m/s", [Series(k, across, v) for k, v in speeds.items()]),
        ],
        x=Axis("clear gap, m"),
        shared=False,
    )
    return [plot, table]


def contributions_table(contributions: Sequence[Mapping[str, Any]], found: Found) -> Table:
    """Where the uncertainty of the peak rotation comes from."""
    rows = [
        [row["source"], row["share"], row["sd"], CONTRIBUTIONS[row["source"]][0]]
        for row in contributions
    ]
    missing = [
        f"{name} ({asks})"
        for name, (_, asks) in CONTRIBUTIONS.items()
        if name not in {row["source"] for row in contributions}
    ]
    said = f" Not asked for: {', '.join(missing)}." if missing else ""
    return Table(
        "contributions",
        [
            text("source"),
            Column("share", kind="percent", digits=3),
            Column("sd", "standard deviation", "α"),
            text("what", "what it is", brief=False),
        ],
        rows,
        "How sure",
        note=f"Of the variance of the peak rotation; a block that falls counts as 1 α.{said}",
    )


def model_blocks(found: Found) -> list[Block]:
    """How far the other models are from the first, and what the suites know of them."""
    nominal, rows = found.nominal, []
    for model, runs in found.others.items():
        apart = [
            abs(runs[case].peak - nominal[case].peak)
            for case in nominal
            if case in runs and not runs[case].reason
        ]
        trust = known().trust.get(model, {}).get("peak_rotation")
        rows.append(
            [
                "floor-first law of impacts" if model == LAW else model,
                len(apart),
                sum(run.fell for run in runs.values()),
                float(np.sqrt(np.mean(np.square(apart)))) if apart else None,
                max(apart, default=None),
                trust and trust.bias,
                trust and trust.scatter,
            ]
        )
    if not rows:
        return []
    return [
        Table(
            "models",
            [
                text("model", "compared with the first model"),
                Column("runs"),
                Column("overturned"),
                Column("rms", "RMS difference", "α"),
                Column("largest", "largest", "α"),
                Column("bias", "bias in the suites", optional=True),
                Column("scatter", "σ in the suites", kind="percent", digits=3, optional=True),
            ],
            rows,
            "Other models",
            f"Differences in peak rotation from {found.model}.",
            folded=True,
        )
    ]


def criteria_table(criteria: Sequence[Mapping[str, Any]]) -> Table:
    """Predictions of hand methods, beside the simulation."""
    columns = [
        text("name", "method"),
        text("event", "it"),
        Column("predicts", "says"),
        Column("simulated", "is"),
        Column("agrees"),
        Column("estimate", help="Median of what it estimates."),
        Column("motion", help="Median of the simulated motion."),
        text("unit"),
        Column("unsafe", help="Runs that moved farther than estimated."),
    ]
    rows = []
    for row in criteria:
        estimates = row["unsafe"] is not None
        shown = {
            **row,
            "predicts": f"{row['predicts']} of {row['of']}",
            "motion": row["motion"] if estimates else None,
            "unit": _unit(row["unit"]) if estimates else "",
            "unsafe": Mark(row["unsafe"], "changed" if row["unsafe"] else ""),
        }
        rows.append([shown[column.name] for column in columns])
    return Table(
        "criteria",
        columns,
        rows,
        "What hand methods say",
        note="Estimates to be judged, not judges: in how many runs it happens by the method and by"
        " the simulation, and in how many both agree; medians of estimate and motion.",
    )


def run_blocks(found: Found) -> list[Block]:
    """Each case with its four figures and its history."""
    rows = []
    for case, played in found.shown.items():
        run = played.runs[0]
        motion = [getattr(run.motion, q.name) if run.motion else None for q in QUANTITIES]
        link = f"histories/{file_of(case)}" if played.history else ""
        rows.append([Mark(case, link=link), run.outcome or "failed", *motion])
    table = Table(
        "runs",
        [
            text("record" if found.recorded else "scene"),
            text("outcome"),
            *(Column(q.name, q.label, _unit(q.unit)) for q in QUANTITIES),
        ],
        rows,
        "Each run",
        on="page",
        note="Each name leads to the run's history as CSV.",
    )
    return [*histories(found), table]


def histories(found: Found) -> list[Block]:
    """The rotations of all cases over time."""
    columns = {case: _columns(p.history) for case, p in found.shown.items() if p.history}
    if not columns:
        return []
    end = max(one["t"][-1] for one in columns.values())
    times, alpha = np.linspace(0.0, end, POINTS), found.own.scene.block.alpha
    fell = {case: run.fell for case, run in found.nominal.items()}
    series = [
        Series(
            case,
            times.tolist(),
            [
                float(value) if math.isfinite(value) else None
                for value in np.interp(
                    times, one["t"], one["theta"] / alpha, right=math.nan if fell[case] else None
                )
            ],
            style="thin" if len(columns) > 1 else "smooth",
        )
        for case, one in columns.items()
    ]
    return [
        Plot(
            "histories",
            "Histories",
            panels=[Panel("", series)],
            x=Axis("time, s"),
            y=Axis("θ/α", limits=_around(series)),
            note="Rotation over the slenderness angle, positive to the left; a line a run.",
            live=True,
        )
    ]


def _around(series: Sequence[Series]) -> tuple[float, float]:
    """Limits of an axis for some series, 1e-3 wide at the least, so that noise is not blown up."""
    values = [value for one in series for value in one.y if value is not None]
    low, high = min(values), max(values)
    beyond = max(0.05 * (high - low), 0.5e-3)
    return low - beyond, high + beyond


def _columns(table: str) -> dict[str, NDArray[np.float64]]:
    """Time and rotation of a history that was kept as CSV."""
    head, *lines = table.splitlines()
    names = head.split(",")
    at = [names.index(name) for name in ("t", "theta")]
    rows = np.array([[float(line.split(",")[k]) for k in at] for line in lines])
    return {"t": rows[:, 0], "theta": rows[:, 1]}


def file_of(case: str) -> str:
    """The file of a case's history."""
    return f"{case.replace(' ', '-')}.csv"


def notes_of(found: Found) -> list[Block]:
    """What else a reader should know."""
    said = [f"outside of what the suites cover: {line}" for line in outside(found.own.scene)]
    if found.model != found.swift and (found.at_gaps or any(found.drawn.values())):
        said.append(f"gaps and draws are played by {found.swift}")
    if found.own.spreads and not any(found.drawn.values()) and found.recorded:
        names = ", ".join(found.own.names)
        said.append(f"uncertain in the scene, and not drawn: {names}; --samples 64 draws them")
    return [Text(items=said, title="Notes", on="page")] if said else []
