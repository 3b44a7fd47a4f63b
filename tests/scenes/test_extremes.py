"""Extremes of a motion from its rows: largest of the cubics, both sides of impacts."""

import math
from dataclasses import replace

import numpy as np
import pytest

from rockcheck.scenes import PAPER_BLOCK, Event, Floor, History, Scene, Wall, interpolation

ALPHA = PAPER_BLOCK.alpha
WALL = Wall(side="left", gap=0.01)


def swing(step, *, peak=0.1, slide=0.0):
    """A block that rocks once to the left with a cubic rotation, about a corner that slides."""
    t = np.arange(0.0, 1.0 + 0.5 * step, step)
    theta = peak * 6.75 * t * t * (1.0 - t)
    theta_dot = peak * 6.75 * (2.0 * t - 3.0 * t * t)
    b, r, a = PAPER_BLOCK.half_width, PAPER_BLOCK.half_diagonal, PAPER_BLOCK.box_angle
    channels = {
        "t": t,
        "x": r * np.sin(a - theta) - b - slide * t,
        "y": r * np.cos(a - theta),
        "theta": theta,
        "x_dot": -r * np.cos(a - theta) * theta_dot - slide,
        "y_dot": r * np.sin(a - theta) * theta_dot,
        "theta_dot": theta_dot,
    }
    return History(
        name="swing",
        model="made",
        channels=channels,
        event_list=(),
        outcome="moving",
        block=PAPER_BLOCK,
    )


def test_the_peak_lies_between_rows():
    history = swing(0.3)
    assert np.max(history.channels["theta"]) < 0.0973
    assert history.extremes.rotation_left == pytest.approx(0.1, rel=1e-12)


def test_the_time_of_the_peak_lies_between_rows():
    assert swing(0.3).extremes.rotation_left_s == pytest.approx(2.0 / 3.0, rel=1e-12)


def test_a_block_that_turns_to_one_side_never_turns_to_the_other():
    assert swing(0.1).extremes.rotation_right == 0.0


@pytest.mark.parametrize("figure", ["reach_left", "reach_right", "top_displacement", "slip"])
def test_figures_do_not_depend_on_how_far_rows_are_apart(figure):
    fine = getattr(swing(0.0005, slide=0.02).extremes, figure)
    coarse = getattr(swing(0.02, slide=0.02).extremes, figure)
    assert coarse == pytest.approx(fine, rel=1e-6, abs=1e-9)


def test_a_block_that_keeps_its_corner_down_does_not_hop():
    assert swing(0.02).extremes.hop < 1e-7


def test_the_hop_of_a_block_that_turns_through_upright_is_between_rows():
    t = np.array([0.0, 0.1])
    columns = {"x": 0.0 * t, "y": 1.6 + 0.5 * t - 5.0 * t * t, "theta": 0.01 - 0.2 * t}
    rates = {"x_dot": 0.0 * t, "y_dot": 0.5 - 10.0 * t, "theta_dot": 0.0 * t - 0.2}
    found = interpolation.from_rows({"t": t, **columns, **rates}, (), PAPER_BLOCK, "moving")
    assert found.hop == pytest.approx(1.6125 - PAPER_BLOCK.half_height, rel=1e-9)


def test_the_reach_is_that_of_the_top_corner():
    reach = PAPER_BLOCK.half_diagonal * math.sin(PAPER_BLOCK.box_angle + 0.1)
    pivot = PAPER_BLOCK.half_diagonal * math.sin(PAPER_BLOCK.box_angle - 0.1)
    assert swing(0.01).extremes.reach_left == pytest.approx(reach - pivot, rel=1e-7)


def test_rows_say_that_they_are_rows():
    assert swing(0.1).extremes.source == "rows"


def test_what_a_model_kept_is_not_read_from_rows():
    history = swing(0.1)
    kept = replace(history.extremes, slip=7.0, source="model")
    assert replace(history, model_extremes=kept).extremes.slip == 7.0


def test_without_a_block_lengths_are_unknown():
    history = swing(0.1)
    bare = replace(history, block=None)
    assert math.isnan(bare.extremes.top_displacement)


def test_without_rates_the_largest_row_counts():
    history = swing(0.3)
    rows = {name: history.channels[name] for name in ("t", "theta")}
    bare = replace(history, channels=rows)
    assert bare.extremes.rotation_left == np.max(rows["theta"])


def bounce(rows_at):
    """A quantity that rises at 2 up to t = 0.5, and falls at 1 from there."""
    t = np.array(rows_at)
    return t, np.where(t < 0.5, 2.0 * t, 1.5 - t), np.where(t < 0.5, 2.0, -1.0)


def test_an_impact_between_rows_is_reached_by_the_rate_before_it():
    t, value, rate = bounce([0.0, 0.35, 0.9])
    peak, _ = interpolation.largest(t, value, rate, np.array([0.5]))
    assert peak == pytest.approx(1.0, rel=1e-12)


def test_without_the_event_of_an_impact_rows_hide_it():
    t, value, rate = bounce([0.0, 0.35, 0.9])
    peak, _ = interpolation.largest(t, value, rate, np.empty(0))
    assert peak < 0.95


