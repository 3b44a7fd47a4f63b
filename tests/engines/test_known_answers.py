"""Scenes with a known answer, which each engine that is installed meets at its own tolerance."""

import math

import numpy as np
import pytest
from cases import RACK, free_rocking, pulse_scene
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
)
from rockcheck.engines import base_motion, registry
from rockcheck.scenes import PAPER_BLOCK

SQUAT = Block(half_width=1.0, half_height=0.5)


def within(model, engines: float, continuous: float) -> float:
    """A tolerance: that of the engines, or of the continuous model."""
    return continuous if isinstance(model, ContinuousModel) else engines


def test_rest_stays_at_rest(model, block):
    history = model.simulate(
        Scene(name="rest", block=block, floor=Floor(friction=0.3), duration=1.0)
    )
    assert (history.outcome, history.event_list) == ("at rest", ())
    for name, place, most in (("theta", 0, 2e-8), ("x", 0, 1e-7), ("y", block.half_height, 1e-6)):
        assert np.max(np.abs(history.channels[name] - place)) < most, name


def test_impact_obeys_housner(model, block):
    history = model.simulate(free_rocking(0.5, output_step=1e-4, duration=0.8))
    impact = next(event for event in history.event_list if event.kind == "floor impact")
    t, w = history.channels["t"], history.channels["theta_dot"]
    # Of theta, near zero, either side.
    acceleration = 0.75 * 9.81 / block.radius * math.sin(block.alpha)
    before, after = np.interp(impact.t + np.array([-0.005, 0.005]), t, w) - acceleration * 0.005
    assert after / before == pytest.approx(1.0 - 1.5 * math.sin(block.alpha) ** 2, abs=4e-4)
    # The new pivot takes up all of the vertical momentum, and carries the block for the 2 ms that
    # are counted.
    upward = block.radius * math.sin(block.alpha) * (1.0 + after / before) * abs(before)
    assert impact.impulse == pytest.approx(upward + 9.81 * 2e-3, rel=within(model, 0.02, 0.008))


def test_quarter_period(model):
    scene = free_rocking(0.4)
    impact = next(
        event for event in model.simulate(scene).event_list if event.kind == "floor impact"
    )
    alpha, tilt = scene.block.alpha, scene.initial_rotation
    # Energy integral of theta'' = -p^2 sin(alpha - theta), with theta = tilt - v^2 to take out the
    # end's singularity.
    quarter = quad(
        lambda v: (
            2.0 * v / math.sqrt(2.0 * (math.cos(alpha - tilt) - math.cos(alpha - tilt + v * v)))
        ),
        0.0,
        math.sqrt(tilt),
    )[0]
    assert impact.t == pytest.approx(
        quarter / scene.frequency_parameter, abs=within(model, 2e-4, 1e-6)
    )


@pytest.mark.parametrize(("speed", "friction"), [(1.0, 0.2), (-1.5, 0.5)])
def test_sliding_distance(model, speed, friction):
    history = model.simulate(
        Scene(
            name="slide",
            block=SQUAT,
            floor=Floor(friction=friction),
            initial_velocity=speed,
            duration=1.0,
        )
    )
    slid = pytest.approx(speed * abs(speed) / (2 * friction * 9.81), rel=within(model, 5e-4, 1e-5))
    assert (history.outcome, history.channels["x"][-1]) == ("at rest", slid)
    assert history.peak_rotation < 1e-5
    if model.name != "cm":  # which tells impacts alone
        assert [event.kind for event in history.event_list] == ["stick", "settled"]
        assert history.event_list[0].t == pytest.approx(abs(speed) / (friction * 9.81), abs=2e-4)


