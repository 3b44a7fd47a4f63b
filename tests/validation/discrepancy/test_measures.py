"""Each measure against a case that can be worked out by hand."""

import dataclasses
import math
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from rockcheck import Event, EventBasedModel, Floor, Wall, compare, load_scene
from rockcheck.scenes import PAPER_BLOCK
from rockcheck.scenes.extremes import NO_STRIKE, WallExtremes
from rockcheck.validation.discrepancy import measures
from rockcheck.validation.discrepancy.compare import describe, motion_of, wall_speeds
from rockcheck.validation.discrepancy.figures import Pair, between_rows
from rockcheck.validation.discrepancy.impacts import match_impacts
from rockcheck.validation.suite import suites

T = np.linspace(0.0, 10.0, 4001)
WAVE = 0.3 * np.sin(2 * np.pi * T)
SECONDS = np.arange(11.0)


def impact(t, impulse=1.0, kind="floor impact"):
    return Event(t=t, kind=kind, impulse=impulse)


def figures(history, **more):
    return {figure.measure: figure.value for figure in describe(history, **more)}


def times(found):
    pairs, *alone = found
    return (
        [(first.t, second.t) for first, second in pairs],
        *([e.t for e in events] for events in alone),
    )


def test_a_history_agrees_with_itself(made):
    history = made(WAVE, T, events=[impact(0.5), impact(1.5)], slip_rate=np.cos(T), x=0.01 * T)
    found = compare(history, history)
    assert found.gap == ""
    assert {figure.measure: figure.value for figure in found.figures} == pytest.approx(
        {
            measure.name: 10.0 if measure.sense == "at least" else measure.ideal
            for measure in measures.DIFFERENCES.values()
            if not measure.on_request
        },
        abs=1e-7,
    )


@pytest.mark.parametrize(
    "measure",
    [*measures.DIFFERENCES.values(), *measures.FIGURES.values(), *measures.STATISTICS.values()],
    ids=lambda measure: measure.name,
)
def test_every_measure_says_what_it_is(measure):
    assert len(measure.formula) > 20
    assert measure.label
    assert measure.unit


#: Columns of a reference and of a candidate that are not WAVE's, and what they differ by.
WORKED_OUT = {
    "offset": (
        {},
        {"theta": WAVE + 0.02, "x": np.full(len(T), 0.003), "slip_rate": WAVE / 3.0},
        {
            "theta_rms": pytest.approx(0.02, rel=1e-9),
            "theta_peak": pytest.approx(0.02, rel=1e-9),
            "x_rms": pytest.approx(0.003, rel=1e-9),
            "slip_rate_rms": pytest.approx(0.1 / math.sqrt(2.0), rel=1e-6),
            "slip_rate_peak": pytest.approx(0.1, rel=1e-5),
        },
    ),
    "louder": (
        {},
        {"theta": 1.2 * WAVE},
        {
            "sprague_geers_m": pytest.approx(0.2, abs=1e-9),
            "sprague_geers_p": pytest.approx(0.0, abs=1e-6),
            "peak_ratio": pytest.approx(1.2),
        },
    ),
    "late": (
        {},
        {"theta": 0.3 * np.sin(2 * np.pi * T - 0.25 * np.pi)},
        {
            "sprague_geers_m": pytest.approx(0.0, abs=1e-9),
            "sprague_geers_p": pytest.approx(0.25, abs=1e-6),
            "sprague_geers_c": pytest.approx(0.25, abs=1e-6),
        },
    ),
    "a kick": (
        {"theta": 0.0 * T},
        {"theta": 0.0 * T, "x_dot": 2.0 + 0.0 * T},
        {"energy_rms": pytest.approx(2.0)},
    ),
    # A jump that comes a hundredth of a second late counts as lateness.
    "a late jump": (
        {"theta": np.where(T < 5.0, 0.0, 1.0)},
        {"theta": np.where(T < 5.01, 0.0, 1.0)},
        {"theta_peak": pytest.approx(1.0), "theta_hausdorff": pytest.approx(0.01 * 2.14, rel=0.02)},
    ),
    # Half way up, no sample of the jump is near, but the jump is.
    "a jump in two": (
        {"theta": 0.5 * (T >= 4.9) + 0.5 * (T >= 5.1)},
        {"theta": np.where(T < 5.0, 0.0, 1.0)},
        {"theta_hausdorff": pytest.approx(0.1 * 2.14, rel=0.02)},
    ),
    # A spike is as far as it is high, but for a line from the start to the end of the jump.
    "a spike before a jump": (
        {"theta": 1.0 * (T >= 5.0)},
        {"theta": (T >= 5.0) + (np.arange(len(T)) == 800)},
        {"theta_hausdorff": pytest.approx(1.0)},
    ),
}


