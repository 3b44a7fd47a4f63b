"""`rockcheck conformance --tune`: engines' parameters for a wanted restitution and friction.

They are found by dropping a block and by sliding it.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from rockcheck.engines.steps import march_fixed
from rockcheck.scenes import Floor, InputError, ModelFailure, Scene
from rockcheck.scenes.errors import printable
from rockcheck.validation.execute.models import build, home
from rockcheck.validation.execute.pool import Failure
from rockcheck.validation.execute.provenance import code_digest
from rockcheck.validation.finding import Column, Finding, Mark, Table, text
from rockcheck.validation.studies.conformance.phenomena import DROP, SQUAT, FloatArray, G
from rockcheck.validation.study import Study, Task

#: Tolerance of the restitution, absolute, and of the friction, relative.
NEAR = 2e-3
SLIDING = 1.5  # m/s
#: Allowed values: least and most.
WANTED = {
    "restitution": (0.0, 1.0),
    "friction": (1e-6, 1.3),
    "time_step": (1e-6, 0.01),
    "penetration": (0.0, math.inf),
}


@dataclass(frozen=True)
class Knob:
    """The parameter that sets an engine's restitution.

    `bounds` are its limits; `words` are all parameters in the engine's own words, in which
    `Tune` fills in the numbers.
    """

    bounds: tuple[float, float]
    words: Mapping[str, str]


KNOBS: dict[str, Knob] = {
    "mujoco": Knob(
        (0.5, 2.2),
        {
            "geom solref": "{push:.6g} {damp:.6g}",
            "geom solimp": "0.9999 0.9999 0.001 0.5 1",
            "geom friction": "{friction:.4g} 0 0",
            "option": 'timestep="{step:g}" integrator="Euler" cone="elliptic"',
        },
    ),
    "pybullet": Knob(
        (0.0, 1.2),
        {
            "changeDynamics(block)": "restitution=1, lateralFriction=1 (of two bodies they"
            " multiply)",
            "changeDynamics(floor)": "restitution={restitution:.4g},"
            " lateralFriction={friction:.4g}",
            "setPhysicsEngineParameter": "restitutionVelocityThreshold=0.2 (slower contacts do not"
            " bounce), contactERP=0.2",
        },
    ),
    "pymunk": Knob(
        (0.0, 1.2),
        {
            "block": "elasticity=1, friction=1 (of two shapes they multiply)",
            "floor": "elasticity={restitution:.4g}, friction={friction:.4g}",
            "space": "collision_bias=0.0018 (0.9 ** 60 a second), collision_slop=0.1",
        },
    ),
    "dart": Knob(
        (0.0, 1.0),
        {
            "block": "setRestitutionCoeff(1), setFrictionCoeff({friction:.4g}) (restitutions"
            " multiply, the smaller friction counts)",
            "floor": "setRestitutionCoeff({restitution:.4g}), setFrictionCoeff({friction:.4g})",
            "world": "contacts below 0.1 m/s do not bounce; the error reduction of 0.01 cannot be"
            " set from Python",
        },
    ),
    "drake": Knob(
        (0.0, 20.0),
        {
            "AddContactMaterial": "dissipation={restitution:.4g} s/m, point_stiffness="
            "{stiffness:.4g} N/m a kg, each body",
            "CoulombFriction": "{friction:.4g}, {friction:.4g}",
            "MultibodyPlant": "time_step={step:g}, DiscreteContactApproximation.kTamsi",
            "remark": "dissipation, not restitution: it holds for this speed of approach, 2 m/s,"
            " and this mass",
        },
    ),
    "box2d": Knob(
        (0.0, 1.0),
        {
            "block": "restitution=0, friction={friction:.4g} (of two restitutions the larger"
            " counts, of two frictions the geometric mean)",
            "floor": "restitution={restitution:.4g}, friction={friction:.4g}",
            "world": "restitution_threshold=1 (slower contacts do not bounce), contact_hertz=30, 4"
            " substeps",
        },
    ),
    "physx": Knob(
        (0.0, 2.0),
        {
            "PhysxMaterial(block)": "{friction:.4g}, {friction:.4g}, 0 (of two materials the mean"
            " counts)",
            "PhysxMaterial(floor)": "{friction:.4g}, {friction:.4g}, {restitution:.4g}",
            "set_scene_config": "bounce_threshold=2 (slower contacts do not bounce)",
        },
    ),
    "jolt": Knob(
        (0.0, 1.2),
        {
            "create_body(block)": "friction={friction:.4g}, restitution=0 (of two restitutions the"
            " larger counts, of two frictions the geometric mean)",
            "create_body(floor)": "friction={friction:.4g}, restitution={restitution:.4g}",
            "remark": "contacts below about 1 m/s do not bounce",
        },
    ),
}


@dataclass(frozen=True)
class Calibration:
    """Parameters in the engine's own words, and the contact reached with them.

    Reached are `restitution`, `friction` and `penetration` (m) at a `step` (s); `reached` tells
    whether they are near enough to the wanted ones.
    """

    engine: str
    step: float
    parameters: dict[str, str]
    restitution: float
    friction: float
    penetration: float
    reached: bool


def _played(model: Any, scene: Scene, parameters: Mapping[str, float], step: float) -> FloatArray:
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
    """An engine's wanted restitution and friction, and largest penetration (m), at a step (s)."""

    engine: str
    restitution: float
    friction: float = 0.3
    time_step: float = 1e-3
    penetration: float = math.inf

    def __post_init__(self) -> None:
        for name, (least, most) in WANTED.items():
            value = getattr(self, name)
            if not isinstance(value, int | float) or not least <= value <= most:
                reason = f"{printable(value)} is not allowed: give {least:g} to {most:g}"
                raise InputError(reason, "--tune" if name == "restitution" else f"--set {name}")

    def depends(self) -> Any:
        """Also the engine's code."""
        return {**super().depends(), "home": code_digest(home(self.engine))}

    def play(self) -> Calibration:
        """Parameters in the engine's own words, and the contact reached with them.

        The rebound of a block dropped from 0.2 m gives the restitution, the way of one sliding at
        1.5 m/s the friction. Raises `InputError` where the engine cannot reach the restitution,
        naming what it can.
        """
        from scipy.optimize import brentq

        knob, step, friction = KNOBS[self.engine], self.time_step, self.friction
        model: Any = build(self.engine, {"time_step": step, "settings": "default"})
        drop = Scene(
            name="drop",
            block=SQUAT,
            floor=Floor(friction=friction),
            initial_height=DROP,
            duration=0.65,
        )
        slide = Scene(
            name="slide",
            block=SQUAT,
            floor=Floor(friction=friction),
            initial_velocity=SLIDING,
            duration=SLIDING / (friction * G) + 0.3,
        )

        def dropped(setting: float) -> tuple[float, float]:
            """Restitution of the rebound, and penetration, m."""
            parameters = {"restitution": setting, "friction": friction}
            heights = _played(model, drop, parameters, step)[:, 1] - SQUAT.half_height
            later = heights[int((math.sqrt(2.0 * DROP / G) + 0.02) / step) :]
            return math.sqrt(max(float(np.max(later)), 0.0) / DROP), -float(np.min(heights))

        restitution, ends = self.restitution, [dropped(end)[0] for end in knob.bounds]
        if not min(ends) - NEAR <= restitution <= max(ends) + NEAR:
            raise InputError(
                f"{restitution:g} cannot be reached by {self.engine} at a step of {step:g} s:"
                f" {min(ends):.3g} to {max(ends):.3g} can",
                "--tune",
            )
        near = [
            one
            for one, end in zip(knob.bounds, ends, strict=True)
            if abs(end - restitution) <= NEAR
        ]
        found = (
            near[0]
            if near
            else brentq(
                lambda setting: dropped(setting)[0] - restitution,
                *knob.bounds,
                xtol=1e-5,
                rtol=1e-5,
            )
        )
        asked = friction
        for _ in range(12):
            way = _played(model, slide, {"restitution": found, "friction": asked}, step)[-1, 0]
            slid = SLIDING**2 / (2.0 * G * float(way))
            if abs(slid - friction) <= NEAR * friction:
                break
            asked *= friction / slid
        rebound, deep = dropped(found)
        used = {"step": step, "restitution": found, "friction": asked, **model.tuned(step)}
        used |= {"push": -used.get("erp", 0.0) / step**2, "damp": -found / step}
        words = {where: what.format_map(used) for where, what in knob.words.items()}
        reached = (
            abs(rebound - restitution) <= 5.0 * NEAR
            and abs(slid - friction) <= 5.0 * NEAR * friction
            and deep <= self.penetration
        )
        return Calibration(self.engine, step, words, rebound, slid, max(deep, 0.0), reached)


