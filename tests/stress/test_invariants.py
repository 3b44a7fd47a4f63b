"""What a stress run holds runs against: scenes that can be made again, invariants that notice
faults."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, History, Record, Rest, Ricker, Scene, Sine, Wall
from rockcheck.scenes.scene import PAPER_BLOCK
from rockcheck.validation.studies.stress import invariants, players
from rockcheck.validation.studies.stress.exact import exact_scene
from rockcheck.validation.studies.stress.generator import ALPHA, FRICTION, RADIUS, random_scene
from rockcheck.validation.studies.stress.invariants import (
    INVARIANTS,
    audited,
    check_run,
    energy_error,
    similar,
)
from rockcheck.validation.studies.stress.mechanics import BOOLE, arms, integrals, tilted_forces
from rockcheck.validation.studies.stress.players import PLAYERS, Approximate, energy_without_source
from rockcheck.validation.studies.stress.runs import Chunk

SLIDES_AND_HITS = Scene(
    name="hits",
    block=PAPER_BLOCK,
    floor=Floor(friction=0.3),
    walls=[Wall(side="left", gap=0.05, restitution=0.5)],
    excitation=Ricker(amplitude=8.0, period=1.2),
    duration=4.0,
    output_step=0.04,
)


def test_a_scene_of_a_seed_can_be_made_alone():
    assert random_scene(5, 1234) == random_scene(5, 1234)
    assert random_scene(5, 1234) != random_scene(5, 1235)
    assert random_scene(5, 1234) != random_scene(6, 1234)


def test_scenes_cover_what_a_user_could_write():
    """The corners of the ranges are reached, and every kind of excitation, wall and start
    occurs."""
    scenes = [random_scene(1, n) for n in range(2000)]
    alphas, radii, friction = (
        np.array(one)
        for one in zip(
            *((s.block.box_angle, s.block.half_diagonal, s.floor.friction) for s in scenes),
            strict=True,
        )
    )
    for values, (low, high) in ((alphas, ALPHA), (radii, RADIUS)):
        assert low * (1 - 1e-9) <= values.min() < 2.0 * low
        assert 0.9 * high < values.max() <= high * (1 + 1e-9)
    assert friction.min() == 0.0
    assert friction.max() > 0.98 * FRICTION[1]
    assert (
        {s.excitation.kind for s in scenes}
        == {s.vertical.kind for s in scenes}
        == {"rest", "ricker", "sine", "record"}
    )
    assert {tuple(w.side for w in s.walls) for s in scenes} == {
        (),
        ("left",),
        ("right",),
        ("left", "right"),
    }
    assert {w.restitution for s in scenes for w in s.walls} >= {0.0, 1.0}
    assert any(w.gap == 0.0 for s in scenes for w in s.walls)
    assert any(abs(s.initial_rotation) == pytest.approx(s.block.alpha) for s in scenes)
    assert any(s.floor.mu_s > s.floor.friction for s in scenes)
    assert any(isinstance(s.excitation, Record) and len(s.excitation.unscaled) == 1 for s in scenes)
    level = [np.max(np.abs(s.vertical.acceleration(s.output_times))) / s.gravity for s in scenes]
    assert max(level) > 1.0
    assert any(s.initial_height > 0.0 for s in scenes)
    for kind in ("bilateral", "bouc-wen", "no-slip"):
        for n in range(300):
            scene = random_scene(1, n, kind)
            assert scene.floor.restitution == scene.initial_height == 0.0
            assert kind != "bouc-wen" or scene.floor.static_friction is None


@pytest.mark.parametrize("make", [random_scene, exact_scene])
def test_a_third_of_the_blocks_are_asymmetric(make):
    """To either side, with a moment of inertia of their own or without, some with a load in the
    middle."""
    scenes = [make(1, n) for n in range(1500)]
    off = np.array([scene.block.offset[0] for scene in scenes])
    assert 0.3 < np.mean(off != 0.0) < 0.37
    assert 0.4 < np.mean(off[off != 0.0] > 0.0) < 0.6
    bear = [scene.block for scene in scenes if not scene.block.homogeneous]
    assert 0.4 < np.mean([block.moment_of_inertia is None for block in bear]) < 0.6
    assert any(block.offset[0] == 0.0 != block.offset[1] for block in bear)
    assert any(block.offset[1] == 0.0 != block.offset[0] for block in bear)
    tilts = [
        (scene.initial_rotation, scene.block)
        for scene in scenes
        if not scene.block.homogeneous and scene.initial_rotation
    ]
    balanced = [
        tilt
        for tilt, block in tilts
        if abs(tilt) == block.pivot("left" if tilt > 0.0 else "right").alpha
    ]
    assert min(balanced) < 0.0 < max(balanced)


LOADED = SLIDES_AND_HITS.replace(
    block=Block(half_width=0.4, half_height=1.2, centre_of_mass=(0.1, -0.3), moment_of_inertia=0.4),
    floor=Floor(friction=0.25),
)


@pytest.mark.parametrize("label", ["ebm", "ebm-unilateral", "ebm no-slip", "ebm-bouc-wen"])
def test_a_loaded_block_keeps_all_invariants(label):
    """It slides, rocks and hits the wall. The base works on its mass's centre, its contacts are the
    box's."""
    scene = LOADED
    played = PLAYERS[label].check(scene, 1, 0)  # run 0 is audited
    assert played.broken == []
    assert played.events > 3
    assert {"energy", "mirror", "similarity", "tolerance"} <= played.figures.keys()


