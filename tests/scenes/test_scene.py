"""Scenes: what they accept, what they refuse, what follows from them."""

import math

import numpy as np
import pytest

from rockcheck.scenes import PAPER_BLOCK, Block, Floor, Record, Scene, Wall, kinematics, observation

GOOD = {
    "name": "good",
    "block": {"half_width": 0.397, "half_height": 1.555},
    "floor": {"friction": 0.3},
    "walls": [{"side": "left", "gap": 0.053, "restitution": 0.5}],
    "excitation": {"kind": "ricker", "amplitude": 6.0, "period": 0.98},
    "duration": 10.0,
}


BOX = {"half_width": 0.4, "half_height": 1.0}


def scene(**change: object) -> Scene:
    return Scene(**(GOOD | change))


def block(**change: object) -> dict[str, object]:
    return {"block": BOX | change}


WRONG = [math.nan, math.inf, -math.inf, "1", True, None]
#: Values that are not allowed, by the numbers that refuse them.
REFUSED = {
    "block.half_width block.half_height excitation.period duration output_step gravity": [
        *WRONG,
        0.0,
        -1.0,
    ],
    "floor.friction floor.static_friction initial_height": [*WRONG[:-1], -1e-9],
    "floor.restitution": [math.nan, -0.01, 1.01, "0.5"],
    "excitation.amplitude initial_rotation initial_angular_velocity initial_velocity": WRONG,
}


@pytest.mark.parametrize(
    ("key", "value"),
    [(key, value) for keys, values in REFUSED.items() for key in keys.split() for value in values],
)
def test_numbers_that_are_refused(key, value, fault_of):
    table, _, name = key.rpartition(".")
    change = {table: GOOD[table] | {name: value}} if table else {name: value}
    assert fault_of(scene, **change).key == key


@pytest.mark.parametrize(
    ("change", "key", "said"),
    [
        ({"block": {"half_width": 0.4}}, "block.half_height", "is missing"),
        (block(depth=1.0), "block.depth", "unknown key"),
        (block(mass=0.0), "block.mass", "0.0 is not allowed"),
        (
            block(center_of_mass=[0.1, 0.1]),
            "block.center_of_mass",
            "did you mean 'centre_of_mass'?",
        ),
        (
            block(centre_of_mass=[0.4, 0.1]),
            "block.centre_of_mass",
            "(0.4, 0.1) is not allowed: must lie inside the box",
        ),
        (block(centre_of_mass=[0.1, -1.0]), "block.centre_of_mass", "z between -1 and 1 m"),
        (block(centre_of_mass=[0.1, math.nan]), "block.centre_of_mass.1", "nan is not allowed"),
        (block(centre_of_mass=[0.1]), "block.centre_of_mass.1", "is missing"),
        (block(moment_of_inertia=0.0), "block.moment_of_inertia", "0.0 is not allowed"),
        (block(moment_of_inertia=100.0), "block.moment_of_inertia", "taken as that of 1 kg"),
        (
            block(moment_of_inertia=117.0, mass=100.0),
            "block.moment_of_inertia",
            "at most 116 kg m^2",
        ),
        # The homogeneous box's own moment of inertia is too much for a centre so near to a corner.
        (block(centre_of_mass=[0.3, 0.9]), "block.moment_of_inertia", "0.386667 is not allowed"),
    ],
)
def test_a_fault_of_the_block_names_its_key(change, key, said, fault_of):
    fault = fault_of(scene, **change)
    assert fault.key == key
    assert said in str(fault)


@pytest.mark.parametrize(
    ("change", "key", "said"),
    [
        (
            {"floor": {"friction": 0.3, "static_friction": 0.2}},
            "floor.static_friction",
            "at least the kinetic friction 0.3",
        ),
        ({"walls": [{"side": "up", "gap": 0.1}]}, "walls.0.side", "'left' or 'right'"),
        ({"walls": [{"side": "left", "gap": -0.1}]}, "walls.0.gap", "-0.1 is not allowed"),
        ({"walls": [{"side": "left", "gap": math.nan}]}, "walls.0.gap", "nan is not allowed"),
        *(
            (
                {"walls": [{"side": "left", "gap": 0.1, "restitution": value}]},
                "walls.0.restitution",
                "is not allowed",
            )
            for value in (math.nan, -0.01, 1.01, "0.5")
        ),
        (
            {"walls": [{"side": "left", "gap": 0.1}, {"side": "left", "gap": 0.2}]},
            "walls",
            "two walls on one side",
        ),
    ],
)
def test_a_fault_of_floor_or_walls_names_its_key(change, key, said, fault_of):
    fault = fault_of(scene, **change)
    assert fault.key == key
    assert said in str(fault)


