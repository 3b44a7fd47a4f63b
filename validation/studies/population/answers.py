"""Answers from the runs of an assessment, led by a sentence for an engineer's report."""

import io
import itertools
import math
import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import median_low
from typing import Any

import numpy as np

from rockcheck.scenes import Side, experience, history, writing
from rockcheck.validation.criteria import CRITERIA
from rockcheck.validation.discrepancy.compare import QUANTITIES, spread
from rockcheck.validation.execute import pool
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
from rockcheck.validation.studies.population.runs import (
    LAW,
    MOST_ROWS,
    Asked,
    Played,
    Ran,
    Sure,
)
from rockcheck.validation.uncertainty import population
from rockcheck.validation.uncertainty.numerical import Numerical

#: Name of the error of a step or tolerance, among the sources of uncertainty.
STEPS = "numerical error"
FATES = {"at rest": "stays", "moving": "stays, and still moves at the end"}
#: Units as readers know them, where these are other words.
UNITS = {"alpha": "α"}
#: Of a probability.
INTERVAL = ("probability", "low", "high")
#: A slip (m) or rotation (alpha) below this is none: models with contacts yield a little.
MOVED = 1e-6
#: Points of a history on the page.
POINTS = 400
#: Sources of uncertainty: what each is, what asks for it, and what of it changes the answer.
CONTRIBUTIONS = {
    "records": ("scatter between the records", "two records or more", "other records"),
    "inputs": ("draws of the scene's uncertain numbers", "--samples", "knowing {} better"),
    STEPS: (
        "u_num of the model's own step or tolerance",
        "a model with a step",
        "a smaller step or tolerance",
    ),
    "model form": ("difference of the other models", "--models", "another model"),
    LAW: ("half the difference between the laws of impacts", "a wall", "another law of impacts"),
}
#: The questions whose answers lead, as one would write them in a report.
LEADS = ("Does it fall?", "How far does it move?", "Which gap is safe?")
#: What is said where there is no answer.
ASKS = {
    "How far does it move?": "No run stands.",
    "Which gap is safe?": "Not asked for: --gaps 0,0.05,0.1, or left:0,0.05,0.1 without a wall.",
    "At which intensity does it fall?": "Not asked for: --levels pga:0.05:2:40 with records,"
    " pga-ratio:1:8:40 with a pulse.",
}


@dataclass(frozen=True, kw_only=True)
class Found:
    """The runs of an assessment, by the case: the scene under each of its motions.

    `drawn` has the draws of each case with all of them; `at_gaps` the runs at each gap
    (m) and `free` those without the wall that have a motion; `others` the runs by other models;
    `sure` how sure a run is, and `own`, by "", the scene under its own motion; `levels`
    the answer and blocks over intensities; `failed` whether any task did.
    """

    study: Asked
    shown: Mapping[str, Played]
    drawn: Mapping[str, Sequence[Ran]]
    at_gaps: Mapping[float, Sequence[Ran]]
    free: Sequence[Ran]
    others: Mapping[str, Mapping[str, Ran]]
    sure: Mapping[str, Sure]
    own: Sure
    levels: tuple[str, Sequence[Block]]
    failed: bool

    @cached_property
    def runs(self) -> dict[str, list[Ran]]:
        """By case, the runs that count: its draws, or, where no case has all, itself."""
        counted = self.drawn or {case: played.runs[:1] for case, played in self.shown.items()}
        return {case: [run for run in runs if not run.reason] for case, runs in counted.items()}

    @cached_property
    def each(self) -> list[tuple[str, Ran]]:
        """All runs that count, with their case."""
        return [(case, run) for case, runs in self.runs.items() for run in runs]

    @cached_property
    def nominal(self) -> dict[str, Ran]:
        """By case, the run as it is, where it has a motion."""
        return {case: one.runs[0] for case, one in self.shown.items() if not one.runs[0].reason}

    @cached_property
    def judged(self) -> dict[str, Numerical]:
        """By case, the numerical uncertainty; without records, by "", that of the scene's own."""
        return {
            case: one.numerical
            for case, one in self.sure.items()
            if one.numerical is not None and bool(case) == self.study.recorded
        }

    @cached_property
    def moved(self) -> dict[str, list[tuple[float, str]]]:
        """By name, each of the four figures of the runs that stand and have it, with its case."""
        return {
            q.name: [
                (value, case)
                for case, run in self.each
                if not run.fell and (value := run.motion.get(q.name)) is not None
            ]
            for q in QUANTITIES
        }

    @cached_property
    def apart(self) -> dict[str, list[float]]:
        """By other model, how far its peak rotations are from the first model's, alpha."""
        return {
            model: [
                runs[case].peak - own.peak
                for case, own in self.nominal.items()
                if case in runs and not runs[case].reason
            ]
            for model, runs in self.others.items()
        }


