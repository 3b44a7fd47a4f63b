"""Scenes with a known answer, which each engine that is installed meets at its own tolerance."""

import math

import numpy as np
import pytest
from cases import RACK
from scipy.integrate import quad

from rockcheck import (
    Block,
    ContinuousModel,
    EventBasedModel,
    Floor,
    Record,
    Ricker,
    Scene,
    Sine,
    Wall,
    engines,
)
from rockcheck.engines.base_motion import velocity_at, velocity_of
from rockcheck.scenes.scene import PAPER_BLOCK

SQUAT = Block(half_width=1.0, half_height=0.5)


def within(model, engines: float, continuous: float) -> float:
    """A tolerance: that of the engines, or of the continuous model."""
    return continuous if isinstance(model, ContinuousModel) else engines


def test_rest_stays_at_rest(model, block):
    history = model.simulate(
        Scene(name="rest", block=block, floor=Floor(friction=0.3), duration=1.0)
    )
    assert history.outcome == "at rest"
    assert history.peak_rotation < 2e-8
    assert np.max(np.abs(history.channels["x"])) < 1e-7
    assert np.max(np.abs(history.channels["y"] - block.half_height)) < 1e-6
    assert history.event_list == ()


def test_impact_obeys_housner(model, free_rocking):
    scene = free_rocking(0.5).replace(output_step=1e-4, duration=0.8)
    history = model.simulate(scene)
    impact = next(event for event in history.event_list if event.kind == "floor impact")
    t, w = history.channels["t"], history.channels["theta_dot"]
    acceleration = (
        0.75 * 9.81 / scene.block.radius * math.sin(scene.block.alpha)
    )  # of theta, near zero, either side
    before = np.interp(impact.t - 0.005, t, w) - acceleration * 0.005
    after = np.interp(impact.t + 0.005, t, w) - acceleration * 0.005
    alpha, speed = scene.block.alpha, abs(before)
    assert after / before == pytest.approx(1.0 - 1.5 * math.sin(alpha) ** 2, abs=4e-4)
    # The new pivot takes up all of the vertical momentum, and carries the block for the 2 ms that
    # are counted.
    upward = scene.block.radius * math.sin(alpha) * (1.0 + after / before) * speed
    assert impact.impulse == pytest.approx(upward + 9.81 * 2e-3, rel=within(model, 0.02, 0.008))


def test_quarter_period(model, free_rocking):
    scene = free_rocking(0.4)
    history = model.simulate(scene)
    impact = next(event for event in history.event_list if event.kind == "floor impact")
    alpha, tilt = scene.block.alpha, scene.initial_rotation
    # Energy integral of theta'' = -p^2 sin(alpha - theta), with theta = tilt - v^2 to take out the
    # end's singularity.
    nodes, weights = np.polynomial.legendre.leggauss(60)
    v = 0.5 * math.sqrt(tilt) * (nodes + 1.0)
    speed = (
        np.sqrt(2.0 * (np.cos(alpha - tilt) - np.cos(alpha - tilt + v**2)))
        * scene.frequency_parameter
    )
    quarter = 0.5 * math.sqrt(tilt) * float(np.sum(weights * 2.0 * v / speed))
    assert impact.t == pytest.approx(quarter, abs=within(model, 2e-4, 1e-6))


@pytest.mark.parametrize(("speed", "friction"), [(1.0, 0.2), (-1.5, 0.5)])
def test_sliding_distance(model, speed, friction):
    scene = Scene(
        name="slide",
        block=SQUAT,
        floor=Floor(friction=friction),
        initial_velocity=speed,
        duration=1.0,
    )
    history = model.simulate(scene)
    assert history.channels["x"][-1] == pytest.approx(
        math.copysign(speed**2 / (2 * friction * 9.81), speed), rel=within(model, 5e-4, 1e-5)
    )
    assert history.peak_rotation < 1e-5
    assert history.outcome == "at rest"
    if model.name == "cm":  # tells impacts alone
        return
    stick = next(event for event in history.event_list if event.kind == "stick")
    assert stick.t == pytest.approx(
        abs(speed) / (friction * 9.81), abs=0.003
    )  # the event is told at 1 mm/s
    assert [event.kind for event in history.event_list] == ["stick", "settled"]