@pytest.mark.parametrize(
    ("change", "key", "said"),
    [
        ({"excitation": {"kind": "quake"}}, "excitation", "ricker"),
        (
            {"excitation": {"kind": "rickr"}},
            "excitation",
            "did you mean 'ricker'? allowed: cosine, half-sine, record",
        ),
        ({"excitation": {"amplitude": 1.0}}, "excitation", "kind"),
        (
            {"excitation": {"kind": "sine", "amplitude": 1.0, "period": 1.0, "cycles": 0}},
            "excitation.cycles",
            "0 is not allowed",
        ),
        (
            {"excitation": {"kind": "record", "unscaled": [], "time_step": 0.1}},
            "excitation.unscaled",
            "at least 1",
        ),
        (
            {"excitation": {"kind": "record", "unscaled": [1.0, math.nan], "time_step": 0.1}},
            "excitation.unscaled.1",
            "nan",
        ),
        (
            {"excitation": {"kind": "record", "unscaled": [1.0], "time_step": 0.0}},
            "excitation.time_step",
            "0.0 is not allowed",
        ),
        ({"excitation": {"kind": "record", "file": 3}}, "excitation.file", "the path of a"),
        (
            {"excitation": {"kind": "record", "file": "a.csv", "unscaled": [0.1]}},
            "excitation.unscaled",
            "together with file",
        ),
        (
            {"excitation": {"kind": "record", "file": "a.csv", "time_step": -0.1}},
            "excitation.time_step",
            "-0.1 is not allowed",
        ),
        (
            {"excitation": {"kind": "record", "file": "a.csv", "unit": "furlong"}},
            "excitation.unit",
            "cm/s2",
        ),
        ({"vertical": {"kind": "ricker", "amplitude": 1.0}}, "vertical.period", "is missing"),
    ],
)
def test_a_fault_of_the_base_motion_names_its_key(change, key, said, fault_of):
    fault = fault_of(scene, **change)
    assert fault.key == key
    assert said in str(fault)


@pytest.mark.parametrize(
    ("change", "key", "said"),
    [
        ({"floors": {}}, "floors", "did you mean 'floor'? allowed: block, description, duration"),
        ({"initial_rotation": 1.6}, "initial_rotation", "1.6 is not allowed"),
        ({"initial_rotation": 0.1}, "initial_rotation", "inside the left wall"),
        ({"duration": 1e5, "output_step": 1e-3}, "output_step", "more than 5000000 samples"),
        ({"name": ""}, "name", "not allowed"),
        ({"name": "../etc"}, "name", "not allowed"),
        ({"name": "a\nb"}, "name", "not allowed"),
        ({"description": "x" * 501}, "description", "500"),
    ],
)
def test_a_fault_of_the_scene_itself_names_its_key(change, key, said, fault_of):
    fault = fault_of(scene, **change)
    assert fault.key == key
    assert said in str(fault)


def test_a_tilt_may_touch_a_wall_but_not_enter_it(fault_of):
    """Tilted by theta about its left corner, the top corner moves left by R sin(alpha + theta) - R
    sin(alpha - theta)."""
    alpha, tilt = PAPER_BLOCK.alpha, 0.03
    reach = PAPER_BLOCK.radius * (math.sin(alpha + tilt) - math.sin(alpha - tilt))
    far, near = ([Wall(side="left", gap=gap)] for gap in (reach, reach - 1e-6))
    # It may lean away from the wall as far.
    touching, _ = (scene(initial_rotation=one, walls=far) for one in (tilt, -tilt))
    x, _, theta, *_ = touching.initial_state
    left = kinematics.clearance(touching.block, "left", reach, x, theta)
    assert left == pytest.approx(0.0, abs=1e-15)
    assert fault_of(scene, initial_rotation=tilt, walls=near).key == "initial_rotation"


LOADED = Block(**BOX, mass=50.0, centre_of_mass=(0.1, -0.2), moment_of_inertia=15.0)


def test_a_homogeneous_block_is_written_as_ever():
    """Its tables, and so its hash, do not know of centre and moment of inertia; those of a loaded
    one do, and are read again."""
    assert scene().model_dump(mode="json")["block"] == {
        "half_width": 0.397,
        "half_height": 1.555,
        "mass": None,
    }
    assert Block(**BOX, centre_of_mass=(0.0, 0.0)) == Block(**BOX)
    tables = LOADED.model_dump(mode="json")
    assert tables == BOX | {"mass": 50.0, "centre_of_mass": [0.1, -0.2], "moment_of_inertia": 15.0}
    assert Block(**tables) == LOADED


