"""Edges by name: scenes in which two things happen at once, or exactly at a limit."""

import math

import numpy as np
import pytest
from stepping import assert_contacts_hold

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import (
    PAPER_BLOCK,
    Block,
    Floor,
    History,
    Record,
    Rest,
    Ricker,
    Scene,
    Sine,
    Wall,
    kinematics,
)

SLOPE = PAPER_BLOCK.half_width / PAPER_BLOCK.half_height
G = 9.81
pivots = pytest.mark.parametrize("pivot", ["bilateral", "unilateral"])


#: A scene with what is changed in it.
scene_of = Scene(
    name="edge", block=PAPER_BLOCK, floor=Floor(friction=0.8), duration=3.0, output_step=0.01
).replace


def play(scene: Scene, pivot: str = "bilateral", **settings: object) -> History:
    return EventBasedModel(pivot=pivot, **settings).simulate(scene)


def kinds(history: History) -> list[str]:
    return [event.kind for event in history.event_list]


def constant(acceleration: float, duration: float = 10.0) -> Record:
    return Record.from_samples([acceleration, acceleration], time_step=duration)


def grazing_gap(tilt: float) -> float:
    """Gap at which the top corner of a block that is released from `tilt` (to the right) just
    reaches the left wall.

    Its next rotation follows from Housner's impact, r = 1 - 3/2 sin^2 alpha, and energy.
    """
    alpha = PAPER_BLOCK.alpha
    # Height of the centroid, R cos(alpha - phi), is all the energy there is at a turning point.
    depth = (1.0 - 1.5 * math.sin(alpha) ** 2) ** 2 * (math.cos(alpha - tilt) - math.cos(alpha))
    peak = alpha - math.acos(math.cos(alpha) + depth)
    return PAPER_BLOCK.radius * (math.sin(alpha + peak) - math.sin(alpha - peak))


@pivots
def test_grazing_wall_contact(pivot):
    tilt, gap = 0.15, grazing_gap(0.15)
    free, misses, touches = (
        play(scene_of(initial_rotation=-tilt, duration=2.5, walls=walls), pivot, tolerance=1e-13)
        for walls in (
            [],
            [Wall(side="left", gap=gap * (1.0 + 1e-9))],
            [Wall(side="left", gap=gap * (1.0 - 1e-9))],
        )
    )
    assert "wall impact" not in kinds(misses)
    np.testing.assert_array_equal(misses.channels["theta"], free.channels["theta"])
    (impulse,) = [one.impulse for one in touches.event_list if one.kind == "wall impact"]
    assert 0.0 < impulse < 1e-3
    assert np.max(np.abs(touches.channels["theta"] - free.channels["theta"])) < 1e-3


