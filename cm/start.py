"""How a run begins.

In: a scene, the stiffness of contacts (1/s^2), the longest step (s), the rule of damping.
Out: the constants of the run, and its state at t = 0.
Called by `cm.model`, once a run.
"""

import math

import numpy as np

from rockcheck.cm.contact_law import damping_ratio, damping_ratio_of_paper, least_restitution
from rockcheck.cm.extremes import FLAT_SHARE, extremes_at_start
from rockcheck.cm.geometry import FLOOR, LEFT_WALL, RIGHT_WALL, SURFACES
from rockcheck.cm.impacts import STRIKE_TIME, YOUNG
from rockcheck.cm.state import CONTACT, STATE, Parameters
from rockcheck.scenes import Block, Scene, Side, kinematics
from rockcheck.scenes.named_record import MOTION, filled

#: Damping of the floor's friction spring in units of sqrt(k/m): so stiff, also beside the damper of
#: an impact without restitution, that friction follows the normal force without lag.
FRICTION_DAMPING = 1e5
#: A surface within this distance (m) of the block at the start is touched, unless it is struck.
TOUCHING = 1e-9
WALLS: dict[Side, int] = {"left": LEFT_WALL, "right": RIGHT_WALL}


def parameters_of(scene: Scene, stiffness: float, time_step: float, calibrated: bool) -> Parameters:
    """The constants of a run; the damping of contacts is `calibrated`, or the paper's."""
    block = scene.block
    b, h, (dx, dz) = block.half_width, block.half_height, block.offset
    restitution = [0.0, 0.0, scene.floor.restitution]
    distance = [math.inf, math.inf, 0.0]
    for wall in scene.walls:
        restitution[WALLS[wall.side]] = wall.restitution
        distance[WALLS[wall.side]] = b + wall.gap
    if calibrated:
        least = least_restitution(stiffness, scene.frequency_parameter)
        damping_ratios = [damping_ratio(e, least) for e in restitution]
    else:
        damping_ratios = [damping_ratio_of_paper(e) for e in restitution]
    if block.homogeneous:
        inverse_inertia = 3.0 / (b * b + h * h)
    else:
        inverse_inertia = 1.0 / block.gyration_squared
    return Parameters(
        reach=(b + dx, b - dx, h + dz, h - dz),
        inverse_inertia=inverse_inertia,
        gravity=scene.gravity,
        stiffness=stiffness,
        friction_damping=FRICTION_DAMPING * math.sqrt(stiffness),
        mu_s=scene.floor.mu_s,
        mu_k=scene.floor.friction,
        restitution=tuple(restitution),
        damping_ratio=tuple(damping_ratios),
        distance=tuple(distance),
        calibrated=calibrated,
        time_step=time_step,
        strike=max(STRIKE_TIME, YOUNG / math.sqrt(stiffness)),
        flat_angle=FLAT_SHARE * block.alpha,
        surfaces=np.flatnonzero(np.isfinite(distance)),
    )


def initial_state(scene: Scene, parameters: Parameters) -> np.record:
    """The state at t = 0. A block on the floor starts sunk in by its weight: it does not bounce."""
    block = scene.block
    _, y, tilt, vx, vy, w = scene.initial_state
    placed = kinematics.of_mass(block, scene.initial_state)
    place = dict(zip(MOTION.names or (), placed, strict=True))
    contacts = _open_contacts(scene, parameters)
    if scene.initial_height < TOUCHING:
        contacts["closed"][FLOOR] = tilt >= 0.0, tilt <= 0.0
        sunk, turned = _sunk(block, tilt, parameters)
        place["y"] -= sunk
        place["theta"] += turned
    motion = filled(MOTION, **place)
    energy = kinematics.energy(block, scene.gravity, y, tilt, vx, vy, w)
    return filled(
        STATE,
        motion=motion,
        past_motion=motion,
        contacts=contacts,
        extremes=extremes_at_start(scene),
        contact_step=math.inf,
        first_strike=math.inf,
        allowed_energy=energy,
        absolute_work=abs(energy) + 0.01 * scene.gravity * block.half_width,
        grid=1,
    )


def _open_contacts(scene: Scene, parameters: Parameters) -> np.ndarray:
    """All contacts, open; a wall that is touched at the start is not struck."""
    contacts = np.zeros((len(SURFACES), 2), CONTACT)
    contacts["strike_time"] = math.inf
    contacts["last_closed"] = -math.inf
    contacts["stiffness"] = parameters.stiffness
    damping = 2.0 * math.sqrt(parameters.stiffness) * np.array(parameters.damping_ratio)
    contacts["damping"] = damping[:, None]
    x, _, tilt, vx, _, w = scene.initial_state
    for wall in scene.walls:
        away, toward = kinematics.side_corners(scene.block, wall.side, wall.gap, x, tilt, vx, w).T
        touched = (away < TOUCHING) & (toward <= 0.0)
        contacts["last_closed"][WALLS[wall.side]][touched] = 0.0
    return contacts


def _sunk(block: Block, tilt: float, parameters: Parameters) -> tuple[float, float]:
    """How deep the mass's centre of a standing block is sunk, m, and how far it is turned, rad."""
    on_one_corner = parameters.gravity / parameters.stiffness
    if tilt != 0.0:
        return on_one_corner, 0.0
    sunk = parameters.gravity / (parameters.stiffness * 2)
    if block.offset[0] == 0.0:
        return sunk, 0.0
    # The corner nearer to the mass's centre carries more.
    left = block.pivot("left").arm
    right = block.pivot("right").arm
    width_squared = (left + right) ** 2
    turned = 2.0 * sunk * (right - left) / width_squared
    return sunk * (2.0 * (left * left + right * right) / width_squared), turned
