"""Physics engines as models of a rocking block: each plays a scene with box, floor and walls."""

from rockcheck.engines.dart_engine import Dart
from rockcheck.engines.drake_engine import Drake
from rockcheck.engines.mujoco_engine import MuJoCo
from rockcheck.engines.pybullet_engine import PyBullet
from rockcheck.engines.pymunk_engine import Pymunk

__all__ = ["Dart", "Drake", "MuJoCo", "PyBullet", "Pymunk"]
