"""Contact forces of a tilted block by Newton-Euler, solved by other means than in `ebm`.

In: a block, its tilt and rates, and which contacts are closed. Out: four forces for each row.
Called by `motion`.

The histories of `ebm` are checked against Newton-Euler for a block with given contacts, solved by
other means than in `ebm`. The mass is 1; xi and y are those of its centre. As in `ebm.core.motion`,
a tilted block is seen in the frame of its pivot, which is then the lower-left corner: with S = sign
theta and phi = |theta|, that corner is s to the left of the mass's centre and c below it. The top
corner is s' to the left and c' above, the lifted bottom corner s' to the right and c' below. Four
contact forces can act: P and Q of the floor on the pivot, N of the wall that the top corner
touches, M of the wall that the lifted bottom corner touches. The gap of each contact, its row J
(xi, y, phi) and the part of its acceleration that the velocities alone give:

    P  y - c             (0, 1, -s)      c w^2
    Q  xi - s            (1, 0, c)       s w^2
    N  xi + delta - s'   (1, 0, -c')     s' w^2
    M  delta - xi - s'   (-1, 0, -c')    s' w^2
"""

import numpy as np
from numpy.typing import NDArray

from rockcheck.scenes import (
    Block,
    Floats,
)

Mask = NDArray[np.bool_]


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
    right_side = np.where(closed, -(np.einsum("nik,nk->ni", rows, free) + bias), 0.0)
    matrix = np.where(closed[:, :, None], matrix, np.eye(4))
    slipping = floor & (slip != 0)
    matrix[slipping, 1, 0] = mu * slip[slipping]
    forces = _solved(matrix, right_side)
    doubtful = slipping & ((forces[:, 0] < 0.0) | (forces[:, 2:].min(axis=1) < 0.0))
    matrix[doubtful, 1, 0] *= -1.0
    other_sign = forces.copy()
    other_sign[doubtful] = _solved(matrix[doubtful], right_side[doubtful])
    pulls = doubtful & (
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
