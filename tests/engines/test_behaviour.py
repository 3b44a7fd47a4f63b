"""Settings, events, notes, failures and everything else that a user of an engine relies on."""

import math
import subprocess
import sys
from types import SimpleNamespace

import numpy as np
import pytest
from cases import free_rocking, pulse_scene
from stepping import assert_contacts_hold

from rockcheck import (
    Block,
    Dart,
    Drake,
    EventBasedModel,
    Floor,
    InputError,
    ModelFailure,
    MuJoCo,
    PyBullet,
    Record,
    Ricker,
    Scene,
    Sine,
    Wall,
    compare,
    load_scene,
)
from rockcheck.engines import steps
from rockcheck.engines.engine import Engine
from rockcheck.scenes import PAPER_BLOCK, compiled
from rockcheck.validation.uncertainty import numerical


def test_a_missing_package_is_named(varying_engine, monkeypatch, fault_of):
    if not varying_engine.module:
        return  # it comes with rockcheck
    monkeypatch.setitem(sys.modules, varying_engine.module, None)
    monkeypatch.setattr("rockcheck.engines.engine.find_spec", lambda name: None)
    assert str(fault_of(varying_engine().simulate, free_rocking(0.0))).endswith(
        f"not installed: pip install {varying_engine.package or varying_engine.module}"
    )


def test_steps_that_cannot_vary_are_refused_with_the_reason(engine, fault_of):
    if not engine.fixed_because:
        engine(time_step="adaptive")
        return
    assert engine.fixed_because in str(fault_of(engine, time_step="adaptive"))
    assert [engine(settings=one).time_step for one in ("best", "default")] == [1e-4, 1e-4]


