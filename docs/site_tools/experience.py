"""What the suites have found about each model: `python docs/site_tools/experience.py RUN ...` from
the folders of finished runs.

Writes bias and scatter of the figures and the domain of the scenes to scenes/data/experience.json,
which `History.expected` and the report read, and the tables of docs/theory.md.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from rockcheck.scenes import experience, writing
from rockcheck.validation.execute import models
from rockcheck.validation.suite import model_bias, results

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "scenes" / "data" / "experience.json"
PAGE = ROOT / "docs" / "theory.md"
BEGIN, END = "<!-- experience: begin -->\n", "<!-- experience: end -->\n"

#: Settings that change no motion.
LIMITS = {"estimate_error", "most_steps", "most_events"}


def experience_of(runs: Sequence[results.Run]) -> experience.Experience:
    """Bias and scatter by model and figure, and the domain of the scenes, over some runs.

    The domain is the range of each axis, `scenes.experience.axes_of`.
    """
    trust: dict[str, dict[str, experience.Trust]] = {}
    for model, pairs in sorted(model_bias.pairs_of(runs).items()):
        if found := model_bias.trust_in(pairs):
            trust[model] = {"peak_rotation": found}
    scenes = [experience.axes_of(run.load_scene(name)) for run in runs for name in run.scenes]
    domain = {}
    for axis in dict.fromkeys(axis for one in scenes for axis in one):
        numbers = [number for one in scenes for number in one.get(axis, ())]
        domain[axis] = experience.Range(low=min(numbers), high=max(numbers))
    settings = {model: _settings_of(model, runs) for model in trust if model in models.FAMILIES}
    return experience.Experience(
        suites=tuple(run.suite for run in runs), trust=trust, settings=settings, domain=domain
    )


def _settings_of(model: str, runs: Iterable[results.Run]) -> dict[str, tuple[Any, ...]]:
    """The values of each setting that a model had, but for those that change no motion.

    Those that it has by default: what follows from others, as the stiffness, is left out.
    """
    default: Any = models.build(model)
    names = default.model_dump(exclude=LIMITS, exclude_none=True)
    had = [  # the cell of an ensemble says only what is not as by default
        names | cell.settings for run in runs for cell in run.cells if cell.model == model
    ]
    return {name: tuple(dict.fromkeys(one[name] for one in had)) for name in names}


def tables(found: experience.Experience) -> str:
    """Bias and scatter by model, and the domain, as Markdown."""
    rows = [
        (f"`{model}`", f"{trust.bias:.4f}", f"{trust.scatter:.2g}", str(trust.count))
        for model, figures in found.trust.items()
        for trust in (figures["peak_rotation"],)
    ]
    covered = [(axis, f"{one.low:.3g}", f"{one.high:.3g}") for axis, one in found.domain.items()]
    first = writing.markdown_table(("model", "bias", "scatter", "scenes"), rows).strip()
    second = writing.markdown_table(("axis", "from", "to"), covered).strip()
    return f"\n{first}\n\n{second}\n\n"


def main(folders: Sequence[str]) -> None:
    """Learns from the runs in these folders."""
    found = experience_of([results.Run.load(Path(folder)) for folder in folders])
    writing.write_whole(KEPT, found.model_dump_json(indent=1) + "\n")
    text = PAGE.read_text(encoding="utf-8")
    before, rest = text.split(BEGIN)
    writing.write_whole(PAGE, before + BEGIN + tables(found) + END + rest.split(END)[1])
    print(tables(found))


if __name__ == "__main__":
    main(sys.argv[1:])