@pytest.mark.parametrize("name", WORKED_OUT)
def test_what_can_be_worked_out_by_hand(made, name):
    first, second, expected = WORKED_OUT[name]
    found = compare(*(made(t=T, **{"theta": WAVE} | columns) for columns in (first, second)))
    assert {measure: found[measure] for measure in expected} == expected


def test_grids_may_differ_and_until_cuts(made):
    coarse = np.linspace(0.0, 10.0, 1501)
    drifting = np.where(coarse > 5.0, 0.1 * (coarse - 5.0), 0.0)
    theta = 0.3 * np.sin(2 * np.pi * coarse) + drifting
    rate = made(np.gradient(theta, coarse)).channels["theta"]
    found = compare(made(WAVE, T), made(theta, coarse, theta_dot=rate), until=5.0)
    assert found["theta_peak"] < 1e-4
    assert found.end == 5.0
    assert found.figures[0].window == "5s"


def test_the_window_is_the_common_time_and_holds_its_own_ends(made):
    t = SECONDS
    late, early = made(np.zeros(9), t[2:]), made(np.zeros(9), t[:-2])
    for pair in ((early, late), (late, early)):
        found = compare(*pair)
        assert (found.start, found.end) == (2.0, 8.0)
        rows = [Pair(*pair, until=until).time.tolist() for until in (math.inf, 6.0)]
        assert rows == [t[2:9].tolist(), t[2:7].tolist()]
    struck = made(
        np.linspace(0.0, 1.0, 11), t, events=[impact(4.0), impact(6.0), impact(6.0 + 5e-8)]
    )
    values = figures(struck, until=6.0)
    assert [values[name] for name in ("floor_impacts", "peak_rotation", "last_rotation")] == [
        2,
        *[pytest.approx(0.6)] * 2,
    ]
    found = Pair(struck, made(np.zeros(11), t, events=[impact(6.0)]), until=6.0).impacts
    assert times(found) == ([(6.0, 6.0)], [4.0], [])


def test_hausdorff_scales_time_by_the_scene_s_own_gravity(made):
    moon = load_scene("fig5a").replace(gravity=1.62)
    jumps = [made(np.heaviside(T - at, 1.0), T) for at in (5.0, 5.01)]
    on_earth, on_the_moon = (
        compare(*jumps, scene=scene)["theta_hausdorff"] for scene in (None, moon)
    )
    assert on_the_moon / on_earth == pytest.approx(math.sqrt(1.62 / 9.81), rel=0.02)


def farthest(points, line):
    """The largest distance of points from a broken line, which is sampled."""
    along = np.linspace(0.0, len(line) - 1.0, 20001)
    samples = np.column_stack([np.interp(along, range(len(line)), axis) for axis in line.T])
    return max(float(np.min(np.linalg.norm(samples - point, axis=1))) for point in points)


@pytest.mark.parametrize(
    ("times", "first", "second"),
    [
        ((0.0, 0.1, 0.2, 1.0, 2.0), (0.0, 1.0, 0.0, 0.5, 10.0), (0.0, -0.01, 0.0, 0.0, 10.0)),
        ((0.0, 1.0, 2.0, 3.0), (0.0, 1.0, 0.0, 0.0), (0.0, 1.0, 2.0, 0.0)),
        ((0.0, 1.0), (0.0, 0.0), (0.5, 0.0)),
        ((0.0,), (0.1,), (0.3,)),
    ],
    ids=["near the first row", "in a line with a piece", "two rows", "one row"],
)
def test_hausdorff_is_the_distance_of_two_broken_lines(made, times, first, second):
    """Of which the first two have their farthest point where a bound by one piece misleads."""
    scaled = np.array(times) / PAPER_BLOCK.frequency_parameter
    found = compare(made(np.array(first), scaled), made(np.array(second), scaled))
    one, other = (np.column_stack([times, theta]) for theta in (first, second))
    expected = max(farthest(one, other), farthest(other, one))
    assert found["theta_hausdorff"] == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize(
    ("column", "touched"),
    [
        ("theta", ("theta_rms", "theta_peak", "theta_hausdorff", "peak_ratio")),
        ("theta", ("sprague_geers_m", "sprague_geers_p", "sprague_geers_c")),
        ("x", ("x_rms", "x_peak")),
        ("slip_rate", ("slip_rate_rms", "slip_rate_peak")),
        ("y_dot", ("energy_rms", "energy_peak")),
    ],
)
def test_nan_is_never_a_number(made, column, touched):
    whole = made(WAVE, T)
    broken = made(t=T, **{"theta": WAVE, column: np.append(WAVE[:-1], math.nan)})
    for found in (compare(whole, broken), compare(broken, whole)):
        assert [name for name in touched if not math.isnan(found[name])] == []


