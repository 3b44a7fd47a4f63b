"""Histories of many scenes at once are those of one at a time, to the bit."""

import math

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.ensemble import play_ensemble
from rockcheck.scenes import Block, Floor, InputError, ModelFailure, Ricker, Scene, Wall

MODEL = EventBasedModel(pivot="unilateral", tolerance=1e-9)


@pytest.fixture(scope="module")
def scenes() -> list[Scene]:
    """Blocks of four sizes, at rest, moving and fallen in the end."""
    return [
        Scene(
            name=f"{size} {amplitude}",
            block=Block(half_width=0.397 * size, half_height=1.555 * size),
            floor=Floor(friction=0.4),
            walls=[Wall(side="left", gap=0.053, restitution=0.5)],
            excitation=Ricker(amplitude=amplitude, period=1.2),
            duration=4.0,
            output_step=0.02,
        )
        for size in (0.25, 0.5, 1.0, 1.7)
        for amplitude in (3.0, 5.0, 7.0, 14.0)
    ]


def test_as_one_at_a_time(scenes):
    found = play_ensemble(scenes, MODEL, rows=1000, jobs=3)
    assert {-1, 0, 1} >= set(found.side.tolist()) > {0}
    for i, scene in enumerate(scenes):
        history = MODEL.simulate(scene)
        theta = history.channels["theta"]
        assert np.array_equal(found.t[: len(theta)], history.channels["t"])
        assert np.array_equal(found.theta[i, : len(theta)], theta)
        if found.side[i]:
            assert history.outcome == f"overturned {'left' if found.side[i] < 0 else 'right'}"
            assert np.all(found.theta[i, len(theta) :] == -0.5 * math.pi * found.side[i])
            assert found.peak[i] == pytest.approx(0.5 * math.pi)
        else:
            assert not history.outcome.startswith("overturned")
            assert found.peak[i] >= np.max(np.abs(theta)) > found.peak[i] - 1e-3
            assert found.last_slip[i] == pytest.approx(history.channels["slip"][-1], abs=1e-12)


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_threads_change_nothing(scenes, jobs):
    once, again = (
        play_ensemble(scenes, MODEL, rows=50),
        play_ensemble(scenes * 5, MODEL, rows=50, jobs=jobs),
    )
    assert np.array_equal(np.tile(once.theta, (5, 1)), again.theta)
    assert np.array_equal(np.tile(once.peak, 5), again.peak)


def test_what_fails_is_told(scenes):
    with pytest.raises(ModelFailure, match="scene 0 of the ensemble: the cap on steps was reached"):
        play_ensemble(scenes, MODEL.model_copy(update={"most_steps": 3}))
    with pytest.raises(InputError, match="Coulomb"):
        play_ensemble(scenes, EventBasedModel(friction="bouc-wen"))
