"""PyBullet as a model of the rocking block."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from engines.contacts import contacts_of
from engines.engine import Engine, World
from scenes import Scene

FloatArray = NDArray[np.float64]
CORNER_RADIUS = 1e-5  # m
SLAB = 1.0  # m, half the thickness of floor and walls
REACH = 100.0  # m, half their extent
FLOOR_ERP = 0.02  # share of a penetration that one step removes; none where it would add to a bounce or make one


class PyBullet(Engine):
    """PyBullet in double precision, its default solver iterated further, without slop, damping and sleeping."""

    name: ClassVar[str] = "pybullet"

    def world(self, scene: Scene) -> World:
        """The scene as PyBullet holds it."""
        return _PyBulletWorld(scene, self.time_step, stock=self.settings == "default")


class _PyBulletWorld:
    """A physics server of its own with block, floor and walls."""

    def __init__(self, scene: Scene, time_step: float, *, stock: bool) -> None:
        import pybullet

        self.bullet: Any = pybullet
        self.client: int = pybullet.connect(pybullet.DIRECT)
        self.options: dict[str, Any] = {"physicsClientId": self.client}
        pybullet.setPhysicsEngineParameter(fixedTimeStep=time_step, **self.options)
        self.body = self._box(scene) if stock else self._corners(scene)
        if not stock:
            pybullet.setPhysicsEngineParameter(
                numSolverIterations=50,
                solverResidualThreshold=0.0,
                contactSlop=0.0,
                restitutionVelocityThreshold=0.0,
                contactERP=0.0 if scene.walls or scene.floor.restitution else FLOOR_ERP,
                **self.options,
            )
        self._slab(0.0, 1.0, 0.0, 0.0 if stock else CORNER_RADIUS, scene.floor.friction, scene.floor.restitution)
        for wall in scene.walls:
            inward = 1.0 if wall.side == "left" else -1.0
            self._slab(inward, 0.0, scene.block.half_width + wall.gap, 0.0 if stock else CORNER_RADIUS, 0.0, wall.restitution)

    def _box(self, scene: Scene) -> int:
        half = [scene.block.half_width, scene.block.half_width, scene.block.half_height]
        shape = self.bullet.createCollisionShape(self.bullet.GEOM_BOX, halfExtents=half, **self.options)
        body = self.bullet.createMultiBody(1.0, shape, **self.options)
        # Friction and restitution of two bodies multiply: the block's are 1, so that those of floor and walls count.
        self.bullet.changeDynamics(body, -1, lateralFriction=1.0, restitution=1.0, **self.options)
        return int(body)

    def _corners(self, scene: Scene) -> int:
        """The block as tiny spheres at its corners; a huge inertia about the other axes keeps it in its plane."""
        places = [[bx, 0.0, bz] for bx, bz in dict.fromkeys(contact.corner for contact in contacts_of(scene))]
        shape = self.bullet.createCollisionShapeArray(
            shapeTypes=[self.bullet.GEOM_SPHERE] * len(places),
            radii=[CORNER_RADIUS] * len(places),
            collisionFramePositions=places,
            **self.options,
        )
        body = self.bullet.createMultiBody(1.0, shape, useMaximalCoordinates=1, **self.options)
        inertia = scene.block.radius**2 / 3.0
        self.bullet.changeDynamics(
            body,
            -1,
            mass=1.0,  # given again: the inertia alone would set it to zero
            localInertiaDiagonal=[1e6 * inertia, inertia, 1e6 * inertia],
            linearDamping=0.0,
            angularDamping=0.0,
            lateralFriction=1.0,
            spinningFriction=0.0,
            rollingFriction=0.0,
            restitution=1.0,
            **self.options,
        )
        return int(body)

    def _slab(self, normal_x: float, normal_z: float, distance: float, inset: float, friction: float, restitution: float) -> None:
        """A thick box whose face looks along the normal, `inset` m behind the surface at -distance."""
        depth = distance + inset + SLAB
        extent = [SLAB if normal_x else REACH, REACH, SLAB if normal_z else REACH]
        shape = self.bullet.createCollisionShape(self.bullet.GEOM_BOX, halfExtents=extent, **self.options)
        body = self.bullet.createMultiBody(0.0, shape, basePosition=[-normal_x * depth, 0.0, -normal_z * depth], **self.options)
        self.bullet.changeDynamics(body, -1, lateralFriction=friction, restitution=restitution, **self.options)

    def place(self, state: FloatArray) -> None:
        """Put the block where `state` says; Bullet's y axis points into the plane, so that angles change sign."""
        x, z, theta, vx, vz, w = map(float, state)
        turn = [0.0, -math.sin(0.5 * theta), 0.0, math.cos(0.5 * theta)]
        self.bullet.resetBasePositionAndOrientation(self.body, [x, 0.0, z], turn, **self.options)
        self.bullet.resetBaseVelocity(self.body, [vx, 0.0, vz], [0.0, -w, 0.0], **self.options)

    def march(self, accelerations: FloatArray) -> FloatArray:
        """States after each step."""
        bullet, body, client = self.bullet, self.body, self.client
        states = np.empty((len(accelerations), 6))
        for row, (ax, az) in enumerate(accelerations.tolist()):
            bullet.setGravity(ax, 0.0, az, physicsClientId=client)
            bullet.stepSimulation(physicsClientId=client)
            (x, _, z), (_, turn, _, whole) = bullet.getBasePositionAndOrientation(body, physicsClientId=client)
            (vx, _, vz), (_, w, _) = bullet.getBaseVelocity(body, physicsClientId=client)
            states[row] = x, z, -2.0 * math.atan2(turn, whole), vx, vz, -w
        return states

    def close(self) -> None:
        """End the physics server."""
        self.bullet.disconnect(**self.options)
