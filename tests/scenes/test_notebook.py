"""What a notebook shows: escaped tables, and figures made without pyplot."""

import re
import subprocess
import sys
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

from rockcheck import (
    Block,
    EventBasedModel,
    Floor,
    History,
    Rest,
    Ricker,
    Scene,
    Wall,
    compare,
    overturning_spectrum,
)

NASTY = "<img src=x onerror=alert(1)>&\"'"


def tags_and_text(thing) -> tuple[set[str], str]:
    """Of what a thing shows of itself; fails where a tag is not closed."""
    shown = ElementTree.fromstring(f"<div>{thing._repr_html_()}</div>")
    return {part.tag for part in shown.iter()}, "".join(shown.itertext())


@pytest.fixture(scope="module")
def scene():
    return Scene(
        name="bookcase",
        block=Block(half_width=0.2, half_height=1.0),
        floor=Floor(friction=0.4),
        walls=[Wall(side="left", gap=0.03, restitution=0.3)],
        excitation=Ricker(amplitude=4.0, period=0.6),
        duration=4.0,
    )


@pytest.fixture(scope="module")
def history(scene):
    return EventBasedModel(pivot="unilateral").simulate(scene)


@pytest.fixture(scope="module")
def things(scene, history):
    return {
        "scene": scene,
        "history": history,
        "discrepancy": compare(history, EventBasedModel().simulate(scene), scene=scene),
        "spectrum": replace(
            overturning_spectrum(scene, [2.0, 4.0, 6.0], [2.0, 8.0]), undecided=np.array([[0, 1]])
        ),
    }


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("scene", "4 m/s²"),
        ("history", "at rest"),
        ("discrepancy", "RMS difference of rotation"),
        ("spectrum", "6, from 6 runs"),
        ("spectrum", "safe16.7 %"),  # and an undecided one, which is not safe
    ],
)
def test_shows_itself_as_a_table_and_its_plot_as_a_picture(things, name, expected):
    tags, text = tags_and_text(things[name])
    assert tags <= {"div", "table", "caption", "b", "tr", "th", "td"}
    assert expected in text
    figure = things[name].plot()
    assert figure._repr_png_().startswith(b"\x89PNG")
    for axes in figure.axes:
        assert axes.get_xlabel() or axes.get_ylabel()


def test_lines_are_the_history_and_the_candidate_less_the_reference(things, scene, history):
    """One model twice has two colours."""
    rotation = history.plot().axes[0].lines[0]
    np.testing.assert_array_equal(rotation.get_xdata(), history.channels["t"])
    np.testing.assert_allclose(rotation.get_ydata() * history.alpha, history.channels["theta"])
    apart = things["discrepancy"].plot().axes[1].lines[0].get_ydata()
    # a short pulse in a long scene is drawn with its peak
    peak = scene.replace(duration=400.0).plot().axes[1].lines[0].get_ydata().max()
    assert [np.sqrt(np.mean(np.square(apart))), peak] == pytest.approx(
        [things["discrepancy"]["theta_rms"], 4.0], rel=0.02
    )  # the measure integrates in time
    one, same = compare(history, history).plot().axes[0].lines[:2]
    assert one.get_color() != same.get_color()


def test_of_a_fallen_block_the_way_to_the_balance_point_is_drawn_and_the_time():
    t = np.linspace(0.0, 1.6, 161)
    fallen = History(
        name="a",
        model="m",
        channels={"t": t, "theta": t},
        event_list=(),
        outcome="overturned left",
        block=Block(half_width=0.4, half_height=1.6),
    )
    plots = [thing.plot().axes[0] for thing in (fallen, compare(fallen, fallen))]
    assert plots[0].get_title() == "a, m: overturned left at 1.53 s"
    assert [axes.get_ylim()[1] for axes in plots] == pytest.approx([1.3, 1.3])


def test_a_flat_landing_counts_as_an_impact_on_the_floor(scene):
    history = EventBasedModel(pivot="unilateral").simulate(
        scene.replace(excitation=Rest(), initial_height=0.05, duration=0.5)
    )
    assert "1 on the floor, 0 on walls" in tags_and_text(history)[1]


def test_a_loaded_block_says_where_its_mass_is():
    block = Block(
        half_width=0.3,
        half_height=1.0,
        mass=400.0,
        centre_of_mass=(0.08, -0.25),
        moment_of_inertia=110.0,
    )
    loaded = Scene(name="rack", block=block, floor=Floor(friction=0.5), duration=1.0)
    plain = loaded.replace(block=Block(half_width=0.3, half_height=1.0))
    shown = " ".join(loaded._repr_html_().split())
    assert "0.08 m right of the box&#x27;s, 0.25 m below it; radius of gyration 0.524 m" in shown
    assert "left α = 0.469 rad, right α = 0.285 rad" in shown
    assert "pivots" not in plain._repr_html_()
    marks, none = (
        [line.get_xydata() for line in one.plot().axes[0].lines if line.get_marker() == "+"]
        for one in (loaded, plain)
    )
    np.testing.assert_allclose(marks[0], [[0.08, 0.75]])
    assert none == []


def test_text_is_escaped():
    made = History(
        name=NASTY,
        model=NASTY,
        channels={"t": np.arange(3.0), "theta": np.zeros(3)},
        event_list=(),
        outcome=NASTY,
        notes=(NASTY,),
    )
    for thing in (made, compare(made, made)):
        tags, text = tags_and_text(thing)
        assert "img" not in tags
        assert NASTY in text
        assert thing.plot()


def test_nothing_heavy_is_imported_to_show_a_table():
    code = (
        "import sys; from rockcheck import Block, Floor, Scene;"
        "Scene(name='a', block=Block(half_width=1.0, half_height=2.0), floor=Floor(friction=0.5),"
        " duration=1.0)._repr_html_();"
        "print(sorted({'matplotlib', 'pandas', 'numba', 'mujoco', 'pybullet'} &"
        " sys.modules.keys()))"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True) == "[]\n"


def test_a_scene_shows_how_it_starts_and_its_gravity_where_they_are_not_as_usual(scene):
    assert not re.search("starts at|gravity", scene._repr_html_())
    _, shown = tags_and_text(
        scene.replace(
            gravity=1.62, initial_velocity=-0.5, initial_angular_velocity=0.25, initial_height=0.125
        )
    )
    assert "gravity 1.62 m/s²" in shown
    assert "velocity −0.5 m/s, angular velocity 0.25 rad/s, height 0.125 m" in shown
