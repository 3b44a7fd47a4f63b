"""The parts of an adaptive step, each against mechanics by hand; lengths in R, which is 1 m."""

import math

import numpy as np
import pytest

from rockcheck import Block, Floor, Record, Scene, Wall
from rockcheck.engines import adaptive_march, contacts, kernels

G = 9.81
BLOCK = Block(half_width=0.6, half_height=0.8)
SCENE = Scene(
    name="parts",
    block=BLOCK,
    floor=Floor(friction=0.5),
    walls=[Wall(side="left", gap=0.2)],
    duration=2.0,
)
#: Contacts: lower corners on the floor, then corners at the left wall.
LEFT, RIGHT, LOWER_AT_WALL, UPPER_AT_WALL = range(4)


class March:
    """A march at its start, with other numbers of its course and its state."""

    def __init__(self, scene=SCENE, *, tolerance=None, closed=(), before=(), course=None, **state):
        self.course, self.run, _ = adaptive_march.start(scene, 0.01, 0.01, 1.0, tolerance)
        self.course = self.course._replace(**(course or {}))
        self.state = self.run.states[0]
        for name, value in state.items():
            setattr(self.state.motion if name in MOTION else self.state, name, value)
        self.run.closed[list(closed)] = True
        self.run.before[list(before)] = True

    @property
    def motion(self):
        return self.state.motion

    @property
    def request(self):
        return self.run.requests[0]

    def contact(self, i):
        motion = self.motion
        cos, sin = math.cos(motion.theta), math.sin(motion.theta)
        return kernels.contact_state(self.course.corners[i], motion, cos, sin)


MOTION = ("x", "y", "theta", "vx", "vy", "w")
MOVING = {"x": 0.1, "y": 0.9, "theta": 0.3, "vx": 0.4, "vy": -0.7, "w": 1.3}
ACCELERATION = {"ax": -2.0, "ay": -9.0, "spin": 3.0}


def gap_after(i, since):
    """The gap of a contact in a motion of constant acceleration."""
    x, y, theta, vx, vy, w = MOVING.values()
    ax, ay, spin = ACCELERATION.values()
    turned = theta + w * since + 0.5 * spin * since**2
    contact = contacts.contacts_of(SCENE)[i]
    bx, bz = contact.corner
    arm_x = bx * math.cos(turned) - bz * math.sin(turned)
    arm_y = bx * math.sin(turned) + bz * math.cos(turned)
    place_x = x + vx * since + 0.5 * ax * since**2 + arm_x
    place_y = y + vy * since + 0.5 * ay * since**2 + arm_y
    return place_y if i in (LEFT, RIGHT) else 0.8 + place_x


# How long and slow is long and slow


def course(usual=5e-3, short=1.0, tolerance=None, scene=SCENE):
    """The course of a run whose steps may be as long as 1 s."""
    return adaptive_march.start(scene, 1.0, usual, short, tolerance)[0]


@pytest.mark.parametrize("name", ["closed", "resting", "settling", "fine"])
def test_what_is_near_slow_and_settled_goes_with_the_usual_step(name):
    once, twice = (getattr(course(usual), name) for usual in (5e-3, 1e-2))
    assert twice == pytest.approx(2.0 * once)


@pytest.mark.parametrize("name", ["probe", "shortest", "long_approach", "long_slowing"])
def test_steps_at_events_go_with_their_setting(name):
    once, twice = (getattr(course(short=short), name) for short in (1.0, 2.0))
    assert twice == pytest.approx(2.0 * once)


@pytest.mark.parametrize("name", ["probe", "shortest", "long_approach"])
def test_steps_at_events_are_longer_for_a_block_that_rocks_slowly(name):
    """1/p goes with the root of 1/g."""
    slow = SCENE.replace(gravity=G / 4.0)
    once, twice = (getattr(course(scene=scene), name) for scene in (SCENE, slow))
    assert twice == pytest.approx(2.0 * once)