@pytest.mark.parametrize("name", ["peak_rotation", "highest_hop", "deepest_penetration"])
def test_nan_in_a_figure_of_the_cell_itself(made, name):
    assert figures(made(np.append(math.nan, WAVE[1:]), T))[name] is None


@pytest.mark.parametrize(
    ("times", "outcome", "until", "gap"),
    [
        (SECONDS[:6], "moving", None, "other ends at 5 s, before 10 s"),
        (SECONDS[:6], "moving", 8.0, "other ends at 5 s, before 8 s"),
        (SECONDS[:6], "moving", 5.0, ""),
        (SECONDS[:6], "overturned left", None, "other falls at 5 s, before 10 s"),
        (SECONDS[:6], "overturned left", 4.0, ""),
        (SECONDS[5:], "moving", None, "other starts only at 5 s"),
        *(
            (
                SECONDS[2:6],
                outcome,
                None,
                f"other starts only at 2 s and other {verb} at 5 s, before 10 s",
            )
            for outcome, verb in (("moving", "ends"), ("overturned left", "falls"))
        ),
        # a step and a half short is whole: 1.4 s are rounding of the grids, 1.6 s are not
        (np.linspace(0.0, 8.6, 11), "moving", None, ""),
        (np.linspace(0.0, 8.4, 11), "moving", None, "other ends at 8.4 s, before 10 s"),
        (np.linspace(1.4, 10.0, 11), "moving", None, ""),
        (np.linspace(1.6, 10.0, 11), "moving", None, "other starts only at 1.6 s"),
    ],
)
def test_what_was_not_compared_is_a_gap(made, times, outcome, until, gap):
    whole = made(0.0 * SECONDS, SECONDS, model="whole")
    other = made(0.0 * times, times, model="other", outcome=outcome)
    found = [compare(*pair, until=until) for pair in ((whole, other), (other, whole))]
    assert [(one.gap, one.fall) for one in found] == [
        (gap, "falls" in gap and "starts" not in gap)
    ] * 2


def test_both_fell_the_same_way_is_whole(made):
    first, second = (
        made(
            WAVE[:n],
            T[:n],
            outcome="overturned left",
            events=[Event(t=T[n], kind="overturned left")],
        )
        for n in (2000, 2004)
    )
    measured = dataclasses.replace(second, event_list=())  # as a table of a test: its end
    for other, time in ((second, 0.01), (measured, T[2003] - T[2000])):
        found = compare(first, other)
        assert found.gap == ""
        assert found["outcome_agrees"] == 1.0
        assert found["overturning_time"] == pytest.approx(time)
    found = compare(first, dataclasses.replace(second, outcome="overturned right"))
    assert found.gap
    assert found["outcome_agrees"] == 0.0


@pytest.mark.parametrize(("share", "alike"), [(0.5e-6, True), (1e-5, False)])
def test_blocks_are_compared_that_differ_by_digits_of_a_file(made, fault_of, share, alike):
    history = made(WAVE, T)
    wider = PAPER_BLOCK.replace(half_width=(1.0 + share) * PAPER_BLOCK.half_width)
    other = dataclasses.replace(history, block=wider)
    if alike:
        assert compare(history, other)["theta_rms"] == 0.0
    else:
        assert "block" in str(fault_of(compare, history, other))


def test_histories_that_begin_alike_have_no_gap(made):
    late = made(0.0 * SECONDS, 5.0 + SECONDS)
    assert compare(late, late).gap == ""


