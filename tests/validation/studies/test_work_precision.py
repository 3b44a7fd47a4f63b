"""The benchmark: orders of convergence and error levels of every model at two settings (never
times), and its arithmetic."""

import itertools
import json
import math

import pandas as pd
import pytest

from rockcheck.reports.document import publish
from rockcheck.validation.execute import models, pool, provenance
from rockcheck.validation.studies.stress import maps, runs
from rockcheck.validation.studies.work_precision.benchmark_scenes import (
    DURATION,
    FAMILIES,
    GAPS,
    MEMBERS,
    PULSES,
    RESTITUTIONS,
    WALLS,
    prepared,
)
from rockcheck.validation.studies.work_precision.convergence import (
    exceptions_of,
    levels_of,
    orders_of,
)
from rockcheck.validation.studies.work_precision.curves import FITTED, cost_at, error_at, slope
from rockcheck.validation.studies.work_precision.lines import LINES
from rockcheck.validation.studies.work_precision.points import (
    at_the_cost,
    frame_of,
    points_of,
    pooled,
)
from rockcheck.validation.studies.work_precision.runs import BenchmarkRun, Play
from rockcheck.validation.studies.work_precision.savings import KINDS, Saving, measured
from rockcheck.validation.studies.work_precision.study import Measure, WorkPrecision
from rockcheck.validation.studies.work_precision.timings import (
    CASES,
    LEVEL,
    at_level,
    batch_size,
    batch_times,
)

SOME = (1, 4, 7)
TWO_WALLS = ("long 53 mm e 0.5", "short 3 mm e 0")


def measure(family: str, member: int, line: str, value: float) -> BenchmarkRun:
    (found,) = Play(family, member, line, value, 1).play()
    return found


def order_and_error(family: str, line: str, coarse: float, fine: float) -> tuple[float, float]:
    """Order between two settings, and the median error at the fine one, alpha, of three members."""
    first, second = points_of(
        frame_of([measure(family, k, line, value) for k in SOME for value in (coarse, fine)])
    ).rms
    return math.log(first / second) / math.log(coarse / fine), second


@pytest.mark.parametrize(
    ("family", "line", "coarse", "fine", "order", "level"),
    [
        ("free", "ebm", 1e-6, 1e-10, 0.9, 1e-9),
        ("slip a", "ebm", 1e-6, 1e-10, 0.9, 2e-9),
        ("wall 53 mm e 0.5", "ebm-unilateral", 1e-6, 1e-10, 0.8, 2e-8),
        ("fig5a", "ebm-unilateral", 1e-4, 1e-10, 0.5, 1e-7),
        ("pulse a", "ebm-bouc-wen", 1e-4, 1e-5, 0.3, 2e-3),
        ("free", "cm", 1e-6, 1e-8, 0.9, 1e-6),
        ("slip a", "cm", 1e-6, 1e-8, 0.6, 2e-4),
        ("wall 53 mm e 0", "cm", 1e-5, 1e-7, 0.35, 1e-4),
        ("wall 53 mm e 0.5", "cm", 1e-6, 1e-8, 0.35, 5e-4),
        ("free", "mujoco", 1e-3, 1e-4, 0.4, 8e-4),
        ("slip a", "mujoco", 1e-3, 1e-4, 0.6, 1e-3),
        ("wall 53 mm e 0.5", "mujoco", 1e-2, 1e-4, 0.7, 2e-3),
        ("free", "pybullet", 1e-3, 1e-4, 0.4, 8e-4),
        ("slip a", "pybullet", 1e-3, 1e-4, 0.6, 1e-3),
        ("wall 53 mm e 0.5", "pybullet", 1e-2, 1e-4, 0.7, 2e-3),
    ],
)
def test_every_model_converges_to_its_limit(family, line, coarse, fine, order, level):
    found, error = order_and_error(family, line, coarse, fine)
    assert (found > order, error < level) == (True, True), (found, error)


@pytest.mark.parametrize("engine", ["mujoco", "pybullet"])
@pytest.mark.parametrize("family", ["pulse b", "slip b", "wall 3 mm e 0.5", "wall 53 mm e 0"])
def test_adaptive_engines_are_within_a_twenty_thousandth_of_alpha(engine, family):
    """At steps of at most 4 ms, which cost less than fixed ones of 1 ms."""
    samples = [measure(family, k, f"{engine} adaptive", 4e-3) for k in SOME]
    assert points_of(frame_of(samples)).rms[0] < 5e-5
    assert all(sample.steps < 450 * sample.horizon for sample in samples)