@dataclass(frozen=True)
class Tuning(Study):
    """The wanted restitution and friction of each engine."""

    wanted: tuple[Tune, ...]
    name = "tuning"
    record = Calibration

    def tasks(self, done: Mapping[Any, Any]) -> Sequence[Tune]:
        """All at once."""
        return self.wanted

    def gather(self, done: Mapping[Any, Any]) -> Finding:
        """Tables of parameters and contacts reached. Raises `InputError` where no engine can."""
        ended = list(map(done.get, self.wanted))
        found = [one for one in ended if isinstance(one, Calibration)]
        refused = [one for one in ended if isinstance(one, Failure) and one.refused]
        if refused and not found:
            raise InputError(refused[0].reason)
        reached = sum(one.reached for one in found)
        return Finding(
            self.name,
            "Parameters for a wanted restitution",
            f"{reached} of {len(self.wanted)} engines reach what is wanted.",
            [
                Table(
                    "parameters",
                    [Column("engine", kind="model"), text("where"), text("what")],
                    [[one.engine, *pair] for one in found for pair in one.parameters.items()],
                    "Parameters",
                ),
                Table(
                    "reached",
                    [
                        Column("engine", kind="model"),
                        Column("step", unit="s"),
                        Column("restitution"),
                        Column("friction"),
                        Column("penetration", unit="m", digits=2),
                        text("reached"),
                    ],
                    [
                        [
                            *(one.engine, one.step, one.restitution, one.friction, one.penetration),
                            Mark(one.reached, "pass" if one.reached else "fail"),
                        ]
                        for one in found
                    ],
                    "Reached",
                ),
            ],
            {"engines": {one.engine: asdict(one) for one in found}},
            "pass" if reached == len(self.wanted) else "fail",
            int(reached < len(self.wanted)),
        )
