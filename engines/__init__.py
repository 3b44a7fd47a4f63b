"""Physics engines as models of a rocking block: each plays a scene with box, floor and walls."""

from rockcheck.engines.mujoco_engine import MuJoCo
from rockcheck.engines.pybullet_engine import PyBullet

__all__ = ["MuJoCo", "PyBullet"]