#: Of a question: its sentences, what `--json` says, and its blocks.
Answer = tuple[list[str], dict[str, Any], list[Block]]


def finding_of(found: Found) -> Finding:
    """All answers, and what `--json` says."""
    study, own, scene = found.study, found.own, found.study.own.scene
    at_levels, levels = found.levels
    falls, outcomes, happens = _falls(found)
    moves, quantities, (how_far, *strips) = _moves(found)
    safe, gaps, gap_blocks = _gaps(found)
    sure, numerical, certainty = _certainty(found)
    change, contributions, shares = _contributions(found)
    hand, criteria, methods = _by_hand(found)
    answers = {
        "Does it fall?": falls,
        "How far does it move?": moves,
        "Which gap is safe?": safe,
        "At which intensity does it fall?": [at_levels],
        "How sure is that?": [*sure, *change],
        "What do hand methods say?": hand,
    }
    blocks: list[Block] = [
        Table(
            "answers",
            [text("question"), text("answer")],
            [[one, " ".join(said) or ASKS.get(one, "")] for one, said in answers.items()],
        ),
        *happens,
        how_far,
        *methods,
        *strips,
        *gap_blocks,
        *levels,
        *shares,
        *_models(found),
        *certainty,
        Table(
            "methods",
            [text("name", "method"), text("formula"), text("source"), text("holds", "range")],
            [[one.name, one.formula, one.source, one.holds] for one in CRITERIA],
            "The hand methods",
            on="page",
            folded=True,
        ),
        *_histories(found),
        *_runs(found),
    ]
    data = {
        "scene": scene.name,
        "model": study.model,
        **(study.levels.data if study.levels else {}),
        "runs": len(found.each),
        **outcomes,
        **quantities,
        **gaps,
        "numerical": {key: numerical[key] for key in ("converged", "quantities")},
        **contributions,
        **criteria,
        "left_out": list(study.left_out),
    }
    if not study.recorded:
        data |= numerical | {"inputs": own.inputs.model_dump() if own.inputs else None}
    decided = study.recorded or numerical["converged"] or study.levels
    # as they are, by case, and by the other model
    as_it_is = {case: one.runs[0] for case, one in found.shown.items()} | {
        f"{case}, {model}": run
        for model, others in found.others.items()
        for case, run in others.items()
    }
    failures = {where: run.reason for where, run in as_it_is.items() if run.reason}
    return Finding(
        "assess",
        f"Assessment: {scene.name}",
        " ".join(said for question in LEADS for said in answers[question]),
        blocks,
        data,
        exit_code=3 if found.failed or failures else int("" in found.sure and not decided),
        failures=failures,
        files={file_of(case): one.history for case, one in found.shown.items() if one.history},
    )


