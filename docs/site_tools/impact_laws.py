"""Counts which law of impacts each engine follows at flush landings, as a table.

`python docs/site_tools/impact_laws.py [LANDINGS]` prints it as Markdown. The landings are drawn with a seed: a random block stands against
a wall, is tilted away from it and let go.
"""

from __future__ import annotations

import math
import sys
from collections import Counter

import numpy as np

from rockcheck.cm import ContinuousModel
from rockcheck.ebm import EventBasedModel
from rockcheck.engines import MuJoCo, PyBullet
from rockcheck.scenes import Block, Floor, InputError, ModelFailure, Scene, Wall
from rockcheck.scenes.writing import markdown_table
from rockcheck.validation.discrepancy.impact_laws import WINDOW, law_followed
from rockcheck.validation.execute.models import Model

LANDINGS, SEED = 160, 1
#: The branches differ by more than this (alpha, RMS over the window), or a landing tells nothing of an engine.
TELLS = 1e-3
LAWS = ("closed", "open", "floor-first", "none")


def flush_landing(number: int) -> Scene:
    """A landing: block, tilt, friction, side and restitution at random; it lasts until WINDOW after the landing."""
    r = np.random.default_rng([SEED, number])
    alpha, radius = r.uniform(0.1, 0.4), 1.0
    block = Block(half_width=radius * math.sin(alpha), half_height=radius * math.cos(alpha))
    side = "left" if r.random() < 0.5 else "right"
    wall = Wall(side=side, gap=0.0, restitution=float(r.choice([0.25, 0.5, 0.75, 1.0])))
    tilt = alpha * r.uniform(0.1, 0.5) * (-1.0 if side == "left" else 1.0)
    floor = Floor(friction=float(r.uniform(0.3, 1.0)))
    still = Scene(name=f"landing {number}", block=block, floor=floor, walls=[wall], initial_rotation=tilt, duration=3.0)
    events = EventBasedModel(pivot="unilateral").simulate(still).event_list
    landing = next(event.t for event in events if event.kind == "floor impact")
    return still.replace(duration=landing + 1.5 * WINDOW, output_step=0.002)


def models() -> dict[str, Model]:
    """What is looked at, by its words in the table."""
    return {
        "mujoco, 1e-5 s": MuJoCo(time_step=1e-5),
        "mujoco, 2e-5 s": MuJoCo(time_step=2e-5),
        "mujoco, adaptive": MuJoCo(time_step="adaptive"),
        "pybullet, 1e-5 s": PyBullet(time_step=1e-5),
        "pybullet, adaptive": PyBullet(time_step="adaptive"),
        "cm": ContinuousModel(),
        "ebm-unilateral": EventBasedModel(pivot="unilateral"),
    }


def main() -> None:
    """Plays, counts, prints."""
    landings = int(sys.argv[1]) if len(sys.argv) > 1 else LANDINGS
    scenes = [flush_landing(number) for number in range(landings)]
    rows = []
    for words, model in models().items():
        counts: Counter[str] = Counter()
        errors: list[float] = []
        for scene in scenes:
            try:
                found = law_followed(scene, model.simulate(scene))
            except (InputError, ModelFailure):
                counts["failed"] += 1
                continue
            if found is not None and found.spread > TELLS:
                counts[found.law] += 1
                if found.law != "none":
                    errors.append(found.errors[found.law])
        worst = f"{np.median(errors):.1e} ({max(errors):.1e})" if errors else ""
        rows.append((words, str(sum(counts[law] for law in LAWS)), *(str(counts[law]) for law in LAWS), worst))
        print(rows[-1], file=sys.stderr, flush=True)
    print(markdown_table(("model", "telling landings", *LAWS, "distance from the branch it follows, alpha: median (largest)"), rows))


if __name__ == "__main__":
    main()
