"""The scenes of the stress study: what a seed gives, and what occurs among them."""

import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from rockcheck import EventBasedModel, load_scene
from rockcheck.scenes import files
from rockcheck.validation.studies.stress.checks import check_run
from rockcheck.validation.studies.stress.generator import (
    ALPHA,
    FRICTION,
    RADIUS,
    exact_scene,
    random_scene,
)

#: What must occur among random scenes: that of a scene, or of one of its walls.
OCCURS = {
    "touching": lambda s: any(wall.gap == 0.0 for wall in s.walls),
    "plastic": lambda s: any(wall.restitution == 0.0 for wall in s.walls),
    "elastic": lambda s: any(wall.restitution == 1.0 for wall in s.walls),
    "balanced": lambda s: abs(s.initial_rotation) == pytest.approx(s.block.alpha),
    "two frictions": lambda s: s.floor.mu_s > s.floor.friction,
    "one sample": lambda s: s.excitation.kind == "record" and len(s.excitation.unscaled) == 1,
    "hop": lambda s: s.initial_height > 0.0,
    "weightless": lambda s: np.max(-s.vertical.acceleration(s.output_times)) > s.gravity,
}
#: And among those at which rounding decides.
EXACT = {
    "noise": lambda s: 0.0 < abs(s.initial_rotation) < 1e-12,
    "slow noise": lambda s: 0.0 < abs(s.initial_angular_velocity) < 1e-12,
    "equal walls": lambda s: len(s.walls) == 2 and s.walls[0].gap == s.walls[1].gap,
    "no weight": lambda s: s.vertical.kind == "record" and min(s.vertical.samples) == -s.gravity,
    "long": lambda s: s.duration == 1e4,
}


@pytest.mark.parametrize("make", [random_scene, exact_scene])
def test_a_scene_of_a_seed_can_be_made_alone(make):
    assert make(5, 1234) == make(5, 1234)
    assert make(5, 1234) not in (make(5, 1235), make(6, 1234))


def test_scenes_cover_what_a_user_could_write():
    scenes = [random_scene(1, n) for n in range(2000)]
    for values, (low, high) in (
        ([scene.block.box_angle for scene in scenes], ALPHA),
        ([scene.block.half_diagonal for scene in scenes], RADIUS),
    ):
        assert low * (1 - 1e-9) <= min(values) < 2.0 * low
        assert 0.9 * high < max(values) <= high * (1 + 1e-9)
    friction = [scene.floor.friction for scene in scenes]
    assert min(friction) == 0.0 < 0.98 * FRICTION[1] < max(friction)
    kinds = {"rest", "ricker", "sine", "cosine", "half-sine", "wavelet", "record"}
    assert {s.excitation.kind for s in scenes} == {s.vertical.kind for s in scenes} == kinds
    assert len({tuple(wall.side for wall in scene.walls) for scene in scenes}) == 4
    assert [name for name, has in OCCURS.items() if not any(map(has, scenes))] == []


@pytest.mark.parametrize("kind", ["bilateral", "bouc-wen", "no-slip"])
@pytest.mark.parametrize("make", [random_scene, exact_scene])
def test_a_kind_of_model_is_asked_for_no_more_than_it_can_play(make, kind):
    scenes = [make(1, n, kind) for n in range(300)]
    assert [scene for scene in scenes if scene.floor.restitution or scene.initial_height] == []
    assert ({scene.floor.static_friction for scene in scenes} == {None}) == (kind == "bouc-wen")
    assert any(scene.initial_velocity for scene in scenes) == (kind != "no-slip")
    if make is exact_scene:
        assert [scene.block for scene in scenes] == [make(1, n).block for n in range(300)]