def _falls(found: Found) -> Answer:
    """How many runs end how, and the probability of overturning with its interval (`share_of`)."""
    study, count, name = found.study, len(found.each), found.study.own.scene.name
    some = [each for each in found.runs.values() if each]
    hits = np.array([[sum(run.fell for run in each)] for each in some]).reshape(-1, 1)
    decided = np.array([[len(each)] for each in some]).reshape(-1, 1)
    ends = np.clip(
        np.ravel(population.share_of(hits, decided) if some else [math.nan] * 3), 0.0, 1.0
    )
    overturning: dict[str, Any] = {
        "count": int(hits.sum()),
        **dict(zip(INTERVAL, writing.finite(ends.tolist()), strict=True)),
    }
    outcomes = {
        name: sum(run.outcome == name for _, run in found.each) for name in history.OUTCOMES
    }
    if count == 0:
        said = f"{name}: no run has a result."
    elif count == 1:
        outcome = found.each[0][1].outcome
        said = f"{name} {FATES.get(outcome, outcome.replace('overturned ', 'overturns to the '))}."
    else:
        records = f"{len(found.runs)} record{'s' * (len(found.runs) > 1)}"
        under = records if study.recorded else "its own base motion"
        draws = f", {count} runs," if count > len(found.runs) else ""
        share, low, high = (f"{100.0 * overturning[key]:.3g} %" for key in INTERVAL)
        said = (
            f"{name} under {under}{draws} overturns in {overturning['count']} of {count}"
            f" ({share}; 95 %: {low} to {high})."
        )
    table = Table(
        "outcomes",
        [
            text("outcome"),
            Column("runs"),
            *(
                Column(name, label, kind="percent", digits=4)
                for name, label in zip(INTERVAL, ("probability", "95 % from", "to"), strict=True)
            ),
        ],
        [
            *([name, number, None, None, None] for name, number in outcomes.items() if number),
            ["overturned", *overturning.values()],
        ],
        "What happens",
        note="The interval is Wilson's; draws of one record count as one record.",
        on="all" if count > 1 else "file",
    )
    return [said], {"outcomes": outcomes, "overturning": overturning}, [table]


def _moves(found: Found) -> Answer:
    """The spread of each of the four figures of the runs that stand, and the largest's case."""
    quantities: dict[str, Any] = {
        q.name: {
            "unit": q.unit,
            **spread([value for value, _ in found.moved[q.name]]),
            "record": max(found.moved[q.name], key=operator.itemgetter(0), default=(0.0, None))[1],
            "of": len(found.moved[q.name]),
        }
        for q in QUANTITIES
    }
    shown = [q for q in QUANTITIES if quantities[q.name]["of"]]
    told = [
        f"{q.label} {quantities[q.name]['largest']:.3g} {UNITS.get(q.unit, q.unit)}" for q in shown
    ]
    several = len(found.shown) > 1 or bool(found.drawn)
    columns = [
        text("quantity", "how far it moves"),
        *(
            Column(name, label, digits=4, brief=several)
            for name, label in (("median", ""), ("p16", "16 %"), ("p84", "84 %"))
        ),
        Column("largest", "largest" if several else "value", digits=4),
        text("unit"),
        text("record", "its record", brief=several),
        Column("of", "of runs that stand", help="Runs that have the figure.", brief=several),
    ]
    strips = [
        {
            "label": f"{q.label}, {UNITS.get(q.unit, q.unit)}",
            "values": [value for value, _ in found.moved[q.name]],
        }
        for q in shown
        if quantities[q.name]["of"] > 1
    ]
    blocks: list[Block] = [
        Table(
            "quantities",
            columns,
            [
                [
                    q.label,
                    *(
                        UNITS.get(q.unit, q.unit)
                        if c.name == "unit"
                        else quantities[q.name][c.name]
                        for c in columns[1:]
                    ),
                ]
                for q in shown
            ],
            note="; ".join(f"{q.label}: {q.help}" for q in shown) + ".",
            on="all" if shown else "file",
        ),
        Plot(
            "motion",
            "How far each run moves",
            kind="strips",
            data=strips,
            note="A point a run that stands; the bar goes from 16 to 84 %, its line is the median.",
        ),
    ]
    return (
        [f"Where it stands, at most: {', '.join(told)}."] if told else [],
        {"quantities": quantities, "motion": quantities},
        blocks if strips else blocks[:1],
    )


