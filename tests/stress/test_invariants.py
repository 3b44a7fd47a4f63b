"""What a stress run holds runs against: scenes that can be made again, invariants that notice
faults."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from rockcheck import (
    Block,
    EventBasedModel,
    Floor,
    History,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
)
from rockcheck.scenes import PAPER_BLOCK
from rockcheck.validation.studies.stress import checks, energy, horizon, players
from rockcheck.validation.studies.stress.checks import audited, check_run, similar
from rockcheck.validation.studies.stress.energy import (
    BOOLE,
    energy_error,
    energy_without_source,
    integrals,
)
from rockcheck.validation.studies.stress.forces import tilted_forces
from rockcheck.validation.studies.stress.invariants import INVARIANTS
from rockcheck.validation.studies.stress.motion import Motion
from rockcheck.validation.studies.stress.players import PLAYERS
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


LOADED = SLIDES_AND_HITS.replace(
    block=Block(half_width=0.4, half_height=1.2, centre_of_mass=(0.1, -0.3), moment_of_inertia=0.4),
    floor=Floor(friction=0.25),
)


@pytest.mark.parametrize("scene", [SLIDES_AND_HITS, LOADED], ids=["plain", "loaded"])
@pytest.mark.parametrize("label", ["ebm", "ebm-unilateral", "ebm no-slip", "ebm-bouc-wen"])
def test_a_run_that_keeps_all_invariants(label, scene):
    """Sliding, rocking, wall and floor impacts: every figure is well inside its bound. The base
    works on the mass's centre, the contacts are the box's."""
    played, again = (PLAYERS[label].check(scene, 1, 0, *only) for only in ((), ["tolerance"]))
    # run 0 is audited, also where only one invariant is checked again
    assert played.broken == []
    assert again.figures == {"tolerance": played.figures["tolerance"]}
    assert played.counts["events"] > 3
    assert {"energy", "mirror", "similarity", "tolerance", "penetration"} <= played.figures.keys()


def test_a_similar_scene_has_another_size():
    """That it moves alike is an invariant of each run."""
    assert similar(LOADED, 3).block.half_width != pytest.approx(LOADED.block.half_width)


def test_disturbed_scenes_differ_a_little():
    most = 0.4**2 + 1.2**2 - 0.1**2 - 0.3**2  # as much as there can be
    full = LOADED.replace(block=LOADED.block.replace(moment_of_inertia=most))
    usual, fewer = ([*horizon.disturbed(one, 1)] for one in (LOADED, full))
    assert 0 < len(fewer) < len(usual) == horizon.DISTURBED
    news = np.array([(*one.block.offset, one.block.moment_of_inertia) for one in usual])
    off = np.abs(news / (*LOADED.block.offset, LOADED.block.moment_of_inertia) - 1.0)
    assert 0.0 < off.min() < off.max() <= 1.01 * horizon.DISTURBANCE


@pytest.mark.parametrize("block", [LOADED.block, PAPER_BLOCK], ids=["loaded", "plain"])
@pytest.mark.parametrize(("sign", "side"), [(1.0, "left"), (-1.0, "right")])
def test_forces_of_a_block_that_starts_from_a_tilt(block, sign, side):
    """ROCK, whose pivot presses with what lifts the centroid, (3); LEAN, whose wall takes the
    moment of weight and base; SLIDE-ROCK."""
    pivot, phi, u = block.pivot(side), 0.1, 0.2
    s = pivot.radius * math.sin(pivot.alpha - phi)
    c = pivot.radius * math.cos(pivot.alpha - phi)

    def forces(tip, slip):
        touching = np.array([[True], [tip], [False]])
        tilt, felt = (np.array([sign]), np.array([phi])), (np.array([u]), np.ones(1))
        found, _ = tilted_forces(
            block, tilt, 0.3, np.zeros(1), felt, touching, np.array([slip], dtype=np.int8)
        )
        return found[:3, 0]

    spin = (u * c - s) / (block.gyration_squared + pivot.radius**2)
    assert forces(False, 0)[:2] == pytest.approx([1.0 + s * spin, u - c * spin], rel=1e-13)
    top = 2.0 * block.half_height * math.cos(phi)  # of the top corner over the floor
    assert forces(True, 0)[[0, 2]] == pytest.approx([1.0, (u * c - s) / top], rel=1e-13)
    push = 1.0 / (1.0 + s * (s + 0.3 * c) / block.gyration_squared)
    assert forces(False, 1)[:2] == pytest.approx([push, -0.3 * push], rel=1e-13)


def test_rules_of_integration():
    x, exact = np.linspace(0.0, 2.0, 17), {5: 2.0**6 / 6.0, 9: 2.0**10 / 10.0}
    assert [
        np.sum(integrals(x[1], values, *rule)) for values, rule in ((x**9, ()), (x**5, [BOOLE]))
    ] == pytest.approx([exact[9], exact[5]], rel=1e-13)
    assert np.sum(integrals(x[1], x**9, BOOLE)) != pytest.approx(exact[9], rel=1e-6)


def spoilt(history: History, outcome: str = "", **change: Callable[..., Any]) -> History:
    channels = {
        name: change.get(name, np.copy)(column) for name, column in history.channels.items()
    }
    return dataclasses.replace(
        history, channels=channels, outcome=outcome or history.outcome, model_extremes=None
    )


FAULTS = {
    "finite": {"theta": lambda c: np.where(np.arange(len(c)) == 7, np.nan, c)},
    "outcome": {"outcome": "overturned left"},
    "penetration": {"y": lambda c: c - 1e-6},
    "floor": {"y": lambda c: np.where(np.arange(len(c)) == 3, c + 1e-6, c)},
    "mirror": {"x": lambda c: c + 1e-6 * (np.arange(len(c)) == len(c) // 2)},
    "stick": {"slip_rate": lambda c: c + 1e-6},
    "coulomb": {"mode": lambda c: np.where(c == "slide-rock", "rock", c)},
    "energy": {"theta_dot": lambda c: c * (1.0 + 1e-5 * np.sin(np.arange(len(c))))},
    "clearance": {"x": lambda c: 2.0 * c},
    "decided": {},
}


@pytest.mark.parametrize("name", FAULTS)
def test_each_invariant_notices_its_fault(name, monkeypatch):
    plain, play, pack = EventBasedModel.simulate, checks.batch.run_batch, checks.batch.pack
    monkeypatch.setattr(
        EventBasedModel, "simulate", lambda *given: spoilt(plain(*given), **FAULTS[name])
    )
    monkeypatch.setattr(
        checks.batch,
        "run_batch",
        lambda given, model, **how: play(
            pack([SLIDES_AND_HITS.replace(excitation=Rest())], model)
            if how["until_decided"]
            else given,
            model,
            **how,
        ),
    )
    played = check_run(
        EventBasedModel(pivot="unilateral"),
        SLIDES_AND_HITS,
        audit=name in ("energy", "clearance", "decided"),
    )
    assert name in played.broken


def test_tension_in_a_floor_that_only_pushes_is_noticed(monkeypatch):
    """The paper's pivot, judged as if the floor could only push: after a wall impact it pulls."""
    scene = SLIDES_AND_HITS.replace(
        excitation=Rest(),
        walls=(),
        initial_rotation=0.02,
        initial_angular_velocity=3.2,
        duration=0.1,
        output_step=1e-3,
    )
    plain, paper = EventBasedModel.simulate, EventBasedModel()
    monkeypatch.setattr(EventBasedModel, "simulate", lambda self, scene: plain(paper, scene))
    assert "push" in check_run(EventBasedModel(pivot="unilateral"), scene).broken


