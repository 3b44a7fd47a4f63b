"""The lower corner of a loaded block, and a block that stands flush with a wall. Natural units."""

import math

import pytest
from stepping import run_at, setting_of

from rockcheck.ebm.core import contacts
from rockcheck.scenes import Block, Wall


@pytest.mark.parametrize(("tilt", "arm"), [(0.1, 0.8), (-0.1, 0.6), (0.0, 0.6)])
def test_a_loaded_block_has_its_centre_over_the_corner_to_which_it_tips(tilt, arm):
    """The centre is 0.6 m from the right side, 0.8 m from the left one and from the floor.
    Upright it is as high over both corners."""
    block = Block(half_width=0.7, half_height=0.8, centre_of_mass=(0.1, 0.0))
    motion = run_at((0.0, 0.0, tilt, 0.0, 0.0, 0.0)).state.motion
    over = 0.8 * math.cos(tilt) + arm * math.sin(abs(tilt))
    assert contacts.height(setting_of(block), motion) == pytest.approx(over, abs=1e-15)


@pytest.mark.parametrize(("side", "place"), [("left", -0.1), ("right", 0.1)])
@pytest.mark.parametrize("off", [5e-11, -5e-11])
def test_a_block_that_lands_flush_with_a_wall_touches_it_exactly(off, side, place):
    block = setting_of(0.4, walls=[Wall(side=side, gap=0.1)])
    motion = run_at((place + off, math.cos(0.4), 0.0, 0.0, 0.0, 0.0)).state.motion
    contacts.land_upright(block, motion, 1, True)
    assert motion.x == place