def test_similar_and_disturbed_blocks_bear_the_same_load():
    (x, z), block = LOADED.block.offset, LOADED.block
    other = similar(LOADED, 3).block
    k = other.half_width / block.half_width
    assert other.offset == pytest.approx((k * x, k * z))
    assert other.moment_of_inertia == pytest.approx(k * k * block.moment_of_inertia)
    changed = [scene.block for scene in invariants._disturbed(LOADED, 1)]
    assert len(changed) == invariants.DISTURBED
    for one in changed:
        for new, old in (
            (one.offset[0], x),
            (one.offset[1], z),
            (one.moment_of_inertia, block.moment_of_inertia),
        ):
            assert 0.0 < abs(new / old - 1.0) <= 1.01 * invariants.DISTURBANCE
    full = LOADED.replace(
        block=block.replace(moment_of_inertia=0.4**2 + 1.2**2 - x * x - z * z)
    )  # as much as there can be
    assert 0 < len(list(invariants._disturbed(full, 1))) < invariants.DISTURBED


def test_forces_of_an_asymmetric_block():
    """Tilted to either side: LEAN, whose wall takes the moment of weight and base, and ROCK."""
    block = LOADED.block
    on, off, still = np.array([True]), np.array([False]), np.zeros(1, dtype=np.int8)
    for sign, side in ((1.0, "left"), (-1.0, "right")):
        pivot, phi, u = block.pivot(side), 0.1, 0.2
        s, c = (
            pivot.radius * math.sin(pivot.alpha - phi),
            pivot.radius * math.cos(pivot.alpha - phi),
        )
        top = 2.0 * block.half_height * math.cos(phi)  # of the top corner over the floor
        at = arms(block, np.array([sign]), np.array([phi]))
        leans = tilted_forces(at, 0.3, np.zeros(1), np.array([u]), np.ones(1), (on, on, off), still)
        assert leans.tip[0] == pytest.approx((u * c - s) / top, rel=1e-13)
        assert leans.normal[0] == pytest.approx(1.0, rel=1e-13)
        falls = tilted_forces(
            at, 0.3, np.zeros(1), np.array([u]), np.ones(1), (on, off, off), still
        )
        spin = (u * c - s) / (block.gyration_squared + pivot.radius**2)
        assert falls.normal[0] == pytest.approx(1.0 + s * spin, rel=1e-13)
        assert falls.friction[0] == pytest.approx(u - c * spin, rel=1e-13)


