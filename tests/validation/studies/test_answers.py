"""The answers of an assessment, of runs whose figures can be worked out by hand."""

import math

import numpy as np
import pytest

from rockcheck import load_scene
from rockcheck.scenes import files
from rockcheck.validation.finding import Mark, Text
from rockcheck.validation.studies.population.answers import Assessment, Found, finding_of
from rockcheck.validation.studies.population.runs import LAW, Played, Ran, Sure
from rockcheck.validation.uncertainty import numerical


def ran(outcome, peak=None, slip=None, top=None, speed=None, **more):
    figures = {"peak_rotation": peak, "slip": slip, "top_displacement": top, "wall_speed": speed}
    return Ran(
        outcome=outcome,
        motion=figures,
        **{"slid": slip or 0.0, "speeds": {"right": speed} if speed else {}} | more,
    )


def sure(u_num, **more):
    peak = numerical.Quantity(
        name="peak_rotation",
        unit="alpha",
        value=0.2,
        u_num=u_num,
        verdict="not converged" if u_num is None else "converged",
    )
    return Sure(numerical=numerical.Numerical(method="by hand", quantities=(peak,)), **more)


RUNS = {
    "a": ran("at rest", 0.2, 0.01, 0.3, 0.4),
    "b": ran("moving", 0.4, 0.03, 0.5, speeds={"left": 0.7}),  # its gap is not varied
    "c": ran("overturned right", speed=0.9, slid=1e-7),  # that of a contact which yields
}
#: By case, whether the event of each hand method happens, and how far it goes.
SAID = {
    "a": ((True, 0.1), (False, 0.0), (False, 0.5), (True, 0.02), (True, 0.0), (True, None)),
    "b": ((False, 0.5), (True, 0.05), (True, 1.5), (True, 0.04), (False, 0.01), (False, 0.3)),
    "c": ((True, 0.3), (True, 0.1), (True, math.inf), (True, 0.1), (True, 0.3), (True, 2.0)),
}
ENDS = {"a": 4.0, "b": 2.0, "c": 1.0}


def found_of(cases, own, samples=0, **more):
    scene = load_scene("fig5a")
    given = files.UncertainScene(
        scene, {"floor.friction": files.Spread(value=0.4, sd=0.04)}, np.eye(1)
    )
    asked = {"models": {"ebm-unilateral": {}, "cm": {}}, "gaps": (0.0, 0.1), "sides": ("right",)}
    return finding_of(
        Found(
            study=Assessment(
                own=given,
                cases=dict.fromkeys(cases, given),
                recorded=len(cases) > 1,
                samples=samples,
                **asked,
            ),
            shown={
                case: Played(
                    runs=(RUNS[case],),
                    said=SAID[case],
                    history=f"t,theta\n0,0\n0.5,0\n{ENDS[case]},{0.1 * scene.block.alpha!r}\n",
                )
                for case in cases
            },
            **{"drawn": {}, "own": own} | more,
            levels=("", ()),
            failed=False,
        )
    )


def rows_of(found, *names):
    return {
        name: [
            [round(cell, 4) if isinstance(cell, float) else cell for cell in row]
            for row in found.table(name).rows
        ]
        for name in names
    }


OF_RECORDS = found_of(
    "abc",
    sure(0.5),
    at_gaps={0.0: [*RUNS.values()], 0.1: [RUNS["a"], RUNS["b"]]},
    free=[
        ran("moving", 0.3, reach={"left": 0.5, "right": 0.07}),
        ran("overturned left", reach={"left": 2.0, "right": 0.02}),
    ],
    others={
        "cm": {
            "a": ran("at rest", 0.25),
            "b": ran("moving", 0.3),
            "c": Ran(outcome="", reason="no"),
        },
        LAW: {"b": ran("moving", 0.6)},
    },
    sure={
        "": sure(0.5),
        "a": sure(0.0196),
        "b": sure(None),
        "c": sure(0.3, depends_on_law_from_s=1.5),
    },
)


