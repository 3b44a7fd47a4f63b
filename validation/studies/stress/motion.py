"""A history as the invariants see it: natural units, contacts, energy, forces.

In: a scene and its history. Out: `Motion`. Called by every check of a run.
"""

import math

import numpy as np

from rockcheck.scenes import (
    Floats,
    History,
    Scene,
    kinematics,
)
from rockcheck.validation.studies.stress.forces import Mask, tilted_forces

#: A contact is closed, R, and a pivot slips, sqrt(g R), beyond these.
CLOSED, SLIPS = 1e-8, 1e-9


def not_finite(history: History) -> float:
    """The number of values that are not finite."""
    return float(
        sum(
            np.sum(~np.isfinite(column))
            for column in history.channels.values()
            if column.dtype.kind == "f"
        )
    )


class Motion:
    """A history of finite values as the invariants see it, one value a row, in natural units.

    Only `channels`, those of the history, keep its units. `radius` (m) and `unit` (s) are the units
    of length and time. `u` and `vertical` accelerate the base; `w` is the rate of rotation, `slip`
    that of slip. `sign` is the sign of theta in each row; where theta is zero, the sign in the next
    row, as a block that is about to tilt has its pivot already. `energy` (J/kg) is kinetic plus
    potential; the mass's centre moves at `across` and `up`, m/s. `height` is the lowest corner's
    over the floor, `gaps` are those to the walls, `deepest` is how deep a corner is in either.
    `tip` tells where the top corner touches the wall it tips to, `far` where the lifted bottom
    corner touches the other.
    """

    def __init__(self, scene: Scene, history: History) -> None:
        block, gravity, channels = scene.block, scene.gravity, history.channels
        t, theta = channels["t"], channels["theta"]
        self.scene, self.history, self.channels = scene, history, channels
        self.radius, self.unit = block.radius, math.sqrt(block.radius / gravity)
        self.u: Floats = scene.excitation.acceleration(t) / gravity
        self.vertical: Floats = scene.vertical.acceleration(t) / gravity
        self.w: Floats = channels["theta_dot"] * self.unit
        self.slip: Floats = channels["slip_rate"] * self.unit / self.radius
        sign = np.sign(theta)
        standing = np.flatnonzero(sign[:-1] == 0.0)
        sign[standing] = sign[standing + 1]
        self.sign = np.where(sign < 0.0, -1.0, 1.0)
        state = [channels[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot")]
        self.energy: Floats = kinematics.energy(block, gravity, *state)
        self.across, self.up = kinematics.mass_motion(block, *state)[1:]
        self.height: Floats = kinematics.pivot_height(block, channels["y"], theta) / self.radius
        self.gaps: dict[str, Floats] = {
            wall.side: kinematics.clearance(scene.block, wall.side, wall.gap, channels["x"], theta)
            / self.radius
            for wall in scene.walls
        }
        self.deepest = max(float(np.max(-gap)) for gap in (self.height, *self.gaps.values()))
        left, right = (
            self.gaps.get(side, np.full(len(t), np.inf)) < CLOSED for side in ("left", "right")
        )
        self.tip, self.far = np.where(sign < 0.0, (right, left), (left, right))

    def within(self, *modes: str) -> Mask:
        """The rows in these modes of motion."""
        return np.isin(self.channels["mode"], modes)

    def forces(
        self, rows: Mask, slip: Floats, *, later: float = 0.0, faster: float = 0.0
    ) -> tuple[Floats, Floats]:
        """What `tilted_forces` says of these rows, in which the block is tilted.

        `slip` is as there. The block is turned on by its rate for the time `later`; for the forces,
        `faster` is added to the rate.
        """
        sign, walls, on = self.sign, self.within("lean", "ladder"), np.ones(int(rows.sum()), bool)
        w = (sign * self.w)[rows]
        tip, far = ((contact & walls)[rows] for contact in (self.tip, self.far))
        return tilted_forces(
            self.scene.block,
            (sign[rows], np.abs(self.channels["theta"])[rows] + later * w),
            self.scene.floor.friction,
            w + faster,
            ((sign * self.u)[rows], (1.0 + self.vertical)[rows]),
            (on, tip, far),
            slip[rows].astype(np.int8),
        )
