"""What each thing costs that a scene may not need: the same scene with it and without it, one at a
time."""

from __future__ import annotations

import math
import tempfile
import time
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from rockcheck.scenes import Floor, History, Record, Scene, Wall
from rockcheck.scenes.scene import PAPER_BLOCK
from rockcheck.validation.execute.models import Model, build, not_installed
from rockcheck.validation.studies.work_precision.scenes import pulse

#: A wall that the block cannot reach, m.
FAR = Wall(side="left", gap=100.0)
ROUNDS = 5
#: Not in the table, and why.
NOT_MEASURED = (
    "rendering in MuJoCo: it needs a display or a GPU; no model here ever makes a renderer, nor"
    " PyBullet's window",
    "out-of-plane motion in PyBullet: it is always three-dimensional; a huge inertia about the"
    " other axes keeps the block in its plane",
)


@dataclass(frozen=True)
class Saving:
    """Cost with and without a thing that the scene does not need, in `unit`; `change`: largest
    change of theta, alpha."""

    model: str
    thing: str
    unit: str
    cost_with: float
    cost_without: float
    change: float = math.nan
    remark: str = ""

    @property
    def ratio(self) -> float:
        """How many times dearer the thing makes it."""
        return self.cost_with / self.cost_without


def _medians(variants: Mapping[str, Callable[[], float]]) -> dict[str, float]:
    """Median cost of each variant, played in turn; a first round warms up."""
    rounds = [{name: play() for name, play in variants.items()} for _ in range(ROUNDS + 1)][1:]
    return {name: median(taken[name] for taken in rounds) for name in variants}


def _saving(
    model: str,
    thing: str,
    unit: str,
    dear: Callable[[], float],
    cheap: Callable[[], float],
    **more: Any,
) -> Saving:
    cost = _medians({"with": dear, "without": cheap})
    return Saving(model, thing, unit, cost["with"], cost["without"], **more)


# --- the event-based model, in batches over a grid of pulses


def _batches(nodes: int) -> Iterator[Saving]:
    from rockcheck.ebm import EventBasedModel
    from rockcheck.ebm.batch import pack_pulses, run_batch
    from rockcheck.validation.studies.work_precision.ebm import grid

    plain = pulse(4.5, 4.0, 0.3).replace(duration=10.0)
    strengths, periods = grid(plain, nodes)

    def batch(
        scene: Scene, *, until_decided: bool = True, **settings: Any
    ) -> tuple[Callable[[], float], Callable[[], Any]]:
        model = EventBasedModel(tolerance=1e-8, **settings)
        packed = pack_pulses(scene, model, strengths, periods)

        def run() -> Any:
            return run_batch(packed, model, until_decided=until_decided, strict=False, jobs=1)

        def cost() -> float:
            began = time.process_time()
            run()
            return 1e6 * (time.process_time() - began) / len(packed)

        return cost, run

    def row(thing: str, dear: tuple[Any, Any], cheap: tuple[Any, Any], remark: str = "") -> Saving:
        peaks = dear[1](), cheap[1]()
        both = (peaks[0].side == 0) & (peaks[1].side == 0)
        change = (
            float(np.max(np.abs(peaks[0].peak - peaks[1].peak)[both], initial=0.0))
            / PAPER_BLOCK.alpha
        )
        return _saving(
            "ebm", thing, "μs a trajectory", dear[0], cheap[0], change=change, remark=remark
        )

    sticky = plain.replace(floor=Floor(friction=1.3))
    still = Record.from_samples(np.zeros(1001), 0.01)
    yield row(
        "wall",
        batch(plain.replace(walls=(FAR,))),
        batch(plain),
        "a wall out of reach against none: no guard, earlier decision",
    )
    yield row(
        "friction limit",
        batch(sticky),
        batch(sticky, friction="no-slip"),
        "μ 1.3, where the strongest pulses slip a little, against no slip",
    )
    yield row(
        "free flight",
        batch(plain, pivot="unilateral"),
        batch(plain),
        "unilateral against bilateral, no wall",
    )
    yield row(
        "the tail",
        batch(plain, until_decided=False),
        batch(plain),
        "10 s against: until outcome and peak are certain",
    )
    yield row(
        "vertical motion",
        batch(plain.replace(vertical=still)),
        batch(plain),
        "a record of zeros against none",
    )


# --- histories: every model