def test_forces_of_housners_block():
    """ROCK: (3), and a block that stands on its corner without speed presses with what lifts its
    centroid."""
    phi, u = np.array([0.1]), np.array([0.2])
    on, off = np.array([True]), np.array([False])
    alpha = PAPER_BLOCK.alpha
    at = arms(PAPER_BLOCK, np.ones(1), phi)
    forces = tilted_forces(
        at, 0.3, np.zeros(1), u, np.ones(1), (on, off, off), np.zeros(1, dtype=np.int8)
    )
    s, c = math.sin(alpha - 0.1), math.cos(alpha - 0.1)
    spin = 0.75 * (0.2 * c - s)
    assert forces.normal[0] == pytest.approx(1.0 + s * spin, rel=1e-13)
    assert forces.friction[0] == pytest.approx(0.2 - c * spin, rel=1e-13)
    slips = tilted_forces(
        at, 0.3, np.zeros(1), u, np.ones(1), (on, off, off), np.ones(1, dtype=np.int8)
    )
    eta = 0.3
    assert slips.normal[0] == pytest.approx(
        1.0 / (1.0 + 3.0 * s * s + 3.0 * eta * s * c), rel=1e-13
    )
    assert slips.friction[0] == pytest.approx(-0.3 * slips.normal[0], rel=1e-13)


def test_rules_of_integration():
    x = np.linspace(0.0, 2.0, 17)
    exact = 2.0**10 / 10.0
    assert np.sum(integrals(x[1], x**9)) == pytest.approx(exact, rel=1e-13)
    assert np.sum(integrals(x[1], x**5, BOOLE)) == pytest.approx(2.0**6 / 6.0, rel=1e-13)
    assert np.sum(integrals(x[1], x**9, BOOLE)) != pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize("label", ["ebm", "ebm-unilateral", "ebm no-slip", "ebm-bouc-wen"])
def test_a_run_that_keeps_all_invariants(label):
    """Sliding, rocking, wall and floor impacts: every figure is well inside its bound."""
    player = PLAYERS[label]
    played = player.check(SLIDES_AND_HITS, 1, 0)  # run 0 is audited
    assert played.broken == []
    assert played.events > 5
    assert {"energy", "mirror", "similarity", "tolerance", "penetration"} <= played.figures.keys()


class Spoilt:
    """A model whose histories have one thing changed."""

    def __init__(self, **change: object) -> None:
        self.model = EventBasedModel(pivot="unilateral")
        self.change = change

    def __getattr__(self, name: str) -> object:
        return getattr(self.model, name)

    def model_copy(self, **_: object) -> Spoilt:
        return self

    def simulate(self, scene: Scene) -> History:
        history = self.model.simulate(scene)
        channels = {name: column.copy() for name, column in history.channels.items()}
        for name, change in self.change.items():
            if name in channels:
                channels[name] = change(channels[name])  # type: ignore[operator]
        outcome = self.change.get("outcome", history.outcome)
        return dataclasses.replace(history, channels=channels, outcome=outcome)


