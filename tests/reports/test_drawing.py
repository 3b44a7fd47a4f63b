"""How scenes, histories, comparisons and records draw themselves in a notebook."""

import numpy as np
import pytest

from rockcheck.reports.show import drawing
from rockcheck.reports.style import SPARE, look_of
from rockcheck.scenes import Event, Record, Scene
from rockcheck.scenes.recordings import Recording
from rockcheck.validation import compare

T = 0.01 * np.arange(400)
SWING = 0.3 * np.exp(-0.3 * T) * np.sin(3.0 * T)
G = 9.80665


def test_events_stand_on_tracks_of_their_kinds(made):
    events = [
        Event(t=1.0, kind="floor impact"),
        Event(t=1.5, kind="wall impact"),
        Event(t=2.0, kind="floor impact"),
        Event(t=2.5, kind="uplift"),
    ]
    rotation, _, tracks = drawing.history_figure(made(SWING, T, events=events)).axes
    assert [line.get_xydata().tolist() for line in tracks.lines] == [
        [[1.5, 0.0]],
        [[1.0, 1.0], [2.0, 1.0]],
    ]
    assert [word.get_text() for word in tracks.get_yticklabels()] == ["wall impact", "floor impact"]
    assert tracks.get_ylim() == (1.5, -0.5)
    high, middle, low = rotation.get_subplotspec().get_gridspec().get_height_ratios()
    assert high > middle > low
    np.testing.assert_allclose(rotation.lines[0].get_ydata(), SWING)
    assert rotation.lines[0].get_linewidth() < 2.0
    assert "made" in rotation.get_title()


def test_slip_is_drawn_in_mm_where_it_is_known(made):
    history = made(SWING, T, slip=1e-3 * T)
    _, slip, tracks = drawing.history_figure(history).axes
    np.testing.assert_allclose(slip.lines[0].get_ydata(), T)
    assert slip.lines[0].get_linewidth() < 2.0
    assert tracks.get_ylim() == (0.5, -0.5)
    del history.channels["slip"]
    assert len(drawing.history_figure(history).axes[1].lines) == 0


def test_without_a_block_angles_are_in_rad(made):
    known, unknown = made(SWING, T), made(SWING, T)
    object.__setattr__(unknown, "block", None)
    axes = drawing.history_figure(known).axes[0]
    assert axes.get_ylabel() == "θ / α"
    axes = drawing.history_figure(unknown).axes[0]
    assert axes.get_ylabel() == "θ, rad"
    np.testing.assert_allclose(axes.lines[0].get_ydata(), SWING * known.alpha)


def test_a_fall_is_cut_a_little_above_the_balance_point(made):
    falls = made(np.linspace(0.0, 4.0, 400), T, outcome="overturned left")
    assert drawing.history_figure(falls).axes[0].get_ylim()[1] == drawing.FALLEN
    stays = made(np.linspace(0.0, 1.5, 400), T)
    assert drawing.history_figure(stays).axes[0].get_ylim()[1] > 1.5


def test_a_comparison_shows_both_and_candidate_minus_reference(made):
    reference, candidate = made(SWING, T, model="ebm"), made(0.9 * SWING, T, model="cm")
    above, below = drawing.discrepancy_figure(compare(reference, candidate)).axes
    assert [line.get_color() for line in above.lines] == [look_of("ebm").light, look_of("cm").light]
    np.testing.assert_allclose(below.lines[0].get_ydata(), -0.1 * SWING, atol=1e-12)
    assert below.get_ylabel() == "difference, α"
    assert above.get_position().height > below.get_position().height


def test_two_histories_of_one_model_have_two_colours(made):
    found = compare(made(SWING, T, model="ebm"), made(0.9 * SWING, T, model="ebm"))
    lines = drawing.discrepancy_figure(found).axes[0].lines
    assert [line.get_color() for line in lines] == [look_of("ebm").light, SPARE[0].light]


def test_without_a_block_a_difference_is_in_rad(made):
    histories = [made(SWING, T), made(0.9 * SWING, T)]
    for history in histories:
        object.__setattr__(history, "block", None)
    below = drawing.discrepancy_figure(compare(*histories)).axes[1]
    assert below.get_ylabel() == "difference, rad"


def test_records_have_a_row_each():
    records = [
        (f"a$b {n}", Recording(samples=G * np.sin(T), time_step=0.01, unit="g", form="made"))
        for n in range(3)
    ]
    figure = drawing.recordings_figure(records)
    assert len(figure.axes) == 9
    assert 1.5 < figure.get_figheight() / 3 < 2.5
    acceleration, velocity, spectrum = figure.axes[:3]
    np.testing.assert_allclose(acceleration.lines[0].get_xydata(), np.column_stack([T, np.sin(T)]))
    np.testing.assert_allclose(velocity.lines[0].get_ydata(), G * (1.0 - np.cos(T)), atol=1e-4 * G)
    assert spectrum.lines[0].get_xdata()[[0, -1]] == pytest.approx([0.1, 4.0])
    assert acceleration.get_title(loc="left") == "a\\$b 0"


def test_a_scene_s_base_is_drawn_with_its_vertical_motion_if_there_is_one():
    scene = Scene(
        name="a",
        block={"half_width": 0.4, "half_height": 1.6},
        floor={"friction": 0.3},
        excitation=Record.from_samples([0.0, 1.0, 0.0], 0.013),
        duration=0.05,
    )
    across = drawing.scene_figure(scene).axes[1]
    (line,) = across.lines
    assert line.get_ydata().max() == 1.0
    assert line.get_xdata()[[0, -1]].tolist() == [0.0, 0.05]
    assert across.get_legend() is None
    both = drawing.scene_figure(scene.replace(vertical=scene.excitation)).axes[1]
    assert [word.get_text() for word in both.get_legend().texts] == ["horizontal", "vertical"]