def test_with_a_tolerance_slip_is_close_to_its_end_within_a_part_of_the_usual_step():
    once, twice = (course(usual, tolerance=1e-8).long_slowing for usual in (5e-3, 1e-2))
    assert twice == pytest.approx(2.0 * once)
    assert once < 5e-3


def test_what_touches_is_within_a_ten_millionth_of_the_radius():
    assert course().closed < 1e-7


def test_an_impact_takes_less_than_a_ten_millionth_of_the_usual_time():
    assert course().shortest * SCENE.frequency_parameter < 1e-7


def test_no_step_at_an_event_is_longer_than_the_longest():
    short, _, _ = adaptive_march.start(SCENE, 1e-9, 5e-3, 1.0, None)
    assert short.probe == 1e-9
    assert short.shortest == 1e-9


def test_without_a_tolerance_errors_do_not_limit_steps():
    assert course().tolerance == math.inf
    assert course(tolerance=1e-8).tolerance == pytest.approx(1e-8 * BLOCK.alpha)


@pytest.mark.parametrize(("tolerance", "ends"), [(1e-8, True), (None, False)])
def test_with_a_tolerance_steps_end_at_kinks_of_the_base(tolerance, ends):
    """Of a record too weak to move the block."""
    weak = SCENE.replace(excitation=Record.from_samples([0.0, 0.1, 0.3, 0.1], 0.25))
    stops = course(scene=weak, tolerance=tolerance).stops.tolist()
    assert (0.25 in stops) == ends
    assert stops[-1] == math.inf


# Contacts


@pytest.mark.parametrize("i", range(4))
def test_gap_and_rate_are_those_of_the_corner(i):
    _, gap, rate = March(**MOVING).contact(i)
    assert gap == pytest.approx(gap_after(i, 0.0))
    assert rate == pytest.approx((gap_after(i, 1e-6) - gap_after(i, -1e-6)) / 2e-6, rel=1e-6)


@pytest.mark.parametrize("i", range(4))
def test_the_acceleration_of_a_gap_is_its_second_derivative(i):
    march = March(**MOVING, **ACCELERATION)
    arm, _, _ = march.contact(i)
    found = kernels.gap_acceleration(march.course.corners[i], march.state, arm)
    h = 1e-4
    second = (gap_after(i, h) - 2.0 * gap_after(i, 0.0) + gap_after(i, -h)) / h**2
    assert found == pytest.approx(second, rel=1e-5)


# Times to events


@pytest.mark.parametrize(("predicted", "taken"), [(0.1, 0.1), (0.2, 0.2), (0.3, 0.285)])
def test_a_far_event_is_trusted_to_a_twentieth(predicted, taken):
    assert kernels.trusted(predicted, 0.2) == pytest.approx(taken)


def closing(gap, rate, acceleration, *, known=True):
    """The time to close of a corner below which the floor is, pulled so."""
    march = March(known=known, ay=acceleration)
    arm = (0.6, -0.8)
    return kernels.time_to_close(march.course.corners[RIGHT], march.state, arm, gap, rate)


@pytest.mark.parametrize(
    ("gap", "rate", "acceleration"),
    [(0.1, -0.3, -G), (0.1, -0.3, 0.0), (0.1, 0.3, -G), (0.1, 0.0, -G), (0.1, -0.5, 1.2)],
    ids=["falls", "coasts", "comes back", "is let go", "is braked"],
)
def test_a_gap_closes_where_its_parabola_is_zero(gap, rate, acceleration):
    t = closing(gap, rate, acceleration)
    assert t > 0.0
    assert gap + rate * t + 0.5 * acceleration * t**2 == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("rate", "acceleration"), [(0.3, 0.0), (0.3, G), (-0.3, G), (0.0, 0.0)])
def test_a_gap_that_does_not_close_never_does(rate, acceleration):
    assert closing(0.1, rate, acceleration) == math.inf


def test_an_acceleration_that_is_not_known_is_not_used():
    assert closing(0.1, -0.4, -G, known=False) == pytest.approx(0.25)