def test_the_error_of_mujocos_default_contact_stays_beside_a_wall():
    order, error = order_and_error("wall 53 mm e 0.5", "mujoco default", 1e-3, 2e-4)
    assert (abs(order) < 0.3, error > 0.02) == (True, True), (order, error)


@pytest.mark.parametrize(
    ("family", "members", "least", "most", "judges"),
    [
        *((family, MEMBERS, 1.5, 8.0, ("ebm", "ebm-unilateral")) for family in FAMILIES),
        *((name, 1, 3.0, DURATION, ("ebm-unilateral",)) for name in WALLS),
    ],
)
def test_members_stay_up_and_end_at_their_horizon(family, members, least, most, judges):
    """A member that fell would be compared over its fall only; without a wall that it hits the two
    limits are one model."""
    for ready in (prepared(family, k) for k in range(members)):
        assert least < ready.scene.duration <= most
        outcomes = {ready.references[judge].outcome for judge in judges}
        assert not outcomes & {"overturned left", "overturned right"}
        assert (ready.model_form > 1e-3) if ready.scene.walls else (ready.model_form < 1e-12)


def line_of(*points: tuple[float, float, float]) -> pd.DataFrame:
    return pd.DataFrame(points, columns=["value", "rms", "cpu"])


def test_the_order_is_the_slope_between_rounding_and_nonsense():
    line = line_of((1e-1, 0.9, 1.0), (1e-2, 3e-2, 1.0), (1e-3, 3e-4, 1.0), (1e-4, 1e-14, 1.0))
    assert [slope(one.value, one.rms, FITTED) for one in (line, line[:2])] == pytest.approx(
        [2.0, math.nan], nan_ok=True
    )


def test_the_cost_of_a_level_is_interpolated_between_logarithms():
    line = line_of((1e-2, 1e-2, 1.0), (1e-3, 1e-4, 16.0), (1e-4, 1e-5, 3.0))
    costs = [cost_at(one) for one in (line[:2], line[1:2], line)]
    assert costs == [(pytest.approx(4.0), False), (16.0, True), (3.0, False)]
    assert math.isnan(cost_at(line[:1])[0])


def test_the_error_of_adaptive_steps_is_told_at_the_cost_of_fixed_ones():
    line = line_of((4e-3, 1e-2, 1.0), (1e-3, 1e-4, 16.0))
    assert [error_at(line, cost) for cost in (4.0, 17.0)] == pytest.approx(
        [1e-3, math.nan], nan_ok=True
    )
    adaptive = (
        BenchmarkRun("pulse a", k, "mujoco adaptive", value, 3.0, rms=rms * (1 + k % 3), cpu=cpu)
        for value, rms, cpu in ((2e-3, 1e-3, 0.15), (1e-3, 1e-5, 0.6))
        for k in range(3)
    )
    every = pooled(frame_of([*(sample(k, 5e-3) for k in range(10)), *adaptive]))
    every["at_the_cost"] = at_the_cost(every)
    fixed, adaptive = every[(every.family == "all") & (every.value == 1e-3)].itertuples()
    assert (fixed.at_the_cost, adaptive.rms_worst) == pytest.approx((2e-4, 3e-5))


def sample(member: int, rms: float, **change: object) -> BenchmarkRun:
    return BenchmarkRun(
        "free",
        member,
        "mujoco",
        1e-3,
        3.0,
        rms=rms,
        cpu=0.3,
        wall=0.6,
        set_up=0.1,
        steps=3000,
        **change,
    )  # type: ignore[arg-type]


@pytest.mark.parametrize(("good", "rms"), [(10, 5.5e-3), (4, math.inf)])
def test_quantiles_are_those_of_the_sample_and_failed_runs_infinitely_wrong(good, rms):
    played = [sample(k, 1e-3 * (k + 1)) for k in range(good)]
    failed = BenchmarkRun("free", 10, "mujoco", 1e-3, 3.0, failure="it blew up")
    (row,) = points_of(frame_of(played + [failed] * (10 - good))).itertuples()
    assert (row.runs, row.failed, (row.rms, row.rms_10, row.rms_90, row.cpu)) == (
        10,
        10 - good,
        pytest.approx((rms, 1.5e-3, 9.5e-3 if good == 10 else math.inf, 0.1)),
    )


