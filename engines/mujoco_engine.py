"""MuJoCo as a model of the rocking block."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from engines.contacts import contacts_of
from engines.engine import Engine, World
from scenes import Scene

FloatArray = NDArray[np.float64]
CORNER_RADIUS = 1e-6  # m; contacts are points, and MuJoCo has no contact of a point with a plane
STIFFNESS = 0.01  # share of a penetration that one step removes
IMPEDANCE = (0.9999, 0.9999, 0.001, 0.5, 1.0)
SLIDING = 1e-6  # m/s: slower slip needs no correction of the cone, and it need not be known better
MOST_CORRECTIONS = 20


class MuJoCo(Engine):
    """MuJoCo, with contacts that remove the approach within one step (Euler, elliptic cone, Newton solver).

    `cone_correction` applies De Saxce's correction to the floor's contacts. MuJoCo's friction is associated: a sliding
    contact lifts off at mu times its slip rate, whatever the step; the correction takes just that out. It belongs to
    the "best" settings; the stock engine ("default") has none.
    """

    name: ClassVar[str] = "mujoco"
    cone_correction: bool = True

    def world(self, scene: Scene) -> World:
        """The scene as MuJoCo holds it."""
        if self.settings == "default":
            return _MuJoCoWorld(_stock_model(scene), self.time_step)
        world = _MuJoCoWorld(_point_contact_model(scene), self.time_step, scene.floor.friction if self.cone_correction else 0.0)
        world.set_one_step_contacts([contact.restitution for contact in contacts_of(scene)])
        return world

    def notes(self, scene: Scene) -> list[str]:
        """What MuJoCo cannot do of the scene, a line each."""
        notes = super().notes(scene)
        if self.settings == "default" and any(contact.restitution > 0.0 for contact in contacts_of(scene)):
            notes.append("MuJoCo's default contact has no coefficient of restitution; that of the scene is not used")
        return notes


class _MuJoCoWorld:
    """A compiled model with its data, stepped by Euler's method."""

    def __init__(self, model_text: str, time_step: float, corrected_friction: float = 0.0) -> None:
        import mujoco

        self.model: Any = mujoco.MjModel.from_xml_string(model_text)
        self.model.opt.timestep = time_step
        self.data: Any = mujoco.MjData(self.model)
        self.friction = corrected_friction

    def set_one_step_contacts(self, restitutions: list[float]) -> None:
        """Contacts that end a step with -e times the normal velocity they began it with.

        Reference acceleration -(1+e)/dt times the velocity, less a share of the penetration; not that for a bouncing wall,
        which would gain energy.
        """
        dt = self.model.opt.timestep
        for pair, e in enumerate(restitutions):
            self.model.pair_solref[pair] = [-(STIFFNESS if e == 0.0 else 0.0) / dt**2, -(1.0 + e) / dt]

    def place(self, state: FloatArray) -> None:
        """Put the block where `state` says."""
        self.data.qpos[:] = state[:3]
        self.data.qvel[:] = state[3:]

    def march(self, accelerations: FloatArray) -> FloatArray:
        """States after each step."""
        import mujoco

        model, data, step = self.model, self.data, mujoco.mj_step if self.friction == 0.0 else self._corrected_step
        qpos, qvel, ctrl = data.qpos, data.qvel, data.ctrl
        states = np.empty((len(accelerations), 6))
        for state, acceleration in zip(states, accelerations, strict=True):
            ctrl[:] = acceleration
            step(model, data)
            state[:3] = qpos
            state[3:] = qvel
        return states

    def _corrected_step(self, model: Any, data: Any) -> None:
        """One Euler step with De Saxce's correction of the friction cone."""
        import mujoco

        mujoco.mj_step1(model, data)
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        mujoco.mj_fwdConstraint(model, data)
        forces = data.efc_force.tolist()
        # Three rows for each contact with friction, which come first, and one for each without.
        rows = range(0, 3 * ((len(forces) - data.ncon) // 2), 3)
        if any(abs(forces[row + 2]) > 0.999 * self.friction * forces[row] > 0.0 for row in rows):
            self._correct_cone(list(rows))
        mujoco.mj_Euler(model, data)

    def _correct_cone(self, rows: list[int]) -> None:
        """Solve again with the normal target of each floor contact lowered by mu times its slip rate, until that is consistent.

        The fixed point obeys Coulomb's law with the contact neither parting nor closing (De Saxce & Feng 1998).
        """
        import mujoco

        model, data, dt = self.model, self.data, self.model.opt.timestep
        original = data.efc_aref.copy()
        tangents = data.efc_J.reshape(-1, 3)[[row + 2 for row in rows]]
        before = np.full(len(rows), np.inf)
        for _ in range(MOST_CORRECTIONS):
            slip_rate = np.abs(tangents @ (data.qvel + dt * data.qacc))
            if np.all(np.abs(slip_rate - before) < SLIDING):
                return
            data.efc_aref[rows] = original[rows] - self.friction * slip_rate / dt
            mujoco.mj_fwdConstraint(model, data)
            before = slip_rate

    def close(self) -> None:
        """Nothing to give back: the model goes with its last reference."""


def _planar_body(scene: Scene, geoms: str) -> str:
    """A body of unit mass that moves in the plane x, z and turns counterclockwise; motors give the inertia force."""
    inertia = scene.block.radius**2 / 3.0
    return f"""
<body>
  <joint name="x" type="slide" axis="1 0 0"/><joint name="z" type="slide" axis="0 0 1"/><joint type="hinge" axis="0 -1 0"/>
  <inertial pos="0 0 0" mass="1" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>
  {geoms}
</body>"""


def _model(option: str, world: str, contact: str = "") -> str:
    return f"""<mujoco>
<option gravity="0 0 0" {option}><flag autoreset="disable"/></option>
<worldbody>{world}</worldbody>
{contact}
<actuator><motor joint="x"/><motor joint="z"/></actuator>
</mujoco>"""


def _plane(name: str, scene: Scene, inset: float, attributes: str) -> str:
    """The floor or a wall, `inset` m behind its surface."""
    if name == "floor":
        return f'<geom name="floor" type="plane" size="0 0 1" pos="0 0 {-inset!r}" {attributes}/>'
    wall = next(wall for wall in scene.walls if wall.side == name)
    inward = 1.0 if name == "left" else -1.0
    place = -inward * (scene.block.half_width + wall.gap + inset)
    return f'<geom name="{name}" type="plane" size="0 0 1" pos="{place!r} 0 0" zaxis="{inward!r} 0 0" {attributes}/>'


def _point_contact_model(scene: Scene) -> str:
    """Corners as tiny spheres, and one contact pair for each contact that the scene can use, in their order."""
    off = 'contype="0" conaffinity="0"'
    contacts = contacts_of(scene)
    corners = {contact.corner: f"corner{contact.corner[0]:+g}{contact.corner[1]:+g}" for contact in contacts}
    spheres = "".join(
        f'<geom name="{name}" type="sphere" size="{CORNER_RADIUS!r}" pos="{bx!r} 0 {bz!r}" {off}/>' for (bx, bz), name in corners.items()
    )
    planes = "".join(_plane(name, scene, CORNER_RADIUS, off) for name in dict.fromkeys(contact.surface for contact in contacts))
    impedance = " ".join(map(repr, IMPEDANCE))
    # A frictionless floor is a frictionless contact: MuJoCo would raise a coefficient of zero to 1e-5.
    mu = scene.floor.friction
    kinds = dict.fromkeys(("floor", "left", "right"), 'condim="1"')
    if mu > 0.0:
        kinds["floor"] = f'condim="3" friction="{mu!r} {mu!r} 0 0 0"'
    pairs = "".join(
        f'<pair geom1="{contact.surface}" geom2="{corners[contact.corner]}" solimp="{impedance}" {kinds[contact.surface]}/>'
        for contact in contacts
    )
    option = 'integrator="Euler" cone="elliptic" solver="Newton" iterations="10" tolerance="0" jacobian="dense" impratio="1"'
    return _model(option, planes + _planar_body(scene, spheres), f"<contact>{pairs}</contact>")


def _stock_model(scene: Scene) -> str:
    """A box on a plane, beside planes, with MuJoCo's default contact parameters, solver and cone."""
    mu, block = scene.floor.friction, scene.block
    planes = _plane("floor", scene, 0.0, f'condim="3" friction="{mu!r} 0 0"')
    planes += "".join(_plane(wall.side, scene, 0.0, 'condim="1"') for wall in scene.walls)
    size = f"{block.half_width!r} {block.half_width!r} {block.half_height!r}"
    return _model("", planes + _planar_body(scene, f'<geom type="box" size="{size}" condim="1" friction="0 0 0"/>'))