def stopping(dt, arm=(0.6, -0.8), **state):
    march = March(course={"resting": 0.01}, **{"known": True, **state})
    return kernels.stopping_time(march.state, arm, dt, march.course)


def test_slip_stops_where_what_slows_it_brings_it():
    """The corner's velocity is vx - w r_y, its acceleration ax - spin r_y - w^2 r_x."""
    slip, slowing = 1.0 + 0.5 * 0.8, -4.0 + 2.0 * 0.8 - 0.25 * 0.6
    found = stopping(1.0, vx=1.0, w=0.5, ax=-4.0, spin=2.0)
    assert found == pytest.approx(-slip / slowing)


@pytest.mark.parametrize(("dt", "stops"), [(0.099, False), (0.101, True)])
def test_slip_that_lasts_longer_than_the_step_does_not_stop_in_it(dt, stops):
    assert (stopping(dt, vx=-0.5, ax=5.0) < math.inf) == stops


@pytest.mark.parametrize(
    "state",
    [{"known": False}, {"ax": 5.0}, {"vx": 0.0019}],
    ids=["unknown", "speeds up", "as good as none"],
)
def test_other_slip_does_not_stop(state):
    assert stopping(1.0, **{"vx": 0.5, "ax": -5.0} | state) == math.inf


def test_slip_of_more_than_a_fifth_of_rest_stops():
    assert stopping(1.0, vx=0.0021, ax=-5.0) == pytest.approx(0.00042)


def slipping(**state):
    given = {"known": True, "margin": 2.0, "margin_rate": -4.0, "past_dt": 0.1}
    return kernels.slipping_time(March(**given | state).state)


def test_slip_begins_where_the_margin_is_used_up():
    """It was 2 in the middle of the last step, half of 0.1 s ago."""
    assert slipping() == pytest.approx(0.45)


def test_slip_that_should_have_begun_begins_at_once():
    assert slipping(margin=0.1) == 0.0


@pytest.mark.parametrize("state", [{"known": False}, {"margin_rate": 0.0}, {"margin_rate": 1.0}])
def test_a_margin_that_does_not_fall_is_never_used_up(state):
    assert slipping(**state) == math.inf


# The next step

LIMITED = {"tolerance": 1e-9, "probe": 1e-4, "fine": 0.02, "long_slowing": 1e-3}


def longest(dt, *, known=True, course=None):
    march = March(course=course, known=known, allowed=0.1)
    return kernels.longest_step(march.state, march.course, dt)


@pytest.mark.parametrize(
    ("dt", "step"), [(0.05, 0.05), (0.1, 0.1), (0.15, 0.075), (0.2, 0.1), (0.25, 0.1)]
)
def test_of_what_remains_no_sliver_is_left(dt, step):
    assert longest(dt, course=LIMITED) == pytest.approx(step)


def test_without_a_tolerance_a_step_is_as_long_as_it_may_be():
    assert longest(0.15, course={"tolerance": math.inf}) == 0.1


def test_after_an_event_a_step_is_a_probe():
    assert longest(0.25, known=False, course=LIMITED) == 1e-4


@pytest.mark.parametrize(
    ("closed", "leans"),
    [
        ((LEFT, RIGHT, LOWER_AT_WALL), False),
        ((LEFT, LOWER_AT_WALL), True),
        ((RIGHT, UPPER_AT_WALL), True),
        ((UPPER_AT_WALL,), True),
        ((RIGHT,), False),
        ((), False),
    ],
)
def test_a_block_leans_that_touches_a_wall_and_is_not_flat(closed, leans):
    assert kernels.leans(March(closed=closed).run) == leans


@pytest.mark.parametrize(
    ("closed", "before", "changed"),
    [((), (), False), ((RIGHT,), (RIGHT,), False), ((RIGHT,), (LEFT,), True), ((RIGHT,), (), True)],
)
def test_contacts_have_changed_where_others_are_closed(closed, before, changed):
    assert kernels.contacts_changed(March(closed=closed, before=before).run) == changed