def test_a_loaded_block_scaled_and_mirrored():
    twice = LOADED.scaled(2.0)
    mirrored = scene(block=LOADED, initial_rotation=-0.02).mirrored()
    for side, other in (("left", "right"), ("right", "left")):
        one, large = LOADED.pivot(side), twice.pivot(side)
        assert large.alpha == one.alpha
        assert large.radius == 2.0 * one.radius
        assert large.frequency_parameter(9.81) == pytest.approx(
            one.frequency_parameter(9.81) / math.sqrt(2.0), rel=1e-15
        )
        assert mirrored.block.pivot(other) == one
    assert mirrored.mirrored() == scene(block=LOADED, initial_rotation=-0.02)
    assert LOADED.slope == pytest.approx(0.3 / 0.8)
    assert LOADED.alpha == LOADED.pivot("right").alpha


def least_jam(block):
    """The least friction at which a slipping corner can jam: where some tilt leaves no push of the
    floor an effect (Painleve).

    A push N lifts the corner by (1/m + x (x - mu z)/I) N, with x and z the corner's distances from
    the mass's centre; all tilts, both corners.
    """
    tilts = np.linspace(0.0, math.pi / 2, 100_001)
    radius = np.array([[block.pivot(side).radius] for side in ("left", "right")])
    x, z = radius * np.sin(tilts), radius * np.cos(tilts)
    with np.errstate(divide="ignore"):
        return np.min((block.gyration_squared + x * x) / (x * z))


@pytest.mark.parametrize("centre", [(0.0, 0.0), (0.1, -0.2), (-0.15, 0.3)])
@pytest.mark.parametrize("inertia", [None, 0.05, 0.6])
def test_less_friction_than_painleves_jams_neither_corner(centre, inertia):
    block = Block(**BOX, centre_of_mass=centre, moment_of_inertia=inertia)
    assert block.least_painleve_friction == pytest.approx(least_jam(block), rel=1e-6)


def test_the_moment_of_inertia_is_at_most_that_of_mass_in_the_corners(fault_of):
    bound, centre = 0.4 * 0.4 + 1.0 - 0.1 * 0.1 - 0.2 * 0.2, (0.1, -0.2)
    for mass, inertia in ((2.0, bound - 1e-15), (1.0, bound)):
        given = Block(**BOX, mass=mass, centre_of_mass=centre, moment_of_inertia=mass * inertia)
        assert given.gyration_squared == inertia
    for wrong, key in (
        ({"centre_of_mass": centre, "moment_of_inertia": bound * (1.0 + 1e-9)}, "moment"),
        ({"centre_of_mass": centre, "moment_of_inertia": bound * 1.05}, "moment"),
        ({"centre_of_mass": (0.4, 0.0)}, "centre"),  # on the box's surface
        ({"centre_of_mass": (0.0, -1.0)}, "centre"),
    ):
        assert str(fault_of(Block, **BOX, **wrong)).startswith(key)


def test_a_block_as_large_as_a_hill_is_told():
    """200 mm that are written as 200. Of rows far apart nothing is said: extremes are exact."""
    blocks = [Block(half_width=size / 4, half_height=size) for size in (0.03, 0.2, 30.0, 200.0)]
    notes = [
        "".join(observation.scene_notes(scene(block=block, walls=[], output_step=0.05)))
        for block in blocks
    ]
    assert [note[:4] for note in notes] == ["", "", "", "the "]


def test_the_centres_of_mass_and_box():
    """Where the mass's centre is and how fast, by finite differences of a turned offset; and back
    to rounding. Energy is the mass's."""
    states, small = np.random.default_rng(1).normal(size=(20, 6)), 1e-6
    placed = kinematics.of_mass(LOADED, states)
    np.testing.assert_allclose(kinematics.of_box(LOADED, placed), states, atol=1e-15)
    np.testing.assert_allclose(
        (placed - states)[:, :2] @ [1.0, 1j], np.exp(1j * states[:, 2]) * (0.1 - 0.2j), atol=1e-15
    )
    later = states.copy()
    later[:, :3] += small * states[:, 3:]
    np.testing.assert_allclose(
        (kinematics.of_mass(LOADED, later)[:, :2] - placed[:, :2]) / small,
        placed[:, 3:5],
        atol=1e-5,
    )
    own = 0.5 * (placed[:, 3] ** 2 + placed[:, 4] ** 2 + 0.3 * placed[:, 5] ** 2) + 9.81 * (
        placed[:, 1] - 0.8
    )
    np.testing.assert_allclose(kinematics.energy(LOADED, 9.81, *states[:, 1:].T), own, atol=1e-13)
    assert kinematics.of_mass(PAPER_BLOCK, states) is states


def test_derived_quantities():
    block = PAPER_BLOCK
    assert block.alpha == pytest.approx(0.25, abs=1e-4)
    assert block.radius == pytest.approx(math.hypot(0.397, 1.555))
    assert block.frequency_parameter == pytest.approx(2.14, abs=5e-3)
    assert scene(gravity=1.62).frequency_parameter == pytest.approx(
        math.sqrt(0.75 * 1.62 / block.radius)
    )
    assert Floor(friction=0.3).mu_s == 0.3
    assert Floor(friction=0.3, static_friction=0.4).mu_s == 0.4
    assert scene().wall("left") == scene().walls[0]
    assert scene().wall("right") is None