def test_a_run_prints_nothing():
    code = """
from rockcheck.engines import registry
from rockcheck.scenes import Block, Floor, Scene
scene = Scene(name="quiet", block=Block(half_width=0.4, half_height=1.5), \
floor=Floor(friction=0.3), duration=0.01)
for engine in (facts.engine for facts in registry.every()):
    if engine.installed():
        for settings in ("best", "default"):
            engine(time_step=1e-3, settings=settings).simulate(scene)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=300, check=True
    )
    assert done.stdout + done.stderr == ""


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"time_step": "adaptve"}, "time_step: adaptve is not allowed"),
        ({"time_step": 0.0}, "time_step: 0.0 is not allowed"),
        ({"time_step": True}, "time_step: True is not allowed"),
        ({"time_step": math.nan}, "time_step: nan is not allowed"),
        ({"time_step": 10**400}, "time_step: 10+... is not allowed"),
        ({"largest_step": -1.0}, "largest_step"),
        ({"tolerance": 0.0}, "tolerance"),
        ({"settings": "worst"}, "settings"),
        (
            {"time_step": "adaptive", "settings": "default"},
            '^time_step: "adaptive" is not allowed with settings = "default": give a step in s$',
        ),
        (
            {"time_step": steps.AdaptiveStep(largest=2e-3), "settings": "default"},
            '"adaptive" is not allowed',
        ),
        ({"step": 1e-3}, "step: unknown key"),
    ],
)
def test_wrong_settings(varying_engine, settings, words):
    with pytest.raises(InputError, match=words):
        varying_engine(**settings)


def test_steps_are_adaptive_unless_something_else_is_asked_for(varying_engine):
    """An engine as it comes cannot step so: it has a fixed step, also by default."""
    given = ({}, {"settings": "default"}, {"settings": "default", "time_step": 1e-3})
    assert [varying_engine(**one).time_step for one in given] == ["adaptive", 1e-4, 1e-3]
    assert varying_engine(time_step=1e-3).coarser(2.0).time_step == 2e-3


@pytest.mark.parametrize(
    ("settings", "longest", "tolerance"),
    [
        ({}, 0.02, 1e-9),
        ({"short_steps": 2.0}, 0.02, 1e-9),
        ({"largest_step": 2e-3}, 2e-3, None),
        ({"tolerance": 1e-6}, 0.02, 1e-6),
        ({"largest_step": 2e-3, "tolerance": 1e-6}, 2e-3, 1e-6),
        ({"time_step": 1e-3}, 0.02, None),
    ],
)
def test_adaptive_steps_follow_a_tolerance_or_a_longest_step(
    varying_engine, settings, longest, tolerance
):
    model = varying_engine(**settings)
    assert model.largest_step == longest
    assert model.tolerance == tolerance
    assert varying_engine(**model.model_dump()) == model


def test_a_step_controller_says_how_steps_follow_each_other(varying_engine):
    fixed, adaptive = steps.FixedStep(1e-3), steps.AdaptiveStep(largest=2e-3, short=3.0)
    assert varying_engine(time_step=fixed) == varying_engine(time_step=1e-3)
    model = varying_engine(time_step=adaptive)
    assert (model.largest_step, model.short_steps, model.steps) == (2e-3, 3.0, adaptive)
    assert model.coarser(2.0).steps == steps.AdaptiveStep(4e-3, 6.0)
    by_error = varying_engine(time_step=steps.AdaptiveStep(2e-3, 3.0, 1e-6))
    assert by_error.coarser(2.0).steps == steps.AdaptiveStep(4e-3, 6.0, 8e-6)
    named = {"time_step": "adaptive", "largest_step": 2e-3, "short_steps": 3.0}
    assert model.steps == varying_engine(**named).steps


@pytest.mark.slow
@pytest.mark.needs("drake")
def test_drake_goes_on_where_its_solver_stumbles():
    """Two steps of this record are not solved as they stand: the run ends all the same, and does so
    again."""
    scene = load_scene("fig4a").replace(duration=8.0)
    history = Drake(time_step=1e-3).simulate(scene)
    assert compare(EventBasedModel(pivot="unilateral").simulate(scene), history)["theta_rms"] < 0.02
    np.testing.assert_array_equal(
        Drake(time_step=1e-3).simulate(scene).channels["theta"], history.channels["theta"]
    )


@pytest.mark.slow_for("dart")
def test_a_default_run_of_the_readmes_scene_is_converged(varying_engine):
    """A wall that the block strikes at 5.95 alpha and comes back from: at fixed steps of 1e-4 s it
    is not."""
    scene = Scene(
        name="bookcase",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.3),
        walls=(Wall(side="left", gap=0.053),),
        excitation=Ricker(amplitude=4.0, period=1.5),
        duration=6.0,
    )
    model = varying_engine()
    history = model.simulate(scene)
    reference = EventBasedModel(pivot="unilateral").simulate(scene)
    found = numerical.numerical_uncertainty(model, scene, history)
    assert found.converged
    assert compare(reference, history)["theta_rms"] < found.u_num("theta_rms") < 1e-3


@pytest.mark.parametrize(
    ("knob", "value"), [("time_step", 1e-9), ("largest_step", 1e-9), ("tolerance", 1e-30)]
)
def test_too_many_steps_are_refused_at_once(varying_engine, knob, value, fault_of):
    fault = str(fault_of(varying_engine(**{knob: value}).simulate, free_rocking(0.5)))
    assert fault.startswith(f"{knob}: {value:g} is not allowed: ")
    assert fault.endswith("more than 5000000 steps")


def test_history_says_how_it_came_about(engine):
    history = engine(time_step=1e-3).simulate(free_rocking(0.5, duration=1.0))
    settings, cost = history.settings, history.cost
    assert (history.model, history.notes) == (engine.name, ())
    assert (settings["time_step"], settings["settings"], cost.steps) == (1e-3, "best", 1000)
    assert min(cost.wall_seconds, cost.cpu_seconds, cost.set_up) > 0.0


@pytest.mark.parametrize("settings", ["best", "default"])
def test_what_an_engine_cannot_do_is_noted(engine, settings):
    scene = free_rocking(
        0.5, duration=0.1, floor=Floor(friction=0.5, static_friction=0.7, restitution=0.5)
    )
    notes = "\n".join(engine(time_step=1e-3, settings=settings).simulate(scene).notes)
    assert "kinetic 0.5 is used for static 0.7" in notes
    assert ("no coefficient of restitution" in notes) == (settings not in engine.bounces_with)


@pytest.mark.parametrize("settings", ["best", "default"])
@pytest.mark.parametrize(("restitution", "tips"), [(0.5, True), (0.0, False)])
def test_dart_says_that_a_block_that_bounces_may_tip(settings, restitution, tips):
    notes = Dart(settings=settings).notes(
        free_rocking(0.5, floor=Floor(friction=0.5, restitution=restitution))
    )
    assert any("tip at its second landing" in note for note in notes) == tips


@pytest.mark.parametrize(("duration", "outcome"), [(2.0, "overturned left"), (1.86, "moving")])
def test_a_run_ends_with_its_duration_and_not_with_its_last_row(model, duration, outcome):
    # It is down at 1.87 s.
    history = model.simulate(free_rocking(1.2, duration=duration, output_step=1e9))
    assert (history.channels["t"].tolist(), history.outcome) == ([0.0], outcome)


@pytest.mark.parametrize("step", [7e-4, "adaptive"])
def test_output_grid_need_not_fit_the_steps(varying_engine, step):
    coarse, fine = (
        varying_engine(time_step=step)
        .simulate(free_rocking(0.5, duration=2.0, output_step=every))
        .channels
        for every in (3.1e-3, 1e-4)
    )
    again = np.interp(coarse["t"], fine["t"], fine["theta"])
    assert np.max(np.abs(coarse["theta"] - again)) < (1e-7 if step == 7e-4 else 1e-5)


@pytest.mark.parametrize("stock", [MuJoCo, PyBullet])
def test_small_and_large_blocks_move_alike(stock):
    large = pulse_scene(4.0, 2.0, 0.3, ("left", 0.053, 0.5), duration=4.0)
    one = stock(time_step="adaptive", largest_step=2e-3).simulate(large)
    other = stock(time_step="adaptive", largest_step=2e-4).simulate(
        large.replace(
            block=large.block.scaled(0.01),
            walls=[Wall(side="left", gap=0.00053, restitution=0.5)],
            excitation=large.excitation.replace(period=0.1 * large.excitation.period),
            duration=0.1 * large.duration,
            output_step=0.1 * large.output_step,
        )
    )
    assert np.max(np.abs(one.channels["theta"] - other.channels["theta"])) < 1e-6
    assert np.max(np.abs(one.channels["x"] - 100 * other.channels["x"])) < 1e-5
    kinds, others = (
        [event.kind for event in history.event_list if "impact" in event.kind][:6]
        for history in (one, other)
    )
    assert kinds == others


def test_record_with_kinks(model):
    """A sliding block feels the exact integral of a record that is linear between its samples."""
    samples = np.random.default_rng(5).normal(size=40)
    velocity = -np.concatenate([[0.0], np.cumsum(0.01 * (samples[1:] + samples[:-1]))])
    history = model.simulate(
        Scene(
            name="kinks",
            block=Block(half_width=1.0, half_height=0.5),
            floor=Floor(friction=0.0),
            excitation=Record.from_samples(samples, time_step=0.02),
            duration=0.76,
        )
    )
    assert history.channels["x_dot"][::4] == pytest.approx(velocity[:39], abs=1e-5)


HARD = [
    Scene(
        name="rattle between walls",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.3),
        walls=[
            Wall(side="left", gap=0.0, restitution=0.9),
            Wall(side="right", gap=0.001, restitution=1.0),
        ],
        excitation=Sine(amplitude=8.0, period=0.7, cycles=2),
        duration=2.0,
    ),
    Scene(
        name="bouncing floor",
        block=Block(half_width=0.3, half_height=0.4),
        floor=Floor(friction=0.7, restitution=0.9),
        excitation=Ricker(amplitude=9.0, period=0.8),
        vertical=Sine(amplitude=14.0, period=0.3, cycles=4),
        initial_height=0.02,
        initial_rotation=0.1,
        duration=2.0,
    ),
    Scene(
        name="squat and frictionless",
        block=Block(half_width=2.0, half_height=0.1),
        floor=Floor(friction=0.0, restitution=0.5),
        walls=[Wall(side="right", gap=0.05, restitution=1.0)],
        initial_velocity=1.0,
        initial_angular_velocity=0.5,
        duration=1.0,
    ),
    Scene(
        name="pressed on a wall",
        block=PAPER_BLOCK,
        floor=Floor(friction=1.2),
        walls=[Wall(side="left", gap=0.0, restitution=0.5)],
        excitation=Record.from_samples([6.0] * 150, time_step=0.01),
        duration=2.0,
    ),
]


@pytest.mark.parametrize("scene", HARD, ids=lambda scene: scene.name)
@pytest.mark.parametrize("step", [1e-3, 1e-2, "adaptive"])
def test_hard_scenes_end(varying_engine, scene, step):
    history = varying_engine(time_step=step).simulate(scene)
    assert history.cost.steps < 40_000
    assert np.all(
        np.isfinite([column for name, column in history.channels.items() if name != "mode"])
    )
    if step == "adaptive":
        assert_contacts_hold(scene, history, 1e-5)


@pytest.mark.parametrize("step", [1e-3, "adaptive"])
def test_blow_up_is_a_failure(varying_engine, step, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ModelFailure):
        varying_engine(time_step=step).simulate(
            free_rocking(
                0.0, vertical=Record.from_samples([1e30] * 50, time_step=0.01), duration=0.4
            )
        )
    assert list(tmp_path.iterdir()) == []  # no log of the engine's own


class Scripted(Engine):
    name = "scripted"
    answers: dict[str, object]

    def rigid_world(self, scene):
        return SimpleNamespace(
            **dict.fromkeys(("place", "close", "ready", "step"), lambda *given: None),
            embedding=0.0,
            **self.answers,
        )

    stock_world = rigid_world


@pytest.mark.parametrize(
    ("step", "answers", "words"),
    [
        (1e-3, {"state": lambda: (math.nan,) * 6}, "blew up"),
        ("adaptive", {"push": lambda *asked: (math.nan,) * 3}, "blew up"),
        (1e-3, {"state": lambda: (-1.0,) * 6}, "through the floor"),
        # A contact that never stops what approaches: one impact step after the other.
        ("adaptive", {"push": lambda *asked: (0.0, -1.0, 0.0)}, "no end to the events"),
    ],
)
def test_a_motion_that_cannot_be_is_a_failure(step, answers, words):
    with pytest.raises(ModelFailure, match=words):
        Scripted(time_step=step, answers=answers).simulate(free_rocking(0.0))


# Of which a cubic makes 1.6 rad.
@pytest.mark.parametrize(
    ("state", "duration", "told"),
    [
        (lambda: (0.0, 1.0, 1.5, 0.0, 0.0, 100.0), 4.0, ("moving", "lift-off")),
        # Down after the scene's end, in a step that goes beyond it.
        (lambda: (0.0, 1.0, 1.6, 0.0, 0.0, 100.0), 9.5e-3, ("moving", "lift-off")),
        # It comes down within a step, and has not left the floor; heights in R.
        (
            ([(0.0, math.cos(PAPER_BLOCK.alpha) + up, *[0.0] * 4) for up in (0.0, 3e-4)] * 200).pop,
            4.0,
            ("at rest",),
        ),
    ],
)
def test_between_long_steps_no_block_falls_nor_hops(state, duration, told):
    history = Scripted(time_step=1e-2, answers={"state": state}).simulate(
        free_rocking(0.0, output_step=1e-3, duration=duration)
    )
    assert (history.outcome, *(event.kind for event in history.event_list)) == told


@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("above", [3e-9, -3e-9])
def test_mujocos_floor_is_where_it_is_said_to_be(friction, above):
    block = Block(half_width=0.3, half_height=math.sqrt(1.0 - 0.09))  # R = 1 m
    world = MuJoCo().rigid_world(
        Scene(name="a", block=block, floor=Floor(friction=friction), duration=0.1)
    )
    _, falls, _ = world.push(
        (0.0, block.half_height + above, 0.0), (0.0, 0.0, 0.0), 2e-5, (0.0, -9.81), False
    )
    world.close()
    assert falls == pytest.approx(-9.81 * 2e-5 if above > 0.0 else 0.0, abs=1e-9)


def test_a_march_loads_its_compiled_step_before_its_clock_starts(monkeypatch):
    march = steps.AdaptiveStep().ready(
        SimpleNamespace(push=lambda *asked: (0.0, 0.0, 0.0)), free_rocking(0.0, duration=0.01)
    )
    monkeypatch.delattr(compiled, "for_types_of")
    assert len(march()[0]) > 1


def test_what_is_read_off_between_steps_is_exact_where_the_acceleration_is_linear():
    ends = np.array([0.0, 0.0003, 0.002, 0.0152])

    def motion(t):
        place = np.outer(t**3 - t, [1.0, -2.0, 3.0])
        return np.hstack([place, np.outer(3.0 * t**2 - 1.0, [1.0, -2.0, 3.0])])

    felt = np.arange(6.0).reshape(3, 2)
    times, states, between = steps.in_fine_steps(ends, motion(ends), felt)
    assert np.max(np.diff(times)) <= steps.FINE * (1.0 + 1e-9)
    assert set(ends) <= set(times)
    assert states == pytest.approx(motion(times), abs=1e-14)
    assert between[times[1:] <= 0.002 + 1e-12][-1].tolist() == [2.0, 3.0]
    assert between[-1].tolist() == [4.0, 5.0]


def test_steps_are_long_where_nothing_moves(varying_engine):
    history = varying_engine().simulate(free_rocking(0.0, duration=10.0))
    assert history.cost.steps < 1.02 * 10.0 / varying_engine().largest_step + 10


@pytest.mark.parametrize("step", [1e-3, "adaptive"])
def test_a_second_flush_hit_leaves_a_cube_flat(bouncing_engine, step):
    """Both corners of a side meet the wall at one moment: Newton's law has one answer for both."""
    if step == "adaptive" and bouncing_engine.fixed_because:
        return
    walls = [Wall(side=side, gap=0.1, restitution=1.0) for side in ("left", "right")]
    scene = Scene(
        name="to and fro",
        block=Block(half_width=0.5, half_height=0.5),
        floor=Floor(friction=0.0),
        walls=walls,
        initial_velocity=-1.0,
        duration=0.45,
    )
    motion = bouncing_engine(time_step=step).simulate(scene).channels
    assert np.max(np.abs(motion["theta"])) < 1e-7
    assert np.max(motion["y"]) - 0.5 < 1e-8
    assert motion["x_dot"][-1] == pytest.approx(-1.0, abs=2e-3)


def test_what_stands_does_not_fall_in_its_first_step(double_engine):
    """In one step of a user's engine, 1/240 s, what falls freely falls by 0.17 mm."""
    scene = free_rocking(0.0, duration=0.5)
    motion = double_engine(time_step=1.0 / 240.0).simulate(scene).channels
    assert np.max(scene.block.half_height - motion["y"]) < 8e-5


@pytest.mark.needs("pybullet")
def test_pybullets_friction_holds_at_a_users_step():
    """A corner that rounding lifts by 1e-13 m touches all the same."""
    push = Record.from_samples([-0.36 * 9.81] * 2, time_step=5.0)
    scene = Scene(
        name="held",
        block=Block(half_width=1.0, half_height=0.5),
        floor=Floor(friction=0.4),
        excitation=push,
        duration=5.0,
    )
    x = PyBullet(time_step=1.0 / 240.0).simulate(scene).channels["x"]
    assert np.max(np.abs(x)) < 1e-10
