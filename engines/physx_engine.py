"""PhysX 5 (sapien) as a model of the rocking block."""

import math
import warnings
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from rockcheck.engines import contacts, steps
from rockcheck.engines.engine import ContactParameters, Engine, Worlds
from rockcheck.engines.facts import EngineFacts, LineLook
from rockcheck.scenes import Scene

CORNER_RADIUS = 1e-4  # of the block's radius; contacts are points
OFFSET = 1e-2  # of the block's radius: from where contacts are made; smaller ones do worse
THRESHOLD = 1e-3  # block radii a second: slower approaches do not bounce
PLANAR = 1e3  # by how much the block is harder to turn out of its plane than in it


class _PhysXWorld(steps.World):
    """A scene with a box on planes, and PhysX's default parameters.

    Of two materials PhysX takes the mean. A user gives the block and the floor the friction that
    their contact should have, and a wall its restitution; half of that is what is left.
    """

    #: Of scenes, bodies and shapes that are made from here on.
    config: ClassVar[dict[str, dict[str, float]]] = {"scene": {}, "body": {}, "shape": {}}
    #: Of the block's own material and of the surfaces', in those of a contact.
    shares = (1.0, 1.0)
    #: How far surfaces lie behind the scene's; how much harder the block turns out of its plane.
    inset, out_of_plane = 0.0, 1.0

    def __init__(self, scene: Scene) -> None:
        with warnings.catch_warnings(action="ignore"):  # nothing is rendered
            import sapien
            from sapien import physx

        self.sapien, self.physx = sapien, physx
        for made, values in self.config.items():
            getattr(physx, f"set_{made}_config")(**values)
        self.world = sapien.Scene([physx.PhysxCpuSystem()])
        self.body = physx.PhysxRigidDynamicComponent()
        rough = self.shares[0] * scene.floor.friction
        self.shape(scene, physx.PhysxMaterial(rough, rough, 0.0))
        self.block = self._entity(self.body)
        self.body.set_mass(1.0)
        self.body.set_cmass_local_pose(sapien.Pose())
        inertia = scene.block.gyration_squared
        self.body.set_inertia([self.out_of_plane * inertia, inertia, self.out_of_plane * inertia])
        self.body.set_linear_damping(0.0)
        self.body.set_angular_damping(0.0)
        self.body.set_disable_gravity(True)
        for face in contacts.surfaces_of(scene):
            rough, bounce = (self.shares[1] * one for one in (face.friction, face.restitution))
            plane = physx.PhysxCollisionShapePlane(physx.PhysxMaterial(rough, rough, bounce))
            (x, z), (nx, nz) = face.behind(self.inset), face.normal
            half = -0.5 * math.atan2(nz, nx)  # a plane looks along its own x axis
            turn = [math.cos(half), 0.0, math.sin(half), 0.0]
            plane.set_local_pose(sapien.Pose([x, 0.0, z], turn))
            fixed = physx.PhysxRigidStaticComponent()
            fixed.attach(plane)
            self._entity(fixed)

    def _entity(self, component: Any) -> Any:
        entity = self.sapien.Entity()
        entity.add_component(component)
        self.world.add_entity(entity)
        return entity

    def shape(self, scene: Scene, material: Any) -> None:
        b, h, (dx, dz) = scene.block.half_width, scene.block.half_height, scene.block.offset
        box = self.physx.PhysxCollisionShapeBox([b, b, h], material)
        box.set_local_pose(self.sapien.Pose([-dx, 0.0, -dz]))
        self.body.attach(box)

    # The y axis points into the plane: its angles are clockwise.
    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        turn = [math.cos(0.5 * theta), 0.0, -math.sin(0.5 * theta), 0.0]
        self.block.set_pose(self.sapien.Pose([x, 0.0, y], turn))
        self.body.set_linear_velocity([vx, 0.0, vy])
        self.body.set_angular_velocity([0.0, -w, 0.0])

    def step(self, felt: tuple[float, float], dt: float) -> None:
        self.world.set_timestep(dt)
        self.body.add_force_torque([felt[0], 0.0, felt[1]], [0.0, 0.0, 0.0], "force")
        self.world.step()

    def state(self) -> steps.State:
        pose = self.block.get_pose()
        (x, _, z), (whole, _, turn, _) = pose.p.tolist(), pose.q.tolist()
        (vx, _, vz), w = self.body.get_linear_velocity().tolist(), self.body.get_angular_velocity()
        return x, z, -2.0 * math.atan2(turn, whole), vx, vz, -float(w[1])


class _RigidPhysXWorld(_PhysXWorld):
    """Contacts of tiny spheres, that bounce however slow, and a block that never sleeps."""

    config: ClassVar[dict[str, dict[str, float]]] = {
        "scene": {"bounce_threshold": THRESHOLD},
        "body": {"sleep_threshold": 0.0},
        "shape": {"contact_offset": OFFSET},
    }
    inset, out_of_plane = CORNER_RADIUS, PLANAR
    shares = (0.0, 2.0)

    def shape(self, scene: Scene, material: Any) -> None:
        self.body.set_max_angular_velocity(1e6)  # small blocks turn faster than its 100/s
        depth = scene.block.half_width  # before and behind the plane
        for bx, bz in contacts.corners_of(scene):
            for by in (-depth, depth):
                corner = self.physx.PhysxCollisionShapeSphere(CORNER_RADIUS, material)
                corner.set_local_pose(self.sapien.Pose([bx, by, bz]))
                self.body.attach(corner)


class PhysX(Engine):
    """PhysX 5.

    Its best settings: tiny spheres as corners, materials that add up to a contact's parameters, and
    a block that never sleeps.
    """

    name: ClassVar[str] = "physx"
    module: ClassVar[str] = "sapien"
    precision: ClassVar[Literal["double", "single"]] = "single"
    fixed_because: ClassVar[str] = "PhysX computes in single precision"
    worlds: ClassVar[Worlds] = (_RigidPhysXWorld, _PhysXWorld)
    contact_parameters: ClassVar[ContactParameters] = ContactParameters(
        (0.0, 2.0),
        {
            "PhysxMaterial(block)": "{friction:.4g}, {friction:.4g}, 0 (of two materials the mean"
            " counts)",
            "PhysxMaterial(floor)": "{friction:.4g}, {friction:.4g}, {restitution:.4g}",
            "set_scene_config": "bounce_threshold=2 (slower contacts do not bounce)",
        },
    )
    advice: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "damping": "set_linear_damping, set_angular_damping; it computes in single precision",
            "restitution": "bounce_threshold; of two materials the mean counts",
            "penetration": "contact_offset of set_shape_config",
            "corners": "contact_offset of set_shape_config",
            "friction": "of two materials the mean counts",
            "sleep": "sleep_threshold of set_body_config",
        }
    )


FACTS = EngineFacts(
    engine=PhysX,
    label="PhysX",
    summary="the physics engine PhysX 5 (single precision)",
    look=LineLook("#4c7a1e", "#93c25f", (2.0, 2.0), "d"),
)
