"""Savings: the cost of what a scene may not need, with it and without it.

In: a kind of saving. Out: the median costs of the same scene with and without it. Called by the
study, one kind a task.
"""

import math
import re
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.batch import pack_pulses, run_batch
from rockcheck.engines import registry
from rockcheck.scenes import (
    PAPER_BLOCK,
    Floor,
    Record,
    Scene,
    Wall,
)
from rockcheck.validation.execute import models
from rockcheck.validation.studies.work_precision.benchmark_scenes import pulse
from rockcheck.validation.studies.work_precision.timings import PLAIN, grid, timed

#: A wall that the block cannot reach, m.
FAR = Wall(side="left", gap=100.0)
#: Rounds, and those of a quick benchmark.
SAVING_ROUNDS, QUICK_ROUNDS = 5, 2
#: Not in the table, and why.
NOT_MEASURED = (
    "rendering in MuJoCo: it needs a display or a GPU; no model here ever makes a renderer, nor"
    " PyBullet's window",
    "out-of-plane motion in PyBullet: it is always three-dimensional; a huge inertia about the"
    " other axes keeps the block in its plane",
)


@dataclass(frozen=True)
class Saving:
    """Cost with and without a thing that the scene does not need, in `unit`.

    `change` is the largest change of theta, alpha.
    """

    model: str
    thing: str
    unit: str
    cost_with: float
    cost_without: float
    change: float = math.nan
    remark: str = ""


Play = Callable[[], float]
#: A saving to measure: model, thing, unit, the plays with it and without it, change and remark.
Pair = tuple[str, str, str, Play, Play, float, str]


def measured(name: str, rounds: int = SAVING_ROUNDS) -> Iterator[Saving]:
    """The savings of one of `KINDS`: median costs with and without.

    The two are played in turn, after a first round that warms up.
    """
    for model, thing, unit, dear, cheap, change, remark in KINDS[name]():
        costs = [(dear(), cheap()) for _ in range(rounds + 1)][1:]
        first, second = map(median, zip(*costs, strict=True))
        yield Saving(model, thing, unit, first, second, change, remark)


# --- the event-based model, in batches over a grid of pulses


def _batches(nodes: int) -> Iterator[Pair]:
    strengths, periods = grid(PLAIN, nodes)

    def batch(scene: Scene, *, until_decided: bool = True, **settings: Any) -> tuple[Play, Any]:
        """Cost of a trajectory, us, and a run of the batch."""
        model = EventBasedModel(tolerance=1e-8, **settings)
        packed = pack_pulses(scene, model, strengths, periods)
        run = partial(run_batch, packed, model, until_decided=until_decided, strict=False, jobs=1)
        return timed(lambda _: run(), len(packed.given)), run

    sticky = PLAIN.replace(floor=Floor(friction=1.3))
    basis = batch(PLAIN)
    for thing, dear, cheap, remark in (
        (
            "wall",
            batch(PLAIN.replace(walls=(FAR,))),
            basis,
            "a wall out of reach against none: no guard, earlier decision",
        ),
        (
            "friction limit",
            batch(sticky),
            batch(sticky, friction="no-slip"),
            "μ 1.3, where the strongest pulses slip a little, against no slip",
        ),
        (
            "free flight",
            batch(PLAIN, pivot="unilateral"),
            basis,
            "unilateral against bilateral, no wall",
        ),
        (
            "the tail",
            batch(PLAIN, until_decided=False),
            basis,
            "10 s against: until outcome and peak are certain",
        ),
        (
            "vertical motion",
            batch(PLAIN.replace(vertical=Record.from_samples(np.zeros(1001), 0.01))),
            basis,
            "a record of zeros against none",
        ),
    ):
        one, other = dear[1](), cheap[1]()
        apart = np.abs(one.runs["peak"] - other.runs["peak"])[(one.side == 0) & (other.side == 0)]
        yield (
            "ebm",
            thing,
            "μs a trajectory",
            dear[0],
            cheap[0],
            float(np.max(apart, initial=0.0)) / PAPER_BLOCK.alpha,
            remark,
        )


# --- histories: every model


