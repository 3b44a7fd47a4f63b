"""The page of an ensemble: its distributions, and scene by scene."""

import numpy as np
import pytest

from rockcheck.reports import ensemble_page
from rockcheck.reports.ensemble_page import FALLEN, LOWEST, MOST, EnsembleView
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.finding import Mark
from rockcheck.validation.suite import results

PEAKS = {"ebm": [0.1, 0.2, 0.5, 2.0], "cm": [0.1, 0.3, 2.0, 2.0], "mujoco": [0.1, None, 0.2, 0.3]}
DEFINITION = {
    "name": "crowd",
    "count": 4,
    "friction": {"uniform": [0.3, 0.8]},
    "pulse": {"period": {"uniform": [0.4, 1.5]}, "amplitude": {"lognormal": [6.0, 0.4]}},
    "scene": {
        "duration": 6.0,
        "block": {"half_width": 0.4, "half_height": 1.5},
        "floor": {"friction": 0.5},
    },
}


def outcome(peak):
    return "it crashed" if peak is None else "overturned left" if peak == 2.0 else "at rest"


@pytest.fixture
def view(tmp_path):
    """The view of an ensemble of four scenes with these peaks in alpha, by model."""

    def make(peaks=PEAKS, reference="ebm", scene=None):
        cells = tuple(
            results.Cell(scene="crowd", model=model, status="done", reason=f"no {model}")
            for model in peaks
        )
        definition = DEFINITION | {"scene": DEFINITION["scene"] | (scene or {})}
        record = results.EnsembleRecord(
            name="crowd",
            definition=definition,
            peaks={model: tuple(values) for model, values in peaks.items()},
            outcomes={model: tuple(map(outcome, values)) for model, values in peaks.items()},
        )
        run = results.Run(
            suite="made up",
            created="2026-01-01",
            reference=reference,
            models=tuple(peaks),
            scenes={},
            cells=cells,
            ensembles=(record,),
        )
        return EnsembleView(run, "crowd", "crowd", record)

    return make


def test_models_are_held_against_the_reference_or_the_first_that_finished(view):
    assert view().references == ("ebm",)
    assert view(reference="mujoco").references == ("ebm",)
    assert view(reference="cm").references == ("cm",)


def test_a_curve_ends_at_the_share_that_stays(view):
    curves = view().curves
    assert curves == {"ebm": ([0.1, 0.2, 0.5], [0.25, 0.5, 0.75]), "cm": ([0.1, 0.3], [0.25, 0.5])}
    assert view().missing == {"mujoco": "no mujoco"}


def test_shares_rise_by_a_scene_at_each_peak(view):
    shares, difference = view().distributions().panels
    own, other = (dict(zip(one.x, one.y, strict=True)) for one in shares.series)
    assert own == pytest.approx({0.0: 0.0, 0.1: 0.25, 0.2: 0.5, 0.3: 0.5, 0.5: 0.75, 1.05: 0.75})
    assert other == pytest.approx({0.0: 0.0, 0.1: 0.25, 0.2: 0.25, 0.3: 0.5, 0.5: 0.5, 1.05: 0.5})
    step, band = difference.series
    np.testing.assert_allclose(step.y, np.subtract(list(other.values()), list(own.values())))
    assert band.y == (0.0,)
    assert band.x == (0.0, 1.05)
    # Kolmogorov and Smirnov's distance of two samples of four, at 95 %.
    assert band.high == pytest.approx([1.358 * np.sqrt(2 / 4)] * 2, rel=1e-3)
    assert band.low == tuple(-one for one in band.high)


def test_peaks_beyond_one_and_a_half_are_not_drawn(view):
    plot = view(PEAKS | {"cm": [0.1, 0.3, 0.9, 2.0]}).distributions()
    assert plot.x.limits == (0.0, 1.05 * MOST)


def test_scene_by_scene_those_that_fall_in_one_model_are_crosses(view):
    plot = view().by_scene()
    (panel,) = plot.panels
    equal, same, apart = panel.series
    assert equal.x == equal.y == (LOWEST, MOST)
    assert list(zip(same.x, same.y, strict=True)) == [(0.1, 0.1), (0.2, 0.3), (FALLEN, FALLEN)]
    assert list(zip(apart.x, apart.y, strict=True)) == [(0.5, FALLEN)]
    low, high = plot.x.limits
    assert 0.0 < low < LOWEST
    assert FALLEN < high < 10.0
    assert plot.y.limits == plot.x.limits


def test_peaks_out_of_the_axes_stand_at_their_ends(view):
    peaks = {"ebm": [1e-6, 0.1, 0.2, 9.0], "cm": [0.1, 0.1, 0.2, 0.9]}
    (panel,) = view(peaks).by_scene().panels
    assert panel.series[1].x[0] == LOWEST
    assert MOST < panel.series[1].x[-1] < FALLEN


def test_who_falls_where_is_counted_beside_the_statistics(view):
    figures = tuple(
        Figure(measure=name, label=name, unit="1", value=0.5, against="ebm", note="[0, 1], [2, 3]")
        for name in ensemble_page.STATISTICS_SHOWN
    )
    one = view()
    vars(one)["cells"] = [
        cell.model_copy(update={"figures": figures if cell.model == "cm" else ()})
        for cell in one.cells
    ]
    (row,) = one.agreement("ebm").rows
    assert row[:5] == ["cm", 1, 0, 1, 2]
    assert row[5] == Mark(0.5, more="[0, 1]\n[2, 3]")
    assert one.agreement("cm").rows == []


def test_facts_tell_what_is_drawn_and_from_which_scene(view):
    facts = dict(view().facts())
    assert facts["scenes"].startswith("4, seed ")
    assert "friction" in facts
    assert "block" in facts
    assert "base" not in facts
    shaken = dict(view(scene={"excitation": {"kind": "rest"}}).facts())
    assert "block" not in shaken


def test_an_ensemble_of_one_model_is_not_drawn_scene_by_scene(view):
    alone, both = (
        [block.name for block in view(peaks).page().plots()]
        for peaks in ({"ebm": [0.1] * 4}, PEAKS)
    )
    assert alone == ["crowd"]
    assert both == ["crowd", "crowd~scenes"]