def test_a_coarse_model_breaks_the_comparison_with_a_finer_one():
    played = check_run(EventBasedModel(tolerance=1e-2), SLIDES_AND_HITS)
    assert played.figures["tolerance"] > INVARIANTS["tolerance"].bound


@pytest.mark.parametrize("vertical", [Rest(), Sine(amplitude=3.0, period=0.4, cycles=5)], ids=str)
def test_energy_balance_is_exact_to_rounding(vertical):
    fine = audited(SLIDES_AND_HITS.replace(vertical=vertical))
    model = EventBasedModel(tolerance=1e-13)
    assert energy_error(model, Motion(fine, model.simulate(fine))) < 1e-11


def test_the_spring_of_bouc_wens_friction_gives_energy_only_where_the_floors_push_changes():
    """(9) keeps z, not energy: its force mu |P| z grows with P. What it gives is less than it can
    hold."""
    shakes = SLIDES_AND_HITS.replace(walls=(), vertical=Sine(amplitude=6.0, period=0.15, cycles=27))
    gains = {}
    for name, scene in (("shaken", shakes), ("steady", shakes.replace(vertical=Rest()))):
        for yields in (1e-2, 1e-3):
            size, fine = yields * scene.block.radius, audited(scene)
            model = EventBasedModel(friction="bouc-wen", yield_displacement=size, tolerance=1e-12)
            motion = Motion(fine, model.simulate(fine))
            assert energy_error(model, motion) < 1e-9
            # as if it could hold nothing
            gains[name, yields] = energy_error(
                model.model_copy(update={"yield_displacement": 1e-30}), motion
            )
    assert max(gains["steady", 1e-2], gains["steady", 1e-3]) < 1e-9
    assert 1e-6 < gains["shaken", 1e-3] < 0.5 * gains["shaken", 1e-2]


