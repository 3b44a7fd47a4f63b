"""What a scene, a history and a comparison read like, by their numbers."""

import math
import re

import numpy as np
import pytest

from rockcheck import Block, Cosine, Event, Floor, HalfSine, Record, Rest, Ricker, Scene, Sine, Wall
from rockcheck.ebm.spectrum import LEFT as FELL_LEFT, RIGHT as FELL_RIGHT, Spectrum
from rockcheck.reports.show import words
from rockcheck.validation.discrepancy.figures import Figure

SCENE = Scene(
    name="shelf",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.4),
    excitation=Ricker(amplitude=2.0, period=0.5),
    duration=3.0,
    output_step=0.02,
)


def fact(name, **change):
    return dict(words.scene_facts(SCENE.replace(**change))).get(name)


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (None, 3, "–"),
        (-1.23456, 3, "−1.23"),
        (1.23456, 4, "1.235"),
        (1.2e-5, 2, "1.2·10⁻⁵"),
    ],
)
def test_a_number_has_its_digits_and_a_true_minus(value, digits, text):
    assert words.number(value, digits) == text


def test_a_block_is_told_by_its_whole_width_and_height():
    assert fact("block").startswith("0.6 m × 2 m")
    assert f"{math.atan(0.3):.3g} rad" in fact("block")


def test_a_homogeneous_block_has_no_place_of_its_mass():
    assert fact("mass's centre") is None
    assert fact("pivots") is None


@pytest.mark.parametrize(
    ("centre", "text"),
    [
        ((0.1, 0.2), "0.1 m right of the box's, 0.2 m above it"),
        ((-0.1, -0.2), "0.1 m left of the box's, 0.2 m below it"),
    ],
)
def test_the_mass_of_a_loaded_block_has_a_place(centre, text):
    loaded = Block(half_width=0.3, half_height=1.0, centre_of_mass=centre)
    assert fact("mass's centre", block=loaded).startswith(text)


def test_a_loaded_block_has_two_slendernesses():
    loaded = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.1, 0.0))
    left, right = math.atan(0.4), math.atan(0.2)
    expected = f"left α = {left:.3g} rad, right α = {right:.3g} rad"
    assert fact("pivots", block=loaded) == expected


@pytest.mark.parametrize(("gravity", "told"), [(9.81, False), (1.62, True)])
def test_another_gravity_is_told(gravity, told):
    assert ("gravity 1.62" in fact("p", gravity=gravity)) == told


@pytest.mark.parametrize(
    ("floor", "text"),
    [
        (Floor(friction=0.4), "μ 0.4"),
        (Floor(friction=0.4, static_friction=0.5), "μ 0.4 (static 0.5)"),
        (Floor(friction=0.4, restitution=0.2), "μ 0.4, restitution 0.2"),
    ],
)
def test_a_floor_has_its_friction_and_what_else_it_has(floor, text):
    assert fact("floor", floor=floor) == text


LEFT, RIGHT = Wall(side="left", gap=0.05, restitution=0.3), Wall(side="right", gap=0.1)


def test_gaps_are_in_millimetres():
    assert fact("wall", walls=[LEFT]) == "left, gap 50 mm, restitution 0.3"
    assert fact("walls", walls=[LEFT, RIGHT]).startswith("left, gap 50 mm, restitution 0.3, right")
    assert fact("wall") == "none"


@pytest.mark.parametrize(
    ("excitation", "text"),
    [
        (Rest(), "at rest"),
        (Sine(amplitude=2.0, period=0.5, cycles=3), "sine, 2 m/s², period 0.5 s, 3 cycles"),
        (Cosine(amplitude=2.0, period=0.5), "cosine, 2 m/s², period 0.5 s, 1 cycles"),
        (HalfSine(amplitude=2.0, period=0.5), "half-sine pulse, 2 m/s², period 0.5 s"),
        (Ricker(amplitude=2.0, period=0.5), "antisymmetric Ricker pulse, 2 m/s², period 0.5 s"),
        (
            Ricker(amplitude=2.0, period=0.5, symmetric=True),
            "symmetric Ricker pulse, 2 m/s², period 0.5 s",
        ),
        (
            Record.from_samples([0.0, -9.80665], 0.1, scale=0.5),
            "samples × 0.5, peak 0.5 g",
        ),
    ],
)
def test_a_base_is_told_by_its_kind_and_its_size(excitation, text):
    assert fact("base", excitation=excitation) == text


