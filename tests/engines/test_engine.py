"""What every engine's settings mean, by an engine made up."""

import sys
import time
from typing import ClassVar

import numpy as np
import pytest

from rockcheck import Block, Floor, InputError, Scene, Wall
from rockcheck.engines.engine import Engine
from tests.engines.test_steps import Air

SCENE = Scene(
    name="made",
    block=Block(half_width=0.3, half_height=1.0),
    floor=Floor(friction=0.5),
    duration=2.0,
)


class Made(Engine):
    """An engine that can do all."""

    name: ClassVar[str] = "made"


class Fixed(Made):
    """One whose steps do not vary."""

    fixed_because: ClassVar[str] = "it keeps impulses"
    homogeneous_only: ClassVar[bool] = True
    bounces_with: ClassVar[tuple[str, ...]] = ("best",)


def with_wheels(first, last=None):
    class Published(Made):
        """One that is published for some Pythons."""

        module: ClassVar[str] = "made"
        first_python: ClassVar[tuple[int, int]] = first
        last_python: ClassVar[tuple[int, int] | None] = last

    return Published


HERE = sys.version_info[:2]
NEXT, BEFORE = (HERE[0], HERE[1] + 1), (HERE[0], HERE[1] - 1)


@pytest.mark.parametrize(
    ("first", "last", "has"),
    [
        (HERE, None, True),
        (HERE, HERE, True),
        (BEFORE, NEXT, True),
        (NEXT, None, False),
        (BEFORE, BEFORE, False),
    ],
)
def test_a_package_has_wheels_from_its_first_to_its_last_python(first, last, has):
    assert with_wheels(first, last).has_wheel() == has


def test_a_package_that_says_nothing_has_wheels():
    assert Made.has_wheel()


def test_without_wheels_a_package_is_compiled():
    assert "no wheel for Python" in with_wheels(NEXT).hint()
    assert with_wheels(HERE).hint() == "not installed: pip install made"


def test_an_engine_that_needs_no_module_is_installed():
    assert Made.installed()
    assert not with_wheels(HERE).installed()


@pytest.mark.parametrize(
    ("kind", "given", "step"),
    [
        (Made, {}, "adaptive"),
        (Made, {"settings": "default"}, 1e-4),
        (Fixed, {}, 1e-4),
        (Fixed, {"time_step": 0.25}, 0.25),
    ],
)
def test_steps_are_adaptive_where_they_can(kind, given, step):
    assert kind(**given).time_step == step


@pytest.mark.parametrize("step", [0.0, -1.0, True, float("inf")])
def test_a_step_is_above_zero(step, fault_of):
    assert "give a step above 0 s" in str(fault_of(Made, time_step=step))


def test_where_steps_cannot_vary_is_said_why(fault_of):
    assert "it keeps impulses" in str(fault_of(Fixed, time_step="adaptive"))
    assert 'settings = "default"' in str(fault_of(Made, time_step="adaptive", settings="default"))


def test_with_a_longest_step_no_error_is_estimated():
    assert Made(largest_step=0.01).tolerance is None
    assert Made().tolerance == 1e-9
    assert Made(time_step=1e-3).tolerance is None


@pytest.mark.parametrize(("duration", "fits"), [(4999.0, True), (5001.0, False)])
def test_a_run_has_five_million_steps_at_most(duration, fits, fault_of):
    long = SCENE.replace(duration=duration, output_step=1.0)
    engine = Made(time_step=1e-3)
    if fits:
        engine.check(long)
    else:
        assert "more than 5000000 steps" in str(fault_of(engine.check, long))


@pytest.mark.parametrize(("kind", "holds"), [(Made, True), (Fixed, False)])
def test_some_engines_hold_a_homogeneous_block_alone(kind, holds):
    loaded = SCENE.replace(block=Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.1, 0.0)))
    kind(time_step=1e-3).check(SCENE)
    if holds:
        kind(time_step=1e-3).check(loaded)
        return
    with pytest.raises(InputError, match="homogeneous"):
        kind(time_step=1e-3).check(loaded)


def noted(engine, *, static=None, restitution=0.0, settings="default"):
    floor = Floor(friction=0.5, static_friction=static)
    walls = [Wall(side="left", gap=0.1, restitution=restitution)]
    return engine(settings=settings).notes(SCENE.replace(floor=floor, walls=walls))


def test_a_static_friction_is_not_used():
    (note,) = noted(Made, static=0.7)
    assert "kinetic 0.5 is used for static 0.7" in note


@pytest.mark.parametrize(
    ("settings", "restitution", "count"),
    [("default", 0.5, 1), ("default", 0.0, 0), ("best", 0.5, 0)],
)
def test_a_restitution_that_is_not_there_is_told(settings, restitution, count):
    assert len(noted(Fixed, restitution=restitution, settings=settings)) == count


@pytest.mark.parametrize(("settings", "lacks"), [("best", ()), ("default", ("restitution",))])
def test_an_engine_lacks_what_its_settings_have_not(settings, lacks):
    assert Fixed(settings=settings).lacks() == lacks


# A run


class Flying(Made):
    """An engine in which nothing touches."""

    def rigid_world(self, scene):
        return Air()

    stock_world = rigid_world


THROWN = SCENE.replace(
    initial_height=1.0, initial_velocity=0.5, duration=0.31, output_step=0.02, gravity=10.0
)


@pytest.mark.parametrize(
    ("settings", "error"),
    [({}, 1e-9), ({"time_step": 1e-3}, 2e-3), ({"time_step": 1e-3, "settings": "default"}, 2e-3)],
    ids=["adaptive", "fixed", "default"],
)
def test_a_thrown_block_flies_on_its_parabola(settings, error):
    history = Flying(**settings).simulate(THROWN)
    t = history.channels["t"]
    assert t == pytest.approx(0.02 * np.arange(16))
    assert history.channels["x"] == pytest.approx(0.5 * t)
    assert history.channels["y"] == pytest.approx(2.0 - 5.0 * t**2, abs=error)
    assert history.extremes.source == "model"
    assert history.extremes.hop == pytest.approx(1.0)


def test_a_run_says_how_many_steps_it_took():
    history = Flying(time_step=1e-3).simulate(THROWN)
    assert history.cost.steps == 310
    assert history.cost.set_up > 0.0
    assert history.settings["time_step"] == 1e-3


def test_extremes_end_with_the_scene():
    """A step of 0.04 s goes on to 0.32 s; the way there is that of 0.31 s."""
    reach = Flying(time_step=0.04).simulate(THROWN).extremes.reach_right
    assert reach == pytest.approx(0.155)


def test_the_processor_time_of_a_run_is_a_part_of_that_of_the_call():
    before = time.process_time()
    cost = Flying(time_step=1e-3).simulate(THROWN).cost
    assert 0.0 <= cost.cpu_seconds <= time.process_time() - before