def _at_gap(gap: float, runs: Sequence[Ran], every: int, sides: Sequence[Side]) -> dict[str, Any]:
    struck = [[run.speeds[side] for side in sides if side in run.speeds] for run in runs]
    speeds = spread([max(some) for some in struck if some])
    fallen = sum(run.fell for run in runs)
    return {
        "gap": gap,
        "runs": len(runs),
        "overturned": fallen,
        "struck": sum(map(bool, struck)),
        "wall_speed": {key: speeds[key] for key in ("median", "largest")},
        "verdict": "fail" if fallen else "pass" if len(runs) == every else "incomplete",
    }


def gaps_of(found: Found) -> dict[str, Any]:
    """Outcomes at each gap with runs, the clearance that is needed, and the largest safe gap.

    `struck` counts the runs that strike a wall whose gap is varied; `verdict` is "incomplete" where
    none falls and some have no result.
    `clearance` (m) is the largest reach without the wall: nearer than that a block would strike.
    It has the reach of blocks that fall, `free_overturned` of the runs without the wall.
    `none_overturns_up_to` (m) is the largest gap up to which no run overturns, and none failed.
    `monotonic` tells whether a wider gap never lets fewer runs overturn.
    """
    every, sides = len(found.study.cases) * max(len(found.study.draws), 1), found.study.sides
    rows = [_at_gap(gap, runs, every, sides) for gap, runs in found.at_gaps.items()]
    falls = [row["overturned"] for row in rows]
    stand = {row["gap"] for row in rows if row["verdict"] == "pass"}
    safe = itertools.takewhile(stand.__contains__, found.study.gaps)
    return {
        "gaps": rows,
        "clearance": max((run.reach[side] for run in found.free for side in sides), default=None),
        "free_overturned": sum(run.fell for run in found.free),
        "none_overturns_up_to": max(safe, default=None),
        "monotonic": falls == sorted(falls),
    }


def _gaps(found: Found) -> Answer:
    data, said = gaps_of(found), list[str]()
    rows, safe, free = (data[key] for key in ("gaps", "none_overturns_up_to", "free_overturned"))
    if rows:
        said.append(
            f"None overturns up to a gap of {safe:g} m."
            if safe is not None
            else "Some fall, or have no result, already at the smallest gap,"
            f" {found.study.gaps[0]:g} m."
        )
    if not data["monotonic"]:
        said.append("A larger gap is not always worse: see each.")
    if data["clearance"] is not None:
        falls = f"; {free} run{'s overturn' if free > 1 else ' overturns'}" if free else ""
        said.append(f"Without the wall the largest reach is {data['clearance']:.3g} m{falls}.")
    across = [row["gap"] for row in rows]
    blocks: list[Block] = [
        Plot(
            "gaps",
            "Which gap is safe",
            panels=[
                Panel(
                    "share of the runs",
                    [
                        Series(name, across, [row[name] / row["runs"] for row in rows])
                        for name in ("struck", "overturned")
                    ],
                ),
                Panel(
                    "speed at the wall, m/s",
                    [
                        Series(name, across, [row["wall_speed"][name] for row in rows])
                        for name in ("median", "largest")
                    ],
                ),
            ],
            x=Axis("clear gap, m"),
            shared=False,
        ),
        Table(
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
                    Mark(row["overturned"], row["verdict"]),
                    row["struck"],
                    *row["wall_speed"].values(),
                ]
                for row in rows
            ],
            note="Struck: also by runs that then overturn. Yellow: some runs have no result.",
        ),
    ]
    return said, data, blocks if rows else []