def test_sliding_without_friction(model):
    ice = Scene(
        name="ice", block=SQUAT, floor=Floor(friction=0.0), initial_velocity=0.5, duration=1.0
    )
    assert model.simulate(ice).channels["x"][-1] == pytest.approx(0.5, abs=1e-5)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
def test_bounce_height(bouncing_model, restitution):
    floor = Floor(friction=0.3, restitution=restitution)
    scene = Scene(
        name="drop", block=SQUAT, floor=floor, initial_height=0.2, duration=0.6, output_step=1e-3
    )
    history = bouncing_model.simulate(scene)
    fall = math.sqrt(2 * 0.2 / 9.81)
    later = (history.channels["t"] > fall + 1e-3) & (
        history.channels["t"] < fall * (1 + 2 * restitution) + 0.02
    )
    bounce = np.max(history.channels["y"][later]) - SQUAT.half_height
    assert bounce == pytest.approx(0.2 * restitution**2, abs=3e-4)
    impacts = [event for event in history.event_list if event.kind == "floor impact"][:2]
    assert impacts[0].t == pytest.approx(fall, abs=2e-4)
    carried = 9.81 * 2e-3 if restitution == 0.0 else 0.0
    assert sum(event.impulse for event in impacts) == pytest.approx(
        (1 + restitution) * math.sqrt(2 * 9.81 * 0.2) + carried, rel=4e-3
    )


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("restitution", [0.0, 0.5, 1.0])
def test_flush_impact_on_a_wall(bouncing_model, side, restitution):
    outward = -1.0 if side == "left" else 1.0
    wall = Wall(side=side, gap=0.050737, restitution=restitution)
    scene = Scene(
        name="flush",
        block=SQUAT,
        floor=Floor(friction=0.0),
        walls=[wall],
        initial_velocity=outward,
        duration=0.1,
    )
    history = bouncing_model.simulate(scene)
    assert history.channels["x_dot"][-1] == pytest.approx(-restitution * outward, abs=1e-3)
    assert history.peak_rotation < 1e-6
    impacts = [event for event in history.event_list if event.kind == "wall impact"]
    assert len(impacts) == 2  # both corners
    times, impulse = [event.t for event in impacts], sum(event.impulse for event in impacts)
    assert times == pytest.approx([0.050737] * 2, abs=within(bouncing_model, 1e-4, 1e-6))
    assert impulse == pytest.approx(1.0 + restitution, rel=within(bouncing_model, 2e-3, 1e-3))


def test_both_walls(bouncing_model):
    walls = [
        Wall(side="left", gap=0.030037, restitution=1.0),
        Wall(side="right", gap=0.050537, restitution=1.0),
    ]
    scene = Scene(
        name="between",
        block=SQUAT,
        floor=Floor(friction=0.0),
        walls=walls,
        initial_velocity=-1.0,
        duration=0.4,
    )
    history = bouncing_model.simulate(scene)
    assert np.min(history.channels["x"]) == pytest.approx(-0.030037, abs=1e-3)
    assert np.max(history.channels["x"]) == pytest.approx(0.050537, abs=1e-3)
    assert abs(history.channels["x_dot"][-1]) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    "excitation",
    [
        Ricker(amplitude=4.0, period=1.5),
        Ricker(amplitude=4.0, period=0.5, symmetric=True),
        Sine(amplitude=4.0, period=0.5, cycles=2),
        Record.from_samples([0.0, 3.0, -2.0, 1.0, 0.5], time_step=0.2),
    ],
    ids=lambda excitation: excitation.kind,
)
def test_the_base_gains_what_its_acceleration_gives(excitation):
    """The velocity of the base against an integral of its own, to rounding; it stays when the
    shaking has ended."""
    velocity = velocity_of(excitation)
    for share in (0.1, 0.37, 0.5, 0.81, 1.0, 1.3):
        t = share * excitation.quiet_after
        kinks = 0.2 * np.arange(1, 5) if excitation.kind == "record" else None
        gained = quad(
            lambda s: float(excitation.acceleration(s)),
            0.0,
            t,
            points=kinks,
            epsabs=1e-13,
            limit=500,
        )[0]
        assert velocity_at(t, *velocity) == pytest.approx(gained, abs=1e-10)