def test_a_wall_is_struck_with_the_speed_just_before():
    # The corner moves at 0.4 m/s, slowed by 1 m/s^2 until it strikes.
    t = np.array([0.0, 0.01, 0.02, 0.03])
    moved = np.where(t < 0.025, 0.4 * t - 0.5 * t * t, 0.0097)
    speed = np.where(t < 0.025, 0.4 - t, -0.1)
    zero = np.zeros(4)
    channels = dict(zip(("t", "x", "y", "theta"), (t, -moved, zero + 1.555, zero), strict=True))
    channels |= {"x_dot": -speed, "y_dot": zero, "theta_dot": zero}
    event = Event(t=0.025, kind="wall impact", impulse=0.6)
    wall = WALL.replace(gap=0.4 * 0.025 - 0.5 * 0.025**2)
    found = interpolation.from_rows(channels, [event], PAPER_BLOCK, "moving", [wall])
    assert found.walls["left"].speed == pytest.approx(0.375, rel=1e-9)


def test_a_wall_is_struck_by_the_corner_that_is_nearest_though_another_is_faster():
    """Tilted to the right, the block turns to the left: its top corner is the faster one."""
    t, spin, wide, high = np.array([0.0, 0.01, 0.02, 0.03]), 0.2, 0.397, 1.555
    theta, x = spin * t - 0.1, -t
    zero = np.zeros(4)
    channels = {"t": t, "x": x, "y": zero + high, "theta": theta}
    channels |= {"x_dot": zero - 1.0, "y_dot": zero, "theta_dot": zero + spin}
    at = -0.1 + spin * 0.025
    lower = -0.025 - wide * math.cos(at) + high * math.sin(at)
    speed = 1.0 - spin * (wide * math.sin(at) + high * math.cos(at))
    event = Event(t=0.025, kind="wall impact")
    wall = WALL.replace(gap=-lower - wide)
    found = interpolation.from_rows(channels, [event], PAPER_BLOCK, "moving", [wall])
    assert found.walls["left"].speed == pytest.approx(speed, rel=1e-4)


def test_a_wall_that_is_never_struck_has_no_first_time():
    history = swing(0.1)
    rows = history.channels
    found = interpolation.from_rows(rows, (), PAPER_BLOCK, "moving", [WALL])
    assert found.walls["left"].first_s is None


def test_a_block_that_overturns_turns_by_a_quarter():
    history = replace(
        swing(0.1, peak=1.5),
        outcome="overturned left",
        event_list=(Event(t=0.7, kind="overturned left"),),
    )
    assert history.extremes.rotation_left == 0.5 * math.pi
    assert history.extremes.rotation_left_s == 0.7


def test_a_state_between_rows_follows_the_side_of_an_impact_it_is_on():
    t = np.array([0.0, 1.0])
    states = np.array([[0.0, 0.0, 0.0, 2.0, 0.0, 0.0], [0.75, 0.0, 0.0, -1.0, 0.0, 0.0]])
    track = interpolation.Track(t=t, states=states, breaks=np.array([0.5]))
    x, x_dot = track.states_at(np.array([0.25, 0.75]))[:, [0, 3]].T
    assert x.tolist() == [0.5, 1.0]
    assert x_dot.tolist() == [2.0, -1.0]


def test_the_track_of_a_scene_ends_where_it_is_cut():
    track = interpolation.track_of(swing(0.1).channels, ())
    assert track.until(0.25).states[-1, 2] == pytest.approx(0.1 * 6.75 * 0.0625 * 0.75, rel=1e-12)


def test_from_a_scene_that_rests_nothing_moves():
    scene = Scene(name="rest", block=PAPER_BLOCK, floor=Floor(friction=0.5), duration=1.0)
    track = np.tile(np.array(scene.initial_state), (3, 1))
    rows = interpolation.Track(t=np.array([0.0, 0.5, 1.0]), states=track, breaks=np.empty(0))
    found = interpolation.extremes_of(rows, scene.block, (), (), "at rest", source="model")
    assert found.top_displacement == 0.0


def test_a_cut_motion_keeps_its_cubic():
    history = swing(0.3)
    track = interpolation.track_of(history.channels, ()).until(0.85)
    assert track.states[-1, 5] == pytest.approx(0.1 * 6.75 * (1.7 - 3.0 * 0.85**2), rel=1e-9)


def test_a_motion_cut_at_its_start_keeps_its_cubic():
    history = swing(0.3)
    track = interpolation.track_of(history.channels, ()).since(0.65)
    theta, rate = track.states[:, 2], track.states[:, 5]
    assert interpolation.largest(track.t, theta, rate, track.breaks)[0] == pytest.approx(0.1)


def kept(history):
    """The same history with extremes that no row shows."""
    shown = replace(history.extremes, rotation_left=0.123, source="model")
    return replace(history, model_extremes=shown)


def test_a_loaded_history_reads_its_rows(tmp_path):
    kept(swing(0.1)).save(tmp_path / "swing.csv")
    assert History.load(tmp_path / "swing.csv").extremes.source == "rows"


def test_a_result_that_is_read_back_keeps_what_its_model_kept(tmp_path):
    history = kept(swing(0.1))
    history.save(tmp_path / "swing.csv.gz")
    found = History.load_with_extremes(tmp_path / "swing.csv.gz")
    assert found.extremes == history.extremes