def _players() -> Iterator[tuple[str, models.Model, str]]:
    """A label, its model, and what else changes with the wall: of all that are installed."""
    for name in ("ebm", "ebm-unilateral", "cm"):
        yield name, models.build(name), ""
    for facts in registry.every():
        if not facts.in_short_studies or not facts.engine.installed():
            continue
        fixed = models.build(facts.name, {"time_step": 1e-3})
        yield facts.name, fixed, facts.changes_without_wall
        if facts.steps_vary:
            yield f"{facts.name} adaptive", models.build(facts.name, {"time_step": "adaptive"}), ""


def _histories() -> Iterator[Pair]:
    scene = pulse(6.0, 6.0, 0.3)
    for label, model, changes in _players():
        remark = "a wall out of reach against none"
        if changes:
            remark += f", and with it {changes}"
        yield _of_histories(
            label, "wall", (model, scene.replace(walls=(FAR,))), (model, scene), remark
        )
        if label in ("ebm", "ebm-unilateral"):
            yield _of_histories(
                label,
                "dense output",
                (model, scene.replace(output_step=0.001)),
                (model, scene.replace(output_step=scene.duration)),
                "a row each 1 ms against two rows in all",
            )
    for step in (1e-3, "adaptive"):
        label = "mujoco adaptive" if step == "adaptive" else "mujoco"
        mended, plain = (
            models.build("mujoco", {"time_step": step, "cone_correction": on})
            for on in (True, False)
        )
        yield _of_histories(
            label,
            "cone correction",
            (mended, scene),
            (plain, scene),
            "needed where the pivot slips: see the change",
        )
        sticky = scene.replace(floor=Floor(friction=1.0))
        yield _of_histories(
            label,
            "cone correction, no slip",
            (mended, sticky),
            (plain, sticky),
            "the same where the pivot sticks",
        )


def _of_histories(
    label: str,
    thing: str,
    dear: tuple[models.Model, Scene],
    cheap: tuple[models.Model, Scene],
    remark: str,
) -> Pair:
    def cost(model: models.Model, scene: Scene) -> Play:
        return lambda: 1e3 * model.simulate(scene).cost.cpu_seconds / scene.duration

    # theta by time, to the nanosecond
    first, second = (
        dict(zip(found["t"].round(9).tolist(), found["theta"].tolist(), strict=True))
        for found in (model.simulate(scene).channels for model, scene in (dear, cheap))
    )
    apart = max(abs(first[t] - second[t]) for t in first.keys() & second.keys())
    return (
        label,
        thing,
        "ms a simulated s",
        cost(*dear),
        cost(*cheap),
        apart / PAPER_BLOCK.alpha,
        remark,
    )


# --- steps of the engines themselves, in a row without anything between them

_STEPS = 3000
_TILTED = Scene(
    name="tilted",
    block=PAPER_BLOCK,
    floor=Floor(friction=1.0),
    duration=1.0,
    initial_rotation=0.3 * PAPER_BLOCK.alpha,
)