@pytest.mark.parametrize(("side", "sign"), [("left", 1.0), ("right", -1.0)])
@pytest.mark.parametrize("e", [0.0, 0.5])
@pivots
def test_impact_on_floor_and_wall_at_once(pivot, e, side, sign):
    """A block beside a wall, tilted away and let go, lands flush against it. One that slides
    strikes the wall before it lands, if only by 3e-4 s."""
    other = {"left": "right", "right": "left"}[side]
    walls = [Wall(side=other, gap=5.0, restitution=0.9), Wall(side=side, gap=0.0, restitution=e)]
    scene = scene_of(walls=walls, initial_rotation=-0.1 * sign)
    history = play(scene, pivot, tolerance=1e-12)
    assert_contacts_hold(scene, history)
    motion = history.channels
    energy = kinematics.energy(
        PAPER_BLOCK, G, *(motion[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot"))
    )
    slides = scene_of(
        walls=[Wall(side=side, gap=2e-4, restitution=e)],
        duration=1e-3,
        initial_rotation=-5e-6 * sign,
        initial_angular_velocity=0.01 * sign,
        initial_velocity=-sign,
    )
    assert np.max(sign * motion["theta"]) < 1e-9
    assert kinds(play(slides, pivot))[0] == "wall impact"
    assert np.max(np.diff(energy)) < 1e-8
    if e == 0.0:
        assert history.outcome == "at rest"
    elif pivot == "bilateral":  # the closed branch: every velocity -e times
        first = next(event for event in history.event_list if event.kind == "floor impact")
        after = motion["t"] > first.t
        assert energy[after][0] / energy[0] == pytest.approx(e**2, rel=1e-6)
        spin = math.sqrt(1.5 * energy[0]) / PAPER_BLOCK.radius
        assert first.impulse == pytest.approx((1.0 + e) * PAPER_BLOCK.half_width * spin, rel=1e-6)
        assert np.min(sign * motion["theta"][after]) < -1e-3
        assert history.cost.rules["flush landing"] > 0


@pytest.mark.parametrize(
    ("friction", "limit", "kind", "column"),
    [(0.8, SLOPE, "uplift", "theta"), (0.2, 0.2, "slip", "x")],
)
@pivots
def test_motion_begins_beyond_exactly_the_slope_or_the_friction(
    pivot, friction, limit, kind, column
):
    """|u| = g tan alpha, or mu g, is the limit itself: less does not move the block, more does, and
    at the limit nothing happens in a hurry."""
    below, at, barely, above = (
        play(scene_of(floor=Floor(friction=friction), excitation=constant(u * G * limit)), pivot)
        for u in (1.0 - 1e-12, 1.0, 1.0 + 1e-12, 1.0 + 1e-7)
    )
    assert kinds(below) == []
    assert not below.channels[column].any()
    assert kinds(above)[0] == kind
    assert np.max(np.abs([at.channels[column], barely.channels[column]])) < 1e-9
    if kind == "slip":
        assert above.channels["x"][-1] == pytest.approx(-0.5 * 1e-7 * G * limit * 9.0, rel=1e-5)


@pytest.mark.parametrize(
    ("friction", "kind", "begins"), [("coulomb", "slip", 0.25), ("no-slip", "uplift", 0.5)]
)
def test_what_cannot_slip_waits_for_the_slope(friction, kind, begins):
    """Under an acceleration that grows evenly a block slips as it passes the friction; one that
    cannot slip stands up to its slope."""
    growing = scene_of(
        floor=Floor(friction=0.5 * SLOPE),
        excitation=Record.from_samples([0.0, 2.0 * SLOPE * G], time_step=1.0),
        duration=0.6,
    )
    first = play(growing, friction=friction).event_list[0]
    assert first.kind == kind
    assert first.t == pytest.approx(begins, abs=1e-9)


@pivots
def test_balance_point(pivot):
    back, on, over = (
        play(scene_of(initial_rotation=PAPER_BLOCK.alpha * factor, duration=20.0), pivot)
        for factor in (1.0 - 1e-6, 1.0, 1.0 + 1e-6)
    )
    # On its corner it stands, but not on its base.
    assert [one.outcome for one in (back, on, over)] == ["at rest", "moving", "overturned left"]
    assert not kinds(on)
    np.testing.assert_allclose(on.channels["theta"], PAPER_BLOCK.alpha, rtol=0.0, atol=1e-9)
    # It came back through the upright.
    assert np.min(back.channels["theta"]) < -0.1 * PAPER_BLOCK.alpha
    assert np.all(np.diff(over.channels["theta"]) > 0.0)


#: Gaps to the left and the right wall, the scene, and the events that there must be.
BESIDE_WALLS = {
    "touched": ([0.0], {"excitation": Ricker(amplitude=3.0 * G * SLOPE, period=0.8)}, {"uplift"}),
    "left": ([0.0], {"excitation": Ricker(amplitude=-3.0 * G * SLOPE, period=0.8)}, {"uplift"}),
    "rattles": ([0.001], {"excitation": constant(1.5 * G * SLOPE)}, {"wall impact"}),
    "between": (
        [0.03, 0.05],
        {"excitation": Ricker(amplitude=6.0 * G * SLOPE, period=0.9), "floor": Floor(friction=0.3)},
        {"uplift", "floor impact", "wall impact"},
    ),
}


@pytest.mark.parametrize("e", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("name", BESIDE_WALLS)
@pivots
def test_walls_and_floor_are_not_entered(pivot, name, e):
    gaps, more, events = BESIDE_WALLS[name]
    sides = zip(("left", "right"), gaps, strict=False)
    scene = scene_of(
        walls=[Wall(side=side, gap=gap, restitution=e) for side, gap in sides], duration=6.0, **more
    )
    history = play(scene, pivot)
    assert_contacts_hold(scene, history)
    assert events - set(kinds(history)) == set()
    assert len(history.event_list) < 20_000
    lift = kinematics.pivot_height(
        PAPER_BLOCK, history.channels["y"], history.channels["theta"]
    ).max()
    if pivot == "bilateral":
        assert lift <= 1e-4
    elif name == "between":
        assert lift > 1e-4


def test_zeno_sequence_of_a_bouncing_block():
    height, e = 1e-4, 0.999
    end = math.sqrt(2.0 * height / G) * (1.0 + e) / (1.0 - e)
    history = play(
        scene_of(
            floor=Floor(friction=0.5, restitution=e),
            initial_height=height,
            duration=1.2 * end,
            output_step=0.1,
        ),
        "unilateral",
    )
    assert history.outcome == "at rest"
    landings = [event.t for event in history.event_list if event.impulse > 0.0]
    assert len(landings) > 2000
    assert 0.98 * end <= landings[-1] < end
    assert np.max(np.abs(history.channels["theta"])) < 1e-9


@pivots
def test_zeno_sequence_of_a_rocking_block(pivot):
    block = Block(half_width=0.1, half_height=1.0)
    scene = scene_of(
        block=block,
        floor=Floor(friction=0.5),
        initial_rotation=0.5 * block.alpha,
        duration=200.0,
    )
    history = play(scene, pivot)
    impacts = [event.t for event in history.event_list if event.kind == "floor impact"]
    assert history.outcome == "at rest"
    assert len(impacts) > 500
    # Quarter periods fall by the ratio of speeds where rotations are small: t_n+1/t_n tends to 1 -
    # 3/2 sin^2 alpha.
    late = np.diff(impacts)[400:500]
    np.testing.assert_allclose(
        late[1:] / late[:-1], 1.0 - 1.5 * math.sin(block.alpha) ** 2, atol=2e-4
    )


@pytest.mark.parametrize(
    ("excitation", "friction"),
    [
        *(
            (Record.from_samples([strength], time_step=0.01), 0.6)
            for strength in (0.1, 20.0, -20.0)
        ),
        (Ricker(amplitude=4.0, period=0.6), 0.0),
    ],
)
@pivots
def test_record_of_one_sample_and_a_pulse_on_ice(pivot, excitation, friction):
    """One sample lasts no time: nothing happens. Found by `rockcheck stress`: no mode was
    consistent at t = 0. A pulse whose integral is 0 leaves a block on ice where it was, with no
    more speed than rounding gives."""
    shaken = play(scene_of(excitation=excitation, floor=Floor(friction=friction)), pivot)
    assert shaken.outcome == "at rest"
    assert not shaken.channels["theta"].any()


@pivots
def test_record_that_ends_with_a_jump(pivot):
    scene = scene_of(excitation=constant(3.0 * G * SLOPE, 0.4))
    slow = Record.from_samples([3.0 * G * SLOPE, 3.0 * G * SLOPE, 0.0], time_step=0.4)
    ends, falls = (
        play(one, pivot, tolerance=1e-12).channels["theta"]
        for one in (scene, scene.replace(excitation=slow))
    )
    np.testing.assert_allclose(ends[:40], falls[:40], rtol=0.0, atol=1e-12)
    # The outcome is that at the end, even where the last row comes before it. What falls moves.
    assert ends[45] < falls[45]
    assert play(scene.replace(duration=0.5, output_step=1.0), pivot).outcome == "moving"
    assert play(scene_of(initial_height=1.0, duration=0.2), "unilateral").outcome == "moving"


@pytest.mark.parametrize("tilt", [0.0, 0.3])
@pytest.mark.parametrize("symmetric", [False, True])
@pytest.mark.parametrize("vertical", [Rest(), Sine(amplitude=0.5, period=1.0, cycles=3)], ids=str)
@pivots
def test_pulse_that_is_shorter_than_a_step(pivot, vertical, symmetric, tilt):
    """A pulse of a thousandth of the block's time is not stepped over, at rest nor in rocking.

    Found by `rockcheck stress`: the tail of a symmetric pulse is too thin for a Taylor series to
    tell that it is there.
    """
    scene = scene_of(
        floor=Floor(friction=1.2),
        excitation=Ricker(amplitude=4000.0 * G * SLOPE, period=2e-3, symmetric=symmetric),
        vertical=vertical,
        initial_rotation=tilt * PAPER_BLOCK.alpha,
        duration=0.5,
    )
    usual, fine, without = (
        play(one, pivot, **settings).channels["theta"]
        for one, settings in (
            (scene, {}),
            (scene, {"tolerance": 1e-13}),
            (scene.replace(excitation=Rest()), {}),
        )
    )
    np.testing.assert_allclose(usual, fine, rtol=0.0, atol=1e-7)
    assert np.max(np.abs(fine - without)) > 1e-6


@pivots
def test_duration_that_ends_at_an_impact(pivot):
    scene = scene_of(initial_rotation=0.1, output_step=0.05)
    impact = next(
        event.t for event in play(scene, pivot).event_list if event.kind == "floor impact"
    )
    for end in (
        math.nextafter(impact, 0.0),
        impact,
        math.nextafter(impact, 9.0),
        impact * (1.0 - 1e-13),
        impact * (1.0 + 1e-13),
    ):
        history = play(scene.replace(duration=end, output_step=end / 8.0), pivot)
        theta = history.channels["theta"]
        ends = (len(theta), history.outcome, theta[-1], len(history.event_list) <= 1)
        assert ends == (9, "moving", pytest.approx(0.0, abs=1e-9), True)
