"""PyBullet as a model of the rocking block."""

import math
import os
from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import Any, ClassVar

from rockcheck.engines import contacts, steps
from rockcheck.engines.engine import ContactParameters, Engine, Worlds
from rockcheck.engines.facts import BenchmarkSteps, EngineFacts, LineLook, SpectrumPlay
from rockcheck.scenes import Scene

# of the block's radius; contacts are points, and Bullet has no contact of a point with a plane
CORNER_RADIUS = 1e-9
SLAB = 10.0  # half the thickness, in m, of floor and walls as the engine comes
REACH = 300.0  # half their extent
# share of a penetration that one step removes; none where it would add to a bounce or make one
FLOOR_ERP = 0.02
ALOFT = 10.0  # block radii above the floor: where a block is made, away from all contacts


@cache
def _bullet() -> Any:
    """The module, imported without the banner that it writes on the process's standard error."""
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        import pybullet
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
    return pybullet


class _PyBulletWorld(steps.World):
    """A physics server with block, floor and walls, at PyBullet's default parameters."""

    #: Whether surfaces are planes, behind them by the radius of the corners; else thick boxes.
    planes = False

    def __init__(self, scene: Scene) -> None:
        self.bullet = pybullet = _bullet()
        self.client: int = pybullet.connect(pybullet.DIRECT)
        self.options: dict[str, Any] = {"physicsClientId": self.client}
        shape, made, dynamics = self.block_of(scene)
        # Friction and restitution of two bodies multiply: the block's are 1, so that those of floor
        # and walls count.
        self.body: int = pybullet.createMultiBody(
            1.0, shape, basePosition=[0.0, 0.0, ALOFT * scene.block.radius], **made, **self.options
        )
        pybullet.changeDynamics(
            self.body, -1, lateralFriction=1.0, restitution=1.0, **dynamics, **self.options
        )
        self.dt = 0.0
        # A step in the air, in which Bullet takes notice of an inertia that was changed.
        pybullet.stepSimulation(**self.options)
        for surface in contacts.surfaces_of(scene):
            (x, z), (nx, nz) = (
                surface.behind(CORNER_RADIUS if self.planes else SLAB),
                surface.normal,
            )
            face = (
                {"shapeType": pybullet.GEOM_PLANE, "planeNormal": [nx, 0.0, nz]}
                if self.planes
                else {"shapeType": pybullet.GEOM_BOX, "halfExtents": surface.extent(SLAB, REACH)}
            )
            shape = pybullet.createCollisionShape(**face, **self.options)
            body = pybullet.createMultiBody(0.0, shape, basePosition=[x, 0.0, z], **self.options)
            contact = {"lateralFriction": surface.friction, "restitution": surface.restitution}
            pybullet.changeDynamics(body, -1, **contact, **self.options)

    def block_of(self, scene: Scene) -> tuple[int, dict[str, Any], dict[str, Any]]:
        """A box as a shape, how its body is made, and what is changed in it."""
        half = [scene.block.half_width, scene.block.half_width, scene.block.half_height]
        (dx, dz), inertia = scene.block.offset, scene.block.gyration_squared
        loaded = not scene.block.homogeneous  # of a plain box Bullet finds the inertia itself
        placed = {"collisionFramePosition": [-dx, 0.0, -dz]} if loaded else {}
        shape = self.bullet.createCollisionShape(
            self.bullet.GEOM_BOX, halfExtents=half, **placed, **self.options
        )
        return shape, {}, {"mass": 1.0, "localInertiaDiagonal": [inertia] * 3} if loaded else {}

    # The y axis points into the plane: its angles are clockwise.
    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        turn = (0.0, -math.sin(0.5 * theta), 0.0, math.cos(0.5 * theta))
        self.bullet.resetBasePositionAndOrientation(self.body, (x, 0.0, y), turn, self.client)
        self.bullet.resetBaseVelocity(self.body, (vx, 0.0, vy), (0.0, -w, 0.0), self.client)

    def step(self, felt: tuple[float, float], dt: float) -> None:
        if dt != self.dt:
            self.bullet.setTimeStep(dt, self.client)
            self.dt = dt
        self.bullet.setGravity(felt[0], 0.0, felt[1], self.client)
        self.bullet.stepSimulation(self.client)

    def state(self) -> steps.State:
        (x, _, z), (_, turn, _, whole) = self.bullet.getBasePositionAndOrientation(
            self.body, self.client
        )
        (vx, _, vz), (_, w, _) = self.bullet.getBaseVelocity(self.body, self.client)
        return x, z, -2.0 * math.atan2(turn, whole), vx, vz, -w

    def close(self) -> None:
        self.bullet.disconnect(**self.options)