@pytest.mark.parametrize(("impulse", "impacts"), [(1.0, 1), (0.0, 0)])
def test_a_landing_with_an_impulse_is_a_floor_impact(made, impulse, impacts):
    history = made(WAVE, T, events=[impact(1.0, impulse, "landing")])
    assert figures(history)["floor_impacts"] == impacts


@pytest.mark.parametrize(
    ("unit", "distance"), [("angle", 5e-5), ("m", 1.25e-4), ("s", 0.01), ("1", 0.0)]
)
def test_what_lies_between_two_rows_is_not_told_from_zero(unit, distance):
    """At p = 2/s and g = 10 m/s^2, a hundredth of a second apart."""
    assert between_rows(unit, 2.0, 10.0, 0.01) == pytest.approx(distance)


@pytest.mark.parametrize(("peak", "rocks"), [(0.9e-4, False), (1.1e-4, True)])
def test_a_reference_that_turns_by_a_tenth_of_a_milliradian_rocks(made, peak, rocks):
    small = made(peak / PAPER_BLOCK.alpha * np.sin(T), T)
    assert (compare(small, made(WAVE, T))["peak_ratio"] > 0.0) == rocks


def test_a_candidate_that_does_not_rotate_has_no_phase(made):
    figure = compare(made(WAVE, T), made(0.0 * T, T)).figure("sprague_geers_p")
    assert figure.value is None
    assert "only one of the two rotates" in figure.note


# How far a block moves


def struck(speed, strikes=1):
    return WallExtremes(strikes=strikes, first_s=1.0, speed=speed, impulse=1.0)


def with_walls(history, **walls):
    kept = dataclasses.replace(history.extremes, walls=walls, source="model")
    return dataclasses.replace(history, model_extremes=kept)


def test_the_figures_of_a_block_that_stands(made):
    history = with_walls(made(WAVE, T), left=struck(0.5), right=struck(0.9, strikes=0))
    motion = motion_of(history)
    assert motion["peak_rotation"] == pytest.approx(0.3, rel=1e-6)
    assert motion["wall_speed"] == 0.5


def test_the_peak_of_a_block_that_is_not_known_is_not_known(made):
    assert motion_of(dataclasses.replace(made(WAVE, T), block=None))["peak_rotation"] is None


def test_of_a_block_that_falls_the_speed_at_a_wall_alone_is_known(made):
    motion = motion_of(with_walls(fallen(made), left=struck(0.5)))
    assert motion.pop("wall_speed") == 0.5
    assert set(motion.values()) == {None}


def test_only_walls_that_are_struck_have_a_speed(made):
    history = with_walls(made(WAVE, T), left=struck(0.5), right=NO_STRIKE)
    scene = load_scene("fig5a")
    assert list(wall_speeds(history, scene)) == [(0.5, "left")]


def test_falls_without_events_are_timed_by_their_rotation(made):
    slow, fast = (
        made(np.minimum(rate * T, 6.4), T, outcome="overturned left") for rate in (0.8, 1.6)
    )
    assert compare(slow, fast)["overturning_time"] == pytest.approx(3.8, abs=0.01)
    assert compare(slow, made(WAVE, T)).figure("overturning_time").note == "infinite"


@pytest.mark.parametrize(
    ("end", "said", "alone"),
    [
        (None, (3.0, "floor impact only in r"), 2.0),
        (1.002, (1.002, "all events agree"), 0.0),
        (3.001, (3.0, "floor impact only in r"), 1.0),
        (2.99, (2.99, "all events agree"), 0.0),
    ],
)
def test_events_agree_until_the_first_without_counterpart(made, end, said, alone):
    # a counterpart may come just after the end of the window
    events = {
        "r": [impact(1.0), impact(2.0), impact(3.0), impact(4.0, 0.001)],
        # another corner strikes at the same moment
        "c": [impact(1.004), impact(1.0041, 0.1), impact(2.0), impact(3.1), impact(5.0, 0.001)],
    }
    found = compare(
        *(made(WAVE, T, model=name, events=of) for name, of in events.items()), until=end
    )
    until = found.figure("events_agree_until")
    assert (until.value, until.note) == said
    assert found["unmatched_impacts"] == alone
    assert found["impact_time"] == pytest.approx(0.004)


