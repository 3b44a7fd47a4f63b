"""How often u_num holds the true error: `python docs/site_tools/uncertainty_holds.py RUN` from a run with `uncertainty = true`.

Of the figures of stepping models that are called converged: how many differ from the reference by no more than both numerical
uncertainties. Scenes whose reference depends on the law of impacts are left out: there the difference is not numerical.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

import numpy as np

from rockcheck.ebm import EventBasedModel
from rockcheck.ebm.horizon import other_laws
from rockcheck.scenes import Scene
from rockcheck.validation.suite.results import Run

#: Largest difference of rotation (alpha) between laws at which a scene does not depend on them.
SAME = 1e-6


def depends_on_law(scene: Scene) -> bool:
    """Whether the reference's motion is another one under another law of impacts."""
    model = EventBasedModel(pivot="unilateral")
    models = [model.model_copy(update={"impacts": law}) for law in other_laws(model, walls=True, flat=True)]
    motions = [one.simulate(scene).channels["theta"] for one in (model, *models)]
    rows = min(map(len, motions))
    return bool(np.max(np.ptp([motion[:rows] for motion in motions], axis=0)) > SAME * scene.block.alpha)


def main(folder: Path) -> None:
    """Prints the table."""
    run = Run.load(folder)
    scenes = [name for name in run.scenes if not depends_on_law(run.load_scene(name))]
    held: Counter[tuple[str, str]] = Counter()
    told: Counter[tuple[str, str]] = Counter()
    for cell in run.cells:
        if cell.scene not in scenes or cell.model.startswith("ebm"):
            continue
        for found in cell.explanations:
            if found.against == run.reference and found.u_num is not None and found.error is not None:
                told[cell.model, found.quantity] += 1
                held[cell.model, found.quantity] += found.error <= found.u_num
    print(f"{len(scenes)} of {len(run.scenes)} scenes do not depend on the law of impacts")
    for key, count in sorted(told.items()):
        print(f"{key[0]:12}{key[1]:16}{held[key]:5} of {count:4}  {held[key] / count:.0%}")
    print(f"{'all':28}{held.total():5} of {told.total():4}  {held.total() / told.total():.1%}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
