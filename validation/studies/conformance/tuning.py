"""`rockcheck conformance --tune`: engines' own parameters for a wanted restitution and friction,
found by dropping a block and sliding it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rockcheck.engines.marching import march_fixed
from rockcheck.scenes import Floor, InputError, ModelFailure, Scene
from rockcheck.scenes.errors import printable
from rockcheck.validation.execute.models import build, home
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.execute.provenance import code_digest
from rockcheck.validation.finding import Column, Finding, Mark, Table, text
from rockcheck.validation.studies.conformance.phenomena import DROP, SQUAT, G
from rockcheck.validation.study import Study, Task

FloatArray = NDArray[np.float64]
#: How near the wanted restitution has to be, and a friction, of itself.
NEAR = 2e-3
SLIDING = 1.5  # m/s


@dataclass(frozen=True)
class Knob:
    """The parameter that sets an engine's restitution: its bounds at a step, and all parameters in
    the engine's own words."""

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
    "drake": Knob(
        (0.0, 20.0),
        _drake,
        "dissipation, not restitution: it holds for this speed of approach, 2 m/s, and this mass",
    ),
}


@dataclass(frozen=True)
class Calibration:
    """What an engine needs, in its own words, and what was reached with it: restitution, friction,
    penetration (m)."""

    engine: str
    step: float
    parameters: dict[str, str]
    restitution: float
    friction: float
    penetration: float
    reached: bool
    remark: str


def calibrate(
    engine: str, *, restitution: float, friction: float, step: float, penetration: float = math.inf
) -> Calibration:
    """The parameters with which a block dropped from 0.2 m rebounds, and one at 1.5 m/s slides, as
    wanted.

    Raises `InputError` where the engine cannot reach the restitution, naming what it can.
    """
    from scipy.optimize import brentq

    knob = KNOBS[engine]
    model: Any = build(engine, {"time_step": step, "settings": "default"})
    drop = Scene(
        name="drop", block=SQUAT, floor=Floor(friction=friction), initial_height=DROP, duration=0.65
    )
    slide = Scene(
        name="slide",
        block=SQUAT,
        floor=Floor(friction=friction),
        initial_velocity=SLIDING,
        duration=SLIDING / (friction * G) + 0.3,
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
            "--tune",
        )
    found = (
        low
        if abs(ends[0] - restitution) <= NEAR
        else high
        if abs(ends[1] - restitution) <= NEAR
        else math.nan
    )
    if math.isnan(found):
        found = brentq(
            lambda setting: bounced(setting) - restitution, low, high, xtol=1e-5, rtol=1e-5
        )
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
    near = (
        abs(rebound - restitution) <= 5.0 * NEAR
        and abs(slid - friction) <= 5.0 * NEAR * friction
        and deep <= penetration
    )
    return Calibration(
        engine, step, knob.words(used, step), rebound, slid, max(deep, 0.0), near, knob.remark
    )


def _played(model: Any, scene: Scene, parameters: Mapping[str, float], step: float) -> FloatArray:
    """States after each step."""
    times: FloatArray = step * np.arange(math.ceil(scene.duration / step) + 1, dtype=np.float64)
    world = model.tuned_world(scene, parameters, step)
    try:
        return march_fixed(world, scene, times, np.tile([0.0, -G], (len(times) - 1, 1)))[1]
    except ModelFailure as error:
        raise InputError(
            f"{model.name} cannot play a drop with these parameters: {error}", "--set time_step"
        ) from None
    finally:
        world.close()


@dataclass(frozen=True)
class Tune(Task):
    """What is wanted of an engine."""

    engine: str
    restitution: float
    friction: float
    step: float
    penetration: float

    def depends(self) -> Any:
        """Also the engine's code."""
        return {**super().depends(), "engine": code_digest(home(self.engine))}


#: What may be wanted: least and most.
WANTED = {"friction": (1e-6, 1.3), "time_step": (1e-6, 0.01), "penetration": (0.0, math.inf)}


@dataclass(frozen=True)
class Tuning(Study):
    """Engines, and what is wanted of them: restitution, friction, penetration (m) at a step (s)."""

    engines: tuple[str, ...]
    restitution: float
    friction: float = 0.3
    time_step: float = 1e-3
    penetration: float = math.inf
    name = "tuning"
    record = Calibration

    def __post_init__(self) -> None:
        for name, (least, most) in {"restitution": (0.0, 1.0), **WANTED}.items():
            value = getattr(self, name)
            if not isinstance(value, int | float) or not least <= value <= most:
                reason = f"{printable(value)} is not allowed: give {least:g} to {most:g}"
                raise InputError(reason, "--tune" if name == "restitution" else f"--set {name}")

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Tune]:
        """One an engine."""
        wanted = (self.restitution, self.friction, self.time_step, self.penetration)
        return [Tune(engine, *wanted, expected=1e-3 / self.time_step) for engine in self.engines]

    @staticmethod
    def play(task: Tune) -> Calibration:
        """Finds the parameters."""
        return calibrate(**task.fields())

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """Parameters, and what they reach. Raises `InputError` where no engine can."""
        found = [one for one in done.values() if isinstance(one, Calibration)]
        refused = [one for one in done.values() if isinstance(one, Failure) and one.refused]
        if refused and not found:
            raise InputError(refused[0].reason)
        reached = sum(one.reached for one in found)
        wanted = f"restitution {self.restitution:g} at friction {self.friction:g}"
        columns = [
            Column("restitution"),
            Column("friction"),
            Column("penetration", unit="m", digits=2),
            Column("reached", kind="text"),
            text("remark", brief=False),
        ]
        rows = [
            [one.engine, one.restitution, one.friction, one.penetration]
            + [Mark(one.reached, "pass" if one.reached else "fail"), one.remark]
            for one in found
        ]
        words = [[one.engine, *pair] for one in found for pair in one.parameters.items()]
        engine = Column("engine", kind="model")
        return Finding(
            self.name,
            "Parameters for a wanted restitution",
            f"{reached} of {len(self.engines)} engines reach {wanted}.",
            [
                Table("parameters", [engine, text("where"), text("what")], words, "Parameters"),
                Table("reached", [engine, *columns], rows, f"Reached at {self.time_step:g} s"),
            ],
            {"engines": {one.engine: asdict(one) for one in found}},
            "pass" if reached == len(self.engines) else "fail",
            int(reached < len(self.engines)),
        )