@pytest.mark.parametrize(
    ("duration", "step", "rows"),
    [(1.0, 0.1, 11), (0.3, 0.1, 4), (1.0, 0.3, 4), (0.05, 0.1, 1), (36.0, 0.005, 7201)],
)
def test_output_times(duration, step, rows):
    np.testing.assert_allclose(
        scene(duration=duration, output_step=step).output_times, step * np.arange(rows), rtol=1e-9
    )


@pytest.mark.parametrize(
    ("duration", "step", "last"),
    [
        (1.0, 0.1, [0.9, 1.0]),
        (0.3, 0.1, [0.2, 0.3]),
        (1.0, 0.3, [0.9, 1.0]),
        (0.05, 0.1, [0, 0.05]),
    ],
)
def test_a_run_goes_to_the_scene_s_end(duration, step, last):
    times = scene(duration=duration, output_step=step).run_times
    np.testing.assert_allclose(times[-2:], last, rtol=1e-9)


def test_a_scene_begins_at_rest_and_upright_and_nothing_bounces_unless_it_says_so():
    made = scene(walls=[{"side": "left", "gap": 0.053}])
    assert made.initial_state == (0.0, 1.555, 0.0, 0.0, 0.0, 0.0)
    assert made.floor.restitution == made.walls[0].restitution == 0.0


def test_a_block_starts_tilted_by_less_than_a_right_angle(fault_of):
    for side in (1.0, -1.0):
        assert scene(walls=[], initial_rotation=side * 1.57).initial_rotation == side * 1.57
        fault_of(scene, walls=[], initial_rotation=side * 1.571)


@pytest.mark.parametrize(("friction", "share"), [(0.2, 0.2), (0.9, 0.397 / 1.555), (0.0, 0.01)])
def test_a_block_is_moved_by_sliding_or_by_uplift_and_on_ice_by_little(friction, share):
    made = scene(floor={"friction": friction})
    assert made.moving_acceleration == pytest.approx(9.81 * share)


def test_the_mirrored_scene_is_shaken_the_other_way():
    made = scene(initial_rotation=-0.1, initial_angular_velocity=0.2, initial_velocity=0.3)
    other = made.mirrored()
    assert other.excitation.acceleration(0.1) == -made.excitation.acceleration(0.1) != 0.0
    assert [wall.side for wall in other.walls] == ["right"]
    x, y, theta, x_dot, y_dot, theta_dot = made.initial_state
    assert other.initial_state == pytest.approx((-x, y, -theta, -x_dot, y_dot, -theta_dot))


@pytest.mark.parametrize("tilt", [0.0, 0.04, -0.2])
def test_initial_state_stands_on_its_pivot(tilt):
    made = scene(
        walls=[], initial_rotation=tilt, initial_angular_velocity=0.3, initial_velocity=0.2
    )
    x, y, theta, x_dot, y_dot, theta_dot = made.initial_state
    assert theta == tilt
    assert theta_dot == 0.3
    assert kinematics.slip(made.block, x, theta) == pytest.approx(0.0, abs=1e-15)
    assert kinematics.slip_rate(made.block, theta, x_dot, theta_dot) == pytest.approx(
        0.2, abs=1e-15
    )
    assert kinematics.pivot_height(made.block, y, theta) == pytest.approx(0.0, abs=1e-15)
    # The centroid's vertical velocity is that of a turn about the pivot.
    now, later = (
        made.block.radius * math.cos(made.block.alpha - abs(tilt + 0.3 * s)) for s in (0.0, 1e-7)
    )
    assert y_dot == pytest.approx((later - now) / 1e-7, abs=1e-6)


@pytest.mark.parametrize(
    ("act", "given", "said"),
    [
        (scene().replace, {"duration": -1.0}, "duration: -1.0 is not allowed"),
        (scene().excitation.scaled, {"factor": math.nan}, "amplitude: nan is not allowed"),
        (scene().excitation.stretched, {"factor": -1.0}, "period: -"),
        (
            Record.from_samples([1.0, 2.0], 0.1).scaled,
            {"factor": math.inf},
            "scale: inf is not allowed",
        ),
        (
            Record.from_samples([1.0, 2.0], 0.1).stretched,
            {"factor": 0.0},
            "time_step: 0.0 is not allowed",
        ),
        (LOADED.scaled, {"factor": -1.0}, "half_width: -"),
    ],
)
def test_a_change_is_validated(act, given, said, fault_of):
    assert str(fault_of(act, **given)).startswith(said)
