"""DART (dartpy) as a model of the rocking block."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from rockcheck.engines import contacts, steps
from rockcheck.engines.engine import ContactParameters, Engine, Worlds
from rockcheck.engines.facts import BenchmarkSteps, EngineFacts, LineLook, SpectrumPlay
from rockcheck.scenes import Scene

SLAB = 10.0  # half the thickness of floor and walls
REACH = 1000.0  # half their extent
#: DART drops rebounds slower than 0.1 of its units of length a second, and caps them at 100: sqrt(g
#: R) is made so many of them.
NATURAL_SPEED = 30.0
#: Of its iterative solver, in so many sweeps at least; its direct one yields by 3e-4 g dt in each
#: step.
SWEEPS, TOLERANCE = 100, 1e-8


class _DartWorld(steps.World):
    """A planar box, floor and walls, with DART's default parameters.

    `scale`: lengths in this world per length in the scene.
    """

    def __init__(self, scene: Scene, scale: float = 1.0) -> None:
        import dartpy

        self.dart: Any = dartpy
        self.scale = np.array([scale, scale, 1.0])
        self.world = dartpy.simulation.World()
        b, h = scale * scene.block.half_width, scale * scene.block.half_height
        self.block = dartpy.dynamics.Skeleton("block")
        joint, body = self.block.createPlanarJointAndBodyNodePair()
        joint.setArbitraryPlane([1.0, 0.0, 0.0], [0.0, 0.0, 1.0])
        inertia = scale**2 * scene.block.gyration_squared
        body.setInertia(dartpy.dynamics.Inertia(1.0, np.zeros(3), inertia * np.eye(3)))
        # Restitutions of two bodies multiply, of frictions the smaller counts: the block's leave
        # those of floor and walls.
        size = (2.0 * b, 2.0 * b, 2.0 * h)
        self.contact = self._box(body, size, scene.floor.friction, 1.0)
        if not scene.block.homogeneous:
            dx, dz = scale * np.array(scene.block.offset)
            body.getShapeNode(0).setRelativeTranslation([-dx, 0.0, -dz])
        self.world.addSkeleton(self.block)
        for surface in contacts.surfaces_of(scene):
            slab = dartpy.dynamics.Skeleton(surface.surface)
            joint, body = slab.createWeldJointAndBodyNodePair()
            x, z = surface.behind(SLAB)
            place = dartpy.math.Isometry3()
            place.set_translation([scale * x, 0.0, scale * z])
            joint.setTransformFromParentBodyNode(place)
            size = surface.extent(2.0 * scale * SLAB, 2.0 * scale * REACH)
            self._box(body, size, surface.friction, surface.restitution)
            self.world.addSkeleton(slab)

    def _box(self, body: Any, size: Any, friction: float, restitution: float) -> Any:
        """A box as a body's shape; returns what holds its friction and restitution."""
        node = body.createShapeNode(self.dart.dynamics.BoxShape(size))
        node.createCollisionAspect()
        contact = node.createDynamicsAspect()
        contact.setFrictionCoeff(friction)
        contact.setRestitutionCoeff(restitution)
        return contact

    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        self.block.setPositions(self.scale * (x, y, theta))
        self.block.setVelocities(self.scale * (vx, vy, w))

    def step(self, felt: tuple[float, float], dt: float) -> None:
        self.world.setTimeStep(dt)
        scale = self.scale[0]
        self.world.setGravity([scale * felt[0], 0.0, scale * felt[1]])
        self.world.step()

    def state(self) -> steps.State:
        pose, velocity = (
            self.block.getPositions() / self.scale,
            self.block.getVelocities() / self.scale,
        )
        return (*pose.tolist(), *velocity.tolist())


class _RigidDartWorld(_DartWorld):
    """A block that never sleeps, and whose penetration is corrected apart from its velocity.

    In its units even slow contacts bounce.
    """

    embedding = steps.EMBEDDED

    def __init__(self, scene: Scene, iterative: bool = False) -> None:
        super().__init__(scene, NATURAL_SPEED / math.sqrt(scene.gravity * scene.block.radius))
        solver = self.world.getConstraintSolver()
        solver.setSplitImpulseEnabled(True)
        if iterative:
            options = self.dart.constraint.NsgsFrictionSolver.Options()
            options.maxSweeps, options.tolerance = contacts.sweeps(scene.block, SWEEPS), TOLERANCE
            solver.setBoxedLcpSolver(self.dart.constraint.NsgsFrictionSolver(options))
        sleep = self.world.getDeactivationOptions()
        sleep.mEnabled = False
        self.world.setDeactivationOptions(sleep)

    def bounce(self, bouncing: bool) -> None:
        self.contact.setRestitutionCoeff(float(bouncing))


class Dart(Engine):
    """DART, with FCL's collision detection.

    Its best settings: penetration is corrected apart from velocity, and nothing sleeps.
    """

    name: ClassVar[str] = "dart"
    module: ClassVar[str] = "dartpy"
    worlds: ClassVar[Worlds] = (_RigidDartWorld, _DartWorld)
    contact_parameters: ClassVar[ContactParameters] = ContactParameters(
        (0.0, 1.0),
        {
            "block": "setRestitutionCoeff(1), setFrictionCoeff({friction:.4g}) (restitutions"
            " multiply, the smaller friction counts)",
            "floor": "setRestitutionCoeff({restitution:.4g}), setFrictionCoeff({friction:.4g})",
            "world": "contacts below 0.1 m/s do not bounce; the error reduction of 0.01 cannot be"
            " set from Python",
        },
    )
    advice: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "creep": "setSplitImpulseEnabled; another setBoxedLcpSolver",
            "restitution": "setRestitutionCoeff of both bodies; below 0.1 m/s nothing bounces",
            "penetration": "setSplitImpulseEnabled",
            "friction": "setFrictionCoeff of both bodies: the smaller counts",
            "solver": "setBoxedLcpSolver: tolerance and sweeps",
            "sleep": "setDeactivationOptions",
        }
    )

    def rigid_world(self, scene: Scene) -> steps.World:
        """The scene as DART holds it, with the solver that suits the steps."""
        return _RigidDartWorld(scene, iterative=isinstance(self.steps, steps.AdaptiveStep))

    def notes(self, scene: Scene) -> list[str]:
        """Also that a flat landing may not stay flat on a floor that bounces."""
        tips = "dart does not keep a bouncing block flat: it may tip at its second landing"
        return super().notes(scene) + [tips] * (scene.floor.restitution > 0.0)


FACTS = EngineFacts(
    engine=Dart,
    label="DART",
    summary="the physics engine DART",
    look=LineLook("#8c564b", "#c58a7f", (6.0, 1.0, 1.0, 1.0), ">"),
    # A run costs four times the other engines': fewer nodes, and no step below 1e-4 s.
    spectrum=SpectrumPlay({"time_step": "adaptive", "largest_step": 4e-3}, share=0.1),
    benchmark=BenchmarkSteps(convergence=(1e-3, 1e-4)),
    in_stress_maps=True,
    dear_adaptive_steps=True,
)
