"""What the event-based models accept, refuse and report."""

import math
from unittest.mock import Mock

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.scenes import (
    PAPER_BLOCK,
    Block,
    Floor,
    Record,
    Rest,
    Ricker,
    Scene,
    Wall,
    load_scene,
    progress,
)

#: A scene with what is changed in it.
scene_of = Scene(
    name="model", block=PAPER_BLOCK, floor=Floor(friction=0.3), excitation=Rest(), duration=1.0
).replace


@pytest.mark.parametrize(
    ("settings", "change", "said"),
    [
        (
            {},
            {"floor": Floor(friction=0.3, restitution=0.4)},
            "floor.restitution: 0.4 is not allowed with the bilateral pivot",
        ),
        (
            {},
            {"initial_height": 0.1},
            "initial_height: 0.1 is not allowed with the bilateral pivot",
        ),
        (
            {"pivot": "unilateral"},
            {"floor": Floor(friction=0.3, restitution=1.0)},
            "floor.restitution: 1 is not allowed",
        ),
        ({"friction": "no-slip"}, {"initial_velocity": 0.1}, "initial_velocity"),
        ({"friction": "bouc-wen", "pivot": "unilateral"}, {}, "pivot: 'unilateral' is not allowed"),
        ({"friction": "no-slip", "pivot": "unilateral"}, {}, "pivot: 'unilateral' is not allowed"),
        (
            {"friction": "bouc-wen"},
            {"floor": Floor(friction=0.3, static_friction=0.4)},
            "floor.static_friction",
        ),
        (
            {"friction": "bouc-wen"},
            {"floor": Floor(friction=0.3, restitution=0.2)},
            "floor.restitution",
        ),
    ],
)
def test_physics_that_is_refused(fault_of, settings, change, said):
    assert str(fault_of(EventBasedModel(**settings).simulate, scene_of(**change))).startswith(said)


@pytest.mark.parametrize(
    ("settings", "key"),
    [
        ({"tolerance": 0.0}, "tolerance"),
        ({"tolerance": -1e-8}, "tolerance"),
        ({"tolerance": math.nan}, "tolerance"),
        ({"tolerance": "1e-8"}, "tolerance"),
        ({"pivot": "free"}, "pivot"),
        ({"friction": "viscous"}, "friction"),
        ({"most_steps": 0}, "most_steps"),
        ({"most_events": 0}, "most_events"),
        ({"tol": 1e-8}, "tol"),
    ],
)
def test_settings_that_are_refused(fault_of, settings, key):
    assert fault_of(EventBasedModel, **settings).key == key


def test_history_of_a_paper_scene():
    scene = load_scene("fig4a")
    history = EventBasedModel().simulate(scene)
    assert history.model == "ebm"
    assert history.name == "fig4a"
    assert history.outcome == "at rest"
    assert history.peak_rotation / scene.block.alpha == pytest.approx(0.329, abs=5e-4)
    assert len(history.frame) == len(scene.output_times) == 7201
    events = history.events
    assert list(events.columns) == ["t", "kind", "mode_before", "mode_after", "impulse"]
    assert events["t"].is_monotonic_increasing
    assert events["kind"][0] == "uplift"
    assert (events["impulse"] >= 0.0).all()
    assert history.cost.evaluations >= history.cost.steps > 0
    assert history.settings == EventBasedModel().model_dump()


def test_the_floor_pushes_at_each_impact_on_it():
    scene = load_scene("fig4a").replace(duration=8.0)
    pushes = [
        event.impulse
        for event in EventBasedModel().simulate(scene).event_list
        if event.kind == "floor impact"
    ]
    assert len(pushes) > 50
    assert min(pushes) > 0.0


@pytest.mark.parametrize(
    ("settings", "name"),
    [
        ({}, "ebm"),
        ({"pivot": "unilateral"}, "ebm-unilateral"),
        ({"friction": "bouc-wen"}, "ebm-bouc-wen"),
    ],
)
def test_a_model_is_named_by_its_pivot_or_friction(settings, name):
    assert EventBasedModel(**settings).name == name