@pytest.mark.parametrize(
    ("measure", "column"),
    [
        ("rotation_rate_rms", "theta_dot"),
        ("x_velocity_rms", "x_dot"),
        ("y_velocity_rms", "y_dot"),
        ("y_rms", "y"),
        ("slip_rms", "slip"),
    ],
)
def test_a_suite_may_ask_for_each_column(made, measure, column):
    reference = made(WAVE, T)
    channels = reference.channels | {column: reference.channels[column] + 0.02}
    candidate = dataclasses.replace(reference, channels=channels)
    found = compare(reference, candidate, measures=[measure])
    assert found[measure] == pytest.approx(0.02, rel=1e-9)


@pytest.mark.parametrize(
    ("candidate", "error"),
    [
        ([impact(1.0, 2.0), impact(2.0, 0.5)], 0.0),
        ([impact(1.0, 1.0), impact(2.0, 0.25)], 0.5),  # halved
        ([impact(1.0, -2.0), impact(2.0, -0.5)], 2.0),  # of the other sign
        ([impact(1.0, 2.0), impact(2.0, 0.7)], 0.1),  # of the strongest, not of its counterpart
        ([impact(1.0, 2.0)], 0.0),  # without a counterpart: of `unmatched_impacts`
        ([], math.nan),
    ],
)
def test_errors_of_impulses_count_against_the_strongest(made, candidate, error):
    reference = [impact(1.0, 2.0), impact(2.0, 0.5)]
    histories = (made(WAVE, T, events=events) for events in (reference, candidate))
    found = compare(*histories, measures=["impulse_error"])
    assert found["impulse_error"] == pytest.approx(error, nan_ok=True)


def fallen(made, side="left"):
    """A history that ends in a fall at 2.5 s."""
    outcome = f"overturned {side}"
    return made(WAVE[:1001], T[:1001], outcome=outcome, events=[Event(t=2.5, kind=outcome)])


def test_a_fall_is_no_impulse(made):
    figure = compare(fallen(made), fallen(made), measures=["impulse_error"]).figure("impulse_error")
    assert figure.value == 0.0
    assert figure.note == "no impact of one contact alone has a counterpart"


def test_the_largest_error_of_a_time_counts(made):
    first, second = (
        made(WAVE, T, events=[impact(1.0), impact(2.0 + late), impact(3.0)])
        for late in (0.0, 0.008)
    )
    figure = compare(first, second).figure("impact_time")
    assert figure.value == pytest.approx(0.008)
    assert figure.note == "floor impact at 2.000 s"


def test_one_that_falls_and_one_that_stands_do_not_agree(made):
    stands = made(WAVE, T)
    assert compare(fallen(made), stands)["outcome_agrees"] == 0.0
    assert compare(stands, fallen(made))["outcome_agrees"] == 0.0


@pytest.mark.parametrize(
    "name", ["outcome_agrees", "unmatched_impacts", "floor_impacts", "wall_impacts"]
)
def test_what_is_counted_has_no_resolution(name):
    assert (measures.DIFFERENCES | measures.FIGURES)[name].resolution == 0.0


@pytest.mark.parametrize(("apart", "matched"), [(0.02, 1), (0.02 + 5e-8, 0)])
def test_impacts_match_within_twenty_milliseconds(apart, matched):
    pairs, _, _ = match_impacts([impact(1.0)], [impact(1.0 + apart)])
    assert len(pairs) == matched


@pytest.mark.parametrize("impulse", [0.005, 0.0])
def test_an_impact_is_weak_beside_others_alone(impulse):
    """Not where all are as small, or no impulse is known."""
    _, only_reference, only_candidate = match_impacts([impact(1.0, impulse)], [])
    assert len(only_reference) == 1
    assert only_candidate == []


@pytest.mark.parametrize(("apart", "error"), [(0.001, 0.0), (0.003, 0.5)])
def test_an_impulse_that_floor_and_wall_share_is_not_compared(made, apart, error):
    reference = [impact(1.0, 2.0), impact(2.0, 1.0)]
    candidate = [impact(1.0, 2.0), impact(2.0, 0.0), impact(2.0 + apart, 1.0, "wall impact")]
    histories = (made(WAVE, T, events=events) for events in (reference, candidate))
    found = compare(*histories, measures=["impulse_error"])
    assert found["impulse_error"] == pytest.approx(error)