def test_every_member_meets_every_setting_once_and_only_the_finest_steps_are_not_timed():
    tasks = [task for task in WorkPrecision("models").tasks({}) if isinstance(task, Play)]
    lines = [line for line in LINES.values() if not models.not_installed(line.family)]
    settings = sum(len(line.values) for line in lines)
    assert len(set(tasks)) == len(tasks) == MEMBERS * len(FAMILIES) * settings
    assert {task for task in tasks if task.where == "worker" and task.clocked} == {
        task for task in tasks if LINES[task.line].knob == "time_step" and task.value < 1e-4
    }


@pytest.mark.parametrize(
    ("line", "scenes"),
    [("drake", {name for name in WALLS if not name.endswith("e 0.5")}), ("mujoco", set(WALLS))],
)
def test_who_has_no_restitution_plays_the_scenes_without_it(monkeypatch, line, scenes):
    monkeypatch.setattr("rockcheck.validation.execute.models.not_installed", lambda model: "")
    tasks = [task for task in WorkPrecision("convergence").tasks({}) if isinstance(task, Play)]
    assert {task.family for task in tasks if task.line == line} == scenes
    assert len(WALLS) == len(PULSES) * len(GAPS) * len(RESTITUTIONS) == 18


@pytest.mark.parametrize(
    ("model", "scene"),
    [
        pytest.param(line.label, scene, marks=[pytest.mark.slow] if line.family == "dart" else [])
        for line in LINES.values()
        for scene in TWO_WALLS
        if line.converge
        and not models.not_installed(line.family)
        and (line.label, scene) != ("drake", TWO_WALLS[0])  # Drake has no restitution
    ],
)
def test_errors_fall_against_the_unilateral_model_and_stall_against_the_papers(model, scene):
    coarse, fine = (measure(scene, 0, model, value) for value in LINES[model].converge[:2])
    form = prepared(scene, 0).model_form
    assert [(one.step, one.against_ebm) for one in (coarse, fine)] == [
        (pytest.approx(1e-3, rel=0.2), pytest.approx(form, rel=0.15)),
        (pytest.approx(1e-4, rel=0.1), pytest.approx(form, rel=0.05)),
    ]
    assert 5.0 * fine.rms < coarse.rms
    assert fine.rms < 2e-4


@pytest.mark.parametrize(
    ("task", "model", "timed"),
    [
        (Play("free", 0, "mujoco adaptive", 4e-3, where="timed"), "mujoco", True),
        (Play("free", 0, "mujoco", 3e-5, clocked=True), "mujoco", True),
        (Play(TWO_WALLS[0], 0, "cm", 1e-6, 1), "cm", False),
        (Measure("saving", "histories", where="timed"), "cm", True),
        (runs.Chunk("ebm-unilateral floor-first", 1, 0, 9), "ebm-unilateral", False),
        (runs.Chunk("pybullet", 1, 0, 9), "pybullet", False),
        (runs.Shrinking(runs.Broken("cm", "source", 1, 2, 0.3), 9), "cm", False),
        (maps.MapPoint("mujoco default", "size", 1.0), "mujoco", False),
    ],
)
def test_a_result_depends_on_the_code_of_its_model_and_a_time_on_the_machine(
    monkeypatch, task, model, timed
):
    monkeypatch.setattr(provenance, "_folder_digest", lambda folder: f"files of {folder}")
    monkeypatch.setattr(provenance, "digest", str)
    monkeypatch.setattr(provenance, "hardware", lambda: {"processor": "abacus"})
    provenance.code_digest.cache_clear()
    depends = json.dumps(task.depends(), default=str)
    provenance.code_digest.cache_clear()
    folder = models.family(model).module.split(".")[1]
    assert f"files of {folder}" in depends
    assert ("abacus" in depends) == timed


def made(*errors: float, model: str = "mujoco", scene: str = TWO_WALLS[0]) -> list[BenchmarkRun]:
    return [
        BenchmarkRun(scene, 0, model, step, 5.0, rms=error, against_ebm=0.1, step=step)
        for step, error in zip((1e-3, 1e-4, 1e-5), errors, strict=False)
    ]


