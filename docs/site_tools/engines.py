"""Makes the tables "Without a wall" of docs/convergence.md: `python docs/site_tools/engines.py`
(five minutes, most of them Drake's).

Free rocking from seven tilts at two fixed steps, and the paper's records with each engine as it
comes; of all engines that are installed.
"""

from __future__ import annotations

import math
import re
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from importlib import resources
from pathlib import Path
from statistics import median

from rockcheck import engines
from rockcheck.ebm import EventBasedModel
from rockcheck.engines.engine import Engine
from rockcheck.reports.style import LOOKS
from rockcheck.scenes import Floor, History, Scene, load_scene
from rockcheck.scenes.scene import PAPER_BLOCK
from rockcheck.scenes.writing import markdown_table
from rockcheck.validation.discrepancy.compare import compare

PAGE = Path(__file__).parents[1] / "convergence.md"
TILTS, STEPS, LONG = (0.3, -0.4, 0.5, 0.6, 0.7, -0.8, 0.9), (1e-3, 1e-4), 4.0
RECORDS, WINDOW = ("fig4a", "fig5a"), 8.0
TOLERANCES = resources.files("rockcheck.validation") / "data" / "tolerances" / "paper.toml"


def rocking(tilt: float) -> Scene:
    """Free rocking without slip from a tilt, in alpha."""
    start = tilt * PAPER_BLOCK.alpha
    return Scene(
        name=f"tilt {tilt:g}",
        block=PAPER_BLOCK,
        floor=Floor(friction=1.0),
        initial_rotation=start,
        duration=LONG,
    )


@cache
def truth(scene: Scene) -> History:
    """The unilateral event-based model's history."""
    return EventBasedModel(pivot="unilateral").simulate(scene)


def error(model: Engine, scene: Scene) -> float:
    """RMS of theta, in alpha."""
    return float(compare(truth(scene), model.simulate(scene), measures=["theta_rms"])["theta_rms"])


def free_rows(kinds: list[type[Engine]]) -> Iterator[tuple[str, ...]]:
    """A row an engine: medians and ranges at both steps, and the order between them."""
    for kind in kinds:
        errors = [
            sorted(error(kind(time_step=step), rocking(tilt)) for tilt in TILTS) for step in STEPS
        ]
        order = math.log(median(errors[0]) / median(errors[1])) / math.log(STEPS[0] / STEPS[1])
        cells = (f"{median(some):.1e} ({some[0]:.0e} … {some[-1]:.0e})" for some in errors)
        yield LOOKS[kind.name].label, *cells, f"{order:.2f}"


def record_rows(kinds: list[type[Engine]]) -> Iterator[tuple[str, ...]]:
    """A row an engine: at a fixed step of 1e-4 s, and at adaptive ones if they can vary; MuJoCo's
    tolerance for those first."""
    scenes = [load_scene(name).replace(duration=WINDOW) for name in RECORDS]
    kept = tomllib.loads(TOLERANCES.read_text(encoding="utf-8"))
    limits = [
        kept[name]["mujoco"]["ebm-unilateral"][f"theta_rms@{WINDOW:g}s"]["limit"]
        for name in RECORDS
    ]
    yield "MuJoCo's tolerance", *("" for _ in RECORDS), *(f"{limit:.1e}" for limit in limits)
    for kind in kinds:
        fixed = [f"{error(kind(time_step=STEPS[-1]), scene):.1e}" for scene in scenes]
        adaptive = ["–"] * len(scenes)
        if not kind.fixed_because:
            found = [error(kind(), scene) for scene in scenes]
            adaptive = [
                f"{one:.1e}" if one <= limit else f"**{one:.1e}**"
                for one, limit in zip(found, limits, strict=True)
            ]
        yield LOOKS[kind.name].label, *fixed, *adaptive


def publish(name: str, head: tuple[str, ...], rows: list[tuple[str, ...]]) -> None:
    """Write a table between its marks."""
    text = PAGE.read_text(encoding="utf-8")
    pattern = rf"(<!-- {name} -->\n).*?(\n<!-- end -->)"
    PAGE.write_text(
        re.sub(pattern, rf"\g<1>\n{markdown_table(head, rows)}\n\2", text, flags=re.S),
        encoding="utf-8",
    )


def main() -> None:
    """Plays, and writes what was found."""
    kinds = [
        kind for kind in (getattr(engines, name) for name in engines.__all__) if kind.installed()
    ]
    for name, found, head in (
        (
            "free rocking",
            free_rows,
            ("engine", *(f"step {step:g} s" for step in STEPS), "observed order"),
        ),
        (
            "records",
            record_rows,
            (
                "engine",
                *(f"{name}, step {STEPS[-1]:g} s" for name in RECORDS),
                *(f"{name}, adaptive" for name in RECORDS),
            ),
        ),
    ):
        rows = []
        for row in found(kinds):
            rows.append(row)
            print(*row, sep="; ", file=sys.stderr, flush=True)
        publish(name, head, rows)


if __name__ == "__main__":
    main()