def test_matching_takes_the_nearest_and_each_once():
    found = match_impacts(
        [impact(4.004, 0.001), *(impact(t) for t in (0.08, 0.12, 1.0, 1.012, 2.0, 3.02, 4.0))],
        [impact(1.015, kind="wall impact"), *(impact(t) for t in (0.1, 1.011, 2.02, 3.0, 4.003))],
    )
    assert times(found) == (
        # the weak one needs no counterpart
        [(0.08, 0.1), (1.012, 1.011), (2.0, 2.02), (3.02, 3.0), (4.0, 4.003)],
        [0.12, 1.0],
        [1.015],
    )


def test_figures_of_one_history(made):
    theta, weak = 0.5 * np.sin(np.pi * T), impact(2.0, 0.001)
    unknown = dict.fromkeys(("theta_dot", "y_dot"), np.full(len(T), math.nan))
    history = made(
        theta,
        T,
        x=np.linspace(0, 0.1, len(T)),
        events=[*map(impact, (1.0, 3.0, 3.001)), weak],
        **unknown,
    )
    values, y = figures(history), history.channels["y"]
    assert set(values) == {
        name for name, measure in measures.FIGURES.items() if not measure.on_request
    }
    expected = {"peak_rotation": 0.5, "last_x": 0.1, "floor_impacts": 2, "highest_hop": 0.0}
    assert {name: values[name] for name in expected} == pytest.approx(expected, abs=1e-12)
    for name, rise in (("highest_hop", 0.004), ("deepest_penetration", -0.002)):
        assert figures(made(theta, T, y=y + rise, **unknown))[name] == pytest.approx(abs(rise))


@pytest.mark.parametrize(("until", "fell"), [(2.4, False), (2.5, True), (None, True)])
def test_the_peak_of_a_block_that_has_fallen_is_none(made, until, fell):
    found = {figure.measure: figure for figure in describe(fallen(made), until=until)}
    assert ("overturned at 2.5 s" in found["peak_rotation"].note) == fell


def test_the_last_slip_of_a_window_is_that_at_its_end(made):
    history = made(WAVE, T, slip=0.01 * T)
    assert figures(history, until=5.0)["last_slip"] == pytest.approx(0.05)
    assert figures(history)["last_slip"] == pytest.approx(0.1)


@pytest.mark.parametrize(("side", "sign"), [("left", -1.0), ("right", 1.0)])
def test_a_corner_behind_a_wall_has_penetrated_it(made, side, sign):
    scene = load_scene("fig5a").replace(walls=[Wall(side=side, gap=0.02)])
    beyond = made(0.0 * T, T, x=sign * np.minimum(0.01 * T, 0.023))
    assert figures(beyond, scene=scene)["deepest_penetration"] == pytest.approx(0.003)


def turning(step, peak=0.5):
    """A block that rocks once to the left with a cubic rotation, its rows `step` apart."""
    t = np.arange(0.0, 1.0 + 0.5 * step, step)
    return {
        "t": t,
        "theta": peak * 6.75 * t * t * (1.0 - t),
        "rate": peak * 6.75 * (2.0 * t - 3.0 * t * t),
    }


def rocked(made, step, **more):
    motion = turning(step)
    return made(motion["theta"], motion["t"], theta_dot=PAPER_BLOCK.alpha * motion["rate"], **more)


def test_the_peak_of_a_window_lies_between_rows(made):
    assert figures(rocked(made, 0.3), until=0.85)["peak_rotation"] == pytest.approx(0.5, rel=1e-9)


def test_a_window_that_ends_between_rows_ends_there(made):
    found = figures(rocked(made, 0.3), until=0.5)
    assert found["last_rotation"] == pytest.approx(0.5 * 6.75 * 0.125, rel=1e-9)
    assert found["peak_rotation"] == pytest.approx(0.5 * 6.75 * 0.125, rel=1e-9)


def test_the_peak_of_a_window_at_an_impact_is_where_both_sides_meet(made):
    t = np.arange(0.0, 1.05, 0.1)
    theta = np.where(t <= 0.43, t, 0.86 - t)
    rate = PAPER_BLOCK.alpha * np.where(t <= 0.43, 1.0, -1.0)
    hit = impact(0.43, kind="wall impact")
    history = made(theta, t, theta_dot=rate, events=[hit])
    assert figures(history, until=0.8)["peak_rotation"] == pytest.approx(0.43, rel=1e-9)


