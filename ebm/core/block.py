"""The block with its floor and walls, a record that compiled code reads by name: SETTING."""

import math

from rockcheck.scenes.compiled import inner_kernel
from rockcheck.scenes.named_record import record

#: One side of the block as it stands: its lower corner, which is the pivot where the block tips to
#: that side, and its top corner.
SIDE = record(
    # Angle from the upright and distance of the lower corner, seen from the mass's centre.
    alpha="f8",
    radius="f8",
    # Horizontal distance of the corners from the mass's centre, and vertical one of the lower
    # corner, where the block stands.
    arm="f8",
    height="f8",
    # As alpha and radius, of the top corner.
    top_alpha="f8",
    top_radius="f8",
    # The arms of corners on a wall, s' and c', are linear in those of the pivot, s' = S c - C s and
    # c' = S s + C c, with (S, C) = (tip_sin, tip_cos) for the top corner of this side and (far_sin,
    # far_cos) for the lower corner of the other one.
    tip_sin="f8",
    tip_cos="f8",
    far_sin="f8",
    far_cos="f8",
    # 1/(I + R^2): 3/4 for a homogeneous block.
    share="f8",
    # Of the wall on this side: its gap, infinite where there is none, and its restitution.
    gap="f8",
    e="f8",
)
#: Block, floor and walls in natural units.
SETTING = record(
    left=SIDE,
    right=SIDE,
    # Height of the mass's centre where the block stands.
    height="f8",
    # Height of the box's top over the mass's centre.
    top="f8",
    # 1/I.
    spin="f8",
    mu_s="f8",
    mu_k="f8",
    e_floor="f8",
    walls="?",
    # The pivot sticks whatever the friction force (Housner's block): no slip guard.
    no_slip="?",
    # The floor can only push (otherwise it can also hold the pivot down: the paper's model).
    unilateral="?",
    # An impact that would add energy uses the largest restitution that does not, instead of e.
    energy_cap="?",
    # The law of impacts at several contacts, a Law; the bilateral pivot needs none.
    law="i8",
    # Of Bouc-Wen friction: the yield displacement.
    yields="f8",
)
#: Static friction of a frictionless floor. With less, rounding in the tail of a base acceleration
#: would move a resting block.
LEAST_FRICTION = 1e-9


@inner_kernel
def side_of(block, sense):
    """The side to which a block tips whose rotation has this sign."""
    return block.left if sense > 0 else block.right


@inner_kernel
def arm_of(side, phi):
    """Horizontal distance of the lower corner from the mass's centre of a block tipped by phi.

    It tips to this side; with phi below 0 to the other one.
    """
    return side.arm if phi == 0.0 else side.radius * math.sin(side.alpha - phi)


@inner_kernel
def height_of(side, phi):
    """Height of the mass's centre over the lower corner, of the same block."""
    return side.height if phi == 0.0 else side.radius * math.cos(side.alpha - phi)


@inner_kernel
def wall_corner(faces, tips):
    """Distance from the mass's centre and angle of the corner that a wall meets.

    It is on the side that faces the wall: the top one where the block tips to that side.
    """
    return (faces.top_radius, faces.top_alpha) if tips else (faces.radius, faces.alpha)


@inner_kernel
def wall_turn(side, tip):
    """(S, C) of the corner on the tip wall, or on the far wall (see SIDE)."""
    return (side.tip_sin, side.tip_cos) if tip else (side.far_sin, side.far_cos)