@pytest.mark.parametrize("make", [random_scene, exact_scene])
def test_a_third_of_the_blocks_are_asymmetric(make):
    scenes = [make(1, n) for n in range(1500)]
    off = np.array([scene.block.offset[0] for scene in scenes])
    assert 0.3 < np.mean(off != 0.0) < 0.37
    assert 0.4 < np.mean(off[off != 0.0] > 0.0) < 0.6
    loaded = [scene for scene in scenes if not scene.block.homogeneous]
    assert 0.4 < np.mean([scene.block.moment_of_inertia is None for scene in loaded]) < 0.6
    assert {tuple(x != 0.0 for x in scene.block.offset) for scene in loaded} >= {
        (False, True),
        (True, False),
    }
    balanced = [
        tilt
        for tilt, block in ((scene.initial_rotation, scene.block) for scene in loaded)
        if tilt and abs(tilt) == block.pivot("left" if tilt > 0.0 else "right").alpha
    ]
    assert min(balanced) < 0.0 < max(balanced)


def test_exact_scenes_hold_what_they_are_for():
    scenes = [exact_scene(5, number) for number in range(400)]
    assert max(len(repr(one)) for s in scenes for one in (s.block.half_width, s.gravity)) < 8
    assert [name for name, has in EXACT.items() if not any(map(has, scenes))] == []


def test_random_starts_are_to_both_sides_and_of_the_block_s_own_size():
    """Rates of a slender block up to those of its size or, in half of them, of its angle."""
    scenes = [random_scene(2, n) for n in range(600)]
    units = [(scene, math.sqrt(scene.block.radius / scene.gravity)) for scene in scenes]
    speeds = [s.initial_velocity * unit / s.block.radius for s, unit in units if s.initial_velocity]
    assert -1.0 <= min(speeds) < -0.8 < 0.8 < max(speeds) <= 1.0
    rates = [
        (s.initial_angular_velocity * unit, s.block.alpha)
        for s, unit in units
        if s.initial_angular_velocity and s.block.alpha < 0.5
    ]
    assert -1.5 <= min(rates)[0] < -1.0 < 1.0 < max(rates)[0] <= 1.5
    slow = np.mean([abs(rate) <= 1.5 * alpha for rate, alpha in rates])
    assert 0.5 < slow < 0.95


def test_a_scene_has_a_hundred_rows_after_the_first():
    assert {len(random_scene(2, n).output_times) for n in range(100)} == {101}


def test_some_records_are_spikes_in_silence():
    records = [s.excitation for s in map(partial(random_scene, 2), range(600))]
    silent = [
        np.mean(np.array(one.unscaled) == 0.0)
        for one in records
        if one.kind == "record" and len(one.unscaled) > 50
    ]
    assert 0.1 < np.mean([0.8 < share < 0.99 for share in silent]) < 0.5


def test_exact_scenes_are_of_round_numbers_up_to_a_thousand():
    scenes = [exact_scene(5, number) for number in range(400)]
    assert {scene.gravity for scene in scenes} == {9.81, 10.0, 1.0}
    starts = [abs(scene.initial_angular_velocity) for scene in scenes]
    assert max(starts) == 1e3


def test_an_exact_scene_moves_or_is_shaken():
    scenes = [exact_scene(5, number) for number in range(400)]
    long = [scene for scene in scenes if scene.duration == 1e4]
    assert {scene.excitation.kind for scene in long} == {"rest"}
    alone = [scene for scene in scenes if not scene.walls]
    tilted = {
        kind: np.mean([s.initial_rotation != 0.0 for s in alone if s.excitation.kind == kind])
        for kind in ("rest", "record")
    }
    assert tilted["rest"] == 1.0
    assert 0.2 < tilted["record"] < 0.6


FOLDER = Path(__file__).parents[1] / "data" / "found_faults"
INDEX = files.read_toml(FOLDER / "index.toml")


def test_every_pinned_scene_is_listed():
    assert {path.stem for path in FOLDER.glob("*.toml")} == {"index", *INDEX["faults"]}


@pytest.mark.parametrize("slug", INDEX["faults"])
def test_a_fault_that_was_found(slug: str):
    entry = INDEX["faults"][slug]
    model = EventBasedModel(**INDEX["limits"] | entry["model"])
    played = check_run(
        model, load_scene(FOLDER / f"{slug}.toml"), seed=entry["seed"], audit=entry["audited"]
    )
    assert played.broken == [], (entry["fault"], played)
    # A fate cannot be judged by Bouc-Wen friction, nor where a long history takes too many steps.
    assert set(played.unjudged) <= {"fate"}
    assert ("energy" in played.figures) == entry["audited"]