def _histories() -> Iterator[Saving]:
    scene = pulse(6.0, 6.0, 0.3)
    scarce = scene.replace(output_step=scene.duration)
    dense = scene.replace(output_step=0.001)
    slow: dict[str, Any] = {"time_step": 1e-3}
    for name, settings in (
        ("ebm", {}),
        ("ebm-unilateral", {}),
        ("cm", {}),
        ("mujoco", slow),
        ("mujoco", {"time_step": "adaptive"}),
        ("pybullet", slow),
        ("pybullet", {"time_step": "adaptive"}),
    ):
        if not_installed(name):
            continue
        model = build(name, settings)
        label = f"{name} adaptive" if "adaptive" in settings.values() else name
        remark = "a wall out of reach against none" + (
            ", and with it another share of penetration removed" if label == "pybullet" else ""
        )
        yield _of_histories(
            label, "wall", (model, scene.replace(walls=(FAR,))), (model, scene), remark
        )
        if name in ("ebm", "ebm-unilateral"):
            yield _of_histories(
                label,
                "dense output",
                (model, dense),
                (model, scarce),
                "a row each 1 ms against two rows in all",
            )
    for step in (1e-3, "adaptive"):
        label = "mujoco adaptive" if step == "adaptive" else "mujoco"
        mended, plain = (
            build("mujoco", {"time_step": step, "cone_correction": on}) for on in (True, False)
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
    label: str, thing: str, dear: tuple[Model, Scene], cheap: tuple[Model, Scene], remark: str
) -> Saving:
    def cost(model: Model, scene: Scene) -> Callable[[], float]:
        return lambda: 1e3 * model.simulate(scene).cost.cpu_seconds / scene.duration

    first, second = (_rows(model.simulate(scene)) for model, scene in (dear, cheap))
    common = sorted(first.keys() & second.keys())
    change = max(abs(first[t] - second[t]) for t in common) / PAPER_BLOCK.alpha
    return _saving(
        label, thing, "ms a simulated s", cost(*dear), cost(*cheap), change=change, remark=remark
    )


def _rows(history: History) -> dict[float, float]:
    """theta by time, to the nanosecond."""
    return {
        round(t, 9): theta
        for t, theta in zip(
            history.channels["t"].tolist(), history.channels["theta"].tolist(), strict=True
        )
    }


# --- steps of the engines themselves, in a row without anything between them

_STEPS = 3000
_TILTED = Scene(
    name="tilted",
    block=PAPER_BLOCK,
    floor=Floor(friction=1.0),
    duration=1.0,
    initial_rotation=0.3 * PAPER_BLOCK.alpha,
)


def _mujoco_steps() -> Iterator[Saving]:
    from rockcheck.engines import MuJoCo

    text = _as_xml(MuJoCo().rigid_world(_TILTED.replace(walls=(FAR,), initial_rotation=0.0)))
    whole, lean = _loaded(text), _loaded(text, _unpaired)
    for thing, dear, cheap, remark in (
        ("contact pairs", whole, lean, "wall pairs out of reach against none"),
        (
            "collision search",
            _loaded(text, _all_collide),
            whole,
            "search among all geoms against listed pairs",
        ),
        (
            "out-of-plane motion",
            _loaded(text, _solid),
            whole,
            "a free joint against two slides and a hinge",
        ),
        (
            "unused features",
            _loaded(text, _flagged),
            whole,
            "energies, accelerometer and gyro that nobody reads",
        ),
    ):
        yield _saving(
            "mujoco, bare steps",
            thing,
            "μs a step",
            _one_by_one(dear),
            _one_by_one(cheap),
            remark=remark,
        )
    cost = _one_by_one(lean), _native(lean)
    yield _saving(
        "mujoco, bare steps",
        "Python between steps",
        "μs a step",
        *cost,
        remark="against mujoco.rollout",
    )


def _loaded(text: str, change: Callable[[ET.Element], None] = lambda root: None) -> Any:
    """MuJoCo's model of a description that is changed before."""
    import mujoco

    root = ET.fromstring(text)
    change(root)
    model = mujoco.MjModel.from_xml_string(ET.tostring(root, encoding="unicode"))
    model.opt.gravity[:] = 0.0, 0.0, -9.81
    model.opt.timestep = 1e-3
    # The one-step contact that the engine's march sets, for pairs and for geoms alike.
    one_step, impedance = (
        (-0.01 / model.opt.timestep**2, -1.0 / model.opt.timestep),
        (0.9999, 0.9999, 0.001, 0.5, 1.0),
    )
    for solref, solimp in (
        (model.pair_solref, model.pair_solimp),
        (model.geom_solref, model.geom_solimp),
    ):
        solref[:], solimp[:] = one_step, impedance
    return model


def _started(model: Any) -> Any:
    import mujoco

    data = mujoco.MjData(model)
    tilt, pose = _TILTED.initial_rotation, _TILTED.initial_state
    if model.nq == 3:
        data.qpos[:] = pose[:3]
    else:
        data.qpos[:] = pose[0], 0.0, pose[1], math.cos(0.5 * tilt), 0.0, -math.sin(0.5 * tilt), 0.0
    return data