def test_base_motion_moves_the_floor_under_a_loose_block(model):
    shake = Sine(amplitude=2.0, period=0.5, cycles=2)
    scene = Scene(
        name="loose", block=SQUAT, floor=Floor(friction=0.0), excitation=shake, duration=1.0
    )
    history = model.simulate(scene)
    omega = 2 * math.pi / 0.5
    t = history.channels["t"]
    exact = (
        -2.0 / omega * (t - np.sin(omega * t) / omega)
    )  # the block stays in space, so that it moves against the floor
    assert np.max(np.abs(history.channels["x"] - exact)) < 1e-4


def test_vertical_acceleration_adds_to_gravity(model):
    """A base that falls with more than g leaves the block behind."""
    falling = Record.from_samples([-15.0] * 101, time_step=1e-3)
    scene = Scene(
        name="falling base", block=SQUAT, floor=Floor(friction=0.3), vertical=falling, duration=0.1
    )
    history = model.simulate(scene)
    height = history.channels["y"] - SQUAT.half_height
    assert np.max(np.abs(height - 0.5 * (15.0 - 9.81) * history.channels["t"] ** 2)) < 1e-4


@pytest.mark.parametrize(("amplitude", "side"), [(6.0, "left"), (-6.0, "right")])
def test_overturning_ends_the_run(model, block, amplitude, side):
    scene = Scene(
        name="over",
        block=block,
        floor=Floor(friction=1.0),
        excitation=Ricker(amplitude=amplitude, period=2.0),
        duration=20.0,
    )
    history = model.simulate(scene)
    assert history.event_list[-1].kind == history.outcome == f"overturned {side}"
    last = history.channels["t"][-1]
    assert last <= history.event_list[-1].t < last + scene.output_step + 1e-9
    assert np.max(np.abs(history.channels["theta"])) < math.pi / 2
    assert np.max(np.abs(history.channels["theta"])) > 0.9 * math.pi / 2
    assert last < 19.0


def test_mirrored_scene_gives_mirrored_motion(model, block):
    scene = Scene(
        name="beside a wall",
        block=block,
        floor=Floor(friction=0.6),
        walls=[Wall(side="left", gap=0.053, restitution=1.0)],
        excitation=Ricker(amplitude=7.5, period=0.49),
        duration=1.5,
    )
    history, mirrored = model.simulate(scene), model.simulate(scene.mirrored())
    for channel in ("x", "theta", "x_dot", "theta_dot", "slip"):
        apart = np.max(np.abs(history.channels[channel] + mirrored.channels[channel]))
        assert apart < (1e-6 if "adaptive" in str(model) else within(model, 2e-3, 1e-7)), channel
    assert history.peak_rotation > 0.2 * block.alpha
    assert "wall impact" in [event.kind for event in history.event_list]
    assert [event.kind for event in history.event_list][:4] == [
        event.kind for event in mirrored.event_list
    ][:4]


def test_events_of_a_pulse_beside_a_wall(varying_engine, pulse):
    """Times from an event-driven implementation of the unilateral model."""
    scene = pulse(
        3.0, 6.0, friction=0.6, walls=[Wall(side="left", gap=0.053, restitution=1.0)], duration=1.9
    )
    history = varying_engine(time_step="adaptive").simulate(scene)
    expected = [
        ("uplift", 0.783060),
        ("wall impact", 0.941125),
        ("lift-off", 0.941125),
        ("floor impact", 0.983946),
        ("landing", 0.983946),
        ("floor impact", 1.831316),
        ("wall impact", 1.849009),
    ]
    found = [(event.kind, event.t) for event in history.event_list][: len(expected)]
    assert [kind for kind, _ in found] == [kind for kind, _ in expected]
    assert [t for _, t in found] == pytest.approx([t for _, t in expected], abs=2e-5)
    reference = EventBasedModel(pivot="unilateral").simulate(scene)
    apart = np.max(np.abs(history.channels["theta"] - reference.channels["theta"]))
    assert apart < 1e-4 * scene.block.alpha
    hit = history.event_list[1]
    assert (hit.mode_before, hit.mode_after) == ("rock", "flight")
    assert hit.impulse == pytest.approx(0.407101, abs=1e-4)


def test_slip_and_stick_events(varying_engine, pulse):
    history = varying_engine(time_step="adaptive").simulate(
        pulse(4.0, 4.5, friction=0.3, duration=1.6)
    )
    found = {event.kind: event.t for event in history.event_list if event.kind in ("slip", "stick")}
    assert found["slip"] == pytest.approx(
        1.057406, abs=1.1e-3
    )  # of the unilateral model; known to one step
    assert found["stick"] == pytest.approx(1.366917, abs=1e-4)