def until(dt=0.5, **given):
    state = {"known": True, "margin": math.inf, "stops": True}
    march = March(course=LIMITED, **state | given)
    return kernels.until_contacts_change(march.run, march.course, dt), bool(march.state.stops)


def test_where_nothing_changes_a_step_is_as_long_as_it_was():
    assert until(closed=(RIGHT,), before=(RIGHT,)) == (0.5, True)


def test_a_block_that_leans_takes_fine_steps():
    touching = (RIGHT, UPPER_AT_WALL)
    assert until(closed=touching, before=touching) == (0.02, False)


def test_a_step_ends_where_slip_begins():
    """Far off it is trusted to a twentieth."""
    step, stops = until(margin=1.0, margin_rate=-10.0, closed=(RIGHT,), before=(RIGHT,))
    assert step == pytest.approx(0.095)
    assert not stops


def test_a_step_to_where_slip_begins_is_not_too_short():
    step, _ = until(margin=0.0, margin_rate=-10.0, closed=(RIGHT,), before=(RIGHT,))
    assert step == 1e-3


def test_a_step_is_a_probe_where_a_contact_has_opened():
    assert until(before=(RIGHT,)) == (1e-4, False)


def length(march, dt=0.005):
    return kernels.step_length(march.run, march.course, dt)


def test_a_block_at_rest_steps_on():
    march = March(known=True, y=0.8)
    assert length(march) == (0.005, False)
    assert march.run.closed.tolist() == [True, True, False, False]


def test_a_step_ends_where_a_gap_closes():
    """From 1e-4 R at 0.1 R/s, not pulled: 1 ms, of which a far one is trusted to a twentieth."""
    march = March(known=True, y=0.8001, vy=-0.1)
    assert length(march) == (pytest.approx(0.95e-3), False)


def test_a_corner_that_comes_in_is_an_impact():
    march = March(known=True, y=0.8, vy=-0.5)
    assert length(march) == (march.course.shortest, True)


def test_a_step_ends_where_slip_stops():
    march = March(known=True, y=0.8, vx=0.01, ax=-5.0, course={"long_slowing": 1.0})
    assert length(march) == (pytest.approx(0.002), False)
    assert march.state.stops


@pytest.mark.parametrize(("share", "together"), [(0.9, True), (1.1, False)])
def test_a_corner_that_comes_k_times_as_fast_strikes_from_k_times_as_far(share, together):
    """The right corner comes five times as fast as the impact."""
    march = March(closed=(LEFT,), theta=0.0, w=-1.0, vy=0.0)
    march.motion.y = 0.8 + share * 5.0 * march.course.closed
    kernels.join(march.run, march.course, 0.6 / 5.0)
    assert march.run.closed.tolist() == [True, together, False, False]


@pytest.mark.parametrize(("share", "together"), [(0.9, True), (1.1, False)])
def test_a_corner_joins_from_twenty_times_as_far_at_most(share, together):
    march = March(theta=0.0, w=-1.0, vy=0.0)
    march.motion.y = 0.8 + share * 20.0 * march.course.closed
    kernels.join(march.run, march.course, 0.6 / 100.0)
    assert march.run.closed[RIGHT] == together


# What the engine is asked


def test_in_flight_the_engine_sees_the_mean_pose():
    march = March(**MOVING, **ACCELERATION, smooth=True)
    kernels.ask_for_pose(march.run, march.course.corners, 0.1)
    means = [
        place + 0.05 * rate + 0.01 / 6.0 * acceleration
        for place, rate, acceleration in zip(
            (0.1, 0.9, 0.3), (0.4, -0.7, 1.3), ACCELERATION.values(), strict=True
        )
    ]
    request = march.request
    assert [request.x, request.y, request.theta] == pytest.approx(means)
    assert [request.vx, request.vy, request.w] == pytest.approx([0.4, -0.7, 1.3])


