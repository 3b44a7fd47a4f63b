"""Scenes, by name, in which a model once found no mode or no impact to go on with: they run, and
their contacts hold."""

import math

import numpy as np
import pytest
from stepping import assert_contacts_hold

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.batch import pack, run_batch
from rockcheck.ebm.packed import state_for
from rockcheck.scenes import (
    Block,
    Floor,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
)
from rockcheck.scenes.scene import PAPER_BLOCK

SQUARE = Block(half_width=7.069, half_height=7.069)


def both(left: float, right: float, e: float) -> tuple[Wall, Wall]:
    return Wall(side="left", gap=left, restitution=e), Wall(side="right", gap=right, restitution=e)


def scene_of(block: Block, friction: float, duration: float, **more: object) -> Scene:
    return Scene(
        name="rare",
        block=block,
        floor=Floor(friction=friction),
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
        SQUARE, 0.3, 1.0, walls=both(0.0, 0.0, 0.9), initial_velocity=1.33
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
    "spikes from below": scene_of(
        Block(half_width=0.088, half_height=0.996),
        0.354,
        0.003,
        vertical=Record.from_samples([0.0] * 18 + [1017.0, 0.0, -223.0, 0.0], 0.000126),
    ),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    "settings",
    [{}, {"tolerance": 1e-8}, {"pivot": "unilateral"}, {"friction": "bouc-wen"}],
    ids=str,
)
def test_it_runs(name, settings):
    scene = SCENES[name]
    history = EventBasedModel(**settings).simulate(scene)
    assert_contacts_hold(scene, history, 1e-9 * scene.block.radius)


@pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])
@pytest.mark.parametrize("name", ["no room between walls", "no room, elastic walls"])
def test_without_room_nothing_moves(name, pivot):
    motion = EventBasedModel(pivot=pivot).simulate(SCENES[name]).channels
    assert np.max(np.abs(motion["x"])) < 1e-9
    assert np.max(np.abs(motion["theta"])) < 1e-9


def test_a_landing_at_the_slip_limit_takes_its_energy():
    """Housner's ratio for 45 degrees is 1/4: the tilt falls with each landing, and the block comes
    to rest."""
    history = EventBasedModel().simulate(SCENES["square block that lands at its slip limit"])
    assert history.outcome == "at rest"
    assert len(history.event_list) < 60


def test_a_vertical_record_of_zeros_is_none():
    """It costs no step at each of its samples."""
    scene = scene_of(PAPER_BLOCK, 0.5, 5.0, excitation=Ricker(amplitude=4.0, period=1.0))
    flat = scene.replace(vertical=Record.from_samples(np.zeros(1000), 0.005))
    one, other = (EventBasedModel().simulate(each) for each in (scene, flat))
    assert other.cost.steps == one.cost.steps
    np.testing.assert_array_equal(other.channels["theta"], one.channels["theta"])


@pytest.mark.parametrize(
    "settings", [{}, {"pivot": "unilateral"}, {"friction": "no-slip"}], ids=str
)
def test_random_pulses_between_walls(settings):
    """A thousand pulses between walls that are touched or nearly so: every one is played to its
    end."""
    random = np.random.default_rng(7)
    model = EventBasedModel(tolerance=1e-8, **settings)
    gaps = (0.0, 0.003, 0.053)
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


@pytest.mark.parametrize(
    ("amplitude", "period", "friction"), [(6.0, 1.0, 0.3), (-9.0, 0.7, 1.0), (5.0, 1.5, 0.6)]
)
def test_a_decided_run_has_the_peak_of_the_whole_run(amplitude, period, friction):
    """Deciding early, when what is left of the pulse cannot lift the block above its peak, changes
    no peak."""
    model = EventBasedModel(tolerance=1e-11)
    scene = scene_of(
        PAPER_BLOCK, friction, 15.0, excitation=Ricker(amplitude=amplitude, period=period)
    )
    packed = pack([scene], model)
    early, whole = run_batch(packed, model), run_batch(packed, model, until_decided=False)
    assert early.series[0] < whole.series[0]
    assert early.side[0] == whole.side[0]
    assert early.peak[0] == pytest.approx(whole.peak[0], abs=1e-11)


