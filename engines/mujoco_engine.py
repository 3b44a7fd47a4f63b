"""MuJoCo as a model of the rocking block."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from rockcheck.engines import steps
from rockcheck.engines.contacts import Surface, contacts_of, corners_of, surfaces_of
from rockcheck.engines.engine import ContactParameters, Engine, Worlds
from rockcheck.engines.facts import BenchmarkSteps, EngineFacts, LineLook, SpectrumPlay
from rockcheck.scenes import Floor, ModelFailure, Scene, printable

# of the block's radius; contacts are points, and MuJoCo has no contact of a point with a plane
CORNER_RADIUS = 1e-8
PUSHED_OUT = 0.01  # share of a penetration that one step removes
IMPEDANCE = 0.9999  # share of an impact that a contact takes up
SOLIMP = f'solimp="{IMPEDANCE!r} {IMPEDANCE!r} 0.001 0.5 1.0"'
# inverse regularisation of a contact, kg, where MuJoCo gives at most 1.5e4 to a block of 1 kg
RIGID = 1e7
#: Without warm start Newton's method needs fewer iterations, and it does not get stuck on the edge
#: of a stiff cone. The 50 iterations of a line search that MuJoCo allows are too few there:
#: Newton's method would stop short of its solution.
SOLVER = """
<option integrator="Euler" cone="elliptic" impratio="1" jacobian="dense" solver="Newton" \
iterations="100" tolerance="1e-15"
  ls_tolerance="1e-6" ls_iterations="200"><flag island="disable" warmstart="disable"/></option>
"""
# block radii per second: how well a slip rate has to be known for the correction of the cone
SLIDING = 1e-7
FLATTEST = -0.05  # slope that the secant method trusts
MOST_CORRECTIONS = 20


class MuJoCoWorld(steps.World):
    """A compiled model with its data: a box on a plane, with planes for the walls.

    The planar body of unit mass moves in the plane x, z, counterclockwise positive. Without
    `settings`, MuJoCo's default contact parameters, solver and cone apply.
    """

    #: How far walls lie behind the scene's, and by how much the body is raised above the floor's
    #: origin, m.
    inset = 0.0

    def __init__(self, scene: Scene, settings: str = "") -> None:
        import mujoco

        self.mujoco: Any = mujoco
        # MuJoCo would print its warnings and keep a log of them in the working directory.
        self.warnings: list[str] = []
        self.former_handler = mujoco.get_mju_user_warning()
        mujoco.set_mju_user_warning(self.warnings.append)
        planes, geoms, more = self.shapes(scene)
        inertia = scene.block.gyration_squared
        self.model: Any = mujoco.MjModel.from_xml_string(
            f"""<mujoco><option gravity="0 0 0"/>{settings or more}<worldbody>{planes}
<body pos="0 0 {self.inset!r}">
  <joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>\
<joint type="hinge" axis="0 -1 0"/>
  <inertial pos="0 0 0" mass="1" diaginertia="{inertia!r} {inertia!r} {inertia!r}"/>
  {geoms}