def test_an_acceleration_that_does_not_go_on_is_left_out():
    march = March(**MOVING, **ACCELERATION, smooth=False)
    kernels.ask_for_pose(march.run, march.course.corners, 0.1)
    assert march.request.x == pytest.approx(0.1 + 0.05 * 0.4)


def turned(theta):
    """The right lower corner from the mass, turned."""
    return np.array(
        [
            0.6 * math.cos(theta) + 0.8 * math.sin(theta),
            0.6 * math.sin(theta) - 0.8 * math.cos(theta),
        ]
    )


def pivoting(w=-0.7, theta=-0.2, **more):
    """A block that turns about its right lower corner, which stands on the floor."""
    arm = turned(theta)
    rates = {"vx": w * arm[1], "vy": -w * arm[0], "w": w}
    return March(x=0.0, y=-arm[1], theta=theta, closed=(RIGHT,), **rates, **more)


def test_a_corner_that_touches_is_seen_just_below_the_floor():
    march = pivoting()
    kernels.ask_for_pose(march.run, march.course.corners, 0.1)
    request = march.request
    assert request.y + turned(request.theta)[1] == pytest.approx(-kernels.EMBEDDED, abs=1e-12)


def test_a_corner_is_seen_with_the_velocity_that_it_has_at_the_end():
    """It turns on at a spin that is known; the engine sees the arm of the mean pose."""
    march = pivoting(spin=0.5, smooth=True)
    vx, vy = march.motion.vx, march.motion.vy
    kernels.ask_for_pose(march.run, march.course.corners, 0.1)
    request, later = march.request, -0.7 + 0.1 * 0.5
    mean, end = turned(request.theta), turned(-0.2 + 0.05 * (-0.7 + later))
    assert request.vx - later * mean[1] == pytest.approx(vx - later * end[1])
    assert request.vy + later * mean[0] == pytest.approx(vy + later * end[0])


def test_beside_a_wall_the_height_is_left_to_the_floor():
    march = March(theta=0.0, x=-0.2, y=0.9, w=0.3, closed=(LOWER_AT_WALL,))
    kernels.ask_for_pose(march.run, march.course.corners, 0.1)
    assert march.request.vy == 0.0
    assert march.state.carry_y == 0.0
    assert march.request.y == pytest.approx(0.9)


PUSHED = SCENE.replace(
    excitation=Record.from_samples([2.0, 2.0], 4.0), vertical=Record.from_samples([1.0, 1.0], 4.0)
)


def test_a_step_feels_gravity_and_what_the_base_does():
    march = March(PUSHED, known=True, allowed=0.005)
    assert kernels.plan(march.run, march.course) == kernels.GOES_ON
    assert march.request.felt_x == pytest.approx(-2.0)
    assert march.request.felt_y == pytest.approx(-G - 1.0)
    assert march.request.dt == pytest.approx(0.005)
    assert march.state.t == pytest.approx(0.005)


def test_a_step_feels_the_mean_of_what_the_base_does():
    """The base's acceleration rises from 0 to 2 in 4 s: in the middle of the step it is 1.00125."""
    ramp = SCENE.replace(excitation=Record.from_samples([0.0, 2.0], 4.0))
    march = March(ramp, known=True, allowed=0.005, t=2.0, base_x=1.0)
    march.course = march.course._replace(stops=np.array([math.inf]), end=4.0)
    kernels.plan(march.run, march.course)
    assert march.request.felt_x == pytest.approx(-1.00125)


@pytest.mark.parametrize(
    "state", [{"t": 2.0}, {"theta": 0.5 * math.pi}, {"theta": -1.6}], ids=["end", "lies", "right"]
)
def test_a_run_is_over_at_its_end_or_where_the_block_lies(state):
    march = March(course={"end": 2.0}, **state)
    assert kernels.plan(march.run, march.course) == kernels.OVER


