"""Newton-Euler for a block with given contacts, against which the histories of `ebm` are checked.

It is solved by other means than in `ebm`. Natural units: lengths in R, accelerations in g, unit
mass; xi and y are those of the mass's centre. As in `ebm.core.motion`, a tilted block is seen in
the frame of its pivot, which is then the lower-left corner: with S = sign theta and phi = |theta|,
that corner is s to the left of the mass's centre and c below it (`Arms`). The top corner is s' to
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
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import Block, History, Scene, kinematics

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
#: A contact is closed, R, and a pivot slips, sqrt(g R), beyond these.
CLOSED, SLIPS = 1e-8, 1e-9


@dataclass(frozen=True)
class Forces:
    """Contact forces per unit weight, one value a row; zero where there is no contact."""

    normal: Floats
    friction: Floats
    tip: Floats
    far: Floats


@dataclass(frozen=True)
class Arms:
    """Where three corners are from the mass's centre, one value a row, and 1/I."""

    pivot: tuple[Floats, Floats]
    tip: tuple[Floats, Floats]
    far: tuple[Floats, Floats]
    spin: float


def arms(block: Block, sign: Floats, phi: Floats) -> Arms:
    """The arms of a block whose rotation has the sign `sign` and the size `phi`."""
    unit, left, right = block.radius, block.pivot("left"), block.pivot("right")
    near = np.where(sign > 0.0, left.arm, right.arm) / unit
    other = (left.arm + right.arm) / unit - near
    low, top = left.height / unit, (2.0 * block.half_height - left.height) / unit
    sine, cosine = np.sin(phi), np.cos(phi)
    return Arms(
        pivot=(near * cosine - low * sine, near * sine + low * cosine),
        tip=(near * cosine + top * sine, top * cosine - near * sine),
        far=(other * cosine + low * sine, low * cosine - other * sine),
        spin=unit**2 / block.gyration_squared,
    )


def tilted_forces(
    at: Arms,
    mu: float,
    w: Floats,
    u: Floats,
    g: Floats,
    touching: tuple[Mask, Mask, Mask],
    slip: NDArray[np.int8],
) -> Forces:
    """Forces of a tilted block.

    `w`: rate of rotation; `u`, `g`: base acceleration and gravity felt, all in the pivot's frame.
    `touching`: pivot on the floor, top corner on its wall, bottom corner on its wall. `slip`:
    direction in which the pivot slips, 0 where it sticks. A slipping pivot has Q = -mu d |P|: where
    P would pull, the sign of its friction turns with it. Near Painleve's limit both signs of P can
    solve this; it is then the pull that is returned where only with it the walls push.
    """
    (s, c), (tip_s, tip_c), (far_s, far_c) = at.pivot, at.tip, at.far
    zero, one = np.zeros_like(w), np.ones_like(w)
    jacobian = (zero, one, -s), (one, zero, c), (one, zero, -tip_c), (-one, zero, -far_c)
    rows = np.stack([np.stack(row, axis=1) for row in jacobian], axis=1)
    bias = np.stack([c, s, tip_s, far_s], axis=1) * (w * w)[:, None]
    floor, tip, far = touching
    closed = np.stack([floor, floor & (slip == 0), tip, far], axis=1)
    # J M^-1 J^T lambda = -(J a0 + bias), with an open contact's row replaced by "no force".
    inverse_mass = np.array([1.0, 1.0, at.spin])
    matrix = np.einsum("nik,k,njk->nij", rows, inverse_mass, rows)
    free = np.stack([-u, -g, zero], axis=1)
    right = -(np.einsum("nik,nk->ni", rows, free) + bias)
    matrix = np.where(closed[:, :, None], matrix, np.eye(4))
    right = np.where(closed, right, 0.0)
    slipping = floor & (slip != 0)
    matrix[slipping, 1, 0] = mu * slip[slipping]
    forces = _solved(matrix, right)
    asked = slipping & ((forces[:, 0] < 0.0) | (forces[:, 2:].min(axis=1) < 0.0))
    if asked.any():
        matrix[asked, 1, 0] *= -1.0
        other = forces.copy()
        other[asked] = _solved(matrix[asked], right[asked])
        pulls = asked & (
            (forces[:, 0] < 0.0) | ((other[:, 0] < 0.0) & (other[:, 2:].min(axis=1) >= 0.0))
        )
        forces[pulls] = other[pulls]
    return Forces(*forces.T)


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
    columns = (one for one in history.channels.values() if one.dtype.kind == "f")
    return float(sum(np.sum(~np.isfinite(column)) for column in columns))