def test_tables_of_three_records():
    """One of three falls: Wilson's interval. Errors of 0.0196 and, of a block that falls, of none:
    half of 0.01^2. A peak that changes by 0.2 alpha with the law of impacts counts half."""
    known = ("outcomes", "quantities", "gaps", "contributions", "criteria", "models", "runs")
    assert rows_of(OF_RECORDS, *known) == {
        "outcomes": [
            ["at rest", 1, None, None, None],
            ["moving", 1, None, None, None],
            ["overturned right", 1, None, None, None],
            ["overturned", 1, 0.3333, 0.0615, 0.7923],
        ],
        "quantities": [
            ["peak rotation", 0.3, 0.232, 0.368, 0.4, "α", "b", 2],
            ["slip", 0.02, 0.0132, 0.0268, 0.03, "m", "b", 2],
            ["top displacement", 0.4, 0.332, 0.468, 0.5, "m", "b", 2],
            ["speed at the wall", 0.4, 0.4, 0.4, 0.4, "m/s", "a", 1],
        ],
        "gaps": [
            [0.0, 3, Mark(1, "fail"), 2, 0.65, 0.9],
            [0.1, 2, Mark(0, "incomplete"), 1, 0.4, 0.4],
        ],
        "contributions": [
            ["records", 0.914, 0.4163, "scatter between the records"],
            ["impact law", 0.0527, 0.1, "half the difference between the laws of impacts"],
            ["model form", 0.033, 0.0791, "difference of the other models"],
            ["numerical error", 0.0003, 0.0071, "u_num of the model's own step or tolerance"],
        ],
        "criteria": [
            ["uplift", "uplifts", "2 of 3", 3, 2, 0.3, 0.4, "α", Mark(2, "changed")],
            ["sliding", "slides", "2 of 3", 2, 1, 0.05, 0.01, "m", Mark(1, "changed")],
            ["step of velocity", "overturns", "2 of 3", 1, 2, 1.5, 0.4, "α", Mark(0)],
            ["sliding block", "slides", "3 of 3", 2, 2, 0.04, 0.01, "m", Mark(0)],
            ["reserve sliding", "slides", "2 of 3", 2, 1, 0.01, 0.01, "m", Mark(2, "changed")],
            ["reserve rocking", "overturns", "2 of 3", 1, 2, 0.3, 0.4, "α", Mark(2, "changed")],
        ],
        "models": [
            ["cm", 2, 0, 0.0791, 0.1, 1.0124, 0.1363],
            ["another law of impacts", 1, 0, 0.2, 0.2, None, None],
        ],
        "runs": [
            [Mark("a", link="histories/a.csv"), "at rest", 0.2, 0.01, 0.3, 0.4],
            [Mark("b", link="histories/b.csv"), "moving", 0.4, 0.03, 0.5, None],
            [Mark("c", link="histories/c.csv"), "overturned right", None, None, None, 0.9],
        ],
    }
    assert OF_RECORDS.failures == {"c, cm": "no"}


def test_a_single_run_has_no_statistics():
    """Nor is there a record that it belongs to, or a share of nothing that is known."""
    own = sure(None)
    found = found_of("a", own, at_gaps={}, free=[], others={}, sure={"": own})
    briefly = {
        table.name: " ".join(column.name for column in table.columns if column.brief)
        for table in found.tables()
        if table.on == "all"
    }
    assert {name: briefly.get(name) for name in ("outcomes", "quantities", "contributions")} == {
        "outcomes": None,
        "quantities": "quantity largest unit",
        "contributions": "source share sd",
    }
    assert (found.exit_code, [plot.name for plot in found.plots()]) == (1, ["histories"])
    assert rows_of(found, "numerical", "contributions") == {
        "numerical": [["peak_rotation", 0.2, None, None, "alpha", "not converged"]],
        "contributions": [],
    }


def test_figures_of_three_records():
    """Each history ends where it ends: the longest at 4 s, at 0.1 alpha; one at rest is carried on,
    one that moves or fell is not."""
    plots = {plot.name: plot for plot in OF_RECORDS.plots()}
    assert [one["values"] for one in plots["motion"].data] == [[0.2, 0.4], [0.01, 0.03], [0.3, 0.5]]
    assert [one.y for panel in plots["gaps"].panels for one in panel.series] == [
        [2 / 3, 1 / 2],
        [1 / 3, 0.0],
        [pytest.approx(0.65), 0.4],
        [0.9, 0.4],
    ]
    assert [
        (one.label, one.x[-1], one.y[-1], one.y.count(None))
        for one in plots["histories"].panels[0].series
    ] == [
        ("a", 4.0, pytest.approx(0.1), 0),
        ("b", 4.0, None, 200),
        ("c", 4.0, None, 300),
    ]
    assert plots["histories"].y.limits == pytest.approx((-0.005, 0.105))


@pytest.mark.parametrize(
    ("samples", "hits", "low", "sd"),
    [(0, 1, 0.0945, {}), (4, 2, 0.0369, {"inputs": 0.0354})],
)
def test_draws_count_in_the_place_of_the_runs_as_they_are(samples, hits, low, sd):
    """Four draws each: the peaks of a stray by 0.05 about 0.2, those of c are all 1, fallen or
    not. The interval is Wilson's for two runs, and for three: so many as the records part. What is
    uncertain and not drawn is told."""
    drawn = {
        "a": [ran("moving", peak) for peak in (0.15, 0.25, 0.25, 0.15)],
        "c": [ran("moving", 1.0)] * 2 + [ran("overturned left")] * 2,
    }
    drawn = drawn if samples else {}
    found = found_of("ac", sure(0.5), samples, drawn=drawn, at_gaps={}, free=[], others={}, sure={})
    overturning = found.data["overturning"]
    assert (overturning["count"], overturning["low"]) == (hits, pytest.approx(low, abs=1e-4))
    assert {
        source: size for source, _, size, _ in rows_of(found, "contributions")["contributions"]
    } == sd | {"records": 0.5657}
    notes = [line for block in found.blocks if isinstance(block, Text) for line in block.items]
    assert any("floor.friction" in line for line in notes) == (not samples)