@pytest.mark.parametrize(
    ("settings", "steps"),
    [
        ({}, 2500),
        ({"pivot": "unilateral"}, 2500),
        ({"friction": "no-slip"}, 2500),
        ({"pivot": "unilateral"}, 200),
        ({"friction": "bouc-wen"}, 2500),
    ],
    ids=str,
)
def test_a_single_short_run_does_not_wait_for_the_compiler(monkeypatch, settings, steps):
    """It is interpreted, the same to the bit; compiled if that takes many steps, or if friction is
    stiff."""
    model, scene = EventBasedModel(**settings), load_scene("fig5a").replace(duration=3.0)
    scene = scene.replace(excitation=Ricker(amplitude=4.0, period=1.2, symmetric=True))
    expected = model.simulate(scene)
    interpreted, compiled = (Mock(wraps=one) for one in (natural.interpreted, natural.loop_of))
    monkeypatch.setattr(natural, "interpreted", interpreted)
    monkeypatch.setattr(natural, "loop_of", compiled)
    monkeypatch.setattr(natural, "is_ready", lambda *given: False)
    monkeypatch.setattr("rockcheck.ebm.model._INTERPRETED", steps)
    with progress.within(progress.ONE_RUN, True):
        found = model.simulate(scene)
    stiff = model.friction == "bouc-wen"
    assert interpreted.called == (not stiff)
    assert compiled.called == (stiff or steps < found.cost.steps)
    one, other = (
        (
            run.event_list,
            run.outcome,
            run.cost.steps,
            {k: v.tolist() for k, v in run.channels.items()},
        )
        for run in (found, expected)
    )
    assert one == other


def test_note_where_a_record_is_short():
    record = Record.from_samples(np.full(11, 0.2), time_step=0.1)
    ends = "record ends at 1 s, before the scene's 2 s; the base is at rest after it"
    short, long = (
        EventBasedModel().simulate(scene_of(excitation=record, vertical=record, duration=one)).notes
        for one in (0.9, 2.0)
    )
    assert short == ()
    assert long == (f"the horizontal {ends}", f"the vertical {ends}")


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
@pytest.mark.parametrize(
    "settings", [{}, {"pivot": "unilateral"}, {"friction": "bouc-wen"}], ids=str
)
@pytest.mark.parametrize(("tilt", "spin"), [(0.99, 0.3), (1.3, 0.0)])
def test_overturning_ends_the_history(tilt, spin, settings, side, sign):
    scene = scene_of(
        initial_rotation=sign * tilt * PAPER_BLOCK.alpha,
        initial_angular_velocity=sign * spin,
        duration=30.0,
    )
    history = EventBasedModel(**settings).simulate(scene)
    last, t, theta = history.event_list[-1], history.channels["t"], history.channels["theta"]
    assert history.outcome == last.kind == f"overturned {side}"
    assert t[-1] < last.t < t[-1] + scene.output_step
    assert 1.4 < abs(theta[-1]) < math.pi / 2
    assert np.all(np.diff(sign * theta) > 0.0)
    assert {len(channel) for channel in history.channels.values()} == {len(t)}


@pytest.mark.parametrize(("pivot", "name"), [("bilateral", "fig4a"), ("unilateral", "fig5b")])
def test_events_of_a_flight_are_not_floor_impacts(pivot, name):
    """A floor impact has an impulse. A block that flies through theta = 0 strikes nothing."""
    events = EventBasedModel(pivot=pivot).simulate(load_scene(name)).event_list
    assert min(e.impulse for e in events if e.kind in ("floor impact", "wall impact")) > 0.0


