"""Newton-Euler for a block with given contacts, against which the histories of `ebm` are checked.

It is solved by other means than in `ebm`. Natural units: lengths in R, accelerations in g, unit
mass; xi and y are those of the mass's centre. As in `ebm.core.motion`, a tilted block is seen in
the frame of its pivot, which is then the lower-left corner: with S = sign theta and phi = |theta|,
that corner is s to the left of the mass's centre and c below it. The top corner is s' to
the left and c' above, the lifted bottom corner s' to the right and c' below. Four contact forces
can act: P and Q of the floor on the pivot, N of the wall that the top corner touches, M of the wall
that the lifted bottom corner touches. The gap of each contact, its row J (xi, y, phi) and the part
of its acceleration that the velocities alone give:

    P  y - c             (0, 1, -s)      c w^2
    Q  xi - s            (1, 0, c)       s w^2
    N  xi + delta - s'   (1, 0, -c')     s' w^2
    M  delta - xi - s'   (-1, 0, -c')    s' w^2
"""

import math

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Block, Floats, History, Scene, kinematics

Mask = NDArray[np.bool_]
#: A contact is closed, R, and a pivot slips, sqrt(g R), beyond these.
CLOSED, SLIPS = 1e-8, 1e-9


def tilted_forces(
    block: Block,
    tilt: tuple[Floats, Floats],
    mu: float,
    w: Floats,
    felt: tuple[Floats, Floats],
    touching: tuple[Mask, Mask, Mask],
    slip: NDArray[np.int8],
) -> tuple[Floats, Floats]:
    """Forces P, Q, N, M of a tilted block per unit weight (4, ...), and what P and Q turn it by.

    The second is the part of phi's acceleration that the floor's forces give. `tilt`: sign and size
    of the rotation; `w`: its rate; `felt`: base acceleration and gravity felt; all but the sign in
    the pivot's frame. `touching`: pivot on the floor, top corner on its wall, bottom corner on its
    wall; no force where there is no contact. `slip`: direction in which the pivot slips, 0 where it
    sticks. A slipping pivot has Q = -mu d |P|: where P would pull, the sign of its friction turns
    with it. Near Painleve's limit both signs of P can solve this; it is then the pull that is
    returned where only with it the walls push.
    """
    (sign, phi), unit = tilt, block.radius
    left, right = block.pivot("left"), block.pivot("right")
    near = np.where(sign > 0.0, left.arm, right.arm) / unit
    other = (left.arm + right.arm) / unit - near
    low, top = left.height / unit, (2.0 * block.half_height - left.height) / unit
    sine, cosine = np.sin(phi), np.cos(phi)
    s, c = near * cosine - low * sine, near * sine + low * cosine
    tip_s, tip_c = near * cosine + top * sine, top * cosine - near * sine
    far_s, far_c = other * cosine + low * sine, low * cosine - other * sine
    spin = unit**2 / block.gyration_squared
    zero, one = np.zeros_like(w), np.ones_like(w)
    jacobian = (zero, one, -s), (one, zero, c), (one, zero, -tip_c), (-one, zero, -far_c)
    rows = np.stack([np.stack(row, axis=1) for row in jacobian], axis=1)
    bias = np.stack([c, s, tip_s, far_s], axis=1) * (w * w)[:, None]
    floor, tip, far = touching
    closed = np.stack([floor, floor & (slip == 0), tip, far], axis=1)
    # J M^-1 J^T lambda = -(J a0 + bias), with an open contact's row replaced by "no force".
    matrix = np.einsum("nik,k,njk->nij", rows, np.array([1.0, 1.0, spin]), rows)
    free = np.stack([-felt[0], -felt[1], zero], axis=1)
    given = np.where(closed, -(np.einsum("nik,nk->ni", rows, free) + bias), 0.0)
    matrix = np.where(closed[:, :, None], matrix, np.eye(4))
    slipping = floor & (slip != 0)
    matrix[slipping, 1, 0] = mu * slip[slipping]
    forces = _solved(matrix, given)
    asked = slipping & ((forces[:, 0] < 0.0) | (forces[:, 2:].min(axis=1) < 0.0))
    matrix[asked, 1, 0] *= -1.0
    other_sign = forces.copy()
    other_sign[asked] = _solved(matrix[asked], given[asked])
    pulls = asked & (
        (forces[:, 0] < 0.0) | ((other_sign[:, 0] < 0.0) & (other_sign[:, 2:].min(axis=1) >= 0.0))
    )
    forces[pulls] = other_sign[pulls]
    return forces.T, spin * (c * forces[:, 1] - s * forces[:, 0])


def _solved(matrix: Floats, right: Floats) -> Floats:
    """Solves one system for each row.

    Where contacts are parallel to rounding (a corner just off its wall), takes the least forces.
    """
    try:
        return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.asarray((np.linalg.pinv(matrix) @ right[:, :, None])[:, :, 0])


#: Weights of the closed Newton-Cotes rule with nine nodes, which is exact up to degree 9.
NEWTON_COTES = (
    np.array([989.0, 5888.0, -928.0, 10496.0, -4540.0, 10496.0, -928.0, 5888.0, 989.0])
    * 4.0
    / 14175.0
)
GROUP = len(NEWTON_COTES) - 1
#: The same interval by Boole's rule twice, exact up to degree 5. The difference of the two rules
#: estimates the error.
BOOLE = np.array([7.0, 32.0, 12.0, 32.0, 14.0, 32.0, 12.0, 32.0, 7.0]) * 2.0 / 45.0


def integrals(step: float, values: Floats, rule: Floats = NEWTON_COTES) -> Floats:
    """Integrals of `values`, at multiples of `step`, over each group of eight steps.

    Steps beyond the last whole group are left out.
    """
    groups = (len(values) - 1) // GROUP
    nodes = values[np.arange(groups)[:, None] * GROUP + np.arange(GROUP + 1)]
    return np.asarray(step * (nodes @ rule))


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
