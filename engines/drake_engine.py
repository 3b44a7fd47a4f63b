"""Drake as a model of the rocking block."""

import logging
import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from rockcheck.engines import steps
from rockcheck.engines.contacts import corners_of, surfaces_of
from rockcheck.engines.engine import ContactParameters, Engine, Worlds
from rockcheck.engines.facts import BenchmarkSteps, EngineFacts, LineLook, SpectrumPlay
from rockcheck.scenes import Floor, ModelFailure, Scene, printable

CORNER_RADIUS = 1e-5  # of the block's radius
STIFFNESS = 2e8  # of each of two bodies in contact, N/m for a block of 1 kg and R = 1 m
#: Of Hunt and Crossley, s/m: nothing bounces, and an impact is over within its step.
DISSIPATION = 1e4
#: m/s: slower slip counts as none; at 1e-8 the solver often fails.
STICTION, COARSEST_STICTION = 1e-7, 1e-3
IMPACT_STEPS = 40  # in which an impact can bounce
SLAB, REACH = 20.0, 600.0  # thickness and extent of floor and walls


class _DrakeWorld(steps.World):
    """A plant with a planar box, floor and walls, with Drake's default parameters.

    The plant is made by `ready`, when the step's length is known.
    """

    def __init__(self, scene: Scene) -> None:
        from pydrake import geometry, math
        from pydrake.multibody import plant

        self.scene = scene
        self.geometry, self.contacts, self.math = geometry, plant, math

    def place(self, x: float, y: float, theta: float, vx: float, vy: float, w: float) -> None:
        self.plant.SetPositionsAndVelocities(self.context, np.array([x, y, theta, vx, vy, w]))

    def step(self, felt: tuple[float, float], dt: float) -> None:
        self.force.set_value([felt[0], felt[1], 0.0])
        self.steps += 1
        try:
            self.simulator.AdvanceTo(self.steps * dt)
        except RuntimeError as error:  # its solver has not converged
            raise ModelFailure(f"Drake: {printable(error, 200)}") from None

    def state(self) -> steps.State:
        state: steps.State = tuple(self.plant.GetPositionsAndVelocities(self.context).tolist())
        return state

    def ready(self, dt: float) -> None:
        from pydrake.multibody import tree
        from pydrake.systems import analysis, framework

        self.steps = 0
        builder = framework.DiagramBuilder()
        self.plant, _ = self.contacts.AddMultibodyPlantSceneGraph(builder, time_step=dt)
        self.plant.mutable_gravity_field().set_gravity_vector(np.zeros(3))
        inertia = tree.UnitInertia(*[self.scene.block.gyration_squared] * 3)
        body = self.plant.AddRigidBody("block", tree.SpatialInertia(1.0, np.zeros(3), inertia))
        # The joint's plane is its frame's x and y: to the right and up.
        turned = self.math.RotationMatrix([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
        frames = [
            self.plant.AddFrame(
                tree.FixedOffsetFrame(name, frame, self.math.RigidTransform(turned))
            )
            for name, frame in (
                ("plane of the world", self.plant.world_frame()),
                ("plane of the block", body.body_frame()),
            )
        ]
        self.plant.AddJoint(tree.PlanarJoint("plane", *frames, np.zeros(3)))
        self.shape(body)
        self.plant.Finalize()
        self.simulator = analysis.Simulator(builder.Build())
        self.context = self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())
        self.force = (
            self.plant.get_applied_generalized_force_input_port()
            .FixValue(self.context, np.zeros(3))
            .GetMutableData()
        )
        self.simulator.Initialize()

    def shape(self, body: Any) -> None:
        block, (dx, dz) = self.scene.block, self.scene.block.offset
        b, h, mu = block.half_width, block.half_height, self.scene.floor.friction
        add, world = self.plant.RegisterCollisionGeometry, self.plant.world_body()
        friction, half_space = self.contacts.CoulombFriction, self.geometry.HalfSpace
        box = self.geometry.Box(2.0 * b, 2.0 * b, 2.0 * h)
        add(body, self.math.RigidTransform([-dx, 0.0, -dz]), box, "box", friction(mu, mu))
        # It would warn that half-spaces do not meet deformable bodies.
        logging.getLogger("drake").setLevel(logging.ERROR)
        for surface in surfaces_of(self.scene):
            (nx, nz), (x, z), rough = surface.normal, surface.behind(0.0), surface.friction
            pose = half_space.MakePose([nx, 0.0, nz], [x, 0.0, z])
            add(world, pose, half_space(), surface.surface, friction(rough, rough))


class _RigidDrakeWorld(_DrakeWorld):
    """Contacts of tiny spheres on slabs, so stiff, as they come, that a step stops them."""

    def __init__(
        self,
        scene: Scene,
        stiffness: float = STIFFNESS,
        dissipation: float = DISSIPATION,
        stiction: float = STICTION,
    ) -> None:
        super().__init__(scene)
        self.stiffness, self.dissipation, self.stiction = stiffness, dissipation, stiction
        self.coarser: _RigidDrakeWorld | None = None

    def step(self, felt: tuple[float, float], dt: float) -> None:
        """One step; repeated with a stiction speed ten times as large where it is not solved.

        This smooths the transition from stick to slip at which TAMSI fails to converge. Fails where
        the stiction speed has reached `COARSEST_STICTION`.
        """
        try:
            super().step(felt, dt)
        except ModelFailure:
            if self.stiction >= COARSEST_STICTION:
                raise
            if self.coarser is None:
                self.coarser = _RigidDrakeWorld(
                    self.scene, self.stiffness, self.dissipation, 10.0 * self.stiction
                )
                self.coarser.ready(dt)
            self.coarser.place(*self.state())
            self.coarser.step(felt, dt)
            self.place(*self.coarser.state())
            self.simulator.get_mutable_context().SetTime(self.steps * dt)
            self.simulator.Initialize()

    def shape(self, body: Any) -> None:
        plant, geometry, contacts = self.plant, self.geometry, self.contacts
        # SAP's and the lagged approximations' friction is convex: what slides lifts off, whatever
        # the step.
        plant.set_discrete_contact_approximation(contacts.DiscreteContactApproximation.kTamsi)
        plant.set_stiction_tolerance(self.stiction)

        def material(mu: float) -> Any:
            properties = geometry.ProximityProperties()
            geometry.AddContactMaterial(
                dissipation=self.dissipation,
                point_stiffness=self.stiffness,
                friction=contacts.CoulombFriction(mu, mu),
                properties=properties,
            )
            return properties

        add, world = plant.RegisterCollisionGeometry, plant.world_body()
        rough, point = material(self.scene.floor.friction), geometry.Sphere(CORNER_RADIUS)
        for n, (bx, bz) in enumerate(corners_of(self.scene)):
            add(body, self.math.RigidTransform([bx, 0.0, bz]), point, f"corner {n}", rough)
        for surface in surfaces_of(self.scene):
            x, z = surface.behind(CORNER_RADIUS + 0.5 * SLAB)
            slab, rough = geometry.Box(*surface.extent(SLAB, REACH)), material(surface.friction)
            add(world, self.math.RigidTransform([x, 0.0, z]), slab, surface.surface, rough)


class Drake(Engine):
    """Drake's discrete plant.

    Its best settings: tiny spheres as corners, stiff contacts, and TAMSI, whose friction does not
    lift.
    """

    name: ClassVar[str] = "drake"
    module: ClassVar[str] = "pydrake"
    package: ClassVar[str] = "drake"
    bounces_with: ClassVar[tuple[str, ...]] = ()
    fixed_because: ClassVar[str] = "Drake's discrete plant keeps the step it was made with"
    worlds: ClassVar[Worlds] = (_RigidDrakeWorld, _DrakeWorld)
    contact_parameters: ClassVar[ContactParameters] = ContactParameters(
        (0.0, 20.0),
        {
            "AddContactMaterial": "dissipation={restitution:.4g} s/m, point_stiffness="
            "{stiffness:.4g} N/m a kg, each body",
            "CoulombFriction": "{friction:.4g}, {friction:.4g}",
            "MultibodyPlant": "time_step={step:g}, DiscreteContactApproximation.kTamsi",
            "remark": "dissipation, not restitution: it holds for this speed of approach, 2 m/s,"
            " and this mass",
        },
    )
    advice: ClassVar[Mapping[str, str]] = MappingProxyType(
        {
            "creep": "set_stiction_tolerance, point_stiffness",
            "lift": "DiscreteContactApproximation.kTamsi",
            "restitution": "it has dissipation",
            "penetration": "point_stiffness, dissipation",
            "corners": "spheres as corners: a box on a half-space has few contact points",
            "friction": "DiscreteContactApproximation.kTamsi; spheres as corners",
            "solver": "DiscreteContactApproximation",
        }
    )

    def tuned_world(
        self, scene: Scene, parameters: Mapping[str, float], step: float
    ) -> steps.World:
        """Corners on slabs, so soft that an impact lasts for some steps.

        `restitution` is Hunt and Crossley's dissipation.
        """
        return _RigidDrakeWorld(
            scene.replace(floor=Floor(friction=parameters["friction"])),
            self.tuned(step)["stiffness"],
            parameters["restitution"],
            stiction=1e-4,
        )

    def tuned(self, step: float) -> dict[str, float]:
        """The stiffness with which a block of 1 kg is in contact for `IMPACT_STEPS`, N/m."""
        return {"stiffness": (math.pi / (IMPACT_STEPS * step)) ** 2}


FACTS = EngineFacts(
    engine=Drake,
    label="Drake",
    summary="the physics engine Drake",
    look=LineLook("#6a51a3", "#a48fd6", (3.0, 1.0), "p"),
    # A run costs twice the other engines', and a simulated second at 1e-4 s more than a second.
    spectrum=SpectrumPlay({"time_step": 1e-3}, share=0.2),
    benchmark=BenchmarkSteps((1e-2, 1e-3), (1e-3, 1e-4)),
    in_stress_maps=True,
)
