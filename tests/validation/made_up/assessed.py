"""Results of an assessment, made up: its plan, and what of its tasks has ended."""

import math
from dataclasses import replace
from itertools import count

import numpy as np

from rockcheck import load_scene
from rockcheck.scenes import files
from rockcheck.validation.studies.population import results, statistics
from rockcheck.validation.studies.population.gathered import Gathered
from rockcheck.validation.studies.population.plan import GapRange, Plan
from rockcheck.validation.uncertainty import numerical

SCENE = load_scene("fig5a")
CERTAIN = files.UncertainScene(SCENE, {}, np.eye(0))
UNCERTAIN = files.UncertainScene(
    SCENE, {"floor.friction": files.Spread(value=0.4, sd=0.04)}, np.eye(1)
)


def ran(fate, peak=None, slip=None, top=None, speed=None, reach=None):
    return results.RunResult(
        fate=fate,
        peak_rotation=peak,
        slip=slip,
        top_displacement=top,
        wall_speed={} if speed is None else {"left": speed},
        reach={"left": reach or 0.0, "right": 0.0},
    )


RUNS = {
    "a": ran("at rest", 0.2, 0.01, 0.3, 0.4),
    "b": ran("moving", 0.4, 0.03, 0.5),
    "c": ran("overturned right", 6.0, 1e-7, 2.0, 0.9),
}
#: Without the wall.
FREE = {"a": ran("at rest", 0.3, reach=0.1), "b": ran("at rest", 0.3, reach=0.08)}
#: By case, whether the event of each hand method happens, and how far it goes.
METHODS = {
    "a": ((True, 0.1), (False, 0.0), (False, 0.5), (True, 0.02), (True, 0.0), (True, None)),
    "b": ((False, 0.5), (True, 0.05), (True, 1.5), (True, 0.04), (False, 0.01), (False, 0.3)),
    "c": ((True, 0.3), (True, 0.1), (True, math.inf), (True, 0.1), (True, 0.3), (True, 2.0)),
}


def judged(u_num):
    peak = numerical.Quantity(
        name="peak_rotation",
        unit="alpha",
        value=0.2,
        u_num=u_num,
        verdict="not converged" if u_num is None else "converged",
    )
    return numerical.Numerical(method="by hand", quantities=(peak,))


def unlike(given):
    """The scene under one motion after another, each with a zero more, so that none is a copy."""
    for k in count():
        samples = (*SCENE.excitation.unscaled, *[0.0] * k)
        motion = SCENE.excitation.model_copy(update={"unscaled": samples})
        yield replace(given, scene=given.scene.replace(excitation=motion))


def gathered(
    runs=RUNS,
    *,
    given=CERTAIN,
    recorded=True,
    draws=0,
    certainty=None,
    measure=None,
    bounds=(0.0, 0.05, 0.1),
    capacities=(),
    **played,
):
    """The results of runs as they are, and of what else was `played`, by the plan's task groups."""
    plan = Plan(
        own=given,
        cases=played.get("cases") or dict(zip(runs, unlike(given), strict=False)),
        recorded=recorded,
        draws=draws,
        measure=measure,
        gaps=[GapRange("left", bounds)],
        capacities=capacities,
        models={"ebm-unilateral": {}, "cm": {}},
    )
    done = {
        plan.shown[case]: results.Shown(
            result=run, methods=METHODS.get(case, ()), history="t,theta\n0,0\n1,0.1\n"
        )
        for case, run in runs.items()
    }
    for case, run in played.get("cm", {}).items():
        done[plan.others["cm"][case]] = results.Shown(result=run)
    for case, run in played.get("law", {}).items():
        done[plan.by_other_law[case]] = results.Shown(result=run)
    for case, drawn in played.get("drawn", {}).items():
        done[plan.drawn[case]] = results.Drawn(results=(runs[case], *drawn))
    for case, free in played.get("free", {}).items():
        done[plan.free["left"][case]] = results.Drawn(results=(free,))
    for case, sure in (certainty or {}).items():
        done[plan.certainty(done)[case]] = sure
    for case, search in played.get("gaps", {}).items():
        done[plan.gap_tasks(done)["left"][case]] = search
    for case, search in played.get("factors", {}).items():
        done[plan.factors[case]] = search
    return Gathered(plan, done)


def interval(draw, low, high, below, above):
    return results.FallInterval(
        draw=draw, low=low, high=high, stands_below=below, stands_above=above
    )


def row(gap, overturned, *speeds):
    return results.GapRow(gap=gap, runs=1, overturned=overturned, undecided=0, speeds=speeds)


def search(*intervals, fallen=(0, 0, 0)):
    rows = [row(gap, n, 0.5) for gap, n in zip((0.0, 0.05, 0.1), fallen, strict=True)]
    return results.GapSearch(intervals=intervals, rows=tuple(rows), undecided=0, runs=9)


def gap_answer(**searches):
    everything = gathered(
        {case: RUNS[case] for case in searches},
        free={case: FREE[case] for case in searches},
        gaps=searches,
    )
    (answer,) = statistics.gap_answers(everything)
    return answer


#: It falls at no gap of all that matter.
SAFE = statistics.GapAnswer(
    side="left",
    low=0.0,
    high=0.1,
    looked_every=1e-3,
    finely_up_to=0.1,
    beyond_every=0.0,
    draws_every=None,
    draws_beyond_every=None,
    clearance=0.1,
    free_overturned=0,
    free_runs=1,
    safe_up_to=0.1,
    first=None,
    falls=(),
    rows=(),
    undecided=0,
    runs=9,
    complete=True,
)