def _mujoco_steps() -> list[Pair]:
    import mujoco
    from mujoco import rollout

    from rockcheck.engines import MuJoCo

    world: Any = MuJoCo().rigid_world(_TILTED.replace(walls=(FAR,), initial_rotation=0.0))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.xml"
        mujoco.mj_saveLastXML(str(path), world.model)
        text = path.read_text(encoding="utf-8")
    loaded = {thing: _loaded(text, thing) for thing in ("", *CHANGES)}
    bare = loaded["contact pairs"]

    def steps(model: Any, data: Any) -> None:
        for _ in range(_STEPS):
            mujoco.mj_step(model, data)

    def native(data: Any) -> None:
        start = np.empty(mujoco.mj_stateSize(bare, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(bare, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        rollout.rollout(bare, data, start, nstep=_STEPS)

    played = {
        thing: timed(partial(steps, model), _STEPS, partial(_started, model))
        for thing, model in loaded.items()
    }
    whole, lean = played[""], played["contact pairs"]
    return [
        ("mujoco, bare steps", thing, "μs a step", dear, cheap, math.nan, remark)
        for thing, dear, cheap, remark in (
            ("contact pairs", whole, lean, "wall pairs out of reach against none"),
            (
                "collision search",
                played["collision search"],
                whole,
                "search among all geoms against listed pairs",
            ),
            (
                "out-of-plane motion",
                played["out-of-plane motion"],
                whole,
                "a free joint against two slides and a hinge",
            ),
            (
                "unused features",
                played["unused features"],
                whole,
                "energies, accelerometer and gyro that nobody reads",
            ),
            (
                "Python between steps",
                lean,
                timed(native, _STEPS, partial(_started, bare)),
                "against mujoco.rollout",
            ),
        )
    ]


#: Changes of MuJoCo's description of the scene, by what is not needed: patterns and what takes
#: their place. "contact pairs": no corner meets the wall that is out of reach. "collision search":
#: every corner meets every surface, found by the engine's broad phase in place of the pairs.
#: "unused features": energies and two sensors that nobody reads.
CHANGES = {
    "contact pairs": [(r'<pair geom1="left".*?/>', "")],
    "collision search": [
        (r"(?s)<contact>.*?</contact>", ""),
        (
            'contype="0" conaffinity="0"',
            'contype="1" conaffinity="1" condim="3" friction="1 0 0"',
        ),
    ],
    "out-of-plane motion": [(r"(?s)<joint.*<joint .*?/>", "<freejoint/>")],
    "unused features": [
        ("<flag ", '<flag energy="enable" '),
        ("</body>", '<site name="centre"/></body>'),
        (
            "</mujoco>",
            '<sensor><accelerometer site="centre"/><gyro site="centre"/></sensor></mujoco>',
        ),
    ],
}


def _loaded(text: str, change: str) -> Any:
    """MuJoCo's model of a description, with one of `CHANGES`; "" is none."""
    import mujoco

    for pattern, new in CHANGES.get(change, ()):
        text = re.sub(pattern, new, text)
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.gravity[:] = 0.0, 0.0, -9.81
    model.opt.timestep = 1e-3
    # The one-step contact that the engine's march sets, for pairs and for geoms alike.
    one_step = -0.01 / model.opt.timestep**2, -1.0 / model.opt.timestep
    model.pair_solref[:], model.geom_solref[:] = one_step, one_step
    model.pair_solimp[:] = model.geom_solimp[:] = 0.9999, 0.9999, 0.001, 0.5, 1.0
    return model


def _started(model: Any) -> Any:
    import mujoco

    data = mujoco.MjData(model)
    tilt, pose = _TILTED.initial_rotation, _TILTED.initial_state
    free = pose[0], 0.0, pose[1], math.cos(0.5 * tilt), 0.0, -math.sin(0.5 * tilt), 0.0
    data.qpos[:] = pose[:3] if model.nq == 3 else free
    return data


def _pybullet_steps() -> list[Pair]:
    if models.not_installed("pybullet"):
        return []
    from rockcheck.engines import PyBullet

    def steps(each: str = "", walls: tuple[Wall, ...] = (), count: int = _STEPS) -> Play:
        """Cost of a step, us, with the calls that `each` names after every step."""

        def play() -> float:
            world: Any = PyBullet().rigid_world(_TILTED.replace(walls=walls))
            bullet, options = world.bullet, world.options
            after = {
                "read": lambda: (
                    bullet.getBasePositionAndOrientation(world.body, **options),
                    bullet.getBaseVelocity(world.body, **options),
                ),
                "kept": lambda: bullet.removeState(bullet.saveState(**options), **options),
                "drawn": lambda: bullet.getCameraImage(64, 64, **options),
            }.get(each, lambda: None)

            def stepped(_: Any) -> None:
                for _ in range(count):
                    bullet.stepSimulation(**options)
                    after()

            with closing(world):
                world.place(*_TILTED.initial_state)
                bullet.setTimeStep(1e-3, **options)
                bullet.setGravity(0.0, 0.0, -9.81, **options)
                return timed(stepped, count)()

        return play

    return [
        ("pybullet, bare steps", thing, "μs a step", dear, steps(), math.nan, remark)
        for thing, dear, remark in (
            ("contact pairs", steps(walls=(FAR,)), "a wall out of reach against none"),
            ("dense output", steps("read"), "pose and velocity read after each step, as is needed"),
            ("saved states", steps("kept", count=300), "saveState, as save-and-redo would need"),
            ("rendering", steps("drawn", count=300), "64 × 64 pixels in software each step"),
        )
    ]


#: The savings, measured kind by kind.
KINDS: dict[str, Callable[[], Iterable[Pair]]] = {
    "batches": lambda: _batches(40),
    "batches, quick": lambda: _batches(10),
    "histories": _histories,
    "mujoco's steps": _mujoco_steps,
    "pybullet's steps": _pybullet_steps,
}