def test_levels_and_orders_of_known_errors_and_what_does_not_converge_is_named():
    found = frame_of([*made(1e-2, 1e-3, 1e-4), *made(4e-2, 4e-4, 4e-6, scene=TWO_WALLS[1])])
    both = levels_of(found)
    levels, orders = both[both.reference == "ebm-unilateral"], orders_of(found, both)
    assert (levels["median"].tolist(), levels.within.tolist()) == (
        pytest.approx([2.5e-2, 7e-4, 5.2e-5]),
        [0, 2, 2],
    )
    order = orders.set_index(["reference", "scene"]).order
    known = {("ebm-unilateral", TWO_WALLS[0]): 1.0, ("ebm-unilateral", TWO_WALLS[1]): 2.0}
    known["ebm", ""] = 0.0
    assert {place: order[place] for place in known} == pytest.approx(known, abs=1e-12)
    assert not list(exceptions_of(found, orders))
    stalled, far = made(5e-4, 4e-4, 4e-4), made(1.0, 1e-1, 1e-2, scene=TWO_WALLS[1])
    found = frame_of([*stalled, *far, *made(1e-8, 1e-8, model="cm")])
    named = list(exceptions_of(found, orders_of(found, levels_of(found))))
    assert [line.partition(":")[0] for line in named] == [f"{scene}, mujoco" for scene in TWO_WALLS]


@pytest.mark.parametrize("case", CASES)
def test_batches_are_as_good_as_their_tolerance(case):
    rows = batch_times(case, 6)
    error = {row.tolerance: row.error_95 for row in rows}
    assert error[1e-10] < 2e-8
    assert error[1e-12] < min(1e-9, 0.1 * max(error[1e-6], 1e-12))
    assert [row for row in rows if row.failed or (row.wrong and row.tolerance <= 1e-8)] == []
    assert at_level(rows, case).error_95 <= LEVEL


def test_the_finding_holds_every_table(tmp_path):
    settings = (("ebm", 1e-4), ("ebm", 1e-8), ("cm", 1e-5), ("cm", 1e-6), ("mujoco", 1e-2))
    places = itertools.product(("free", "wall 53 mm e 0"), SOME, settings)
    tasks = (
        *(Play(family, k, *one, 1) for family, k, one in places),
        *(Play(scene, 0, "cm", value, 1) for scene in TWO_WALLS for value in (1e-6, 1e-8)),
    )
    done: dict[object, object] = {
        **{task: task.play() for task in tasks},
        Play("free", 0, "pybullet", 1e-2): pool.Failure("it blew up <fast>"),
        **{Play(scene, 0, "cm", 1e-9, 1): pool.Failure("it sank") for scene in TWO_WALLS},
        Measure("batch", "friction"): batch_times("friction", 6),
        Measure("size", "3", 20): [batch_size(20, 3)],
        Measure("saving", "made"): [Saving("cm", "wall", "ms", 2.0, 1.0)],
    }
    found, savings = map(WorkPrecision().gather, (done, dict([*done.items()][-1:])))
    names = ("work-precision", "orders-and-ratios", "levels", "batch-times", "savings")
    assert ([name for name in names if not found.table(name).rows], savings.answer) == ([], "")
    orders = [
        row["order"] for row in found.table("orders-and-ratios").records() if row["line"] == "ebm"
    ]
    assert (
        found.table("batch-sizes").records()[0]["runs"],
        found.table("order-spread").records()[0]["order"],
    ) == (20, pytest.approx(sum(orders) / 2.0))
    assert {row["failure"] for row in found.table("runs").records()} == {"", "it blew up <fast>"}
    publish(found, tmp_path)
    drawn = {path.stem for path in (tmp_path / "figures").glob("*.svg")}
    assert drawn >= {"without-a-wall", "beside-a-wall", "error-over-step", "batches"}


@pytest.mark.slow
def test_nothing_that_is_skipped_changes_the_motion():
    """Every saving but those that a scene may need (a sliding pivot's cone, a strong pulse's
    slip)."""
    found = [one for name in KINDS if name != "batches" for one in measured(name)]
    needed = {"cone correction", "friction limit"}
    for saving in found:
        reference = 2e-2 if saving.thing in needed or saving.model == "pybullet" else 1e-5
        assert not saving.change > reference, saving
        assert saving.cost_with > 0.0 < saving.cost_without
    assert {"ebm", "cm", "mujoco", "pybullet"} <= {saving.model for saving in found}