def test_a_whole_run_reads_what_the_model_kept(made):
    history = rocked(made, 0.3)
    model = dataclasses.replace(history.extremes, rotation_left=0.123, hop=0.045, source="model")
    found = figures(dataclasses.replace(history, model_extremes=model))
    assert found["peak_rotation"] == pytest.approx(0.123 / PAPER_BLOCK.alpha)
    assert found["highest_hop"] == 0.045


def test_the_ratio_of_peaks_does_not_depend_on_rows(made):
    found = compare(rocked(made, 0.3), rocked(made, 0.05))
    assert found["peak_ratio"] == pytest.approx(1.0, rel=1e-9)


def test_a_candidate_is_interpolated_with_its_rates(made):
    found = compare(rocked(made, 0.05), rocked(made, 0.1))
    assert found["theta_peak"] < 1e-12


def test_a_fall_ends_the_motion_when_it_happens(made):
    down = Event(t=0.9537, kind="overturned left")
    history = rocked(made, 0.1, events=[down], outcome="overturned left")
    assert figures(history)["end_time"] == 0.9537


def test_a_rotation_that_is_not_a_number_has_no_peak(made):
    history = made(np.array([0.0, math.nan, 0.1]))
    assert math.isnan(history.extremes.peak_rotation)


def test_a_measured_history_may_lack_columns(made):
    whole = made(WAVE, T)
    bare = dataclasses.replace(
        whole, channels={name: whole.channels[name] for name in ("t", "theta")}, block=None
    )
    found = compare(whole, bare)
    assert list(found.table) == ["measure", "value", "unit", "note"]
    by_name = found.table.set_index("measure")["value"]
    assert found["theta_rms"] == 0.0
    assert "no column x" in found.figure("x_rms").note
    # it rocks to both sides: without an event, impacts were not recorded
    assert np.isnan([found["x_rms"], by_name["x_rms"], by_name["unmatched_impacts"]]).all()
    assert {figures(whole)[f"{what}_impacts"] for what in ("floor", "wall")} == {None}
    assert [compare(bare, other).figure("theta_rms").unit for other in (bare, whole)] == [
        "rad",
        "alpha",
    ]


@pytest.mark.parametrize(
    ("late", "more", "said"),
    [
        (100.0, {}, "no time in common"),
        (0.0, {"until": -1.0}, "until"),
        (0.0, {"until": 0.0}, "until"),
        (0.0, {"measures": ["rms"]}, "'rms' is not allowed: theta_rms, "),
        (0.0, {"scene": "fig5a"}, "scene: 'fig5a' is not allowed: give a Scene"),
    ],
)
def test_bad_input_is_named(made, fault_of, late, more, said):
    assert said in str(fault_of(compare, made(WAVE, T), made(WAVE, T + late), **more))


def test_iso_18571_rates_on_one_bounded_grid(made):
    wave, t = WAVE[::80], T[::80]
    same, worse, flat = (
        compare(made(wave, t), made(c * wave, t), measures=["iso_18571"]).figure("iso_18571")
        for c in (1.0, 0.7, 0.0)
    )
    assert same.value == pytest.approx(1.0)
    assert 0.3 < worse.value < 0.9
    assert flat.value is None
    assert "constant" in flat.note


@pytest.fixture
def rated(made, monkeypatch):
    """The ISO rating of two rotations at times, by a library made up, and what it is given."""
    given = []

    class Rating:
        def __init__(self, *curves, dt):
            given.append((*curves, dt))

        def overall_rating(self, ndigits):
            return 0.123456 if ndigits < 0 else round(0.123456, ndigits)

    module = SimpleNamespace(ISO18571=Rating)
    monkeypatch.setitem(sys.modules, "objective_rating_metrics", SimpleNamespace(rating=module))
    monkeypatch.setitem(sys.modules, "objective_rating_metrics.rating", module)

    def rate(first, second, t):
        histories = made(first, t), made(second, t)
        return compare(*histories, measures=["iso_18571"]).figure("iso_18571"), given

    return rate


def test_an_iso_rating_is_not_rounded(rated):
    figure, _ = rated(WAVE[:40], 0.5 * WAVE[:40], T[:40])
    assert figure.value == 0.123456


