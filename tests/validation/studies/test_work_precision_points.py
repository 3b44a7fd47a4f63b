"""Points, orders and runs of the diagrams, from runs made up."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from rockcheck import Event
from rockcheck.scenes import Cost
from rockcheck.validation.studies.work_precision import convergence, points, runs
from rockcheck.validation.studies.work_precision.benchmark_scenes import WALLS
from rockcheck.validation.studies.work_precision.curves import LEVEL
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun, Play, errors_of

WALL, OTHER_WALL = list(WALLS)[:2]


def run(value, rms, *, family=WALL, line="mujoco", **more):
    return BenchmarkRun(family, 0, line, value, 2.0, rms=rms, **{"against_ebm": 1.0} | more)


# Convergence beside walls


def levels(*samples):
    return convergence.levels_of(points.frame_of(samples)).to_dict("records")


def test_a_setting_has_its_median_its_largest_error_and_how_many_are_within():
    first, _ = levels(
        run(1e-3, 0.5 * LEVEL, step=1e-3),
        run(1e-3, LEVEL, step=2e-3, family=OTHER_WALL),
        run(1e-3, 2.0 * LEVEL, step=3e-3, family=OTHER_WALL),
    )
    assert first["reference"] == "ebm-unilateral"
    assert first["median"] == LEVEL
    assert first["largest"] == 2.0 * LEVEL
    assert first["within"] == 2
    assert first["runs"] == 3
    assert first["step"] == 2e-3


def test_errors_against_the_paper_s_model_are_rows_of_their_own():
    _, second = levels(run(1e-3, LEVEL, against_ebm=0.25))
    assert second["reference"] == "ebm"
    assert second["median"] == 0.25


def test_a_run_that_failed_is_infinitely_wrong_and_has_no_step():
    first, _ = levels(
        run(1e-3, LEVEL, step=1e-3), run(1e-3, math.nan, step=9.0, failure="it blew up")
    )
    assert first["largest"] == math.inf
    assert first["step"] == 1e-3
    assert first["within"] == 1


def test_settings_are_coarse_to_fine():
    values = [row["value"] for row in levels(run(1e-4, LEVEL), run(1e-2, LEVEL), run(1e-3, LEVEL))]
    assert values == [1e-2, 1e-3, 1e-4] * 2


def orders(*samples):
    frame = points.frame_of(samples)
    return convergence.orders_of(frame, convergence.levels_of(frame))


def test_orders_are_of_the_median_and_of_each_scene():
    """Of first order in one scene, and of second in the other."""
    samples = [
        run(step, rms, family=family, step=step, against_ebm=rms)
        for family, rms_of in ((WALL, lambda h: 0.1 * h), (OTHER_WALL, lambda h: h**2))
        for step in (1e-2, 1e-3)
        for rms in (rms_of(step),)
    ]
    found = orders(*samples)
    of_scenes = found[found.reference == "ebm-unilateral"].set_index("scene").order
    assert of_scenes[WALL] == pytest.approx(1.0)
    assert of_scenes[OTHER_WALL] == pytest.approx(2.0)
    assert "" in of_scenes


def exceptions(errors, order, *, reference="ebm-unilateral", scene=WALL):
    frame = points.frame_of([run(10.0**-k, rms) for k, rms in enumerate(errors)])
    rows = [("mujoco", reference, order, scene)]
    columns = ["model", "reference", "order", "scene"]
    return list(convergence.exceptions_of(frame, pd.DataFrame(rows, columns=columns)))


@pytest.mark.parametrize(
    ("finest", "order", "told"),
    [
        (2.0 * LEVEL, 1.0, True),
        (LEVEL, 1.0, False),
        (0.5 * LEVEL, 1.0, False),
        (0.5 * LEVEL, 0.5, False),
        (0.5 * LEVEL, 0.4, True),
        (0.5 * LEVEL, math.nan, True),
        (0.9e-6, 0.0, False),
        (math.inf, 1.0, False),
    ],
)
def test_a_scene_is_an_exception_whose_finest_error_is_large_or_falls_slowly(finest, order, told):
    assert bool(exceptions([0.1, finest], order)) == told


def test_the_finest_error_counts():
    assert exceptions([2.0 * LEVEL, 0.5 * LEVEL], 1.0) == []


@pytest.mark.parametrize("more", [{"reference": "ebm"}, {"scene": ""}])
def test_only_scenes_against_the_unilateral_model_are_looked_at(more):
    assert exceptions([0.1, 0.1], 0.0, **more) == []


# Points


def point(*samples):
    (row,) = points.points_of(points.frame_of(samples)).to_dict("records")
    return row


def test_a_point_has_the_median_halfway_between_two_errors():
    row = point(*(run(1e-3, rms) for rms in (1.0, 2.0, 4.0, 9.0)))
    assert row["rms"] == 3.0
    assert row["rms_worst"] == 9.0
    assert row["failed"] == 0


def test_quantiles_are_errors_of_the_sample():
    row = point(*(run(1e-3, float(rms)) for rms in range(1, 12)))
    assert row["rms"] == 6.0
    assert row["rms_10"] == 2.0
    assert row["rms_90"] == 10.0


def test_a_point_with_a_failed_run_is_infinitely_wrong_at_worst():
    row = point(run(1e-3, 1.0, cpu=3.0), run(1e-3, math.nan, failure="it blew up"))
    assert row["failed"] == 1
    assert row["runs"] == 2
    assert row["rms_worst"] == math.inf
    assert row["cpu"] == 1.5


def test_costs_are_those_of_a_simulated_second():
    row = point(run(1e-3, 1.0, cpu=3.0, wall=5.0, steps=200, set_up=0.4, peak=0.3))
    assert [row[name] for name in ("cpu", "wall", "steps")] == [1.5, 2.5, 100.0]
    assert [row[name] for name in ("set_up", "peak")] == [0.4, 0.3]


def test_a_cost_is_a_multiple_of_that_of_the_event_based_model():
    rows = [
        ("free", line, value, rms, cpu)
        for line, cpu in (("ebm", 2.0), ("mujoco", 6.0))
        for value, rms in ((1e-2, 10.0 * LEVEL), (1e-3, LEVEL))
    ]
    frame = pd.DataFrame(rows, columns=["family", "line", "value", "rms", "cpu"])
    trends = points.trends_of(frame).set_index("line")
    assert trends.ratio["mujoco"] == pytest.approx(3.0)
    assert trends.ratio["ebm"] == pytest.approx(1.0)
    assert trends.order["mujoco"] == pytest.approx(1.0)


# Runs


def test_errors_are_in_units_of_the_slenderness(made):
    t = np.linspace(0.0, 1.0, 101)
    swing = 0.4 * np.sin(math.pi * t)
    hits = [[Event(t=at, kind="floor impact")] for at in (0.5, 0.53)]
    reference, history = made(swing, t, events=hits[0]), made(1.5 * swing, t, events=hits[1])
    errors = errors_of(reference, history)
    assert errors["largest"] == pytest.approx(0.2)
    assert errors["peak"] == pytest.approx(0.2)
    assert errors["rms"] == pytest.approx(0.2 * math.sqrt(0.5), rel=1e-3)
    assert errors["first_impact"] == pytest.approx(0.03)


def test_the_first_impact_is_of_floor_or_wall(made):
    events = [
        Event(t=0.1, kind="uplift"),
        Event(t=0.5, kind="floor impact"),
        Event(t=0.3, kind="wall impact"),
    ]
    assert runs.first_impact(made([0.0, 0.1], events=events)) == 0.3
    assert math.isnan(runs.first_impact(made([0.0, 0.1])))


@pytest.fixture
def played(made, monkeypatch):
    """A run of a line at 1e-3, and how often it was played, by a model of so many seconds a run."""

    def play(line, *, wall=0.01, time_step=1e-3):
        history = made([0.0, 0.1, 0.2])
        costs = []

        def simulate(scene):
            costs.append(Cost(wall_seconds=wall, cpu_seconds=len(costs) + 1.0, steps=len(costs)))
            return dataclasses.replace(history, cost=costs[-1], settings={"time_step": time_step})

        ready = SimpleNamespace(
            scene=SimpleNamespace(duration=2.0),
            references={"ebm": history, "ebm-unilateral": history},
        )
        monkeypatch.setattr(runs, "prepared", lambda family, member: ready)
        model = SimpleNamespace(simulate=simulate)
        monkeypatch.setattr(runs.models, "build", lambda family, settings: model)
        (result,) = Play("free", 0, line, 1e-3, repeats=3).play()
        return result, len(costs)

    return play


@pytest.mark.parametrize(("wall", "count"), [(0.019, 3), (0.02, 1), (1.0, 1)])
def test_a_short_run_is_played_again_for_its_median_time(played, wall, count):
    result, times = played("mujoco", wall=wall)
    assert times == count
    assert result.cpu == (2.0 if count == 3 else 1.0)
    assert result.steps == 0


@pytest.mark.parametrize(
    ("line", "time_step", "step"),
    [
        ("mujoco", 2e-3, 2e-3),
        ("mujoco adaptive", "adaptive", 1e-3),
        ("mujoco tolerance", "adaptive", math.nan),
    ],
)
def test_the_step_of_a_run_is_its_own_or_the_largest(played, line, time_step, step):
    result, _ = played(line, time_step=time_step)
    assert result.step == pytest.approx(step, nan_ok=True)
    assert result.horizon == 2.0
    assert result.rms == 0.0