@pytest.mark.parametrize("symmetric", [False, True])
def test_impulse_ahead_is_the_integral(symmetric):
    from scipy.integrate import quad

    from rockcheck.ebm.core.ground import acceleration, ground_of, impulse_ahead

    ground = ground_of(Ricker(amplitude=5.0, period=1.3, symmetric=symmetric), 9.81, 0.4)
    for share in (1.3, 1.6, 2.2):
        t = ground.form.centre + share / math.sqrt(ground.form.rate)
        there, _ = quad(
            lambda s: abs(acceleration(ground, s)), t, ground.form.quiet, epsabs=1e-15, epsrel=1e-12
        )
        assert impulse_ahead(ground, t) == pytest.approx(there, rel=1e-9)
    assert impulse_ahead(ground, ground.form.centre) == math.inf


def test_inner_kernels_return_no_arrays(monkeypatch):
    """They are compiled without reference counts, so that an array that they returned would be
    freed too early."""
    from stepping import nothing

    from rockcheck.ebm.core import (
        bouc_wen,
        contacts,
        coulomb,
        decide,
        ground,
        guards,
        march,
        modes,
        motion,
        moving,
        rest,
        series,
        settle,
        state,
    )
    from rockcheck.ebm.core.lanes import LANES
    from rockcheck.ebm.core.laws import contact_impacts, impacts, strike

    seen = set()

    def watched(function):
        def call(*arguments):
            found = function(*arguments)
            parts = found if isinstance(found, tuple) else (found,)
            # Lanes are an array in the interpreter only.
            assert not any(
                isinstance(part, np.ndarray) and part.shape != (LANES,) for part in parts
            ), function.__name__
            seen.add(function.__name__)
            return found

        return call

    # The event loop in the interpreter, with every function of it that is no kernel under watch.
    scene, work = SCENES["wedged"], state.workspace()
    for module in (
        contact_impacts,
        contacts,
        decide,
        ground,
        guards,
        impacts,
        march,
        bouc_wen,
        coulomb,
        modes,
        motion,
        moving,
        rest,
        series,
        settle,
        state,
        strike,
    ):
        for name, function in list(vars(module).items()):
            if not hasattr(function, "py_func"):
                continue
            counts_references = function.targetoptions["_nrt"]
            monkeypatch.setattr(
                module, name, function.py_func if counts_references else watched(function.py_func)
            )
    model = EventBasedModel(pivot="unilateral", tolerance=1e-8)
    packed = pack([scene], model)
    states, found = state_for(model, 200), np.empty(1, state.FOUND)
    packed.rows.durations[0] = 3.0
    records = state.Records(*(part[None] for part in nothing()))
    monkeypatch.setattr(march, "_play_row", march.loop_with(coulomb).py_func)
    with np.errstate(all="ignore"):
        march.play(packed.rows, states, work, records, found)
    assert len(seen) > 30


@pytest.mark.parametrize(
    "settings", [{}, {"pivot": "unilateral"}, {"friction": "no-slip"}], ids=str
)
def test_a_block_that_falls_away_from_its_wall_is_decided_on_the_way(settings):
    """On a base at rest, as soon as it is steeper than friction: whatever it does then turns it
    farther."""
    model = EventBasedModel(**settings)
    scene = scene_of(
        PAPER_BLOCK,
        0.3,
        10.0,
        walls=[Wall(side="left", gap=0.003)],
        initial_rotation=-1.05 * PAPER_BLOCK.alpha,
    )
    whole = model.simulate(scene)
    assert whole.outcome == "overturned right"
    decided = run_batch(pack([scene], model), model)
    assert decided.side[0] == 1
    assert decided.peak[0] == pytest.approx(0.5 * math.pi)
    assert (
        decided.t_end[0] * math.sqrt(PAPER_BLOCK.radius / scene.gravity)
        < whole.event_list[-1].t - 0.1
    )