def contributions_of(found: Found) -> list[dict[str, Any]]:
    """Shares of the variance of the peak rotation by source, the largest first.

    A block that falls counts as 1 alpha.
    """
    forms = [apart for model, apart in found.apart.items() if model != LAW]
    peaks = [[run.peak for run in runs] for runs in found.runs.values() if runs]
    inputs = found.own.inputs
    squares: dict[str, list[float]] = {
        "records": [float(np.var(list(map(np.mean, peaks)), ddof=1))] if len(peaks) > 1 else [],
        "inputs": [
            *(float(np.var(some)) for some in peaks if found.drawn),
            *(
                ((peak.high - peak.low) / (2.0 * experience.WIDTH)) ** 2
                for peak in (inputs.figures[:1] if inputs else ())
            ),
        ],
        STEPS: _by_steps(found),
        LAW: [(0.5 * difference) ** 2 for difference in found.apart.get(LAW, ())],
        "model form": np.square(list(itertools.chain(*forms))).tolist(),
    }
    variance = {source: float(np.mean(some)) for source, some in squares.items() if some}
    total = sum(variance.values()) or 1.0
    return [
        {"source": name, "share": value / total, "sd": math.sqrt(value), "unit": "alpha"}
        for name, value in sorted(variance.items(), key=lambda one: -one[1])
    ]


def _contributions(found: Found) -> Answer:
    """Where the uncertainty of the peak rotation comes from, and what would change the answer.

    Nothing is said where no numerical error is known.
    """
    rows, inputs, said = contributions_of(found), found.own.inputs, list[str]()
    known = [row["source"] for row in rows]
    if rows and rows[0]["sd"] > MOVED and not (found.judged and STEPS not in known):
        most = inputs.sensitivities[0].name if inputs and inputs.sensitivities else _leading(found)
        what = CONTRIBUTIONS[rows[0]["source"]][-1].format(most)
        said = [f"{what[0].upper()}{what[1:]} would change the answer most."]
    asked = {STEPS: "no run is converged"} if found.judged else {}
    missing = [
        f"{name} ({asked.get(name, asks)})"
        for name, (_, asks, _) in CONTRIBUTIONS.items()
        if name not in known
    ]
    table = Table(
        "contributions",
        [
            text("source"),
            Column("share", kind="percent", digits=3),
            Column("sd", "standard deviation", "α"),
            text("what", "what it is", brief=False),
        ],
        [[row["source"], row["share"], row["sd"], CONTRIBUTIONS[row["source"]][0]] for row in rows],
        "How sure",
        note="Of the variance of the peak rotation; a block that falls counts as 1 α."
        + (f" Not known: {', '.join(missing)}." if missing else ""),
    )
    return said, {"contributions": rows}, [table]


def _by_steps(found: Found) -> list[float]:
    """Variances of the peak by the step or tolerance; a block that falls has the peak 1."""
    fallen = {
        case if found.study.recorded else "" for case, run in found.nominal.items() if run.fell
    }
    errors = [
        0.0 if case in fallen and numerical.converged else numerical.u_num("peak_rotation")
        for case, numerical in found.judged.items()
    ]
    return [(error / experience.WIDTH) ** 2 for error in errors if error is not None]


def _leading(found: Found) -> str:
    """The number that was drawn with which the peak correlates most, within the cases."""
    whole = [runs for runs in found.drawn.values() if not any(run.reason for run in runs)]
    if not whole:
        return "the uncertain numbers"
    peaks = np.array([[run.peak for run in runs] for runs in whole])
    peaks -= peaks.mean(axis=1, keepdims=True)
    numbers = np.array([[value for _, value in draw] for draw in found.study.draws])
    numbers -= numbers.mean(axis=0)
    matters = np.abs(peaks.sum(axis=0) @ numbers) / np.linalg.norm(numbers, axis=0)
    return found.study.draws[0][np.argmax(matters)][0]


