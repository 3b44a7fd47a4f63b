from .box2d_engine import Box2D as Box2D
from .dart_engine import Dart as Dart
from .drake_engine import Drake as Drake
from .jolt_engine import Jolt as Jolt
from .mujoco_engine import MuJoCo as MuJoCo
from .physx_engine import PhysX as PhysX
from .pybullet_engine import PyBullet as PyBullet
from .pymunk_engine import Pymunk as Pymunk