def test_a_step_ends_where_the_base_may_move_the_block():
    march = March(known=True, y=0.8)
    march.course = march.course._replace(stops=np.array([0.003, math.inf]))
    kernels.plan(march.run, march.course)
    assert march.request.dt == pytest.approx(0.003)


# The end of a step


def bent(**state):
    """A state after a step of 0.2 s, of the velocities of x'' = 1 + 6 t from t = -0.2 s on."""
    given = {"known": True, "smooth": True, "past_dt": 0.2, "vx": 0.0, "ax": 1.0 - 0.6}
    return March(**given | state)


def test_a_step_of_linear_acceleration_is_exact():
    """In 0.1 s x = t^2/2 + t^3."""
    march = bent(x=0.0)
    kernels.move(march.state, 0.1 + 3.0 * 0.01, 0.0, 0.0, 0.1)
    assert march.motion.x == pytest.approx(0.005 + 0.001)
    assert march.motion.vx == pytest.approx(0.13)
    assert march.state.ax == pytest.approx(1.3)


@pytest.mark.parametrize(("place", "rate"), [("x", "vx"), ("y", "vy"), ("theta", "w")])
def test_each_coordinate_moves_alike(place, rate):
    acceleration = {"vx": "ax", "vy": "ay", "w": "spin"}[rate]
    march = bent(**{"ax": 0.0, place: 0.5, acceleration: 0.4})
    velocity = [0.13 if name == rate else 0.0 for name in ("vx", "vy", "w")]
    before = getattr(march.motion, place)
    kernels.move(march.state, *velocity, 0.1)
    assert getattr(march.motion, place) - before == pytest.approx(0.006)
    assert getattr(march.motion, rate) == pytest.approx(0.13)
    assert getattr(march.state, acceleration) == pytest.approx(1.3)


def test_after_an_event_the_acceleration_is_taken_as_constant():
    march = bent(x=0.0, smooth=False)
    kernels.move(march.state, 0.13, 0.0, 0.0, 0.1)
    assert march.motion.x == pytest.approx(0.0065)


@pytest.mark.parametrize(
    ("velocity", "change"),
    [((0.13, 0.0, 0.0), 0.9), ((0.04, -0.2, 0.1), 2.0), ((0.04, 0.1, 0.3), 3.0)],
)
def test_the_error_of_a_step_is_what_the_largest_change_of_acceleration_moves(velocity, change):
    march = bent()
    error = kernels.step_error(march.state, *velocity, 0.1)
    assert error == pytest.approx(change * 0.001 / (6.0 * 0.3))


def test_after_an_event_no_error_is_known():
    assert kernels.step_error(bent(smooth=False).state, 0.13, 0.0, 0.0, 0.1) == 0.0


@pytest.mark.parametrize(
    ("share", "factor"),
    [(1.0, 0.9), (8.0, 0.45), (0.0, 8.0), (1e-9, 8.0), (1e6, 0.2), (1e-3, 8.0), (0.002, 7.143)],
)
def test_the_next_step_follows_the_cube_root_of_the_error(share, factor):
    course = March(course={"tolerance": 1e-6, "longest": 9.0, "probe": 1e-4}).course
    assert kernels.allowed_step(0.1, share * 1e-6, course) == pytest.approx(0.1 * factor, rel=1e-3)


def test_the_next_step_is_no_longer_than_the_longest():
    course = March(course={"tolerance": 1e-6, "longest": 0.3, "probe": 1e-4}).course
    assert kernels.allowed_step(0.1, 0.0, course) == 0.3


def test_after_an_impact_the_next_step_follows_the_probe():
    course = March(course={"tolerance": 1e-6, "longest": 0.3, "probe": 1e-4}).course
    assert kernels.allowed_step(1e-8, 1e-6, course) == pytest.approx(0.9e-4)


