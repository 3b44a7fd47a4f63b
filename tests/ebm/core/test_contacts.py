"""The corners of a loaded block, and a block that stands flush with a wall. Natural units."""

import math

import numpy as np
import pytest
from stepping import run_at, setting_of

from rockcheck.ebm.core import block, contact_impacts, contacts
from rockcheck.scenes import Block, Wall

#: Its mass's centre is 0.6 m from the right side, 0.8 m from the left one, and 0.8 m from the floor
#: and from the top.
LOADED = Block(half_width=0.7, half_height=0.8, centre_of_mass=(0.1, 0.0))


@pytest.mark.parametrize(("tilt", "arm"), [(0.1, 0.8), (-0.1, 0.6), (0.0, 0.6)])
def test_a_loaded_block_has_its_centre_over_the_corner_to_which_it_tips(tilt, arm):
    """Upright it is as high over both corners."""
    motion = run_at((0.0, 0.0, tilt, 0.0, 0.0, 0.0)).state.motion
    over = 0.8 * math.cos(tilt) + arm * math.sin(abs(tilt))
    assert contacts.height(setting_of(LOADED), motion) == pytest.approx(over, abs=1e-15)


@pytest.mark.parametrize("sense", [1, -1])
def test_where_it_stands_it_is_as_far_from_its_corners_as_just_before(sense):
    """To the bit: a step that begins upright continues the one that ends there."""
    side = block.side_of(setting_of(LOADED), sense)
    assert block.arm_of(side, 0.0) == side.radius * math.sin(side.alpha)
    assert block.height_of(side, 0.0) == side.radius * math.cos(side.alpha)


@pytest.mark.parametrize(("side", "place"), [("left", -0.1), ("right", 0.1)])
@pytest.mark.parametrize("off", [5e-11, -5e-11])
def test_a_block_that_lands_flush_with_a_wall_touches_it_exactly(off, side, place):
    setting = setting_of(0.4, walls=[Wall(side=side, gap=0.1)])
    motion = run_at((place + off, math.cos(0.4), 0.0, 0.0, 0.0, 0.0)).state.motion
    contacts.land_upright(setting, motion, 1, True)
    assert motion.x == place


@pytest.mark.parametrize(("on_floor", "height"), [(True, math.cos(0.4)), (False, 1.5)])
def test_a_block_that_turns_upright_on_the_floor_stands_on_it(on_floor, height):
    motion = run_at((0.0, 1.5, 1e-7, 0.0, 0.0, 0.0)).state.motion
    contacts.land_upright(setting_of(0.4), motion, 1, on_floor)
    assert motion.theta == 0.0
    assert motion.y == height


@pytest.mark.parametrize(("sense", "near", "away"), [(1, 0.8, 0.6), (-1, 0.6, 0.8)])
def test_a_turn_moves_each_corner_across_its_arm(sense, near, away):
    """A corner at (x, y) from the mass's centre moves with (-y, x) times the rate. `near` is the
    arm of the side to which the block tips."""
    phi, rows = 0.2, np.empty((7, 3))
    across = np.array([-near, away, -near, -near, away, away])
    upward = 0.8 * np.array([-1, -1, 1, -1, -1, 1])
    x = across * math.cos(phi) - upward * math.sin(phi)
    y = across * math.sin(phi) + upward * math.cos(phi)
    contact_impacts.contact_rows(setting_of(LOADED), sense, phi, True, rows)
    turns = [*x[:2], *-y[2:4], *y[4:], -y[0]]
    assert rows[:, 2] == pytest.approx(turns, abs=1e-15)
