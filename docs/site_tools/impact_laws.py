"""Makes the tables of the report "impact-laws": which law of impacts each engine follows at
landings where laws part.

`python docs/site_tools/impact_laws.py flush|flat [LANDINGS]` plays them (160 flush ones take half
an hour) and keeps their table. The landings are drawn with a
seed. Flush: a random block stands flush against a wall that bounces and comes back to it, most of
them from a tilt, one in eight after a pulse. Flat: a random block is dropped while it moves.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import whole_runs

from rockcheck import engines
from rockcheck.cm import ContinuousModel
from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import Block, Floor, InputError, ModelFailure, Ricker, Scene, Wall
from rockcheck.validation.discrepancy import impact_laws
from rockcheck.validation.execute.models import Model
from rockcheck.validation.finding import Column, Table, text

LANDINGS, SEED, PULSED = 160, 1, 8
COLUMNS = ("closed", "closed or open", "open", "floor-first", "none")
FLAT_COLUMNS = ("moreau", "moreau or leading-first", "leading-first", "trailing-first", "none")


@dataclass(frozen=True)
class Row:
    """What one model did at the landings, and what the default law does there; None where that
    cannot be told or the model failed."""

    model: str
    found: Sequence[impact_laws.LawFollowed | None]
    default: Sequence[impact_laws.LawFollowed | None]

    def cells(self, columns: Sequence[str]) -> Iterator[str | int | None]:
        """The row of the table."""
        told = [one for one in self.found if one is not None]
        counts = Counter(one.law for one in told)
        errors = [one.error for one in told if one.law != "none"]
        alike = [
            min(one.errors[law] for law in one.errors if law in usual.law.split(" or "))
            for one, usual in zip(self.found, self.default, strict=True)
            if one is not None
            and usual is not None
            and set(one.law.split(" or ")) & set(usual.law.split(" or "))
        ]
        yield self.model
        yield from (counts[law] or None for law in columns)
        yield f"{np.median(errors):.0e} ({min(errors):.0e} … {max(errors):.0e})" if errors else ""
        yield f"{sum(error < impact_laws.TELLS for error in alike)}/{len(alike)}"


def landing(number: int) -> Scene:
    """A scene with a landing: block, friction, side, restitution and motion at random; it lasts as
    long as it is looked at."""
    r = np.random.default_rng([SEED, number])
    alpha = r.uniform(0.1, 0.4)
    block = Block(half_width=math.sin(alpha), half_height=math.cos(alpha))  # R = 1 m
    side = "left" if r.random() < 0.5 else "right"
    away = -1.0 if side == "left" else 1.0
    scene = Scene(
        name=f"landing {number}",
        block=block,
        floor=Floor(friction=float(r.uniform(0.3, 1.0))),
        walls=[Wall(side=side, gap=0.0, restitution=float(r.choice([0.25, 0.5, 0.75, 1.0])))],
        initial_rotation=away * alpha * r.uniform(0.02, 0.15),
        initial_angular_velocity=-away * alpha * r.uniform(0.3, 2.0),
        duration=3.0,
        output_step=0.002,
    )
    if number % PULSED == 0:
        period = 2.0 * math.pi / (scene.frequency_parameter * r.uniform(3.0, 6.0))
        pulse = Ricker(amplitude=9.81 * math.tan(alpha) * r.uniform(1.5, 4.0), period=period)
        scene = scene.replace(excitation=pulse, initial_rotation=0.0, initial_angular_velocity=0.0)
    found = impact_laws.parting_landing(scene)
    by_rule = found and found.followed_by(
        EventBasedModel(pivot="unilateral", impacts="floor-first").simulate(scene), scene
    )
    if found is None or by_rule is None or by_rule.law != "floor-first":
        return landing(
            number + 1000 * PULSED
        )  # it fell, never came back, or tells little: another one of its kind
    return _as_long_as(scene, found)


def flat_landing(number: int) -> Scene:
    """A block, floor and drop at random; it lands flat while it slides."""
    r = np.random.default_rng([SEED, number])
    alpha = r.uniform(0.1, 0.4)
    scene = Scene(
        name=f"landing {number}",
        block=Block(half_width=math.sin(alpha), half_height=math.cos(alpha)),  # R = 1 m
        floor=Floor(friction=float(r.uniform(0.2, 1.0))),
        initial_height=float(r.uniform(0.005, 0.05)),
        initial_velocity=float(r.choice([-1.0, 1.0]) * r.uniform(0.2, 2.0)),
        duration=0.5,
        output_step=0.002,
    )
    found = impact_laws.parting_landing(scene)
    return flat_landing(number + 1000) if found is None else _as_long_as(scene, found)


def _as_long_as(scene: Scene, found: impact_laws.Landing) -> Scene:
    told = scene.output_step * (
        found.start + max(len(motion) for motion in found.branches.values())
    )
    return scene.replace(duration=min(scene.duration, told))


#: The kinds of landings, and the columns of their tables.
KINDS: dict[str, tuple[Callable[[int], Scene], Sequence[str]]] = {
    "flush": (landing, COLUMNS),
    "flat": (flat_landing, FLAT_COLUMNS),
}


def models() -> dict[str, Model]:
    """What is looked at, by its words in the table."""
    found: dict[str, Model] = {}
    for engine in (getattr(engines, name) for name in engines.__all__):
        if engine.installed():
            steps: tuple[float | str, ...] = (
                (1e-5, 1e-4) if engine.fixed_because else (1e-5, 1e-4, "adaptive")
            )
            if engine().lacks():  # without restitution it follows none, whatever the step
                steps = (1e-4,)
            found |= {f"{engine.name} {step}": engine(time_step=step) for step in steps}
    return found | {"cm": ContinuousModel()}


def played(scenes: Sequence[Scene]) -> Iterator[Row]:
    """The rows, one after the other."""
    landings = [where for scene in scenes if (where := impact_laws.parting_landing(scene))]

    def followed(model: Model) -> list[impact_laws.LawFollowed | None]:
        return [
            _followed(where, scene, model) for where, scene in zip(landings, scenes, strict=True)
        ]

    default = followed(EventBasedModel(pivot="unilateral"))
    for words, model in models().items():
        yield Row(words, followed(model), default)


def _followed(
    where: impact_laws.Landing, scene: Scene, model: Model
) -> impact_laws.LawFollowed | None:
    try:
        return where.followed_by(model.simulate(scene), scene)
    except (InputError, ModelFailure) as error:
        print(f"{scene.name}: {error}", file=sys.stderr)
        return None


def publish(kind: str, rows: Sequence[Row]) -> None:
    """Put the table into the kept report."""
    columns = [text("model"), *map(Column, KINDS[kind][1]), text("off"), text("alike")]
    kept = whole_runs.load("impact-laws")
    blocks = [
        replace(block, columns=columns, rows=[list(row.cells(KINDS[kind][1])) for row in rows])
        if isinstance(block, Table) and block.name == kind
        else block
        for block in kept.blocks
    ]
    whole_runs.keep("impact-laws", replace(kept, blocks=blocks))


def main(kind: str, landings: str = str(LANDINGS)) -> None:
    """Plays, and writes what was found."""
    drawn, columns = KINDS[kind]
    rows = []
    for row in played([drawn(number) for number in range(int(landings))]):
        rows.append(row)
        print(*row.cells(columns), sep="; ", file=sys.stderr, flush=True)
    publish(kind, rows)


if __name__ == "__main__":
    main(*sys.argv[1:])
