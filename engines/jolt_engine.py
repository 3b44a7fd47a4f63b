"""Jolt (culverin) as a model of the rocking block."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar, Literal

from rockcheck.engines import contacts, steps
from rockcheck.engines.engine import ContactParameters, Engine, Worlds
from rockcheck.engines.facts import EngineFacts, LineLook
from rockcheck.scenes import ModelFailure, Scene

SLAB, REACH = 10.0, 50.0  # half the thickness and half the extent of floor and walls
#: Of a second's velocity that Jolt takes away, and culverin has no word for.
DAMPING = 0.05
#: At its best, Jolt's units of length in one of the scene's, and sqrt(g/R) in Jolt, 1/s: nothing
#: bounces below about 1 unit a second, and nothing is faster than 500, or turns faster than 47/s.
SCALE, RATE, FASTEST = 50.0, 2.5, 500.0
ROOM = {"max_bodies": 64, "max_pairs": 256, "max_contact_constraints": 256, "num_threads": 1}


class _JoltWorld(steps.World):
    """A box, floor and walls, with Jolt's default parameters; the y axis points up."""

    #: Lengths and times in this world per length and time in the scene, and whether the block stays
    #: in its plane.
    scale, pace, planar = 1.0, 1.0, False

    def __init__(self, scene: Scene) -> None:
        import culverin

        self.jolt = culverin
        self.world = culverin.PhysicsWorld(settings={"gravity": (0.0, 0.0, 0.0), **ROOM})
        # Of two frictions the geometric mean counts, of two restitutions the larger.
        for face in contacts.surfaces_of(scene):
            fixed = {"friction": face.friction, "restitution": face.restitution}
            size = face.extent(SLAB, REACH)
            self._box(face.behind(SLAB), size, motion=culverin.MOTION_STATIC, **fixed)
        b, h = scene.block.half_width, scene.block.half_height
        freedom = culverin.DOF_PLANE_2D if self.planar else culverin.DOF_ALL
        moved = {"friction": scene.floor.friction, "mass": 1.0, "allowed_dofs": freedom}
        self.body = self._box((0.0, h), (b, b, h), motion=culverin.MOTION_DYNAMIC, **moved)
        self.world.step(0.0)  # what is made takes part from the next step on

    def _box(self, place: contacts.Point, size: tuple[float, float, float], **more: Any) -> int:
        """A box with these half sizes, across, deep and high."""
        x, y, width, depth, height = (self.scale * one for one in (*place, *size))
        made: int = self.world.create_body(
            pos=(x, y, 0.0), size=(width, height, depth), shape=self.jolt.SHAPE_BOX, **more
        )
        return made

    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        s, pace = self.scale, self.pace
        turn = (0.0, 0.0, math.sin(0.5 * theta), math.cos(0.5 * theta))
        self.world.set_transform(self.body, (s * x, s * y, 0.0), turn)
        self.world.set_linear_velocity(self.body, s * vx / pace, s * vy / pace, 0.0)
        self.world.set_angular_velocity(self.body, 0.0, 0.0, w / pace)

    def step(self, felt: tuple[float, float], dt: float) -> None:
        x, y = (self.scale * one / self.pace**2 for one in felt)
        self.world.set_gravity(x, y, 0.0)
        self.world.step(dt * self.pace)

    def state(self) -> steps.State:
        world, body, s, pace = self.world, self.body, self.scale, self.pace
        (x, y, _), (_, _, turn, whole) = world.get_position(body), world.get_rotation(body)
        (vx, vy, _), (_, _, w) = world.get_velocity(body), world.get_angular_velocity(body)
        angle = 2.0 * math.atan2(turn, whole)
        return x / s, y / s, angle, vx / s * pace, vy / s * pace, w * pace


class _RigidJoltWorld(_JoltWorld):
    """A block that stays in its plane, in units in which slow contacts bounce, whatever its size.

    Jolt's damping is compensated.
    """

    scale, planar = SCALE, True

    def __init__(self, scene: Scene) -> None:
        self.pace = math.sqrt(scene.gravity / scene.block.radius) / RATE
        super().__init__(scene)

    def step(self, felt: tuple[float, float], dt: float) -> None:
        kept = 1.0 - DAMPING * dt * self.pace  # Jolt makes (v + g dt) (1 - c dt) of a velocity v
        world, body = self.world, self.body
        (vx, vy, _), (_, _, w) = world.get_velocity(body), world.get_angular_velocity(body)
        if math.hypot(vx, vy) > 0.999 * FASTEST:
            most = FASTEST / self.scale * self.pace
            raise ModelFailure(f"Jolt holds no speed above {most:.3g} R/s")
        world.set_linear_velocity(body, vx / kept, vy / kept, 0.0)
        world.set_angular_velocity(body, 0.0, 0.0, w / kept)
        super().step((felt[0] / kept, felt[1] / kept), dt)


class Jolt(Engine):
    """Jolt; at its best in the plane, undamped, and in units in which slow contacts bounce."""

    name: ClassVar[str] = "jolt"
    module: ClassVar[str] = "culverin"
    first_python: ClassVar[tuple[int, int]] = (3, 12)
    precision: ClassVar[Literal["double", "single"]] = "single"
    fixed_because: ClassVar[str] = "Jolt's velocities are in single precision"
    homogeneous_only: ClassVar[bool] = True
    worlds: ClassVar[Worlds] = (_RigidJoltWorld, _JoltWorld)
    contact_parameters: ClassVar[ContactParameters] = ContactParameters(
        (0.0, 1.2),
        {
            "create_body(block)": "friction={friction:.4g}, restitution=0 (of two restitutions the"
            " larger counts, of two frictions the geometric mean)",
            "create_body(floor)": "friction={friction:.4g}, restitution={restitution:.4g}",
            "remark": "contacts below about 1 m/s do not bounce",
        },
    )
    advice: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "damping": "culverin cannot set its damping of 0.05/s",
            "restitution": "lengths: nothing bounces below about 1 a second",
            "friction": "frictions give their geometric mean",
        }
    )


FACTS = EngineFacts(
    engine=Jolt,
    label="Jolt",
    summary="the physics engine Jolt (single precision)",
    look=LineLook("#a03e3e", "#dd8a84", (7.0, 1.5), "*"),
)