def numerical_of(found: Found) -> dict[str, Any]:
    """The numerical uncertainty of each figure of the scene under its own motion.

    From the time on from which the motion depends on the law of impacts, no step is fine enough to
    make a figure sure.
    """
    numerical, parts, inputs = (value for _, value in found.own)
    converged = numerical is not None and numerical.converged and parts is None
    unknown = "a model without step or tolerance" if "" in found.sure else "its runs failed"
    return {
        "scene": found.study.own.scene.name,
        "model": found.study.model,
        "converged": converged,
        "depends_on_law_from_s": parts,
        "method": numerical.method if numerical else "",
        "quantities": [
            {**q.model_dump(), "u_input": inputs.u_input(q.name) if inputs else None}
            for q in (numerical.quantities if numerical else ())
        ],
        "said": f"{'converged' if converged else 'not converged'}, by {numerical.method}"
        if numerical
        else f"{unknown}; its numerical error is not known",
    }


def _certainty(found: Found) -> Answer:
    """How sure the scene's own figures are: of the step, the law of impacts, the inputs."""
    (numerical, parts, inputs), data = (value for _, value in found.own), numerical_of(found)
    blocks: list[Block] = []
    if numerical:
        columns = [
            text("name", "quantity"),
            *(Column(name, name, digits=4) for name in ("value", "u_num", "order")),
            text("unit"),
            text("verdict"),
        ]
        blocks += [
            Table(
                "numerical",
                columns,
                [[one[column.name] for column in columns] for one in data["quantities"]],
                "Numerical uncertainty under the scene's own motion",
                f"{data['scene']}, {data['model']}.",
                folded=True,
            ),
            Text(items=numerical.reasons),
        ]
    if parts is not None:
        blocks.append(
            Text(
                f"from {parts:.3g} s on the motion depends on the law of impacts (docs, limits)",
                verdict="changed",
            )
        )
    if inputs:
        blocks += [
            Table(
                "inputs",
                [
                    text("figure"),
                    *(Column(name, digits=4) for name in ("value", "low", "high")),
                    text("unit"),
                ],
                [
                    [one.name, one.value, one.low, one.high, one.unit]
                    for one in (*inputs.figures, inputs.overturns)
                ],
                "Uncertain inputs",
                note=f"{inputs.samples} draws of {', '.join(inputs.names)}, played by"
                f" {inputs.model}; 95 % of them between low and high.",
            ),
            Table(
                "sensitivities",
                [
                    text("input", "what matters most for the peak"),
                    Column("alone", kind="percent", digits=2),
                    Column("with_others", kind="percent", digits=2),
                ],
                [
                    [one.name, max(one.first, 0.0), max(one.total, 0.0)]
                    for one in inputs.sensitivities
                ],
                on="all" if inputs.sensitivities else "file",
            ),
            Text(inputs.note),
        ]
    return _sure(found, data), data, blocks


def _sure(found: Found, data: Mapping[str, Any]) -> list[str]:
    if found.study.recorded:
        judged = [one.converged for one in found.judged.values()]
        laws = sum(
            one.depends_on_law_from_s is not None for case, one in found.sure.items() if case
        )
        said = f"{sum(judged)} of {len(judged)} runs are numerically converged."
        return [said, f"The law of impacts matters in {laws}."] if laws else [said]
    if found.own.numerical is None:
        return [f"{found.study.model}: {data['said']}."]
    return [
        "Numerically converged." if data["converged"] else "Not converged: no figure of it is sure."
    ]


#: The event of a hand method: the figure of a run, its unit, and above what it happens.
EVENTS = {
    "uplifts": ("turned", "alpha", MOVED),
    "slides": ("slid", "m", MOVED),
    "overturns": ("turned", "alpha", 1.0),
}