def test_an_iso_rating_is_of_one_uniform_grid(rated):
    t = 1.0 + np.concatenate([0.01 * np.arange(20), 0.2 + 0.1 * np.arange(20)])
    _, ((reference, candidate, dt),) = rated(t, 2.0 * t, t)
    expected = np.linspace(1.0, 3.1, 40)
    assert reference[:, 0] == pytest.approx(expected)
    assert reference[:, 1] == pytest.approx(expected)
    assert candidate[:, 1] == pytest.approx(2.0 * expected)
    assert dt == pytest.approx(2.1 / 39.0)


def test_an_iso_rating_is_of_four_thousand_samples_at_most(rated):
    _, ((reference, _, _),) = rated(WAVE, 0.5 * WAVE, T)
    assert len(reference) == 4000


@pytest.mark.parametrize(("rows", "has"), [(19, False), (20, True)])
def test_a_short_curve_has_no_iso_rating(rated, rows, has):
    figure, _ = rated(WAVE[:rows], 0.5 * WAVE[:rows], T[:rows])
    assert (figure.value is not None) == has


CONSTANT = np.full(40, 0.1)


@pytest.mark.parametrize(
    ("first", "second"),
    [(CONSTANT, WAVE[:40]), (WAVE[:40], CONSTANT), (WAVE[:40], math.nan * CONSTANT)],
)
def test_a_curve_that_is_constant_or_none_has_no_iso_rating(rated, first, second):
    figure, given = rated(first, second, T[:40])
    assert figure.value is None
    assert given == []


FORMS = {
    "sliding": ("sliding_distance_error",),
    "rebound": ("wall_rebound_error",),
    "drop": ("bounce_height_error",),
    "rocking": ("quarter_period_error", "impact_ratio_error"),
}


def described(scene, measures, **change):
    history = EventBasedModel(pivot="unilateral").simulate(scene.replace(**change))
    return describe(history, scene=scene, measures=measures)


@pytest.mark.parametrize(
    ("name", "change", "has"),
    [
        *((name, {}, FORMS[name]) for name in FORMS),
        # back past its start; and away from the wall
        ("rebound", {"floor": Floor(friction=0.02), "duration": 30.0}, FORMS["rebound"]),
        ("rebound", {"initial_velocity": -1.0}, ()),
        # not flat
        *((name, {"initial_angular_velocity": 0.1}, ()) for name in FORMS),
    ],
)
def test_the_event_based_model_meets_the_closed_forms_of_its_kind_of_scene(name, change, has):
    every = [form for forms in FORMS.values() for form in forms]
    scene = suites.load_suite("engines").scenes[name].replace(**change)
    assert {one.measure: (one.value, "needed" in one.note) for one in described(scene, every)} == {
        form: (pytest.approx(0.0, abs=5e-7), False) if form in has else (None, True)
        for form in every
    }


@pytest.mark.parametrize("name", ["sliding", "rebound"])
@pytest.mark.parametrize(("friction", "duration"), [(0.2, 0.2), (0.2, 0.25), (0.0, 1.0)])
def test_a_block_that_still_slides_has_no_place_where_it_stops(name, friction, duration):
    change = {"floor": Floor(friction=friction), "duration": duration}
    (figure,) = described(suites.load_suite("engines").scenes[name].replace(**change), FORMS[name])
    assert figure.undefined
    assert "before the block has stopped" in figure.note


def test_a_wrong_history_is_seen():
    (figure,) = described(
        suites.load_suite("engines").scenes["rocking"], ["quarter_period_error"], gravity=9.8
    )
    assert figure.value == pytest.approx(0.5 * 0.01 / 9.81 * 0.733, rel=0.01)


def test_a_block_that_a_wall_has_slowed_stops_sooner():
    """Its last row comes just after it has stopped, the one before it earlier."""
    scene = suites.load_suite("engines").scenes["rebound"]
    (wall,), slowing = scene.walls, scene.floor.friction * scene.gravity
    at_wall = math.sqrt(scene.initial_velocity**2 - 2.0 * slowing * wall.gap)
    lost = (1.0 - wall.restitution) * at_wall
    duration = 1.02 * (abs(scene.initial_velocity) - lost) / slowing
    (figure,) = described(scene, FORMS["rebound"], duration=duration, output_step=0.1 * duration)
    assert figure.value == pytest.approx(0.0, abs=5e-7)