@pytest.mark.parametrize("restitution", [0.0, 0.5, 0.8])
def test_bounce_height(bouncing_model, restitution):
    history = bouncing_model.simulate(
        Scene(
            name="drop",
            block=SQUAT,
            floor=Floor(friction=0.3, restitution=restitution),
            initial_height=0.2,
            duration=0.6,
            output_step=1e-3,
        )
    )
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
@pytest.mark.parametrize(
    ("gap", "restitution"),
    [(0.050737, 0.0), (0.050737, 0.5), (0.050737, 1.0), (0.0, 0.0), (0.0, 0.5)],
)
def test_flush_impact_on_a_wall(bouncing_model, side, gap, restitution):
    outward = -1.0 if side == "left" else 1.0
    history = bouncing_model.simulate(
        Scene(
            name="flush",
            block=SQUAT,
            floor=Floor(friction=0.0),
            walls=[Wall(side=side, gap=gap, restitution=restitution)],
            initial_velocity=outward,
            duration=0.1,
        )
    )
    assert history.channels["x_dot"][-1] == pytest.approx(-restitution * outward, abs=1e-3)
    assert history.peak_rotation < 1e-6
    impacts = [event for event in history.event_list if event.kind == "wall impact"]
    times, impulse = [event.t for event in impacts], sum(event.impulse for event in impacts)
    # Of both corners.
    assert times == pytest.approx([gap] * 2, abs=within(bouncing_model, 1e-4, 1e-6))
    assert impulse == pytest.approx(1.0 + restitution, rel=within(bouncing_model, 2e-3, 1e-3))


def test_both_walls(bouncing_model):
    history = bouncing_model.simulate(
        Scene(
            name="between",
            block=SQUAT,
            floor=Floor(friction=0.0),
            walls=[
                Wall(side="left", gap=0.030037, restitution=1.0),
                Wall(side="right", gap=0.050537, restitution=1.0),
            ],
            initial_velocity=-1.0,
            duration=0.4,
        )
    )
    x, speed = history.channels["x"], abs(history.channels["x_dot"][-1])
    assert (np.min(x), np.max(x), speed) == pytest.approx((-0.030037, 0.050537, 1.0), abs=1e-3)


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
@pytest.mark.parametrize("share", [0.1, 0.37, 0.5, 0.81, 1.0, 1.3])
def test_the_base_gains_what_its_acceleration_gives(excitation, share):
    t = share * excitation.quiet_after
    gained = quad(
        lambda s: float(excitation.acceleration(s)),
        0.0,
        t,
        points=0.2 * np.arange(1, 5) if excitation.kind == "record" else None,
        epsabs=1e-13,
        limit=500,
    )[0]
    assert base_motion.velocity_at(t, *base_motion.velocity_of(excitation)) == pytest.approx(
        gained, abs=1e-10
    )


ICE = Scene(name="ice", block=SQUAT, floor=Floor(friction=0.0), duration=1.0)
TURNS = 4 * math.pi  # rad/s
#: Scenes of a block that nothing holds, a channel, what it is by the time, and how nearly.
LOOSE = {
    "slides": (ICE.replace(initial_velocity=0.5), "x", lambda t: 0.5 * t, 1e-5),
    "slides far": (
        ICE.replace(block=Block(half_width=0.01, half_height=0.005), initial_velocity=2.0),
        "x",
        lambda t: 2.0 * t,
        1e-5,
    ),
    # It stays in space, so that it moves against the floor.
    "is left behind by its base": (
        ICE.replace(excitation=Sine(amplitude=2.0, period=0.5, cycles=2)),
        "x",
        lambda t: -2.0 / TURNS * (t - np.sin(TURNS * t) / TURNS),
        1e-4,
    ),
    # A base that falls with more than g: vertical acceleration adds to gravity.
    "is left behind by its falling base": (
        ICE.replace(
            floor=Floor(friction=0.3),
            vertical=Record.from_samples([-15.0] * 101, time_step=1e-3),
            duration=0.1,
        ),
        "y",
        lambda t: SQUAT.half_height + 0.5 * (15.0 - 9.81) * t**2,
        1e-4,
    ),
}


@pytest.mark.parametrize("name", LOOSE)
def test_a_loose_block(model, name):
    scene, channel, exact, allowed = LOOSE[name]
    found = model.simulate(scene).channels
    assert np.max(np.abs(found[channel] - exact(found["t"]))) < within(model, allowed, 3e-8)


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
    assert 0.9 * math.pi / 2 < np.max(np.abs(history.channels["theta"])) < math.pi / 2
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
        assert np.max(np.abs(history.channels[channel] + mirrored.channels[channel])) < (
            1e-6 if "adaptive" in str(model) else within(model, 2e-3, 1e-7)
        ), channel
    assert history.peak_rotation > 0.2 * block.alpha
    kinds, others = ([event.kind for event in one.event_list] for one in (history, mirrored))
    assert "wall impact" in kinds
    assert kinds[:4] == others[:4]


