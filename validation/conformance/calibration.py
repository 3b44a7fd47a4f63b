"""An engine's own parameters for a wanted restitution and friction: found by dropping a block and sliding it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.engines.marching import march_fixed
from rockcheck.scenes import Floor, InputError, ModelFailure, Scene
from rockcheck.validation.conformance.phenomena import DROP, SQUAT, G
from rockcheck.validation.execute.models import build

FloatArray = NDArray[np.float64]
#: How near the wanted restitution has to be, and a friction, of itself.
NEAR = 2e-3
SLIDING = 1.5  # m/s


@dataclass(frozen=True)
class Knob:
    """The parameter that sets an engine's restitution: its bounds at a step, and all parameters in the engine's own words."""

    bounds: tuple[float, float]
    words: Callable[[Mapping[str, float], float], dict[str, str]]
    remark: str = ""


def _mujoco(found: Mapping[str, float], step: float) -> dict[str, str]:
    return {
        "geom solref": f"{-found['erp'] / step**2:.6g} {-found['restitution'] / step:.6g}",
        "geom solimp": "0.9999 0.9999 0.001 0.5 1",
        "geom friction": f"{found['friction']:.4g} 0 0",
        "option": f'timestep="{step:g}" integrator="Euler" cone="elliptic"',
    }


def _pybullet(found: Mapping[str, float], step: float) -> dict[str, str]:
    return {
        "changeDynamics(block)": "restitution=1, lateralFriction=1 (of two bodies they multiply)",
        "changeDynamics(floor)": f"restitution={found['restitution']:.4g}, lateralFriction={found['friction']:.4g}",
        "setPhysicsEngineParameter": "restitutionVelocityThreshold=0.2 (slower contacts do not bounce), contactERP=0.2",
    }


def _pymunk(found: Mapping[str, float], step: float) -> dict[str, str]:
    return {
        "block": "elasticity=1, friction=1 (of two shapes they multiply)",
        "floor": f"elasticity={found['restitution']:.4g}, friction={found['friction']:.4g}",
        "space": "collision_bias=0.0018 (0.9 ** 60 a second), collision_slop=0.1",
    }


def _dart(found: Mapping[str, float], step: float) -> dict[str, str]:
    return {
        "block": f"setRestitutionCoeff(1), setFrictionCoeff({found['friction']:.4g}) (restitutions multiply, the smaller friction counts)",
        "floor": f"setRestitutionCoeff({found['restitution']:.4g}), setFrictionCoeff({found['friction']:.4g})",
        "world": "contacts below 0.1 m/s do not bounce; the error reduction of 0.01 cannot be set from Python",
    }


def _drake(found: Mapping[str, float], step: float) -> dict[str, str]:
    return {
        "AddContactMaterial": f"dissipation={found['restitution']:.4g} s/m, point_stiffness={found['stiffness']:.4g} N/m a kg, each body",
        "CoulombFriction": f"{found['friction']:.4g}, {found['friction']:.4g}",
        "MultibodyPlant": f"time_step={step:g}, DiscreteContactApproximation.kTamsi",
    }


KNOBS: dict[str, Knob] = {
    "mujoco": Knob((0.5, 2.2), _mujoco),
    "pybullet": Knob((0.0, 1.2), _pybullet),
    "pymunk": Knob((0.0, 1.2), _pymunk),
    "dart": Knob((0.0, 1.0), _dart),
    "drake": Knob((0.0, 20.0), _drake, "dissipation, not restitution: it holds for this speed of approach, 2 m/s, and this mass"),
}


@dataclass(frozen=True)
class Calibration:
    """What an engine needs, in its own words, and what was reached with it: restitution, friction, penetration (m)."""

    engine: str
    step: float
    parameters: dict[str, str]
    restitution: float
    friction: float
    penetration: float
    reached: bool
    remark: str


def calibrate(engine: str, *, restitution: float, friction: float, step: float, penetration: float = math.inf) -> Calibration:
    """The parameters with which a block dropped from 0.2 m rebounds, and one at 1.5 m/s slides, as wanted.

    Raises `InputError` where the engine cannot reach the restitution, naming what it can.
    """
    from scipy.optimize import brentq

    knob = KNOBS[engine]
    model: Any = build(engine, {"time_step": step, "settings": "default"})
    drop = Scene(name="drop", block=SQUAT, floor=Floor(friction=friction), initial_height=DROP, duration=0.65)
    slide = Scene(
        name="slide", block=SQUAT, floor=Floor(friction=friction), initial_velocity=SLIDING, duration=SLIDING / (friction * G) + 0.3
    )
    fall = math.sqrt(2.0 * DROP / G)

    def heights(setting: float) -> FloatArray:
        return _played(model, drop, {"restitution": setting, "friction": friction}, step)

    def bounced(setting: float) -> float:
        states = heights(setting)
        later = states[int((fall + 0.02) / step) :, 1]
        return math.sqrt(max(float(np.max(later)) - SQUAT.half_height, 0.0) / DROP)

    low, high = knob.bounds
    ends = bounced(low), bounced(high)
    if not min(ends) - NEAR <= restitution <= max(ends) + NEAR:
        raise InputError(
            f"{restitution:g} cannot be reached by {engine} at a step of {step:g} s: {min(ends):.3g} to {max(ends):.3g} can",
            "--restitution",
        )
    found = low if abs(ends[0] - restitution) <= NEAR else high if abs(ends[1] - restitution) <= NEAR else math.nan
    if math.isnan(found):
        found = brentq(lambda setting: bounced(setting) - restitution, low, high, xtol=1e-5, rtol=1e-5)
    asked = friction
    for _ in range(12):
        way = _played(model, slide, {"restitution": found, "friction": asked}, step)[-1, 0]
        slid = SLIDING**2 / (2.0 * G * float(way))
        if abs(slid - friction) <= NEAR * friction:
            break
        asked *= friction / slid
    deep = SQUAT.half_height - float(np.min(heights(found)[:, 1]))
    used = {"restitution": found, "friction": asked, **model.tuned(step)}
    rebound = bounced(found)
    near = abs(rebound - restitution) <= 5.0 * NEAR and abs(slid - friction) <= 5.0 * NEAR * friction and deep <= penetration
    return Calibration(engine, step, knob.words(used, step), rebound, slid, max(deep, 0.0), near, knob.remark)


def _played(model: Any, scene: Scene, parameters: Mapping[str, float], step: float) -> FloatArray:
    """States after each step."""
    times: FloatArray = step * np.arange(math.ceil(scene.duration / step) + 1, dtype=np.float64)
    world = model.tuned_world(scene, parameters, step)
    try:
        return march_fixed(world, scene, times, np.tile([0.0, -G], (len(times) - 1, 1)))[1]
    except ModelFailure as error:
        raise InputError(f"{model.name} cannot play a drop with these parameters: {error}", "--step") from None
    finally:
        world.close()