def bent(column: np.ndarray) -> np.ndarray:
    column[len(column) // 2] += 1e-6
    return column


FAULTS = {
    "finite": {"theta": lambda c: np.where(np.arange(len(c)) == 7, np.nan, c)},
    "outcome": {"outcome": "overturned left"},
    "penetration": {"y": lambda c: c - 1e-6},
    "floor": {"y": lambda c: np.where(np.arange(len(c)) == 3, c + 1e-6, c)},
    "mirror": {"x": bent},
    "stick": {"slip_rate": lambda c: c + 1e-6},
    "coulomb": {"mode": lambda c: np.where(c == "slide-rock", "rock", c)},
    "energy": {"theta_dot": lambda c: c * (1.0 + 1e-5 * np.sin(np.arange(len(c))))},
}


@pytest.mark.parametrize("name", FAULTS)
def test_each_invariant_notices_its_fault(name):
    played = check_run(Spoilt(**FAULTS[name]), SLIDES_AND_HITS, audit=name == "energy")
    assert name in played.broken


def test_tension_in_a_floor_that_only_pushes_is_noticed():
    """The paper's pivot, judged as if the floor could only push: after a wall impact it pulls."""
    scene = SLIDES_AND_HITS.replace(
        excitation=Rest(),
        walls=(),
        initial_rotation=0.02,
        initial_angular_velocity=3.2,
        duration=0.1,
        output_step=1e-3,
    )
    paper = EventBasedModel().simulate(scene)

    class Unfair(Spoilt):
        def simulate(self, scene: Scene) -> History:
            return paper

    assert "push" in check_run(Unfair(), scene).broken


def test_a_coarse_model_breaks_the_comparison_with_a_finer_one():
    """A tolerance of 1e-3 is not 1e-10: within the horizon the rotations differ."""
    played = check_run(EventBasedModel(tolerance=1e-2), SLIDES_AND_HITS)
    assert played.figures["tolerance"] > INVARIANTS["tolerance"].bound


def test_energy_balance_is_exact_to_rounding():
    for scene in (
        SLIDES_AND_HITS,
        SLIDES_AND_HITS.replace(vertical=Sine(amplitude=3.0, period=0.4, cycles=5)),
    ):
        fine = audited(scene)
        model = EventBasedModel(tolerance=1e-13)
        assert energy_error(model, fine, model.simulate(fine)) < 1e-11


def test_the_spring_of_bouc_wens_friction_gives_energy_only_where_the_floors_push_changes():
    """(9) keeps z, not energy: its force mu |P| z grows with P. What it gives is less than it can
    hold."""
    shakes = SLIDES_AND_HITS.replace(walls=(), vertical=Sine(amplitude=6.0, period=0.15, cycles=27))
    gains = {}
    for name, scene in (("shaken", shakes), ("steady", shakes.replace(vertical=Rest()))):
        for yields in (1e-2, 1e-3):
            size = yields * scene.block.radius
            model = EventBasedModel(friction="bouc-wen", yield_displacement=size, tolerance=1e-12)
            history = model.simulate(audited(scene))
            assert energy_error(model, audited(scene), history) < 1e-9
            without = model.model_copy(
                update={"yield_displacement": 1e-30}
            )  # as if it could hold nothing
            gains[name, yields] = energy_error(without, audited(scene), history)
    assert gains["steady", 1e-2] < 1e-9
    assert gains["steady", 1e-3] < 1e-9
    assert 1e-6 < gains["shaken", 1e-3] < 0.5 * gains["shaken", 1e-2]


def test_energy_that_cannot_be_judged_is_not_said_to_hold(monkeypatch):
    """A history of too few rows, and one whose work is resolved nowhere: neither has an error of 0,
    and the run is counted."""
    model, short = EventBasedModel(), SLIDES_AND_HITS.replace(duration=0.2)
    assert energy_error(model, short, model.simulate(short)) is None
    rough = SLIDES_AND_HITS.replace(
        excitation=Record.from_samples(8.0 * np.sin(np.arange(500.0)), time_step=0.008)
    )
    assert energy_error(model, rough, model.simulate(rough)) is None  # five kinks between two rows
    assert energy_error(model, audited(rough), model.simulate(audited(rough))) < 1e-9
    monkeypatch.setattr(invariants, "RESOLVED", 0.0)
    played = check_run(model, SLIDES_AND_HITS, audit=True)
    assert (played.unjudged, "energy" in played.figures, played.broken) == (("energy",), False, [])
    assert check_run(model, SLIDES_AND_HITS, audit=True, only="energy").figures == {}
    totals = Chunk("ebm", 1, 0, 1).play()  # run 0 is audited
    assert (totals.unjudged["energy"], totals.looked_at["energy"]) == (1, 0)


def test_a_block_that_hangs_is_its_own_mirror_image():
    """At rest, symmetric, and the floor falls away faster than g: the pivot that cannot let go has
    no corner to choose."""
    hangs = SLIDES_AND_HITS.replace(
        walls=(),
        excitation=Rest(),
        vertical=Record.from_samples([0.0, -20.0, -20.0], time_step=0.1),
        duration=0.3,
        output_step=0.01,
    )
    for settings in (
        {},
        {"friction": "no-slip"},
        {"friction": "bouc-wen"},
        {"pivot": "unilateral"},
    ):
        played = check_run(EventBasedModel(**settings), hangs)
        assert played.broken == [], settings
        assert played.figures["mirror"] == 0.0
    assert EventBasedModel().simulate(hangs).cost.rules == {"hangs flat": 1}


def test_similar_scenes_have_the_same_numbers():
    other = similar(SLIDES_AND_HITS, 3)
    k = other.block.radius / PAPER_BLOCK.radius
    assert k != pytest.approx(1.0)
    assert other.walls[0].gap == pytest.approx(k * 0.05)
    assert other.excitation.amplitude == 8.0
    assert other.excitation.period == pytest.approx(math.sqrt(k) * 1.2)


@pytest.mark.parametrize(
    "label", ["cm", "mujoco", pytest.param("pybullet", marks=pytest.mark.needs("pybullet"))]
)
def test_approximate_models_keep_what_they_state(label):
    player = PLAYERS[label]
    assert isinstance(player, Approximate)
    for number in (1, 2, 3):
        played = player.check(player.scene(1, number), 1, number)
        assert played.broken == []
        assert {"depth", "source"} <= played.figures.keys()


def test_work_of_the_base_on_a_block_that_stands_or_flies():
    """A record finer than the rows, with a jump where it ends: the energy of a block that feels
    only the base is the base's work."""
    scene = SLIDES_AND_HITS.replace(
        floor=Floor(friction=0.0),
        walls=(),
        excitation=Record.from_samples([0.0, 30.0, -50.0, 7.0, 20.0], time_step=0.013),
        duration=0.2,
        output_step=0.05,
    )
    slides = EventBasedModel().simulate(scene)
    assert np.ptp(slides.channels["x_dot"]) > 0.05
    assert abs(energy_without_source(scene, slides)) < 1e-14
    faster = dataclasses.replace(
        slides, channels={**slides.channels, "x_dot": 1.1 * slides.channels["x_dot"]}
    )
    assert energy_without_source(scene, faster) > 1e-5
    drops = scene.replace(
        block=LOADED.block, initial_height=2.0, initial_angular_velocity=1.0
    )  # and turns about the load
    flies = EventBasedModel(pivot="unilateral").simulate(drops)
    assert set(flies.channels["mode"]) == {"flight"}
    assert abs(energy_without_source(drops, flies)) < 1e-13


def test_of_an_engine_that_gains_energy_half_the_step_is_told(monkeypatch):
    """Energy from nowhere that falls with the step is the step's; the words of the failure say
    so."""
    player = PLAYERS["mujoco"]
    scene = player.scene(1, 2)
    monkeypatch.setattr(
        players,
        "energy_without_source",
        lambda played, history: 0.08 * played.output_step / scene.output_step,
    )
    played = player.check(scene, 1, 2)
    assert played.broken == ["source"]
    assert played.failure == "source 0.08, with half the step 0.04"


def test_exact_scenes_are_the_same_for_a_seed_and_hold_what_they_are_for():
    """Numbers of few digits, starts that are noise, walls on both sides, a vertical base that may
    take all weight, long rest."""
    scenes = [exact_scene(5, number, "unilateral") for number in range(400)]
    assert scenes == [exact_scene(5, number, "unilateral") for number in range(400)]
    assert scenes[:50] != [exact_scene(6, number, "unilateral") for number in range(50)]
    assert all(
        len(repr(scene.block.half_width)) < 8 and len(repr(scene.gravity)) < 8 for scene in scenes
    )
    assert any(0.0 < abs(scene.initial_rotation) < 1e-12 for scene in scenes)
    assert any(0.0 < abs(scene.initial_angular_velocity) < 1e-12 for scene in scenes)
    assert any(
        len(scene.walls) == 2 and scene.walls[0].gap == scene.walls[1].gap for scene in scenes
    )
    assert any(
        scene.vertical.kind == "record" and min(scene.vertical.samples) == -scene.gravity
        for scene in scenes
    )
    assert any(scene.duration == 1e4 for scene in scenes)
    yielding = [exact_scene(5, number, "bouc-wen") for number in range(100)]
    assert all(scene.floor.static_friction is None for scene in yielding)
    assert [scene.block for scene in yielding] == [scene.block for scene in scenes[:100]]