@pytest.mark.parametrize("mu", [0.0, 1e-12])
@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
def test_ice(pivot, mu):
    """On a floor without friction the centroid keeps its place above the shaking ground: x =
    -(ground displacement)."""
    scene = scene_of(
        floor=Floor(friction=mu), excitation=Record.from_samples([1.0, 1.0], time_step=2.0)
    )
    motion = EventBasedModel(pivot=pivot).simulate(scene).channels
    np.testing.assert_allclose(motion["x"], -0.5 * motion["t"] ** 2, rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
def test_restitution_of_one_and_walls_that_touch(pivot):
    """A block that slides to and fro between elastic walls on ice keeps its speed, and hits them
    when it must."""
    walls = [
        Wall(side="left", gap=0.1, restitution=1.0),
        Wall(side="right", gap=0.3, restitution=1.0),
    ]
    history = EventBasedModel(pivot=pivot).simulate(
        scene_of(floor=Floor(friction=0.0), walls=walls, initial_velocity=1.0, duration=2.0)
    )
    hits = [e.t for e in history.event_list if e.kind == "wall impact"]
    np.testing.assert_allclose(hits, [0.3, 0.7, 1.1, 1.5, 1.9], rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(history.channels["x_dot"]), 1.0, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("change", "key", "words"),
    [
        ({"floor": Floor(friction=4.0 / 3.0)}, "floor.friction", "must be below 4/3"),
        (
            {"floor": Floor(friction=0.3, static_friction=1.5)},
            "floor.static_friction",
            "must be below 4/3",
        ),
        (
            {"block": Block(half_width=0.4, half_height=1.0, moment_of_inertia=0.02)},
            "floor.friction",
            "must be below 0.2649",
        ),
    ],
)
@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
def test_friction_that_may_jam_a_pivot_is_for_engines_alone(change, key, words, pivot, fault_of):
    fault = fault_of(EventBasedModel(pivot=pivot).simulate, scene_of(**change))
    assert fault.key == key
    assert words in str(fault)
    assert "physics engines play it" in str(fault)


def test_what_never_slips_has_no_friction_to_jam():
    model = EventBasedModel(friction="no-slip")
    motions = [
        model.simulate(scene_of(floor=Floor(friction=mu), initial_rotation=0.1)).channels["theta"]
        for mu in (0.5, 5.0)
    ]
    np.testing.assert_array_equal(*motions)


# Natural units

LOADED = Block(half_width=0.3, half_height=1.0, centre_of_mass=(0.08, -0.2), moment_of_inertia=0.4)


@pytest.mark.parametrize("block", [LOADED, PAPER_BLOCK], ids=["loaded", "homogeneous"])
@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
def test_corners_are_seen_from_the_mass_under_their_angles(block, side, sign):
    """The pivot's, the top corner's above it, and the other lower one's."""
    dx, dz = block.offset
    arm, other = block.half_width + sign * dx, block.half_width - sign * dx
    height, top = block.half_height + dz, block.half_height - dz
    alpha, radius = math.atan2(arm, height), math.hypot(arm, height)
    above, far = math.atan2(arm, top), math.atan2(other, height)
    found = natural.side_of(scene_of(block=block), side)
    assert found.alpha == pytest.approx(alpha)
    assert found.radius == pytest.approx(radius / block.radius)
    assert found.arm == pytest.approx(arm / block.radius)
    assert found.top_alpha == pytest.approx(above)
    assert found.top_radius == pytest.approx(math.hypot(arm, top) / block.radius)
    ratio = math.hypot(arm, top) / radius
    assert found.tip_sin == pytest.approx(ratio * math.sin(alpha + above))
    assert found.tip_cos == pytest.approx(ratio * math.cos(alpha + above))
    ratio = math.hypot(other, height) / radius
    assert found.far_sin == pytest.approx(ratio * math.sin(alpha + far))
    assert found.far_cos == pytest.approx(ratio * math.cos(alpha + far))


def test_a_thrown_block_has_its_velocities_in_natural_units():
    """Of R and sqrt(R/g), with R = 1.25 m."""
    block = Block(half_width=0.75, half_height=1.0)
    thrown = {"initial_height": 0.5, "initial_velocity": 0.4, "initial_angular_velocity": 0.3}
    scene = scene_of(block=block, **thrown)
    x, y, theta, vx, vy, w = scene.initial_state
    unit = math.sqrt(1.25 / 9.81)
    expected = [x / 1.25, y / 1.25, theta, vx * unit / 1.25, vy * unit / 1.25, w * unit]
    assert abs(vy) > 0.1
    assert natural.state_of(scene).tolist() == pytest.approx(expected)