def criteria_of(found: Found) -> Iterator[dict[str, Any]]:
    """What hand methods said of the cases against what the simulation did."""
    cases = [(run, said) for case, run in found.nominal.items() if (said := found.shown[case].said)]
    for k, one in enumerate(CRITERIA):
        figure, unit, least = EVENTS[one.event]
        # whether it happens by the method, the method's estimate, and how far the run went
        runs = [(*said[k], getattr(run, figure)) for run, said in cases]
        pairs = [(estimate, far) for _, estimate, far in runs if estimate is not None]
        yield {
            **{key: value for key, value in vars(one).items() if key != "says"},
            "predicts": sum(says for says, *_ in runs),
            "of": len(runs),
            "simulated": sum(far > least for *_, far in runs),
            "agrees": sum(says == (far > least) for says, _, far in runs),
            # the lower medians; None where they are infinite
            "estimate": writing.finite(median_low(estimate for estimate, _ in pairs))
            if pairs
            else None,
            "motion": writing.finite(median_low(far for _, far in pairs)) if pairs else None,
            "unit": unit,
            "unsafe": sum(far > estimate * (1.0 + MOVED) + MOVED for estimate, far in pairs)
            if pairs
            else None,
        }


def _by_hand(found: Found) -> Answer:
    """In how many runs it overturns by hand methods, and how they agree with the simulation."""
    rows = [*criteria_of(found)]
    told = [
        f"{row['name']} in {row['predicts']} of {row['of']}"
        for row in rows
        if row["event"] == "overturns" and row["of"]
    ]
    table = Table(
        "criteria",
        [
            text("name", "method"),
            text("event", "it"),
            Column("predicts", "says"),
            Column("simulated", "is"),
            Column("agrees"),
            Column("estimate", help="Median of what it estimates."),
            Column("motion", help="Median of the simulated motion."),
            text("unit"),
            Column("unsafe", help="Runs that moved farther than estimated."),
        ],
        [
            [
                *(row["name"], row["event"], f"{row['predicts']} of {row['of']}"),
                *(row["simulated"], row["agrees"], row["estimate"]),
                *(
                    (None, "")
                    if row["unsafe"] is None
                    else (row["motion"], UNITS.get(row["unit"], row["unit"]))
                ),
                Mark(row["unsafe"], "changed" if row["unsafe"] else ""),
            ]
            for row in rows
        ],
        "What hand methods say",
        note="Estimates to be judged, not judges: in how many runs it happens by the method and by"
        " the simulation, and in how many both agree; medians of estimate and motion.",
    )
    return (
        [f"Hand methods let it overturn: {', '.join(told)}."] if told else [],
        {"criteria": rows},
        [table],
    )


def _models(found: Found) -> Iterator[Block]:
    """How far the other models are from the first, and what the suites know of them."""
    trusted = {
        model: experience.trust_of(model, found.study.models.get(model, {})).get("peak_rotation")
        for model in found.apart
    }
    rows = [
        [
            CONTRIBUTIONS[LAW][-1] if model == LAW else model,
            len(apart),
            sum(run.fell for run in found.others[model].values()),
            float(np.sqrt(np.mean(np.square(apart)))) if apart else None,
            max(map(abs, apart), default=None),
            *(getattr(trusted[model], name, None) for name in ("bias", "scatter")),
        ]
        for model, apart in found.apart.items()
    ]
    if rows:
        yield Table(
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
            f"Differences in peak rotation from {found.study.model}.",
            folded=True,
        )


def _histories(found: Found) -> list[Block]:
    rows = {
        case: np.atleast_1d(np.genfromtxt(io.StringIO(one.history), delimiter=",", names=True))
        for case, one in found.shown.items()
        if one.history
    }
    if not rows:
        return []
    times = np.linspace(0.0, max(one["t"][-1] for one in rows.values()), POINTS)
    lines = np.array(
        [
            np.interp(
                times,
                one["t"],
                one["theta"] / found.study.own.scene.block.alpha,
                right=None if found.nominal[case].outcome == "at rest" else math.nan,
            )
            for case, one in rows.items()
        ]
    )
    low, high = float(np.nanmin(lines)), float(np.nanmax(lines))
    beyond = max(0.05 * (high - low), 0.5e-3)  # noise is not blown up
    return [
        Plot(
            "histories",
            "Histories",
            panels=[
                Panel(
                    "",
                    [
                        Series(
                            case, times.tolist(), line, style="thin" if len(rows) > 1 else "smooth"
                        )
                        for case, line in zip(rows, writing.finite(lines.tolist()), strict=True)
                    ],
                )
            ],
            x=Axis("time, s"),
            y=Axis("θ/α", limits=(low - beyond, high + beyond)),
            note="Rotation over the slenderness angle, positive to the left; a line a run.",
            live=True,
        )
    ]


