"""Physics engines as models of a rocking block: each plays a scene with box, floor and walls."""

if __name__ == "engines":  # found in the folder of the sources: it would be a second copy
    raise ImportError("engines is a part of rockcheck: import rockcheck.engines")


from rockcheck.engines.box2d_engine import Box2D
from rockcheck.engines.dart_engine import Dart
from rockcheck.engines.drake_engine import Drake
from rockcheck.engines.jolt_engine import Jolt
from rockcheck.engines.mujoco_engine import MuJoCo
from rockcheck.engines.physx_engine import PhysX
from rockcheck.engines.pybullet_engine import PyBullet
from rockcheck.engines.pymunk_engine import Pymunk

__all__ = ["Box2D", "Dart", "Drake", "Jolt", "MuJoCo", "PhysX", "PyBullet", "Pymunk"]