@pytest.mark.parametrize(
    ("closed", "vy", "gap"),
    [((RIGHT,), 0.0, 0.0), ((LEFT, RIGHT), 0.0, 1e-6), ((RIGHT,), 0.1, 1e-6), ((), 0.0, 1e-6)],
    ids=["one", "both", "fast", "none"],
)
def test_the_one_corner_that_stays_is_put_back(closed, vy, gap):
    march = March(theta=-0.2, vy=vy, closed=closed)
    march.motion.y = 1e-6 - turned(-0.2)[1]
    kernels.put_back(march.run, march.course)
    assert march.contact(RIGHT)[1] == pytest.approx(gap, abs=1e-12)


def test_a_corner_is_put_back_to_a_wall_across():
    march = March(x=-0.2 + 1e-6, y=0.9, closed=(UPPER_AT_WALL,))
    kernels.put_back(march.run, march.course)
    assert march.motion.x == pytest.approx(-0.2, abs=1e-12)
    assert march.motion.y == 0.9


@pytest.mark.parametrize(
    ("closed", "speeds", "still"),
    [
        ((LEFT, RIGHT), {}, True),
        ((LEFT, RIGHT), {"vx": 0.9, "vy": -0.9, "w": 0.9}, True),
        ((LEFT, RIGHT), {"vx": 1.1}, False),
        ((LEFT, RIGHT), {"vy": -1.1}, False),
        ((LEFT, RIGHT), {"w": 1.1}, False),
        ((LEFT,), {}, False),
        ((RIGHT,), {}, False),
    ],
)
def test_a_block_lies_still_on_both_corners_below_an_engine_s_noise(closed, speeds, still):
    noise = 1e-5 * G * 0.01
    march = March(closed=closed, **{name: share * noise for name, share in speeds.items()})
    assert kernels.lies_still(march.run, march.course, 0.01) == still


@pytest.mark.parametrize(("vy", "opens"), [(0.011, True), (0.009, False), (-0.1, False)])
def test_a_closed_contact_gives_way_where_it_opens(vy, opens):
    march = March(vy=vy, closed=(LEFT,), course={"resting": 0.01})
    assert kernels.gives_way(march.run, march.course) == opens


def test_a_contact_that_is_open_does_not_give_way():
    assert not kernels.gives_way(March(vy=1.0).run, March().course)


@pytest.mark.parametrize(
    ("change", "settled"),
    [
        ({}, True),
        ({"y": 0.8 + 1.9e-6}, True),
        ({"y": 0.8 + 2.1e-6}, False),
        ({"vy": 1.9e-6, "ay": 0.0}, True),
        ({"vy": -2.1e-6, "ay": 0.0}, False),
        ({"vy": 0.9e-3, "ay": -10.0}, True),
        ({"vy": 1.1e-3, "ay": -10.0}, False),
        ({"theta": -1e-5}, False),
    ],
)
def test_a_block_settles_whose_corners_return_at_once(change, settled):
    """Within 1e-4 s, under the acceleration that is known."""
    march = March(y=0.8, course={"settling": 1e-4})
    for name, value in change.items():
        setattr(march.motion if name in MOTION else march.state, name, value)
    assert kernels.settles(march.state, march.course) == settled


# Friction that holds


def held(closed=(RIGHT,), *, margin=math.inf, vx=0.0, w=0.0, smooth=True):
    """Held by the floor, which pushes with 9 up and 3 across."""
    march = March(
        closed=closed,
        ax=1.0,
        ay=-1.0,
        vx=vx,
        w=w,
        margin=margin,
        past_dt=0.3,
        smooth=smooth,
        course={"friction": 0.5, "resting": 0.01},
    )
    march.request.felt_x, march.request.felt_y = -2.0, -10.0
    kernels.watch_friction(march.run, march.course, 0.1)
    return march.state


def test_the_margin_is_what_friction_could_still_take():
    assert held().margin == pytest.approx(0.5 * 9.0 - 3.0)


def test_the_rate_of_the_margin_is_its_change_between_the_middles_of_two_steps():
    """In (0.1 + 0.3)/2 s from 2.5 to 1.5."""
    assert held(margin=2.5).margin_rate == pytest.approx(-5.0)