def test_a_rocking_block_comes_to_rest_once(varying_engine, block):
    scene = Scene(
        name="decay",
        block=block,
        floor=Floor(friction=1.0),
        initial_rotation=0.1 * block.alpha,
        duration=8.0,
    )
    history = varying_engine(time_step="adaptive").simulate(scene)
    kinds = [event.kind for event in history.event_list]
    assert history.cost.steps < 1.1 * scene.duration / 5e-4  # of the largest step
    assert kinds.count("settled") == 1
    assert kinds[-1] == "settled"
    assert history.outcome == "at rest"
    assert set(kinds) == {"floor impact", "settled"}


PULSE = Ricker(amplitude=6.5, period=0.8)
SCENES = {
    "on its left pivot": {"initial_rotation": 0.1, "duration": 1.5},
    "on its right pivot": {"initial_rotation": -0.1, "duration": 1.5},
    "slips": {"floor": Floor(friction=0.3), "excitation": PULSE},
    "left wall": {"walls": [Wall(side="left", gap=0.03, restitution=0.3)], "excitation": PULSE},
    "right wall": {"walls": [Wall(side="right", gap=0.03, restitution=0.3)], "excitation": PULSE},
}
ALL = [
    engine
    for engine in (getattr(engines, name) for name in engines.__all__)
    if engine.installed() and not engine.fixed_because
]
#: Models at their best, and engines as they come; how far from the unilateral model they may be,
#: RMS in alpha.
BEST = [(engine(time_step="adaptive"), 1e-5) for engine in ALL] + [(ContinuousModel(), 3e-4)]
STOCK = [(engine(time_step=1e-4, settings="default"), 5e-2) for engine in ALL]


def loaded_scene(name: str) -> Scene:
    return Scene(
        **{"name": name, "block": RACK, "floor": Floor(friction=0.5), "duration": 2.5}
        | SCENES[name]
    )


@pytest.fixture(scope="module")
def references() -> dict[str, np.ndarray]:
    """x of the box's centre and theta of each scene by the unilateral event-based model."""
    histories = {
        name: EventBasedModel(pivot="unilateral").simulate(loaded_scene(name)) for name in SCENES
    }
    assert all(np.max(np.abs(history.channels["theta"])) > 5e-3 for history in histories.values())
    return {
        name: np.array([history.channels["x"], history.channels["theta"]])
        for name, history in histories.items()
    }


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    ("player", "allowed"), [*BEST, *STOCK], ids=lambda one: getattr(one, "name", None)
)
def test_each_model_knows_where_the_mass_is(player, allowed, name, references):
    history = player.simulate(loaded_scene(name))
    x, theta = references[name]
    assert np.sqrt(np.mean((history.channels["theta"] - theta) ** 2)) < allowed * RACK.alpha
    assert np.max(np.abs(history.channels["x"] - x)) < 10.0 * allowed * RACK.radius


def test_the_continuous_model_begins_at_rest():
    """Its springs share the weight as the mass lies: what stands stands still, to a thousandth of
    the depth that it sinks."""
    scene = Scene(name="stands", block=RACK, floor=Floor(friction=0.5), duration=0.5)
    for model in (ContinuousModel(penetration=1e-6), ContinuousModel(penetration=1e-4)):
        channels = model.simulate(
            scene
        ).channels  # its first row is the scene's, before it has sunk
        assert np.ptp(channels["y"][1:]) < 1e-3 * model.penetration
        assert np.ptp(channels["theta"][1:]) * RACK.half_width < 1e-3 * model.penetration


def test_a_bounce_does_not_turn_the_slip_round(varying_engine):
    floor, tilt = Floor(friction=0.5, restitution=0.3), {"initial_rotation": -0.1, "duration": 0.2}
    scene = Scene(name="a", block=PAPER_BLOCK, floor=floor, initial_height=0.02, **tilt)
    for slip in (-1.0, -0.1):
        oblique = scene.replace(initial_velocity=slip)
        reference = EventBasedModel(pivot="unilateral").simulate(oblique)
        history = varying_engine().simulate(oblique)
        for name in ("x", "theta"):
            np.testing.assert_allclose(history.channels[name], reference.channels[name], atol=1e-6)
