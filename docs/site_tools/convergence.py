"""Makes the tables and the figure of docs/convergence.md: `python docs/site_tools/convergence.py` (whole: some minutes of CPU a core).

Every engine that is installed is in them, so that Drake is to be installed, too.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterable
from pathlib import Path

from rockcheck.reports.studies.convergence import convergence_figure
from rockcheck.reports.style import LOOKS
from rockcheck.scenes.writing import markdown_table
from rockcheck.validation.bench.convergence import Convergence, Level, run_convergence

DOCS = Path(__file__).parents[1]
UNILATERAL, PAPER = "ebm-unilateral", "ebm"


def number(value: float) -> str:
    """An error, or what stands for one that there is not."""
    return f"{value:.1e}" if math.isfinite(value) else "failed"


def figures(found: Convergence) -> str:
    """The study in two sentences; of the models that play all scenes."""
    whole = [model for model in found.models() if len({one.scene for one in found.plays if one.model == model}) == len(found.cases)]
    finest = [min((level for level in found.levels if (level.model, level.reference) == (model, UNILATERAL)), key=_step) for model in whole]
    names = [LOOKS[model].label for model in whole]
    forms = sorted(case.model_form for case in found.cases)
    return (
        f"At the finest steps the median error against `ebm-unilateral` is at most {number(max(level.median for level in finest))} alpha"
        f" with {', '.join(names[:-1])} and {names[-1]}. The model form is {number(found.model_form)} alpha in the\n"
        f"median of the scenes ({number(forms[0])} to {number(forms[-1])}).\n"
    )


def _step(level: Level) -> float:
    return level.step


def levels(found: Convergence) -> str:
    """Errors of each model at each step, and how fast they fall."""
    rows = []
    for level in found.levels:
        if level.reference == UNILATERAL:
            errors = [one.against_ebm for one in found.plays if (one.model, one.value) == (level.model, level.value) and not one.failure]
            within = f"{level.within} of {level.runs}"
            median = found.level(level.model, PAPER, level.value).median
            row = (number(level.step), number(level.median), number(level.largest), within, number(median), number(min(errors)))
            rows.append((LOOKS[level.model].label, *row))
    head = ("model", "step, s", "against `ebm-unilateral`: median", "largest", "at most 1e-3", "against `ebm`: median", "smallest")
    return markdown_table(head, rows)


def orders(found: Convergence) -> str:
    """The observed orders of the medians."""
    head = ("observed order in the step, of the median", "against `ebm-unilateral`", "against `ebm`")
    rows = (
        (LOOKS[model].label, *(f"{found.order(model, reference):.2f}" for reference in (UNILATERAL, PAPER))) for model in found.models()
    )
    return markdown_table(head, rows)


def scenes(found: Convergence) -> str:
    """Errors against the unilateral model, scene by scene."""
    rows = []
    for case in found.cases:
        falls = case.ends[PAPER].startswith("overturned") and not case.ends[UNILATERAL].startswith("overturned")
        lines = (" → ".join(number(one.error(UNILATERAL)) for one in found.line(model, case.scene)) for model in found.models())
        rows.append((case.scene, number(case.model_form) + (" †" if falls else ""), *lines))
    return markdown_table(("scene", "`ebm` from `ebm-unilateral`", *(LOOKS[model].label for model in found.models())), rows)


def exceptions(found: Convergence) -> str:
    """What does not converge, of how many."""
    lines: Iterable[str] = found.exceptions or ("none",)
    pairs = {(one.model, one.scene) for one in found.plays}
    return "\n".join([f"Of {len(pairs)} scenes with a model:", "", *(f"- {line}" for line in lines)])


#: What is written between which marks of the page.
MADE = {"figures": figures, "levels": levels, "orders": orders, "scenes": scenes, "exceptions": exceptions}


def main() -> None:
    """Plays, and writes what was found; that there is a place for all of it is seen before."""
    page = DOCS / "convergence.md"
    places = {name: re.compile(rf"(<!-- {name} -->\n).*?(\n<!-- end -->)", flags=re.S) for name in MADE}
    text = page.read_text(encoding="utf-8")
    for name, place in places.items():
        if len(place.findall(text)) != 1:
            sys.exit(f"{page}: no place for {name}")
    found = run_convergence(on_progress=lambda done, of, what: print(f"{done} of {of}: {what}", file=sys.stderr, flush=True))
    convergence_figure(found).savefig(DOCS / "images" / "convergence.png", dpi=130)
    for name, place in places.items():
        table = MADE[name](found).replace("\\", "\\\\")
        text = place.sub(rf"\g<1>\n{table}\n\2", text)
    page.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
