"""How often u_num holds: `python docs/site_tools/uncertainty_holds.py [SEED [SCENES]]`.

Random scenes beside walls, each played by MuJoCo and PyBullet at adaptive and fixed steps, and by
CM. The truth is the model's own run at a sixteenth of the step; an error of rounding is no miss.
"""

from __future__ import annotations

import math
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from itertools import product

import numpy as np

from rockcheck import Block, ContinuousModel, Floor, MuJoCo, PyBullet, Ricker, Scene, Sine, Wall
from rockcheck.validation.uncertainty import numerical

MODELS = {
    "mujoco": MuJoCo(),
    "pybullet": PyBullet(),
    "cm": ContinuousModel(),
    "mujoco 4e-4 s": MuJoCo(time_step=4e-4),
    "pybullet 4e-4 s": PyBullet(time_step=4e-4),
}
#: Of the truth's step, in steps of the model; errors up to this are rounding.
FINE, ROUNDING = 1.0 / 16.0, 1e-10


def wall_scene(seed: int, number: int) -> Scene:
    """Scene `number` of the run with this seed."""
    r = np.random.default_rng([seed, number])
    radius, alpha = r.uniform(0.8, 2.0), r.uniform(0.2, 0.4)
    block = Block(half_width=radius * np.sin(alpha), half_height=radius * np.cos(alpha))
    sides = [["left"], ["right"], ["left", "right"]][int(r.integers(3))]
    walls = []
    for side in sides:
        gap = float(np.exp(r.uniform(*np.log([2e-3, 0.12])))) if r.random() > 0.1 else 0.0
        restitution = float(r.choice([0.0, 0.3, r.uniform(0, 0.9)]))
        walls.append(Wall(side=side, gap=gap, restitution=restitution))
    period = float(r.uniform(0.4, 1.4))
    pulse = Ricker if r.random() < 0.75 else Sine
    amplitude = float(9.81 * np.tan(alpha) * r.uniform(1.1, 4.0) * r.choice([-1, 1]))
    friction = float(r.uniform(0.15, 0.9))
    ends = (4 * period, 0.5, 1.5) if pulse is Ricker else (period, 1.0, 2.5)
    return Scene(
        name=f"walls {seed} {number}",
        block=block,
        floor=Floor(friction=friction),
        walls=walls,
        excitation=pulse(amplitude=amplitude, period=period),
        duration=float(ends[0] + r.uniform(*ends[1:])),
    )


def asked(cell: tuple[int, int, str]) -> tuple[str, Counter[str]]:
    """How many figures of a model's run of a scene are held, missed and refused."""
    scene, model = wall_scene(*cell[:2]), MODELS[cell[2]]
    history, truth = (one.simulate(scene) for one in (model, model.coarser(FINE)))
    found = numerical.numerical_uncertainty(model, scene, history)
    assert found is not None
    told: Counter[str] = Counter()
    true = {name: value for name, _, value in numerical._scalars(scene, truth)}
    for q in found.quantities[:-1]:  # the last is the outcome
        error = abs(q.value - true[q.name]) if q.name in true else math.inf
        if q.name == "theta_rms" and numerical._side(history) == numerical._side(truth):
            error = numerical._changes(scene, history, truth)[q.name]
        told[q.verdict if q.u_num is None else str(error <= q.u_num + ROUNDING)] += 1
    return cell[2], told


def main(seed: int = 2, scenes: int = 60) -> None:
    """Prints the table."""
    counts = {name: Counter[str]() for name in MODELS}
    with ProcessPoolExecutor(2) as pool:
        for name, told in pool.map(asked, product((seed,), range(scenes), MODELS)):
            counts[name] += told
    for name, told in counts.items():
        judged, refused = told["True"] + told["False"], told["not converged"]
        print(f"{name:16}held {told['True']} of {judged}: {told['True'] / judged:.1%},", end=" ")
        print(f"refused {refused / (judged + refused):.1%}")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
