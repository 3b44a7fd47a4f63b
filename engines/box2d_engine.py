"""Box2D v3 (pyb2d3) as a model of the rocking block."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar, Literal

from rockcheck.engines import contacts, steps
from rockcheck.engines.engine import ContactParameters, Engine, Worlds
from rockcheck.engines.facts import EngineFacts, LineLook
from rockcheck.scenes import Scene

SLAB, REACH = 10.0, 50.0  # half the thickness and half the extent of floor and walls
SUBSTEPS = 4  # of each step, as Box2D's manual has them
#: At its best: the stiffness of a contact in cycles a step, its damping ratio, and the speed at
#: which overlap is pushed out; slower approaches than the threshold do not bounce. Lengths in R.
STIFFNESS, DAMPING, PUSH, THRESHOLD = 0.25, 10.0, 3.0, 1e-3
#: At its best, Box2D's units of length in a block radius: contacts may overlap by 0.005 of its
#: units, and what friction holds creeps while they do.
SCALE = 10.0


class _Box2DWorld(steps.World):
    """A world with a box, floor and walls, and Box2D's default parameters."""

    #: Other values of the world's own parameters.
    parameters: ClassVar[Mapping[str, float]] = MappingProxyType({})
    #: Half the thickness and half the extent of floor and walls.
    slab, reach = SLAB, REACH

    def __init__(self, scene: Scene) -> None:
        import pyb2d3

        self.world = pyb2d3.World(gravity=(0.0, 0.0), **self.parameters)
        # Of two frictions the geometric mean counts, of two restitutions the larger.
        for face in contacts.surfaces_of(scene):
            slab = self.world.create_static_body(position=face.behind(self.slab))
            width, _, height = face.extent(self.slab, self.reach)
            stuff = pyb2d3.surface_material(friction=face.friction, restitution=face.restitution)
            slab.create_shape(pyb2d3.shape_def(material=stuff), pyb2d3.box(width, height))
        self.body = self.world.create_dynamic_body(position=(0.0, scene.block.half_height))
        b, h, (dx, dz) = scene.block.half_width, scene.block.half_height, scene.block.offset
        stuff = pyb2d3.surface_material(friction=scene.floor.friction, restitution=0.0)
        box = pyb2d3.box(b, h, center=(-dx, -dz), rotation=0.0)
        self.body.create_shape(pyb2d3.shape_def(material=stuff), box)
        mass = pyb2d3.MassData()
        mass.mass, mass.center = 1.0, (0.0, 0.0)
        mass.rotational_inertia = scene.block.gyration_squared
        self.body.mass_data = mass
        self.turned = pyb2d3.Rot(0.0)

    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        self.turned.c, self.turned.s = math.cos(theta), math.sin(theta)
        self.body.set_transform((x, y), self.turned)
        self.body.linear_velocity, self.body.angular_velocity = (vx, vy), w

    def step(self, felt: tuple[float, float], dt: float) -> None:
        self.world.gravity = felt
        self.world.step(dt, SUBSTEPS)

    def state(self) -> steps.State:
        body = self.body
        (x, y), (vx, vy), turned = body.position, body.linear_velocity, body.rotation
        # The body's own angle is an approximation.
        return x, y, math.atan2(turned.s, turned.c), vx, vy, body.angular_velocity

    def close(self) -> None:
        self.world.destroy()  # Box2D holds few of them


class _RigidBox2DWorld(_Box2DWorld):
    """Contacts as stiff as a step allows, bouncing at any speed; a block that never sleeps.

    A state is in block radii, the world `SCALE` times as large.

    Small blocks are faster than Box2D lets them be, in R a second.
    """

    parameters = MappingProxyType(
        {"restitution_threshold": THRESHOLD * SCALE, "maximum_linear_speed": 1e6}
    )
    slab, reach = SCALE * SLAB, SCALE * REACH

    def __init__(self, scene: Scene) -> None:
        super().__init__(steps.in_units_of(1.0 / SCALE, scene))
        self.world.sleeping_enabled = False

    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        super().place(SCALE * x, SCALE * y, theta, SCALE * vx, SCALE * vy, w)

    def step(self, felt: tuple[float, float], dt: float) -> None:
        super().step((SCALE * felt[0], SCALE * felt[1]), dt)

    def state(self) -> steps.State:
        x, y, theta, vx, vy, w = super().state()
        return x / SCALE, y / SCALE, theta, vx / SCALE, vy / SCALE, w

    def ready(self, dt: float) -> None:
        self.world.set_contact_tuning(STIFFNESS / dt, DAMPING, SCALE * PUSH)


class Box2D(Engine):
    """Box2D v3.

    Its best settings: contacts as stiff as the step allows, which bounce at any speed, and a block
    that never sleeps.
    """

    name: ClassVar[str] = "box2d"
    module: ClassVar[str] = "pyb2d3"
    precision: ClassVar[Literal["double", "single"]] = "single"
    fixed_because: ClassVar[str] = "Box2D holds positions in single precision"
    worlds: ClassVar[Worlds] = (_RigidBox2DWorld, _Box2DWorld)
    contact_parameters: ClassVar[ContactParameters] = ContactParameters(
        (0.0, 1.0),
        {
            "block": "restitution=0, friction={friction:.4g} (of two restitutions the larger"
            " counts, of two frictions the geometric mean)",
            "floor": "restitution={restitution:.4g}, friction={friction:.4g}",
            "world": "restitution_threshold=1 (slower contacts do not bounce), contact_hertz=30, 4"
            " substeps",
        },
    )
    advice: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "creep": "lengths: contacts may overlap by 0.005; set_contact_tuning",
            "damping": "positions are in single precision",
            "restitution": "restitution_threshold; it acts corner by corner",
            "penetration": "set_contact_tuning: hertz, damping ratio, push speed",
            "corners": "sleeping_enabled; set_contact_tuning",
            "friction": "sleeping_enabled; frictions give their geometric mean",
            "solver": "substeps",
            "sleep": "World.sleeping_enabled",
        }
    )


FACTS = EngineFacts(
    engine=Box2D,
    label="Box2D",
    summary="the physics engine Box2D 3 (in two dimensions, single precision)",
    look=LineLook("#3f6fb5", "#86aee8", (1.0, 1.0, 4.0, 1.0), "h"),
)