class _RigidPyBulletWorld(_PyBulletWorld):
    """Contacts of points with planes, solved to convergence.

    A sphere is pushed at its lowest point: its radius below the corner turns the block with a
    moment that no step makes smaller. On planes Bullet's normals are exact for spheres however
    small; on boxes it would lose them.
    """

    planes = True

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self.bounces = contacts.rebounds(scene)
        # Where it would add to a bounce or make one, a penetration is left as it is.
        self.erp = 0.0 if self.bounces or scene.walls else FLOOR_ERP
        self.bouncing: bool | None = None
        self.bullet.setPhysicsEngineParameter(
            numSolverIterations=contacts.sweeps(scene.block, 1000),
            solverResidualThreshold=1e-20,
            contactSlop=0.0,
            contactERP=0.0,
            **self.options,
        )

    def block_of(self, scene: Scene) -> tuple[int, dict[str, Any], dict[str, Any]]:
        """The block as tiny spheres at its corners.

        A huge inertia about the other axes keeps it in its plane.
        """
        places = [[bx, 0.0, bz] for bx, bz in contacts.corners_of(scene)]
        shape = self.bullet.createCollisionShapeArray(
            shapeTypes=[self.bullet.GEOM_SPHERE] * len(places),
            radii=[CORNER_RADIUS] * len(places),
            collisionFramePositions=places,
            **self.options,
        )
        inertia = scene.block.gyration_squared
        changed = {
            "mass": 1.0,  # given again: the inertia alone would set it to zero
            "localInertiaDiagonal": [1e6 * inertia, inertia, 1e6 * inertia],
            "linearDamping": 0.0,
            "angularDamping": 0.0,
            "spinningFriction": 0.0,
            "rollingFriction": 0.0,
            "contactProcessingThreshold": 0.0,  # of a corner that touches, not of one near
        }
        return shape, {"useMaximalCoordinates": 1}, changed

    def ready(self, dt: float) -> None:
        self.bounce(True)
        self.bullet.setPhysicsEngineParameter(contactERP=self.erp, **self.options)
        # Rounding leaves a resting corner so far up, and it would fall freely for a step.
        self.bullet.changeDynamics(
            self.body, -1, contactProcessingThreshold=steps.EMBEDDED, **self.options
        )

    def bounce(self, bouncing: bool) -> None:
        if bouncing is not self.bouncing and (self.bounces or self.bouncing is None):
            self.bullet.setPhysicsEngineParameter(
                restitutionVelocityThreshold=0.0 if bouncing else 1e30, **self.options
            )
            self.bouncing = bouncing


class PyBullet(Engine):
    """PyBullet, with its default solver.

    Its best settings: iterated to convergence, without slop, damping and sleeping.
    """

    name: ClassVar[str] = "pybullet"
    module: ClassVar[str] = "pybullet"
    last_python: ClassVar[tuple[int, int] | None] = (3, 11)
    worlds: ClassVar[Worlds] = (_RigidPyBulletWorld, _PyBulletWorld)
    contact_parameters: ClassVar[ContactParameters] = ContactParameters(
        (0.0, 1.2),
        {
            "changeDynamics(block)": "restitution=1, lateralFriction=1 (of two bodies they"
            " multiply)",
            "changeDynamics(floor)": "restitution={restitution:.4g},"
            " lateralFriction={friction:.4g}",
            "setPhysicsEngineParameter": "restitutionVelocityThreshold=0.2 (slower contacts do not"
            " bounce), contactERP=0.2",
        },
    )
    advice: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "creep": "contactERP, contactSlop, numSolverIterations",
            "damping": "linearDamping and angularDamping are 0.04 as it comes",
            "restitution": "restitutionVelocityThreshold; restitutions of two bodies multiply",
            "penetration": "contactERP, contactSlop, restitutionVelocityThreshold",
            "corners": "a box as floor in place of GEOM_PLANE; corners as spheres",
            "friction": "lateralFriction of both bodies: they multiply",
            "solver": "numSolverIterations, solverResidualThreshold",
            "sleep": "activationState without sleeping",
        }
    )


FACTS = EngineFacts(
    engine=PyBullet,
    label="PyBullet",
    summary="the physics engine PyBullet",
    look=LineLook("#bf5f92", "#d98ab4", (4.0, 1.0, 1.0, 1.0), "v"),
    spectrum=SpectrumPlay({"time_step": "adaptive", "largest_step": 2e-3}),
    benchmark=BenchmarkSteps((1e-2, 1e-3, 1e-4, 3e-5), (1e-3, 1e-4, 4e-5)),
    in_stress_maps=True,
    in_short_studies=True,
    changes_without_wall="another share of penetration removed",
)
