"""The candidates of a selection and their order; which corner rests on a wall, which gap is a
landing. Natural units."""

import math

import numpy as np
import pytest
from situations import Core, upright
from stepping import TILTED, run_at, setting_of

from rockcheck.ebm.core import contacts, modes, series, strike
from rockcheck.ebm.core.names import Family, Guard, Pivot
from rockcheck.scenes import Wall


def test_candidates_have_the_values_of_their_fields():
    candidates = modes._CANDIDATES[1]
    flat = candidates[candidates["family"] == Family.FLAT]
    assert set(candidates["sense"]) == {1, -1}
    assert set(candidates["pull"]) == {1, -1}
    assert set(candidates["slip"]) == {-1, 0, 1}
    assert set(candidates["tip"]) == {0, 1}
    assert set(candidates["far"]) == {0, 1}
    assert set(flat["sense"]) == {1}
    assert set(flat["tip"] + 2 * flat["far"]) == {0, 1, 2, 3}


def test_the_right_side_is_tried_first_as_the_mirror_image_of_the_left_one():
    """A tilted mode in its pivot's frame is its own mirror image."""
    left, right = modes._CANDIDATES[1].copy(), modes._CANDIDATES[-1]
    flat = left["family"] == Family.FLAT
    left["sense"][~flat] *= -1
    left["slip"][flat] *= -1
    left["tip"][flat], left["far"][flat] = left["far"][flat], left["tip"][flat].copy()
    np.testing.assert_array_equal(left, right)


def test_where_nothing_favours_a_side_the_left_one_is_tried_first():
    at = upright(0.0, 1.0, 0.3, 0.5, 0.5)
    core, run = Core(at, "bilateral"), run_at(at.state)
    touching = modes._touching(core.setting, core.base, run.state)
    assert touching.favoured == 0
    assert touching.first == 1


@pytest.mark.parametrize(("x", "side"), [(0.1, 1), (-0.1, -1), (1e-15, 0), (-1e-15, 0)])
def test_where_the_base_does_not_decide_the_block_s_place_does(x, side):
    """A block that stands to the right tips to the left; a place of rounding is none."""
    at = upright(0.0, 1.0, 0.3, 0.5, 0.5)
    core, run = Core(at, "bilateral"), run_at((x, *at.state[1:]))
    assert modes._touching(core.setting, core.base, run.state).favoured == side


@pytest.mark.parametrize(
    ("guard", "winds", "violation"),
    [(Guard.SLIP, False, math.inf), (Guard.SLIP, True, 0.0), (Guard.CONE_PLUS, False, 0.0)],
)
def test_a_pivot_whose_slip_stays_zero_does_not_slip(guard, winds, violation):
    """Unless it has not yielded (Bouc-Wen). A force that stays zero ends nothing."""
    run = run_at(**TILTED, sense=1, pivot=Pivot.SLIPPING, slip=1)
    run.state.winds = winds
    order, ahead = 6, series.AHEAD
    found = modes._guard_violation(run.state, guard, order, ahead, run.a, False)
    assert found == violation


def test_no_mode_is_selected_for_a_motion_that_is_not_finite():
    at = upright(0.0, 1.0, 0.3, 0.5, 0.5)
    core, run = Core(at, "bilateral"), run_at((math.nan, math.nan, math.nan, 0.0, 0.0, 0.0))
    assert not modes.select(core.setting, core.base, run)


@pytest.mark.parametrize("rests", ["top", "bottom"])
@pytest.mark.parametrize(("side", "sign"), [("left", 1), ("right", -1)])
def test_of_a_block_that_turns_flush_with_a_wall_that_corner_rests_which_does_not_move(
    side, sign, rests
):
    """Upright, both corners touch: x_dot of one is zero, the other one moves."""
    block = setting_of(0.4, walls=[Wall(side=side, gap=0.1)])
    arm = math.cos(0.4) if rests == "top" else -math.cos(0.4)
    motion = run_at((-0.1 * sign, math.cos(0.4), 0.0, 0.3 * arm, 0.0, 0.3)).state.motion
    assert contacts.closed_wall(block, motion, sign, True) == (rests == "bottom")
    assert contacts.closed_wall(block, motion, sign, False) == (rests == "top")
    assert not contacts.closed_wall(block, motion, -sign, False)
    assert modes.touched_walls(block, motion, sign, False) == (rests == "top")
    assert modes.touched_walls(block, motion, -sign, False) == 2 * (rests == "bottom")


@pytest.mark.parametrize(
    ("theta", "spin", "slip", "lies"),
    [
        (9e-6, -0.01, 0.0, True),
        (9e-6, -0.01, 1e-7, True),
        (9e-6, -0.01, -1e-6, False),
        (9e-6, -2.0, -2e-5, True),
        (9e-6, 0.01, 0.0, False),
        (2e-5, -0.01, 0.0, False),
    ],
)
@pytest.mark.parametrize("sign", [1, -1])
def test_a_far_gap_that_closes_near_upright_is_a_landing(sign, theta, spin, slip, lies):
    """Below 1e-5 rad, and where the pivot slips by less than 1e-10 until the block has landed."""
    block, alpha = setting_of(0.4), 0.4
    s, c = math.sin(alpha - theta), math.cos(alpha - theta)
    motion = (0.0, c, sign * theta, sign * (slip - c * spin), s * spin, sign * spin)
    state = run_at(motion, **TILTED, sense=sign, pivot=Pivot.SLIPPING).state
    assert strike._lands_along(block, state) == lies
    state.motion.y += 1e-9
    assert not strike._lands_along(block, state)