class Motion(NamedTuple):
    """A history as the invariants see it, one value a row, in natural units.

    Only `channels`, those of the history, keep its units. `radius` (m) and `unit` (s) are the units
    of length and time. `u` and `vertical` accelerate the base; `w` is the rate of rotation, `slip`
    that of slip. `sign` is the sign of theta in each row; where theta is zero, the sign in the next
    row, as a block that is about to tilt has its pivot already. `energy` (J/kg) is kinetic plus
    potential; the mass's centre moves at `across` and `up`, m/s. `height` is the lowest corner's
    over the floor, `gaps` are those to the walls. `tip` tells where the top corner touches the wall
    it tips to, `far` where the lifted bottom corner touches the other.
    """

    scene: Scene
    history: History
    channels: Mapping[str, Any]
    radius: float
    unit: float
    u: Floats
    vertical: Floats
    w: Floats
    slip: Floats
    sign: Floats
    energy: Floats
    across: Floats
    up: Floats
    height: Floats
    gaps: dict[str, Floats]
    tip: Mask
    far: Mask

    @property
    def deepest(self) -> float:
        """How deep a corner is in floor or wall at most, R."""
        return max(float(np.max(-gap)) for gap in (self.height, *self.gaps.values()))

    def within(self, *modes: str) -> Mask:
        """The rows in these modes of motion."""
        return np.isin(self.channels["mode"], modes)

    def forces(
        self, rows: Mask, slip: Floats, *, later: float = 0.0, faster: float = 0.0
    ) -> tuple[Arms, Forces]:
        """The arms and forces in these rows, in which the block is tilted.

        `slip` is as in `tilted_forces`. The block is turned on by its rate for the time `later`;
        for the forces, `faster` is added to the rate.
        """
        sign, walls, on = self.sign, self.within("lean", "ladder"), np.ones(int(rows.sum()), bool)
        w = (sign * self.w)[rows]
        at = arms(self.scene.block, sign[rows], np.abs(self.channels["theta"])[rows] + later * w)
        tip, far = ((contact & walls)[rows] for contact in (self.tip, self.far))
        felt = (sign * self.u)[rows], (1.0 + self.vertical)[rows]
        friction, direction = self.scene.floor.friction, slip[rows].astype(np.int8)
        return at, tilted_forces(at, friction, w + faster, *felt, (on, tip, far), direction)


def motion_of(scene: Scene, history: History) -> Motion:
    """The `Motion` of a history whose values are finite."""
    channels, block, radius, gravity = (
        history.channels,
        scene.block,
        scene.block.radius,
        scene.gravity,
    )
    unit, t, theta = math.sqrt(radius / gravity), channels["t"], channels["theta"]
    state = [channels[name] for name in ("y", "theta", "x_dot", "y_dot", "theta_dot")]
    sign = np.sign(theta)
    standing = np.flatnonzero(sign[:-1] == 0.0)
    sign[standing] = sign[standing + 1]
    sign = np.where(sign < 0.0, -1.0, 1.0)
    gaps: dict[str, Floats] = {
        wall.side: kinematics.wall_gap(scene, wall.side, channels["x"], theta) / radius
        for wall in scene.walls
    }
    nowhere = np.full(len(t), np.inf)
    left, right = (gaps.get(side, nowhere) < CLOSED for side in ("left", "right"))
    _, across, up = kinematics.mass_motion(block, *state)
    return Motion(
        scene=scene,
        history=history,
        channels=channels,
        radius=radius,
        unit=unit,
        u=scene.excitation.acceleration(t) / gravity,
        vertical=scene.vertical.acceleration(t) / gravity,
        w=channels["theta_dot"] * unit,
        slip=channels["slip_rate"] * unit / radius,
        sign=sign,
        energy=np.asarray(kinematics.energy(block, gravity, *state)),
        across=np.asarray(across),
        up=np.asarray(up),
        height=np.asarray(kinematics.pivot_height(block, channels["y"], theta) / radius),
        gaps=gaps,
        tip=np.where(sign > 0, left, right),
        far=np.where(sign > 0, right, left),
    )