</body></worldbody></mujoco>"""
        )
        self.data: Any = mujoco.MjData(self.model)
        # Views of the data, which are dear to make anew in each step.
        self.qpos, self.qvel, self.qacc = self.data.qpos, self.data.qvel, self.data.qacc
        self.force = self.data.qfrc_applied[:2]
        self.dt = 0.0

    def shapes(self, scene: Scene) -> tuple[str, str, str]:
        """The planes, what the body is made of, and what is set beside them, as XML."""
        block, mu = scene.block, scene.floor.friction
        planes = "".join(
            plane_of(
                surface,
                0.0,
                f'condim="3" friction="{mu!r} 0 0"' if surface.surface == "floor" else 'condim="1"',
            )
            for surface in surfaces_of(scene)
        )
        dx, dz = block.offset
        size = f"{block.half_width!r} {block.half_width!r} {block.half_height!r}"
        place = "" if block.centre_of_mass is None else f'pos="{-dx!r} 0 {-dz!r}" '
        box = f'<geom type="box" {place}size="{size}" condim="1" friction="0 0 0"/>'
        return planes, box, ""

    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        self.qpos[:] = x, y, theta
        self.qvel[:] = vx, vy, w

    def step(self, felt: tuple[float, float], dt: float) -> None:
        self.force[:] = felt
        if dt != self.dt:
            self.model.opt.timestep = self.dt = dt
        self.mujoco.mj_step(self.model, self.data)
        self.check()

    def state(self) -> steps.State:
        return (*self.qpos.tolist(), *self.qvel.tolist())

    def check(self) -> None:
        """Raise `ModelFailure` if MuJoCo met a huge or non-finite state or acceleration."""
        if self.warnings:
            kinds = self.mujoco.mjtWarning
            bad = (kinds.mjWARN_BADQPOS, kinds.mjWARN_BADQVEL, kinds.mjWARN_BADQACC)
            if any(self.data.warning[kind].number for kind in bad):
                raise ModelFailure(f"MuJoCo: {printable(self.warnings[-1], 200)}")
            self.warnings.clear()

    def close(self) -> None:
        self.mujoco.set_mju_user_warning(self.former_handler)


def plane_of(surface: Surface, inset: float, attributes: str) -> str:
    """The floor, or a wall `inset` m behind its surface.

    The floor stays where it is and the block is raised instead: a plane nearer to the origin than
    1e-6 m MuJoCo takes to be in it.
    """
    place = "" if surface.surface == "floor" else f'pos="{surface.behind(inset)[0]!r} 0 0" '
    (nx, nz), name = surface.normal, surface.surface
    axis = f'zaxis="{nx!r} 0 {nz!r}"'
    return f'<geom name="{name}" type="plane" size="0 0 1" {place}{axis} {attributes}/>'


class _RigidMuJoCoWorld(MuJoCoWorld):
    """Contacts that end a step with -e times their initial normal velocity.

    Friction obeys Coulomb's cone if corrected.
    """

    inset = CORNER_RADIUS
    embedding = steps.EMBEDDED

    def __init__(self, scene: Scene, corrected: bool = True) -> None:
        super().__init__(scene)
        contacts = contacts_of(scene)
        self.friction = scene.floor.friction if corrected else 0.0
        self.stiffness, self.damping = self.model.pair_solref.T
        self.stiffness[:] = 0.0
        # Friction stops a slip, whatever the restitution: MuJoCo would turn it round, too.
        self.slowing = self.model.pair_solreffriction[:, 1]
        restitutions = np.array([contact.restitution for contact in contacts])
        self.stopping, self.bouncing = np.full(len(contacts), -1.0), -1.0 - restitutions
        self.tuned: tuple[float, bool] | None = (
            None  # step and `bouncing` of the push that the damping is for
        )
        # Not of a penetration that would come back as a bounce: no weight presses the block on a
        # wall.
        self.pushing_out = np.where(
            [contact.surface == "floor" for contact in contacts] & (restitutions == 0.0),
            -PUSHED_OUT,
            0.0,
        )

    def shapes(self, scene: Scene) -> tuple[str, str, str]:
        """Corners as tiny spheres, and a contact pair per contact of the scene, in their order."""
        off = 'contype="0" conaffinity="0"'
        corners = {corner: f"corner {number}" for number, corner in enumerate(corners_of(scene))}
        spheres = "".join(
            f'<geom name="{name}" type="sphere" size="{self.inset!r}" pos="{bx!r} 0 {bz!r}" {off}/>'
            for (bx, bz), name in corners.items()
        )
        planes = "".join(plane_of(surface, self.inset, off) for surface in surfaces_of(scene))
        # A frictionless surface is a frictionless contact: MuJoCo would raise a coefficient of zero
        # to 1e-5.
        frictionless, rough = 'condim="1"', 'condim="3" friction="{0!r} {0!r} 0 0 0"'
        pairs = "".join(
            f'<pair geom1="{contact.surface}" geom2="{corners[contact.corner]}" {SOLIMP}'
            f" {rough.format(contact.friction) if contact.friction else frictionless}/>"
            for contact in contacts_of(scene)
        )
        return planes, spheres, f"{SOLVER}<contact>{pairs}</contact>"

    def ready(self, dt: float) -> None:
        # Reference acceleration: -(1+e)/dt times the velocity, less a share of the penetration.
        self.stiffness[:] = self.pushing_out / dt**2
        self.damping[:], self.slowing[:] = self.bouncing / dt, self.stopping / dt

    def step(self, felt: tuple[float, float], dt: float) -> None:
        # Where a contact slips, the step is done again with the corrected cone.
        before = self.qpos.tolist(), self.qvel.tolist()
        super().step(felt, dt)
        if self.friction > 0.0 and (rows := self._slipping_rows()):
            self.qpos[:], self.qvel[:] = before
            self.mujoco.mj_step1(self.model, self.data)
            self.mujoco.mj_fwdAcceleration(self.model, self.data)
            self._correct_cone(rows, dt)
            self.mujoco.mj_Euler(self.model, self.data)

    def push(
        self,
        pose: steps.Vector,
        velocity: steps.Vector,
        dt: float,
        felt: tuple[float, float],
        bouncing: bool,
    ) -> steps.Vector:
        model, data = self.model, self.data
        self.place(*pose, *velocity)
        self.force[:] = felt
        if (dt, bouncing) != self.tuned:
            self.damping[:] = (self.bouncing if bouncing else self.stopping) * (IMPEDANCE / dt)
            self.slowing[:] = self.stopping * (IMPEDANCE / dt)
            self.tuned = dt, bouncing
        self.mujoco.mj_step1(model, data)
        # MuJoCo caps the impedance, and with it the share of an impact that its contacts take up.
        data.efc_D.fill(RIGID)
        self.mujoco.mj_fwdAcceleration(model, data)
        self.mujoco.mj_fwdConstraint(model, data)
        if self.friction > 0.0 and (rows := self._slipping_rows()):
            self._correct_cone(rows, dt)
        self.check()
        ax, ay, spin = self.qacc.tolist()
        return velocity[0] + dt * ax, velocity[1] + dt * ay, velocity[2] + dt * spin

    def _slipping_rows(self) -> list[int]:
        """First constraint row of each floor contact if one is at its cone's edge, else none."""
        forces = self.data.efc_force.tolist()
        # Three rows for each contact with friction, which come first, and one for each without.
        rows = range(0, 3 * ((len(forces) - self.data.ncon) // 2), 3)
        for row in rows:
            if abs(forces[row + 2]) > 0.999 * self.friction * forces[row] > 0.0:
                return list(rows)
        return []

    def _correct_cone(self, rows: list[int], dt: float) -> None:
        """Solve again, with floor contacts' normal targets lowered by mu times their slip rates.

        Repeated until targets and slip rates agree. The fixed point obeys Coulomb's law with the
        contact neither parting nor closing (De Saxce & Feng 1998). Found by the secant method, from
        the slip rate before the step.
        """
        model, data, count = self.model, self.data, len(rows)
        original = data.efc_aref.copy()
        tangents = data.efc_J.reshape(-1, 3)[[row + 2 for row in rows]]
        guess: list[float] = np.abs(tangents @ self.qvel).tolist()
        slope = [-1.0] * count  # of the excess over the guess
        last: list[tuple[float, float]] = []
        for _ in range(MOST_CORRECTIONS):
            data.efc_aref[rows] = original[rows] - np.multiply(guess, self.friction / dt)
            self.mujoco.mj_fwdConstraint(model, data)
            slip = np.abs(tangents @ (self.qvel + dt * self.qacc)).tolist()
            now = [(guess[i], slip[i] - guess[i]) for i in range(count)]
            if max(abs(excess) for _, excess in now) < SLIDING:
                return
            for i, ((before, had), (here, has)) in enumerate(zip(last, now, strict=False)):
                if before != here:
                    slope[i] = min((has - had) / (here - before), FLATTEST)
            guess = [max(here - has / slope[i], 0.0) for i, (here, has) in enumerate(now)]
            last = now


class MuJoCo(Engine):
    """MuJoCo.

    Its best settings: contacts that remove the approach within one step (Euler, elliptic cone,
    Newton solver). `cone_correction` applies De Saxce's correction to the floor's contacts.
    MuJoCo's friction is associated: a sliding contact lifts off at mu times its slip rate, whatever
    the step; the correction removes exactly this. It belongs to the "best" settings; the stock
    engine ("default") has none.
    """

    name: ClassVar[str] = "mujoco"
    package: ClassVar[str] = "mujoco"
    bounces_with: ClassVar[tuple[str, ...]] = ("best",)
    worlds: ClassVar[Worlds] = (_RigidMuJoCoWorld, MuJoCoWorld)
    contact_parameters: ClassVar[ContactParameters] = ContactParameters(
        (0.5, 2.2),
        {
            "geom solref": "{push:.6g} {damp:.6g}",
            "geom solimp": "0.9999 0.9999 0.001 0.5 1",
            "geom friction": "{friction:.4g} 0 0",
            "option": 'timestep="{step:g}" integrator="Euler" cone="elliptic"',
        },
    )
    advice: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "creep": "impratio, noslip_iterations, solref of the geom",
            "lift": "noslip_iterations do not help: the cone is convex",
            "damping": 'condim="1" for no friction, since a friction of 0 becomes 1e-5',
            "restitution": 'solref="-stiffness -damping"',
            "penetration": "solref and solimp of the geom",
            "corners": "solref and margin of the geom",
            "friction": 'cone="elliptic", impratio',
            "solver": "iterations, tolerance",
        }
    )
    cone_correction: bool = True

    def rigid_world(self, scene: Scene) -> steps.World:
        """The scene as MuJoCo holds it: point contacts of the corners."""
        return _RigidMuJoCoWorld(scene, self.cone_correction)

    def tuned_world(
        self, scene: Scene, parameters: Mapping[str, float], step: float
    ) -> steps.World:
        """A box on a plane whose contacts stop within a step.

        The parameter `restitution` is MuJoCo's damping times the step.
        """
        sliding = scene.model_copy(update={"floor": Floor(friction=parameters["friction"])})
        solref = f"{-PUSHED_OUT / step**2!r} {-parameters['restitution'] / step!r}"
        stops = f'<default><geom solref="{solref}" {SOLIMP}/></default>'
        return MuJoCoWorld(sliding, f'<option cone="elliptic"/>{stops}')

    def tuned(self, step: float) -> dict[str, float]:
        """The share of a penetration that one step removes."""
        return {"erp": PUSHED_OUT}


FACTS = EngineFacts(
    engine=MuJoCo,
    label="MuJoCo",
    summary="the physics engine MuJoCo",
    look=LineLook("#d55e00", "#e8762a", (2.0, 1.0), "^"),
    spectrum=SpectrumPlay({"time_step": "adaptive", "largest_step": 2e-3}),
    benchmark=BenchmarkSteps((1e-2, 1e-3, 1e-4, 3e-5), (1e-3, 1e-4, 4e-5)),
    in_stress_maps=True,
    in_short_studies=True,
)