def test_events_of_a_pulse_beside_a_wall(varying_engine):
    """Times from an event-driven implementation of the unilateral model."""
    scene = pulse_scene(6.0, 3.0, 0.6, ("left", 0.053, 1.0), duration=1.9)
    history = varying_engine(time_step="adaptive").simulate(scene)
    assert [
        (event.kind, pytest.approx(event.t, abs=2e-5), event.mode_before)
        for event in history.event_list[:7]
    ] == [
        ("uplift", 0.783060, "rest"),
        ("wall impact", 0.941125, "rock"),
        ("lift-off", 0.941125, "ladder"),
        ("floor impact", 0.983946, "flight"),
        ("landing", 0.983946, "flight"),
        ("floor impact", 1.831316, "rock"),
        ("wall impact", 1.849009, "rock"),
    ]
    reference = EventBasedModel(pivot="unilateral").simulate(scene)
    apart = np.max(np.abs(history.channels["theta"] - reference.channels["theta"]))
    assert apart < 1e-4 * scene.block.alpha
    hit, impulse = history.event_list[1], pytest.approx(0.407101, abs=1e-4)
    assert (hit.mode_before, hit.mode_after, hit.impulse) == ("rock", "flight", impulse)


@pytest.mark.parametrize(
    ("scene", "step", "times"),
    [
        (
            pulse_scene(4.5, 4.0, 0.3, duration=1.6),
            "adaptive",
            {
                "slip": pytest.approx(1.057406, abs=1.1e-3),
                "stick": pytest.approx(1.366917, abs=1e-4),
            },
        ),
        # In flight it moves against the floor, but slips from its landing on.
        (
            ICE.replace(initial_height=0.2, excitation=Sine(amplitude=2.0, period=1.2)),
            "adaptive",
            {"slip": pytest.approx(math.sqrt(0.4 / 9.81), abs=1e-6)},
        ),
        # It leans on a wall until the base has slowed down.
        (
            ICE.replace(
                block=PAPER_BLOCK,
                floor=Floor(friction=1.2),
                walls=[Wall(side="left", gap=0.05)],
                excitation=Record.from_samples([6.0, 6.0, -3.0], time_step=1.0),
                duration=1.6,
            ),
            "adaptive",
            {"release": pytest.approx(1.401971, abs=1e-3)},
        ),
        # It stands all the time.
        (
            ICE.replace(
                block=PAPER_BLOCK,
                floor=Floor(friction=0.3),
                excitation=Sine(amplitude=1.0, period=0.5, cycles=4),
            ),
            1e-3,
            {},
        ),
    ],
    ids=["rocks", "lands", "leans", "stands"],
)
def test_slip_stick_and_release_events(varying_engine, scene, step, times):
    """Times of the unilateral model; that of the slip is known to one step."""
    events = varying_engine(time_step=step).simulate(scene).event_list
    assert {
        event.kind: event.t
        for event in events
        if event.kind in ("slip", "stick", "release", "settled")
    } == times


def test_a_rocking_block_comes_to_rest_once(varying_engine):
    scene = free_rocking(0.1, duration=8.0)
    history = varying_engine(time_step="adaptive").simulate(scene)
    *impacts, last = [event.kind for event in history.event_list]
    assert history.cost.steps < 1.1 * scene.duration / 5e-4  # of the largest step
    assert (set(impacts), last, history.outcome) == ({"floor impact"}, "settled", "at rest")