@pytest.mark.parametrize("state", [{"margin": math.inf}, {"margin": 2.5, "smooth": False}])
def test_a_margin_that_was_not_known_has_no_rate(state):
    assert held(**state).margin_rate == 0.0


@pytest.mark.parametrize(
    "state",
    [
        {"closed": ()},
        {"closed": (RIGHT, UPPER_AT_WALL)},
        {"vx": 0.02},
        {"w": 0.02},
        {"vx": -0.02, "margin": 2.5},
    ],
    ids=["none", "wall", "slides", "turns", "slid"],
)
def test_what_does_not_stick_to_the_floor_alone_has_no_margin(state):
    found = held(**state)
    assert found.margin == math.inf
    assert found.margin_rate == 0.0


# Whole steps


def stepped(march, kicked):
    row = np.empty(kernels.COLUMNS)
    return kernels.step(march.run, march.course, kicked, row), row


def test_a_step_in_flight_is_a_parabola_and_written_as_a_row():
    thrown = {"vx": 0.3, "w": 0.5, "ay": -G, "past_dt": 0.004}
    march = March(SCENE.replace(initial_height=1.0), known=True, **thrown)
    march.run.states["allowed"] = 0.004
    kernels.plan(march.run, march.course)
    outcome, row = stepped(march, (0.3, -G * 0.004, 0.5))
    assert outcome == kernels.GOES_ON
    fall = 1.8 - 0.5 * G * 0.004**2
    expected = [0.004, 0.0012, fall, 0.002, 0.3, -G * 0.004, 0.5, 0.0, -G]
    assert row.tolist() == pytest.approx(expected)
    assert march.state.known


@pytest.mark.parametrize("speed", [1e7, math.nan])
def test_a_motion_without_end_is_lost(speed):
    march = March(SCENE.replace(initial_height=1.0))
    kernels.plan(march.run, march.course)
    assert stepped(march, (speed, 0.0, 0.0))[0] == kernels.LOST


def jolted(dt, *, probe=1e-4):
    """The outcome of a step in which the acceleration jumps by 1000, and its march."""
    flying = {"known": True, "past_dt": dt, "ay": -G, "tolerance": 1e-15}
    march = March(SCENE.replace(initial_height=1.0), course={"probe": probe}, **flying)
    march.run.states["allowed"] = dt
    kernels.plan(march.run, march.course)
    return stepped(march, (1e3 * dt, -G * dt, 0.0))[0], march


def test_a_step_with_too_large_an_error_is_taken_again_shorter():
    outcome, march = jolted(0.004)
    assert outcome == kernels.AGAIN
    assert march.state.t == pytest.approx(0.2 * 0.004)
    assert march.motion.y == pytest.approx(1.8)


def test_a_probe_is_not_taken_again():
    outcome, _ = jolted(1e-4)
    assert outcome == kernels.GOES_ON


def test_a_step_that_ends_in_an_impact_knows_no_acceleration():
    march = March(known=True, y=0.8, vy=-0.5)
    kernels.plan(march.run, march.course)
    assert march.request.impact == 1.0
    stepped(march, (0.0, 0.0, 0.0))
    assert not march.state.known


def test_a_block_that_has_landed_flat_stands():
    """After the impact it rises at a micrometre a second, which a step leaves of it."""
    march = March(y=0.8 + 1e-8, theta=1e-9)
    kernels.plan(march.run, march.course)
    stepped(march, (0.0, 1e-6, 1e-6))
    assert march.motion.y == march.course.standing
    assert march.motion.theta == 0.0
    assert march.motion.vy == 0.0
    assert march.motion.w == 0.0


def test_an_engine_s_noise_does_not_add_up_at_rest():
    march = March(known=True, y=0.8, tolerance=1e-9)
    kernels.plan(march.run, march.course)
    noise = 0.5e-5 * G * float(march.request.dt)
    stepped(march, (noise, noise, noise))
    assert march.motion.vx == 0.0
    assert march.motion.y == march.course.standing
