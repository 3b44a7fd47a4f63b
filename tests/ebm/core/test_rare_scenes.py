"""Scenes, by name, in which a model once found no mode or no impact to go on with: they run, and
their contacts hold."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from stepping import assert_contacts_hold

from rockcheck.ebm import EventBasedModel, natural
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.ebm.core import names
from rockcheck.ebm.core.ground import acceleration, ground_of, impulse_ahead, weightless_at
from rockcheck.ebm.core.lanes import LANES
from rockcheck.scenes import (
    PAPER_BLOCK,
    Block,
    Floor,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
    compiled,
    files,
    progress,
)

CHOICES = Path(__file__).parents[2] / "data" / "modelling_choices"
PINNED = files.read_toml(CHOICES / "index.toml")["choices"]
SQUAT = Block(half_width=0.1, half_height=0.05)
TALL = Block(half_width=0.2, half_height=1.0)
SETTINGS = (
    {},
    {"tolerance": 1e-8},
    {"pivot": "unilateral"},
    {"pivot": "unilateral", "impacts": "floor-first"},
    {"friction": "no-slip"},
    {"friction": "bouc-wen"},
)


def both(left: float, right: float, e: float) -> tuple[Wall, Wall]:
    return (
        Wall(side="left", gap=left, restitution=e),
        Wall(side="right", gap=right, restitution=e),
    )


def scene_of(
    block: Block, friction: float, duration: float, restitution: float = 0.0, **more: object
) -> Scene:
    return Scene(
        name="rare",
        block=block,
        floor=Floor(friction=friction, restitution=restitution),
        duration=duration,
        output_step=duration / 200.0,
        **more,
    )


SCENES = {
    # The corner lets go of the wall at the instant at which the floor's force turns.
    "release on the ladder": scene_of(
        PAPER_BLOCK,
        0.3,
        4.0,
        walls=[Wall(side="left", gap=0.003)],
        excitation=Ricker(amplitude=27.828295819935693, period=1.030200737875156),
    ),
    "no room between walls": scene_of(
        Block(half_width=7.069, half_height=7.069),
        0.3,
        1.0,
        walls=both(0.0, 0.0, 0.9),
        initial_velocity=1.33,
    ),
    "no room, elastic walls": scene_of(
        PAPER_BLOCK,
        0.3,
        1.0,
        walls=both(0.0, 0.0, 1.0),
        initial_velocity=-0.5,
        initial_angular_velocity=0.2,
    ),
    "wedged": scene_of(
        Block(half_width=0.2767571700542464, half_height=1.842522521858856),
        1.0755489589847906,
        0.0423,
        walls=[Wall(side="left", gap=0.0), Wall(side="right", gap=4.4275213258795984e-05)],
        excitation=Record.from_samples(
            [17.01251771455549, 3.1933179172065307, 0.0], 0.02356894360863881
        ),
        initial_angular_velocity=0.49573088587126474,
        initial_velocity=1.072157064841811,
        gravity=10.0,
    ),
    "no friction, shaken both ways": scene_of(
        PAPER_BLOCK,
        0.0,
        6.0,
        excitation=Ricker(amplitude=8.0, period=0.9),
        vertical=Ricker(amplitude=-6.0, period=0.6),
    ),
    "no friction, a wall that is touched": scene_of(
        PAPER_BLOCK,
        0.0,
        6.0,
        walls=[Wall(side="right", gap=0.0)],
        excitation=Ricker(amplitude=8.0, period=0.9),
        vertical=Ricker(amplitude=6.0, period=0.6),
    ),
    # mu = 0.6 is the slip limit of a square block that lands: cone and landing are one instant.
    "square block that lands at its slip limit": scene_of(
        Block(half_width=0.5, half_height=0.5), 0.6, 4.0, initial_rotation=0.5, excitation=Rest()
    ),
    "weight that turns around": scene_of(
        PAPER_BLOCK,
        0.5,
        3.0,
        excitation=Ricker(amplitude=3.0, period=1.0),
        vertical=Sine(amplitude=14.0, period=1.1, cycles=2),
    ),
    "no room, shaken": scene_of(
        PAPER_BLOCK,
        0.8,
        3.0,
        walls=both(0.0, 0.0, 0.0),
        excitation=Sine(amplitude=30.0, period=0.7, cycles=4),
    ),
    "spikes from below": scene_of(
        Block(half_width=0.088, half_height=0.996),
        0.354,
        0.003,
        vertical=Record.from_samples([0.0] * 18 + [1017.0, 0.0, -223.0, 0.0], 0.000126),
    ),
    **{
        f"spins by {w:g} rad/s": scene_of(PAPER_BLOCK, 0.5, 3.0, initial_angular_velocity=w)
        for w in (1e-300, 1e-12, 1.4e-11, 1e-10, 1e-9)
    },
    **{
        f"tilted by {tilt:g}": scene_of(PAPER_BLOCK, 0.5, 3.0, initial_rotation=tilt)
        for tilt in (1e-300, 1e-13, 1e-11)
    },
    **{
        f"slides by {v:g} m/s at a wall": scene_of(
            PAPER_BLOCK,
            0.3,
            2.0,
            walls=[Wall(side="left", gap=0.0, restitution=0.5)],
            initial_velocity=-v,
        )
        for v in (1e-9, 1e-8)
    },
    "diagonal that just fits": scene_of(
        TALL,
        0.2,
        4.0,
        walls=[
            Wall(side="left", gap=TALL.radius - 0.2, restitution=1.0),
            Wall(side="right", gap=TALL.radius - 0.2, restitution=0.0),
        ],
        initial_angular_velocity=0.99,
        gravity=1.0,
    ),
    # Weightless: the rotation is uniform, so that the series of its rate ends at once, not those of
    # sine and cosine.
    "uniform rotation": scene_of(
        Block(half_width=0.25, half_height=1.0),
        0.75,
        4.0,
        walls=both(0.75, 0.0, 0.5),
        initial_angular_velocity=-0.7,
        gravity=10.0,
        vertical=Record.from_samples([-10.0] * 400, 0.01),
    ),
    # The base falls with exactly g: no contact carries force, and nothing decides.
    **{
        f"weightless but for {part:g} at {tilt:g}": scene_of(
            PAPER_BLOCK,
            0.5,
            1.0,
            vertical=Record.from_samples([-9.81 * (1.0 + part)] * 100, 0.01),
            excitation=Record.from_samples([1.0] * 50, 0.01),
            initial_rotation=tilt,
        )
        for part in (0.0, -1e-12, 1e-12)
        for tilt in (0.0, 0.05)
    },
}


#: On a floor that bounces.
SQUATS = {
    f"squat, from {tilt:g}": scene_of(SQUAT, 0.75, 1.0, 0.5, initial_rotation=tilt)
    for tilt in np.linspace(0.05, 1.05, 21).round(3).tolist()
}
#: A pivot that never slips does not start with slip; one that is held does not bounce.
PAIRS = [
    (settings, name)
    for settings in SETTINGS
    for name in SCENES
    if settings.get("friction") != "no-slip" or SCENES[name].initial_velocity == 0.0
] + [(settings, name) for settings in SETTINGS[2:4] for name in SQUATS]


@pytest.mark.parametrize(("settings", "name"), PAIRS, ids=str)
def test_it_runs_and_contacts_hold(settings, name):
    scene = (SCENES | SQUATS)[name]
    assert_contacts_hold(
        scene, EventBasedModel(**settings).simulate(scene), 1e-9 * scene.block.radius
    )


@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
@pytest.mark.parametrize("name", [name for name in SCENES if name.startswith("no room")])
def test_without_room_nothing_moves(name, pivot):
    history = EventBasedModel(pivot=pivot).simulate(SCENES[name])
    assert max(np.max(np.abs(history.channels[one])) for one in ("x", "theta")) < 1e-9
    assert history.outcome == "at rest"


def test_a_landing_at_the_slip_limit_takes_its_energy():
    """Housner's ratio for 45 degrees is 1/4: the tilt falls with each landing, and the block comes
    to rest."""
    history = EventBasedModel().simulate(SCENES["square block that lands at its slip limit"])
    assert history.outcome == "at rest"
    assert len(history.event_list) < 60


@pytest.mark.parametrize(
    "settings", [{}, {"pivot": "unilateral"}, {"friction": "no-slip"}], ids=str
)
def test_random_pulses_between_walls(settings):
    random, gaps = np.random.default_rng(7), (0.0, 0.003, 0.053)
    model = EventBasedModel(tolerance=1e-8, **settings)
    scenes = [
        scene_of(
            PAPER_BLOCK,
            float(random.choice([0.0, 0.1, 0.3, 1.2])),
            6.0,
            walls=both(
                float(random.choice(gaps)),
                float(random.choice(gaps)),
                float(random.choice([0.0, 0.5, 1.0])),
            ),
            excitation=Ricker(
                amplitude=float(random.uniform(-30.0, 30.0)), period=float(random.uniform(0.4, 4.0))
            ),
        )
        for _ in range(1000)
    ]
    assert not run_batch(pack(scenes, model), model, until_decided=False, strict=False).failed.any()


@pytest.mark.parametrize("share", [1.3, 1.6, 2.2])
@pytest.mark.parametrize("symmetric", [False, True])
def test_impulse_ahead_is_the_integral(symmetric, share):
    ground = ground_of(Ricker(amplitude=5.0, period=1.3, symmetric=symmetric), 9.81, 0.4)
    t = ground.form.centre + share / math.sqrt(ground.form.rate)
    there, _ = quad(
        lambda s: abs(acceleration(ground, s)), t, ground.form.quiet, epsabs=1e-15, epsrel=1e-12
    )
    assert impulse_ahead(ground, t) == pytest.approx(there, rel=1e-9)
    assert impulse_ahead(ground, ground.form.centre) == math.inf


@pytest.mark.parametrize(("early", "found"), [(5e-7, 0.0), (3e-6, 3e-6), (-1e-7, -1e-7)])
def test_a_base_that_soon_falls_faster_than_g_leaves_a_block_weightless(early, found):
    ground = ground_of(Sine(amplitude=-1.5 * 9.81, period=2.0), 9.81, 0.4)
    passes = math.asin(1.0 / 1.5) / ground.form.rate
    assert weightless_at(ground, passes - early) == pytest.approx(passes - found, abs=1e-12)


def test_inner_kernels_return_no_arrays(monkeypatch):
    """They are compiled without reference counts, so that an array that they returned would be
    freed too early."""
    seen = set()

    def watched(kernel, *arguments):
        found = kernel.py_func(*arguments)
        for part in found if isinstance(found, tuple) else (found,):
            # Lanes are an array in the interpreter only.
            assert getattr(part, "shape", ()) in ((), (LANES,)), kernel.__name__
        seen.add(kernel.__name__)
        return found

    monkeypatch.setattr(compiled._Inner, "__call__", watched)
    monkeypatch.setattr(natural, "is_ready", lambda *given: False)
    with progress.within(progress.ONE_RUN, True):  # which is interpreted, before it is compiled
        EventBasedModel(pivot="unilateral", tolerance=1e-8).simulate(SCENES["wedged"])
    assert len(seen) > 30


@pytest.mark.parametrize(
    "settings", [{}, {"pivot": "unilateral"}, {"friction": "no-slip"}], ids=str
)
def test_a_block_that_falls_is_decided_on_the_way(settings):
    """On a base at rest, as soon as it is steeper than friction: whatever it does then turns it
    farther."""
    model = EventBasedModel(**settings)
    scene = scene_of(
        PAPER_BLOCK,
        0.3,
        10.0,
        initial_rotation=-1.05 * PAPER_BLOCK.alpha,
    )
    whole, decided = model.simulate(scene), run_batch(pack([scene], model), model)
    assert whole.outcome == "overturned right"
    assert decided.side[0] == 1
    assert decided.runs[0].peak == pytest.approx(0.5 * math.pi)
    unit = math.sqrt(PAPER_BLOCK.radius / scene.gravity)
    assert decided.runs[0].t * unit < whole.event_list[-1].t - 0.1


def test_a_vertical_record_of_zeros_costs_no_step():
    scene = scene_of(PAPER_BLOCK, 0.5, 5.0, excitation=Ricker(amplitude=4.0, period=1.0))
    zeros = scene.replace(vertical=Record.from_samples(np.zeros(1000), 0.005))
    without, flat = EventBasedModel().simulate(scene), EventBasedModel().simulate(zeros)
    assert flat.cost.steps == without.cost.steps
    np.testing.assert_array_equal(flat.channels["theta"], without.channels["theta"])


def test_every_modelling_choice_has_a_pinned_scene():
    """A choice that no scene needs would go."""
    assert {one["name"] for one in PINNED.values()} == set(names.RULE_NAMES)


@pytest.mark.parametrize("slug", PINNED)
def test_a_modelling_choice_is_made_in_its_scene(slug):
    model, scene = (
        EventBasedModel(**PINNED[slug]["model"]),
        files.load_scene(CHOICES / f"{slug}.toml"),
    )
    assert model.simulate(scene).cost.rules[PINNED[slug]["name"]] > 0