def _one_by_one(model: Any) -> Callable[[], float]:
    """What a step costs, us, called from Python each."""
    import mujoco

    def play() -> float:
        data = _started(model)
        began = time.process_time()
        for _ in range(_STEPS):
            mujoco.mj_step(model, data)
        return 1e6 * (time.process_time() - began) / _STEPS

    return play


def _native(model: Any) -> Callable[[], float]:
    """What a step costs, us, in one call of `mujoco.rollout`."""
    import mujoco
    from mujoco import rollout

    def play() -> float:
        data = _started(model)
        start = np.empty(mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS))
        mujoco.mj_getState(model, data, start, mujoco.mjtState.mjSTATE_FULLPHYSICS)
        began = time.process_time()
        rollout.rollout(model, data, start, nstep=_STEPS)
        return 1e6 * (time.process_time() - began) / _STEPS

    return play


def _found(root: ET.Element, path: str) -> ET.Element:
    element = root.find(path)
    assert element is not None
    return element


def _solid(root: ET.Element) -> None:
    """Free in space."""
    body = _found(root, "worldbody/body")
    for joint in body.findall("joint"):
        body.remove(joint)
    body.insert(0, ET.Element("freejoint"))


def _flagged(root: ET.Element) -> None:
    """Energies, two sensors, and a touch of actuation that nobody reads."""
    option = _found(root, "option")
    flags = option.find("flag")
    (ET.SubElement(option, "flag") if flags is None else flags).set("energy", "enable")
    ET.SubElement(_found(root, "worldbody/body"), "site", {"name": "centre"})
    sensors = ET.SubElement(root, "sensor")
    ET.SubElement(sensors, "accelerometer", {"site": "centre"})
    ET.SubElement(sensors, "gyro", {"site": "centre"})


def _unpaired(root: ET.Element) -> None:
    """No contact with the wall that is out of reach."""
    contact = _found(root, "contact")
    for pair in contact.findall("pair"):
        if "floor" not in (pair.get("geom1"), pair.get("geom2")):
            contact.remove(pair)


def _all_collide(root: ET.Element) -> None:
    """Every corner with every surface, found by the engine's broad phase in place of the pairs."""
    root.remove(_found(root, "contact"))
    for geom in root.iter("geom"):
        for key, value in (
            ("contype", "1"),
            ("conaffinity", "1"),
            ("condim", "3"),
            ("friction", "1 0 0"),
        ):
            geom.set(key, value)


def _as_xml(world: Any) -> str:
    """The model of a world as text."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "world.xml"
        world.mujoco.mj_saveLastXML(str(path), world.model)
        return path.read_text(encoding="utf-8")


def _pybullet_steps() -> Iterator[Saving]:
    if not_installed("pybullet"):
        return
    from rockcheck.engines import PyBullet

    start = np.array(_TILTED.initial_state)

    def steps(
        walls: tuple[Wall, ...] = (),
        each: Callable[[Any], object] = lambda world: None,
        count: int = _STEPS,
    ) -> Callable[[], float]:
        scene = _TILTED.replace(walls=walls)

        def play() -> float:
            world: Any = PyBullet().rigid_world(scene)
            try:
                world.place(start)
                world.bullet.setTimeStep(1e-3, **world.options)
                world.bullet.setGravity(0.0, 0.0, -9.81, **world.options)
                began = time.process_time()
                for _ in range(count):
                    world.bullet.stepSimulation(**world.options)
                    each(world)
                return 1e6 * (time.process_time() - began) / count
            finally:
                world.close()

        return play

    def read(world: Any) -> None:
        world.bullet.getBasePositionAndOrientation(world.body, **world.options)
        world.bullet.getBaseVelocity(world.body, **world.options)

    def render(world: Any) -> None:
        world.bullet.getCameraImage(64, 64, **world.options)

    def kept(world: Any) -> None:
        world.bullet.removeState(world.bullet.saveState(**world.options), **world.options)

    name, unit = "pybullet, bare steps", "μs a step"
    yield _saving(
        name,
        "contact pairs",
        unit,
        steps((FAR,)),
        steps(),
        remark="a wall out of reach against none",
    )
    yield _saving(
        name,
        "dense output",
        unit,
        steps(each=read),
        steps(),
        remark="pose and velocity read after each step, as is needed",
    )
    yield _saving(
        name,
        "saved states",
        unit,
        steps(each=kept, count=300),
        steps(),
        remark="saveState, as save-and-redo would need",
    )
    yield _saving(
        name,
        "rendering",
        unit,
        steps(each=render, count=300),
        steps(),
        remark="64 × 64 pixels in software each step",
    )


#: What is measured, each on its own.
KINDS: dict[str, Callable[[], Iterator[Saving]]] = {
    "batches": lambda: _batches(40),
    "batches, quick": lambda: _batches(10),
    "histories": _histories,
    "mujoco's steps": _mujoco_steps,
    "pybullet's steps": _pybullet_steps,
}
