"""Tasks of an assessment: what each plays, by a batch that is made up."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from assessed import SCENE

from rockcheck import Record, Rest, Wall
from rockcheck.ebm import fates
from rockcheck.validation.studies.population.factor_task import FactorTask
from rockcheck.validation.studies.population.rows import table_of
from rockcheck.validation.studies.population.tasks import (
    DrawTask,
    GapTask,
    PeaksTask,
    effort,
    history_text,
    motion_end,
)


@pytest.fixture
def batches(monkeypatch):
    """What is played, where runs overturn from a factor of 2, and that of -1 is not decided."""
    played = []

    def batch(task, which, **more):
        played.append(more)
        factor = np.broadcast_to(more["factor"], len(which))
        outcome = np.where(factor >= 2.0, fates.OVERTURNED_LEFT, fates.AT_REST)
        outcome = np.where(factor == -1.0, fates.UNDECIDED, outcome)
        peak = 0.1 * SCENE.block.alpha * np.abs(factor)
        return fates.Fates(outcome=outcome, time_s=np.ones(len(which)), peak=peak)

    monkeypatch.setattr(DrawTask, "batch", batch)
    return played


# Factors on the motion

LOOKED_AT = (1.0, 1.5, 3.0, 4.0)


def factor_search(*, both=False):
    task = FactorTask(("up",), SCENE, "ebm-unilateral", factors=LOOKED_AT, both=both)
    return task.play()


@pytest.mark.usefixtures("batches")
def test_the_factor_at_which_it_falls_is_narrowed_to_a_quarter_of_a_percent():
    (fall,) = factor_search().intervals
    assert fall.low == pytest.approx(2.0, abs=1.5 * 2.5e-3)
    assert fall.low - fall.stands_below <= 1.5 * 2.5e-3
    assert fall.high == 4.0


@pytest.mark.usefixtures("batches")
def test_all_runs_of_the_search_are_counted():
    """Four that are looked at, and 1.5 halved nine times, to 0.003."""
    assert factor_search().runs == 4 + 9


def test_the_vertical_motion_is_left_as_it_is(batches):
    factor_search()
    assert {batch["vertical_factor"] for batch in batches} == {1.0}


def test_the_vertical_motion_may_be_scaled_too(batches):
    factor_search(both=True)
    assert batches[0]["vertical_factor"].tolist() == list(LOOKED_AT)


# Gaps

GAPS = (0.0, 0.01, 0.02)
#: The only gaps (m) at which it falls, between those that are looked at.
DEADLY = (0.0132, 0.0138)


def gap_search(monkeypatch, gaps):
    """The search of a scene with this gap, and of draws with the others."""

    def batch(task, which, gaps, restitution, *, keeps):
        falls = (gaps[1] >= DEADLY[0]) & (gaps[1] <= DEADLY[1])
        outcome = np.where(falls, fates.OVERTURNED_LEFT, fates.AT_REST)
        return fates.Fates(outcome=outcome, time_s=np.ones(len(which)), peak=0.1 * ~falls)

    monkeypatch.setattr(DrawTask, "batch", batch)
    first, *others = gaps
    return GapTask(
        ("gaps",),
        SCENE.replace(walls=[Wall(side="left", gap=first)]),
        "ebm-unilateral",
        draws=tuple((("walls.left.gap", gap),) for gap in others),
        side="left",
        fine=GAPS,
        coarse=GAPS,
        tabulated=GAPS,
        reach=(math.inf,) * len(gaps),
        free_stands=(True,) * len(gaps),
    ).play()


@pytest.mark.parametrize(
    ("gaps", "falling"),
    [([0.0135], [0]), ([0.011], []), ([0.011, 0.0135, 0.005], [1]), ([0.0135, 0.0134], [0, 1])],
)
def test_a_run_that_falls_at_its_own_gap_is_never_told_to_stand_there(monkeypatch, gaps, falling):
    found = gap_search(monkeypatch, gaps)
    assert [fall.draw for fall in found.intervals] == falling
    for fall in found.intervals:
        assert (fall.low, fall.high) == pytest.approx(DEADLY, abs=1e-4)


# Peaks at factors


def peaks(*, both=False):
    factors = (0.5, -0.5, -1.0, 2.5)
    return PeaksTask(("up",), SCENE, "ebm-unilateral", factors=factors, both=both).play().peaks


@pytest.mark.usefixtures("batches")
def test_peaks_are_in_units_of_the_slenderness():
    assert peaks()[:2] == pytest.approx([0.05, 0.05])


@pytest.mark.usefixtures("batches")
def test_a_run_that_is_not_decided_has_no_peak():
    assert math.isnan(peaks()[2])


@pytest.mark.usefixtures("batches")
def test_the_peak_of_a_fall_is_beyond_all():
    assert peaks()[3] == math.inf


def test_peaks_leave_the_vertical_motion_as_it_is(batches):
    peaks()
    assert batches[0]["vertical_factor"] == 1.0


def test_a_mirrored_motion_has_the_same_vertical_one(batches):
    peaks(both=True)
    assert batches[0]["vertical_factor"].tolist() == [0.5, 0.5, 1.0, 2.5]


# What a task needs


@pytest.mark.parametrize(
    ("model", "runs", "seconds", "where"),
    [
        ("ebm-unilateral", 119_000, 59.5, "here"),
        ("ebm-unilateral", 121_000, 60.5, "worker"),
        ("cm", 59, 0.0295, "here"),
        ("mujoco", 2, 2.0, "worker"),
    ],
)
def test_a_study_of_less_than_a_minute_by_a_compiled_model_is_played_here(
    model, runs, seconds, where
):
    needs = effort(model, {}, runs, runs)
    assert needs["where"] == where
    assert needs["expected"] == pytest.approx(seconds)


# Histories


def test_a_motion_lasts_as_long_as_the_base_moves():
    record = Record.from_samples([1.0, 2.0, 0.0], 5.0)
    scene = SCENE.replace(excitation=Rest(), vertical=record, duration=2.0)
    assert motion_end(scene) == 10.0
    assert motion_end(scene.replace(duration=12.0)) == 12.0


def rows_until(until):
    """Times of the rows of a history of 4001 rows at 1 ms that are kept up to a time."""

    history = SimpleNamespace(channels={"t": 1e-3 * np.arange(4001), "theta": np.zeros(4001)})
    _, *rows = history_text(history, until).splitlines()
    return [float(row.split(",")[0]) for row in rows]


def test_a_short_history_is_kept_whole_up_to_its_end():
    times = rows_until(1.999)
    assert len(times) == 2000
    assert times[-1] == pytest.approx(1.999)


def test_of_a_long_history_every_other_row_is_kept():
    times = rows_until(2.0)
    assert len(times) == 1001
    assert times[1] == pytest.approx(2e-3)


# Batches


def test_the_motion_of_a_draw_is_that_of_its_scene(monkeypatch):
    tables = []
    monkeypatch.setattr(fates, "play_fates", lambda table, model, **how: tables.append(table))
    DrawTask(("up",), SCENE, "ebm-unilateral").batch(np.array([0]))
    assert tables[0].factor.tolist() == [1.0]
    assert tables[0].vertical_factor.tolist() == [1.0]


# Rows of a batch


def test_a_gap_is_of_one_side_and_the_other_is_the_scene_s():
    table = table_of([SCENE], np.array([0, 0]), gaps=("right", np.array([0.1, 0.2])))
    assert table.gap_right.tolist() == [0.1, 0.2]
    assert np.isnan(table.gap_left).all()


def test_without_gaps_all_are_the_scene_s():
    table = table_of([SCENE], np.array([0]))
    assert np.isnan([*table.gap_left, *table.gap_right]).all()
    assert table.restitution == 0.0
    assert table.factor.tolist() == [1.0]
    assert table.vertical_factor.tolist() == [1.0]


def test_scenes_under_one_motion_have_it_once():
    other = SCENE.replace(floor=SCENE.floor.replace(friction=0.7))
    shaken = SCENE.replace(excitation=Record.from_samples([1.0, 2.0], 0.1))
    table = table_of([SCENE, other, shaken], np.array([2, 0, 1]))
    assert table.motion.tolist() == [1, 0, 0]
    assert [motion for motion, _ in table.motions] == [SCENE.excitation, shaken.excitation]