def test_a_vertical_motion_is_told_where_there_is_one():
    assert fact("vertical") is None
    assert fact("vertical", vertical=Sine(amplitude=1.0, period=0.2)).startswith("sine, 1 m/s²")


def test_rows_are_apart_by_milliseconds():
    assert fact("duration") == "3 s, a row each 20 ms"


def test_a_start_names_what_is_not_zero():
    assert fact("starts at") is None
    tilted = fact("starts at", initial_rotation=0.5 * math.atan(0.3), initial_velocity=0.2)
    assert tilted == "θ = 0.5 α, velocity 0.2 m/s"


def test_a_table_escapes_its_text():
    html = words.html_table("A & B", [("<a>", 1), ("b", 2)])
    assert "A &amp; B" in html
    assert "&lt;a&gt;" in html


def test_without_a_head_the_first_column_names_the_rows():
    html = words.html_table("T", [("a", 1)])
    assert html.count('scope="row"') == 1
    assert html.count("<td") == 1
    assert words.html_table("T", [("a", 1)], ("x", "y")).count('scope="col"') == 2


def test_a_history_shows_its_peak_and_its_impacts(made):
    hits = [Event(t=t, kind="floor impact", impulse=1.0) for t in (0.1, 0.3)]
    html = words.history_html(made([0.0, 0.25, -0.5, 0.0], [0.0, 0.1, 0.2, 0.4], events=hits))
    assert "0.5 α" in html
    assert "2 on the floor, 0 on walls" in html
    assert "0 to 0.4 s, 4 rows" in html
    assert "steps" not in html


def test_a_history_that_rocks_without_events_has_no_count_of_impacts(made):
    assert "on the floor" not in words.history_html(made([0.0, 0.5, -0.5, 0.0]))


def test_a_block_that_has_fallen_has_no_peak(made):
    html = words.history_html(made([0.0, 0.5, 6.0], outcome="overturned left"))
    assert "peak rotation" not in html


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(2.345, "2.3 s"), (1.0, "1.0 s"), (0.99949, "999 ms"), (0.0123456, "12.3 ms")],
)
def test_a_duration_is_in_milliseconds_below_a_second(seconds, text):
    assert words.duration(seconds) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, "–"), (1.234, "1.2×"), (99.4, "99×"), (99.6, "100×"), (12345.6, "12\u202f346×")],
)
def test_a_large_ratio_has_no_decimals(value, text):
    assert words.ratio(value) == text


@pytest.mark.parametrize(("name", "text"), [("alpha", "α"), ("1", ""), ("m", "m")])
def test_units_are_as_printed(name, text):
    assert words.unit(name) == text


def test_a_moment_that_is_none_is_left_as_it_is():
    assert words.moment("2026-01-02T03:04:05+00:00") == "2026-01-02 03:04 UTC"
    assert words.moment("once") == "once"


def test_a_spectrum_shows_its_shares_and_no_base_motion():
    spectrum = Spectrum(
        outcomes=np.array([[0, 0, FELL_LEFT], [FELL_RIGHT] * 3], dtype=np.int8),
        frequency_ratios=np.array([1.0, 2.0, 3.0]),
        amplitude_ratios=np.array([1.0, 2.0]),
        evaluations=5,
        undecided=np.zeros((0, 2), dtype=np.int64),
        scene=SCENE,
        model=None,
    )
    html = words.spectrum_html(spectrum)
    shares = dict(
        re.findall(r">(safe|overturned left|overturned right)</th><td[^>]*>([^<]*)<", html)
    )
    assert shares == {"safe": "33.3 %", "overturned left": "16.7 %", "overturned right": "50 %"}
    assert "6, from 5 runs" in html
    assert "μ 0.4" in html
    assert "Ricker" not in html


def figure_of(window, until):
    return Figure(measure="m", label="m", unit="1", value=1.0, window=window, until=until)


@pytest.mark.parametrize(
    ("window", "until", "text"),
    [
        ("horizon", 2.5, "to the horizon (2.5 s)"),
        ("horizon", None, "to the horizon"),
        ("4s", 4.0, "first 4 s"),
        ("4s", None, "first 4s"),
        ("", None, "whole run"),
    ],
)
def test_a_window_is_told_by_its_end(window, until, text):
    assert words.window(figure_of(window, until)) == text