def test_energy_that_cannot_be_judged_is_not_said_to_hold(monkeypatch):
    """A history of too few rows, and one whose work is resolved nowhere: neither has an error of 0,
    and the run is counted."""
    model, short = EventBasedModel(), SLIDES_AND_HITS.replace(duration=0.2)
    assert energy_error(model, Motion(short, model.simulate(short))) is None
    rough = SLIDES_AND_HITS.replace(
        excitation=Record.from_samples(8.0 * np.sin(np.arange(500.0)), time_step=0.008)
    )
    assert (
        energy_error(model, Motion(rough, model.simulate(rough))) is None
    )  # five kinks between two rows
    assert energy_error(model, Motion(audited(rough), model.simulate(audited(rough)))) < 1e-9
    monkeypatch.setattr(energy, "RESOLVED", 0.0)
    played = check_run(model, SLIDES_AND_HITS, audit=True)
    assert played.unjudged == ("energy",)
    assert "energy" not in played.figures
    assert played.broken == []
    assert check_run(model, SLIDES_AND_HITS, audit=True, only="energy").figures == {}
    totals = Chunk("ebm", 1, 0, 1).play()  # run 0 is audited
    assert totals.unjudged["energy"] == 1
    assert totals.looked_at["energy"] == 0


@pytest.mark.parametrize("number", [1, 2, 3])
@pytest.mark.parametrize(
    "label", ["cm", "mujoco", pytest.param("pybullet", marks=pytest.mark.needs("pybullet"))]
)
def test_approximate_models_keep_what_they_state(label, number):
    player = PLAYERS[label]
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
    # And turns about the load.
    drops = scene.replace(block=LOADED.block, initial_height=2.0, initial_angular_velocity=1.0)
    slides, flies = (EventBasedModel(pivot="unilateral").simulate(one) for one in (scene, drops))
    assert np.ptp(slides.channels["x_dot"]) > 0.05
    assert set(flies.channels["mode"]) == {"flight"}
    for one, history, most in ((scene, slides, 1e-14), (drops, flies, 1e-13)):
        assert abs(energy_without_source(Motion(one, history))) < most
    assert energy_without_source(Motion(scene, spoilt(slides, x_dot=lambda c: 1.1 * c))) > 1e-5


def test_of_an_engine_that_gains_energy_half_the_step_is_told(monkeypatch):
    """Energy from nowhere that falls with the step is the step's; the words of the failure say
    so."""
    player = PLAYERS["mujoco"]
    scene = player.scene(1, 2)
    monkeypatch.setattr(
        players,
        "energy_without_source",
        lambda motion: 0.08 * motion.scene.output_step / scene.output_step,
    )
    played = player.check(scene, 1, 2)
    assert played.broken == ["source"]
    assert played.failure == "source 0.08, with half the step 0.04"
