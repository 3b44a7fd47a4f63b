"""pymunk (Chipmunk, in two dimensions) as a model of the rocking block."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import ClassVar

from rockcheck.engines import contacts, steps
from rockcheck.engines.engine import ContactParameters, Engine, Worlds
from rockcheck.engines.facts import BenchmarkSteps, EngineFacts, LineLook, SpectrumPlay
from rockcheck.scenes import Scene

# half the thickness of floor and walls: Chipmunk's normals are exact where shapes do not cross each
# other's middle
SLAB = 10.0
REACH = 1000.0  # half their extent
KEPT = 0.5  # share of a penetration that is left after a second
ITERATIONS = 200  # at least


class _PymunkWorld(steps.World):
    """A space of its own with a box, floor and walls, and Chipmunk's default parameters."""

    slab = 0.0  # m: half the thickness of floor and walls

    def __init__(self, scene: Scene) -> None:
        import pymunk

        b, h, slab = scene.block.half_width, scene.block.half_height, self.slab
        self.space = pymunk.Space()
        self.body = pymunk.Body(1.0, scene.block.gyration_squared)
        # Friction and elasticity of two shapes multiply: the block's are 1, so that those of floor
        # and walls count.
        dx, dz = scene.block.offset
        self.box = pymunk.Poly(
            self.body, [(x - dx, z - dz) for x, z in ((-b, -h), (b, -h), (b, h), (-b, h))]
        )
        self.box.friction = self.box.elasticity = 1.0
        self.space.add(self.body, self.box)
        for surface in contacts.surfaces_of(scene):
            (x, z), (nx, nz) = surface.behind(slab), surface.normal
            ends = [(x + way * REACH * nz, z + way * REACH * abs(nx)) for way in (-1.0, 1.0)]
            segment = pymunk.Segment(self.space.static_body, *ends, slab)
            segment.friction, segment.elasticity = surface.friction, surface.restitution
            self.space.add(segment)

    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        self.body.position, self.body.angle = (x, y), theta
        self.body.velocity, self.body.angular_velocity = (vx, vy), w

    def step(self, felt: tuple[float, float], dt: float) -> None:
        self.space.gravity = felt
        self.space.step(dt)

    def state(self) -> steps.State:
        body = self.body
        (x, y), (vx, vy) = body.position, body.velocity
        return x, y, body.angle, vx, vy, body.angular_velocity


class _RigidPymunkWorld(_PymunkWorld):
    """Contacts without slop, solved to convergence."""

    slab = SLAB
    embedding = steps.EMBEDDED

    def __init__(self, scene: Scene) -> None:
        super().__init__(scene)
        self.space.collision_slop = 0.0
        self.space.collision_bias = KEPT
        self.space.iterations = contacts.sweeps(scene.block, ITERATIONS)
        self.space.collision_persistence = (
            1  # steps after which a contact that has opened is forgotten
        )
        # Between the walls, wherever the mass is in the box.
        self.aloft = (scene.block.offset[0], 10.0 * scene.block.radius, 0.0, 0.0, 0.0, 0.0)

    def bounce(self, bouncing: bool) -> None:
        self.box.elasticity = float(bouncing)

    def push(
        self,
        pose: steps.Vector,
        velocity: steps.Vector,
        dt: float,
        felt: tuple[float, float],
        bouncing: bool,
    ) -> steps.Vector:
        """Velocity after `dt` s with the contacts closed at `pose`.

        Chipmunk begins with the impulses of the step before, which has to be as long: a step aloft
        makes it forget them. It moves a body before it looks for contacts.
        """
        self.place(*self.aloft)
        self.step((0.0, 0.0), dt)
        (x, y, theta), (vx, vy, w) = pose, velocity
        return super().push(
            (x - vx * dt, y - vy * dt, theta - w * dt), velocity, dt, felt, bouncing
        )


class Pymunk(Engine):
    """pymunk; at its best with a converged solver and without slop."""

    name: ClassVar[str] = "pymunk"
    module: ClassVar[str] = "pymunk"
    worlds: ClassVar[Worlds] = (_RigidPymunkWorld, _PymunkWorld)
    contact_parameters: ClassVar[ContactParameters] = ContactParameters(
        (0.0, 1.2),
        {
            "block": "elasticity=1, friction=1 (of two shapes they multiply)",
            "floor": "elasticity={restitution:.4g}, friction={friction:.4g}",
            "space": "collision_bias=0.0018 (0.9 ** 60 a second), collision_slop=0.1",
        },
    )
    advice: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "creep": "Space.collision_bias, collision_slop, iterations",
            "damping": "Space.damping",
            "restitution": "elasticity of both shapes: they multiply",
            "penetration": "Space.collision_slop, collision_bias",
            "corners": "Space.collision_slop; radius of the Poly",
            "friction": "friction of both shapes: they multiply",
            "solver": "Space.iterations",
            "sleep": "Space.sleep_time_threshold",
        }
    )


FACTS = EngineFacts(
    engine=Pymunk,
    label="pymunk",
    summary="the physics engine pymunk (Chipmunk, in two dimensions)",
    look=LineLook("#7a8a00", "#b5c334", (1.0, 1.0), "<"),
    # Fewer nodes show whether it agrees; a step of 3e-5 s would take too long.
    spectrum=SpectrumPlay({"time_step": "adaptive", "largest_step": 2e-3}, share=0.3),
    benchmark=BenchmarkSteps(convergence=(1e-3, 1e-4, 4e-5)),
    in_stress_maps=True,
)
