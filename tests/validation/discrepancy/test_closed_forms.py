"""Closed forms against the event-based model, which must meet them, and scenes that have none."""

import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.validation.discrepancy.compare import describe
from rockcheck.validation.suite.suites import load_suite

FORMS = {
    "sliding": ("sliding_distance_error",),
    "rebound": ("wall_rebound_error",),
    "drop": ("bounce_height_error",),
    "rocking": ("quarter_period_error", "impact_ratio_error"),
}


@pytest.mark.parametrize("name", FORMS)
def test_the_event_based_model_meets_them(name):
    scene = load_suite("engines").scenes[name]
    history = EventBasedModel(pivot="unilateral").simulate(scene)
    every = [form for forms in FORMS.values() for form in forms]
    found = {figure.measure: figure for figure in describe(history, scene=scene, measures=every)}
    for form in every:
        if form in FORMS[name]:
            assert abs(found[form].value) < 5e-7, form
        else:
            assert found[form].value is None, f"{form} has no meaning for {name}"
            assert "needed" in found[form].note


def test_a_wrong_history_is_seen():
    scene = load_suite("engines").scenes["rocking"]
    heavier = EventBasedModel(pivot="unilateral").simulate(scene.replace(gravity=9.8))
    (figure,) = describe(heavier, scene=scene, measures=["quarter_period_error"])
    assert figure.value == pytest.approx(0.5 * 0.01 / 9.81 * 0.733, rel=0.01)