PULSE = Ricker(amplitude=6.5, period=0.8)
SCENES = {
    "on its left pivot": {"initial_rotation": 0.1, "duration": 1.5},
    "on its right pivot": {"initial_rotation": -0.1, "duration": 1.5},
    "slips": {"floor": Floor(friction=0.3), "excitation": PULSE},
    "left wall": {"walls": [Wall(side="left", gap=0.03, restitution=0.3)], "excitation": PULSE},
    "right wall": {"walls": [Wall(side="right", gap=0.03, restitution=0.3)], "excitation": PULSE},
    "slender": {
        "block": Block(half_width=0.08, half_height=1.0),
        "excitation": Sine(amplitude=1.2, period=0.3, cycles=3),
        "duration": 1.0,
    },
    "far off, beside a wall": {
        "block": RACK.replace(centre_of_mass=(0.2, -0.25)),
        "walls": [Wall(side="left", gap=0.0)],
        "excitation": PULSE,
    },
}
ALL = [
    facts.engine
    for facts in registry.every()
    if facts.engine.installed() and not facts.engine.fixed_because
]
#: Models at their best, and engines as they come; how far from the unilateral model they may be,
#: RMS in alpha.
PLAYERS = [
    *((engine(time_step="adaptive"), 1e-5) for engine in ALL),
    (ContinuousModel(), 3e-4),
    *((engine(time_step=1e-4, settings="default"), 5e-2) for engine in ALL),
]
#: DART takes more time than all others: of its scenes these are played for each change, the others
#: at night.
OF_DART = ("on its left pivot", "slips")


STANDS = Scene(name="stands", block=RACK, floor=Floor(friction=0.5), duration=2.5)


@pytest.mark.parametrize(
    ("player", "allowed", "name"),
    [
        pytest.param(
            player,
            allowed,
            name,
            marks=[pytest.mark.slow] if player.name == "dart" and name not in OF_DART else [],
            id=f"{player.name}-{allowed}-{name}",
        )
        for player, allowed in PLAYERS
        for name in SCENES
    ],
)
def test_each_model_knows_where_the_mass_is(player, allowed, name):
    scene = STANDS.replace(**SCENES[name])
    found, exact = (
        np.array([model.simulate(scene).channels[one] for one in ("x", "theta")])
        for model in (player, EventBasedModel(pivot="unilateral"))
    )
    assert np.max(np.abs(exact[1])) > 5e-3
    assert np.sqrt(np.mean((found - exact)[1] ** 2)) < allowed * RACK.alpha
    assert np.max(np.abs(found - exact)[0]) < 10.0 * allowed * RACK.radius


@pytest.mark.parametrize("depth", [1e-6, 1e-4])
def test_the_continuous_model_begins_at_rest(depth):
    """Its springs share the weight as the mass lies: what stands stands still, to a thousandth of
    the depth that it sinks."""
    # Its first row is the scene's, before it has sunk.
    history = ContinuousModel(penetration=depth).simulate(STANDS.replace(duration=0.5))
    assert np.ptp(history.channels["y"][1:]) < 1e-3 * depth
    assert np.ptp(history.channels["theta"][1:]) * RACK.half_width < 1e-3 * depth


@pytest.mark.parametrize("slip", [-1.0, -0.1])
def test_a_bounce_does_not_turn_the_slip_round(varying_engine, slip):
    scene = Scene(
        name="oblique",
        block=PAPER_BLOCK,
        floor=Floor(friction=0.5, restitution=0.3),
        initial_height=0.02,
        initial_rotation=-0.1,
        initial_velocity=slip,
        duration=0.2,
    )
    found, exact = (
        [model.simulate(scene).channels[name] for name in ("x", "theta")]
        for model in (varying_engine(), EventBasedModel(pivot="unilateral"))
    )
    np.testing.assert_allclose(found, exact, atol=1e-6)


@pytest.mark.parametrize("friction", [2.0, 10.0])
def test_friction_beyond_painleve_is_played_by_engines(double_engine, friction):
    """What slides stops all the same after v^2/(2 mu g), if it is too squat to tip."""
    scene = Scene(
        name="rubber",
        block=Block(half_width=50.0, half_height=0.5),
        floor=Floor(friction=friction),
        initial_velocity=2.0,
        duration=0.3,
    )
    x = double_engine(time_step=1e-4).simulate(scene).channels["x"]
    assert x[-1] == pytest.approx(4.0 / (2.0 * friction * 9.81), rel=0.02)