def file_of(case: str) -> str:
    """The file of a case's history; no name of a record has a tilde."""
    return f"histories/{case.replace(' ', '~')}.csv"


def _runs(found: Found) -> Iterator[Block]:
    """Each case as it is, and what is to be known about all of them."""
    study, drawn = found.study, found.drawn
    yield Table(
        "runs",
        [
            text("record" if study.recorded else "scene"),
            text("outcome"),
            *(Column(q.name, q.label, UNITS.get(q.unit, q.unit)) for q in QUANTITIES),
        ],
        [
            [
                Mark(case, link=file_of(case) if played.history else ""),
                played.runs[0].outcome or "failed",
                *(played.runs[0].motion.get(q.name) for q in QUANTITIES),
            ]
            for case, played in found.shown.items()
        ],
        "Each run",
        on="page",
        note=f"Each name leads to the run's history as CSV, in at most {MOST_ROWS} rows. Of a block"
        " that falls only the speed at the wall is given.",
    )
    beyond: dict[str, list[str]] = {}
    for case, one in study.cases.items():
        for line in experience.outside(one.scene):
            beyond.setdefault(line, []).append(case)
    without = ", ".join(case for case in study.cases if drawn and case not in drawn)

    names = ", ".join(next(iter(study.cases.values())).names)
    scaled = study.levels.model if study.levels else study.model
    told = {
        f"left out, since not all of its draws were played: {without}": without,
        f"gaps and draws are played by {study.swift}": study.model != study.swift
        and (found.at_gaps or drawn),
        f"intensities are played by {scaled}": study.model != scaled,
        f"uncertain in the scene, and not drawn: {names}; --samples 64 draws them": names
        and not drawn
        and study.recorded,
    }
    said = [
        *(
            f"outside of what the suites cover: {line}"
            + (f" ({', '.join(cases)})" if len(cases) < len(study.cases) else "")
            for line, cases in beyond.items()
        ),
        *(line for line, holds in told.items() if holds),
    ]
    if said:
        yield Text(items=said, title="Notes", on="page")


@dataclass(frozen=True, kw_only=True)
class Assessment(Asked):
    """An assessment of a scene."""

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """The answers to the engineer's questions."""
        ended = {task: one for task, one in done.items() if not isinstance(one, pool.Failure)}
        # by part and case, the record of the first of its tasks
        first = {
            part: {
                case: ended[some[0]] for case, some in tasks.items() if some and some[0] in ended
            }
            for part, tasks in self.parts.items()
        }
        drawn = {case: _runs_of(tasks, ended) for case, tasks in self.parts["drawn"].items()}
        at_gaps = {
            gap: [
                run for tasks in cases.values() for run in _runs_of(tasks, ended) if not run.reason
            ]
            for gap, cases in self.at_gaps.items()
        }
        return finding_of(
            Found(
                study=self,
                shown=first["shown"],
                drawn={
                    case: some for case, some in drawn.items() if len(some) == len(self.draws) > 0
                },
                free=at_gaps.pop(math.inf, []),
                at_gaps={gap: some for gap, some in at_gaps.items() if some},
                others={
                    model: {case: one.runs[0] for case, one in first[model].items()}
                    for model in (*self.models, LAW)
                    if first.get(model)
                },
                sure=first["sure"],
                own=first["sure"].get("", Sure()),
                levels=self.levels.gather(ended) if self.levels else ("", ()),
                failed=len(ended) < len(done),
            )
        )


def _runs_of(tasks: Sequence[Any], ended: Mapping[Any, Any]) -> list[Ran]:
    return [run for task in tasks if task in ended for run in ended[task].runs]
