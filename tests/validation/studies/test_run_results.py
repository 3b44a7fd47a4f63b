"""What is kept of a run: the same from a batch as from the model's history."""

import math

import numpy as np
import pytest

from rockcheck import Block, EventBasedModel, Floor, Rest, Ricker, Scene, Wall
from rockcheck.ebm import fates
from rockcheck.validation.studies.population import results

MODEL = EventBasedModel(pivot="unilateral")
BLOCK = Block(half_width=0.2, half_height=1.0)
STRIKES = Scene(
    name="strikes the left wall once",
    block=BLOCK,
    floor=Floor(friction=0.5),
    walls=[Wall(side="left", gap=0.02, restitution=0.5), Wall(side="right", gap=0.9)],
    excitation=Ricker(amplitude=2.5, period=0.8),
    duration=60.0,
)
SCENES = [
    STRIKES,
    STRIKES.replace(walls=(), excitation=Ricker(amplitude=12.0, period=1.5)),
    STRIKES.replace(walls=(), excitation=Rest(), initial_rotation=-0.1),
]


def batch_of(*scenes, **columns):
    count = len(scenes)
    table = fates.RunTable(
        **{
            "scenes": scenes,
            "motions": [(scene.excitation, scene.vertical) for scene in scenes],
            "scene": np.arange(count),
            "motion": np.arange(count),
            "factor": np.ones(count),
            "vertical_factor": np.ones(count),
            "gap_left": np.full(count, np.nan),
            "gap_right": np.full(count, np.nan),
        }
        | columns
    )
    played = fates.play_fates(table, MODEL, keeps=fates.Keep.EXTREMES, jobs=1)
    return results.results_of(played, [scene.block.alpha for scene in scenes])


@pytest.fixture(scope="module")
def both():
    """By scene, the result from a batch and that from its history."""
    histories = [MODEL.simulate(scene) for scene in SCENES]
    alone = [
        results.result_of(history.outcome, history.extremes, scene.block.alpha)
        for scene, history in zip(SCENES, histories, strict=True)
    ]
    return list(zip(batch_of(*SCENES), alone, strict=True))


@pytest.mark.parametrize("k", range(len(SCENES)))
@pytest.mark.parametrize("field", ["fate", "peak_rotation", "slip", "reach", "wall_speed"])
def test_a_batch_keeps_of_a_run_what_its_history_does(both, k, field):
    batch, alone = both[k]
    value = getattr(alone, field)
    expected = value if field == "fate" else pytest.approx(value, rel=1e-6, abs=1e-9)
    assert getattr(batch, field) == expected


def test_only_walls_that_were_struck_have_a_speed(both):
    assert [list(batch.wall_speed) for batch, _ in both] == [["left"], [], []]


def test_a_peak_is_in_units_of_alpha(both):
    batch, _ = both[2]
    assert batch.peak_rotation == pytest.approx(0.1 / math.atan(0.2), rel=1e-6)


def test_a_run_that_failed_has_a_reason_and_no_figure():
    """The block leans to the left, into a wall that touches it."""
    touched = STRIKES.replace(initial_rotation=0.0)
    leans = STRIKES.replace(walls=(), excitation=Rest(), initial_rotation=0.1)
    failed, _ = batch_of(
        leans.replace(walls=[Wall(side="left", gap=0.9)]),
        touched,
        gap_left=np.array([0.0, np.nan]),
    )
    assert failed.fate == "failed"
    assert failed.reason == "the block would start inside a wall"
    assert failed.peak_rotation is None


def test_a_fate_that_was_known_at_once_took_no_time():
    assert results.Shown(result=results.RunResult(fate="at rest")).until_s == 0.0
