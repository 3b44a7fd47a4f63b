"""The lines of the diagrams: a model, its settings, and the values of the one that is swept.

Engines bring their steps in their records. Called by `runs` and the study.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from rockcheck.engines import registry
from rockcheck.engines.engine import Engine
from rockcheck.engines.facts import EngineFacts
from rockcheck.validation.execute import models


@dataclass(frozen=True, kw_only=True)
class DiagramLine(models.Work):
    """A line of the diagrams: a model, and the setting that is swept, coarse to fine.

    `reference` is the model that it is compared with.
    """

    knob: str
    values: tuple[float, ...]
    reference: str = "ebm-unilateral"
    #: The values of `--quick`, and those beside a wall, by which convergence is judged.
    quick: tuple[float, ...] = ()
    converge: tuple[float, ...] = ()

    @property
    def lacks_restitution(self) -> bool:
        """Whether it is of an engine that cannot bounce with these settings."""
        model = models.build(self.family, self.settings)
        return isinstance(model, Engine) and "restitution" in model.lacks()

    @property
    def steps_are_dear(self) -> bool:
        """Whether its adaptive steps cost as much as fixed ones of 1e-4 s."""
        is_adaptive = self.settings.get("time_step") == "adaptive"
        return is_adaptive and registry.facts_of(self.family).dear_adaptive_steps


_TOLERANCES = (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
#: Three tell an order; the CM's step is 3/sqrt(k/m), k/m = g/penetration: 8e-4, 9e-5 and 1e-5 s.
_PENETRATIONS = (1e-6, 1e-8, 1e-10)
#: Largest steps of engines that step adaptively, s.
_LARGEST = (8e-3, 4e-3, 2e-3, 1e-3)
#: Their tolerances where the error of a step limits it.
_STEP_TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8, 1e-9)
#: Steps of engines with their default settings in a quick run, s; in a whole run the first
#: `DEFAULT_STEPS` of their diagram.
_QUICK_DEFAULT, DEFAULT_STEPS = (1e-2, 1e-3), 3


def lines_of_engine(facts: EngineFacts) -> list[DiagramLine]:
    """An engine's lines: fixed steps, adaptive ones where it has them, its default settings.

    Adaptive steps are limited by the longest one, or by their error.

    A quick run leaves out the finest step, which costs more than all others together.
    """
    engine, steps = facts.name, facts.benchmark.diagram
    lines = [
        DiagramLine(
            label=engine,
            family=engine,
            knob="time_step",
            values=steps,
            quick=steps[: max(len(steps) - 1, 2)],
            converge=facts.benchmark.convergence,
        )
    ]
    if facts.steps_vary:
        adaptive = DiagramLine(
            label=f"{engine} adaptive",
            family=engine,
            settings={"time_step": "adaptive"},
            knob="largest_step",
            values=_LARGEST,
            quick=_LARGEST[1:3],
        )
        tolerance = DiagramLine(
            label=f"{engine} tolerance",
            family=engine,
            settings={"time_step": "adaptive"},
            knob="tolerance",
            values=_STEP_TOLERANCES,
            quick=_STEP_TOLERANCES[1:4:2],
        )
        lines += [adaptive, tolerance]
    default = DiagramLine(
        label=f"{engine} default",
        family=engine,
        settings={"settings": "default"},
        knob="time_step",
        values=steps[:DEFAULT_STEPS],
        quick=_QUICK_DEFAULT,
    )
    return [*lines, default]


def _every_line() -> Iterator[DiagramLine]:
    for name in ("ebm", "ebm-unilateral"):
        yield DiagramLine(
            label=name,
            family=name,
            knob="tolerance",
            values=_TOLERANCES,
            reference=name,
            quick=_TOLERANCES,
        )
    yield DiagramLine(
        label="ebm-bouc-wen",
        family="ebm-bouc-wen",
        knob="yield_displacement",
        values=(1e-4, 1e-5, 1e-6),
        reference="ebm",
        quick=(1e-4, 1e-5),
    )
    yield DiagramLine(
        label="cm",
        family="cm",
        knob="penetration",
        values=(1e-4, 1e-5, 1e-6, 1e-7, 1e-8),
        quick=(1e-5, 1e-6, 1e-7),
        converge=_PENETRATIONS,
    )
    for facts in registry.every():
        yield from lines_of_engine(facts)


LINES = {line.label: line for line in _every_line()}
#: Not measured, and why.
LEFT_OUT = (
    "default settings at a step of 3e-5 s: at 1e-4 s they have stopped converging, or converge as"
    " at larger steps",
    "PyBullet's other solvers and MuJoCo's RK4 and pyramidal cone: no better limit, or none, at"
    " more cost",
    "pymunk and DART at 3e-5 s and Drake below 1e-3 s: a simulated second of Drake at 1e-4 s takes"
    " it more than a second",
    "native batches of an engine (mujoco.rollout): they cannot end a step at an event; their cost"
    " is in the table of savings",
    "measured histories: they have no cost",
)
