"""A run as Markdown, for the page of a job of continuous integration.

In: a finished run. Out: the text, in which nothing untrusted can act. The pages call it.
"""

import re
from collections.abc import Container, Iterator

from rockcheck.scenes import printable, writing
from rockcheck.validation.suite import results
from rockcheck.validation.suite.limits_used import share, used
from rockcheck.validation.suite.reasons import improvements, verdict_lines
from rockcheck.validation.suite.shown_scenes import MOST_SHOWN, not_shown, shown

MARKS = {"pass": "✅", "incomplete": "⚪", "changed": "🟡", "fail": "❌", "error": "💥"}


def markdown(run: results.Run) -> str:
    """A summary for a job's page: the verdict, the reasons, and a table of scenes by models."""
    parts = [
        f"## {MARKS[run.verdict]} rockcheck {_plain(run.suite)}: {run.verdict_words}",
        f"{len(run.cells)} simulations, {run.up_to_date} up to date,"
        f" {sum(1 for _ in run.checks())} checks, {run.wall_seconds:.1f} s.",
    ]
    for heading, lines in (
        ([], list(verdict_lines(run))),
        (["Better than expected:"], list(improvements(run))),
    ):
        more = len(lines) - MOST_SHOWN
        rest = [f"- and {more} more, in junit.xml"] if more > 0 else []
        items = [*(f"- {_plain(one)}" for one in lines[:MOST_SHOWN]), *rest]
        parts += [*heading, "\n".join(items)] if lines else []
    cells, places = run.by_scene, shown(run)
    rows = (
        (_plain(scene), *(_entry(cells[scene].get(model), run.judged) for model in run.models))
        for scene in places
    )
    parts += [writing.markdown_table(("scene", *map(_plain, run.models)), rows), *not_shown(run)]
    return "\n\n".join([*parts, *_laws(run, places)]) + "\n"


def _laws(run: results.Run, places: Container[str]) -> Iterator[str]:
    """The law of impacts that each model followed, for scenes with a landing at which laws part.

    It is not judged.
    """
    found = {(cell.scene, cell.model): cell.impact_law for cell in run.cells if cell.impact_law}
    told = {scene: law.t for (scene, _), law in found.items() if scene in places}
    models = [model for model in run.models if any(model == of for _, of in found)]
    rows = (
        (
            _plain(scene),
            f"{t:.3f} s",
            *(found[scene, one].law if (scene, one) in found else "" for one in models),
        )
        for scene, t in told.items()
    )
    if told:
        yield "The law of impacts followed at the first landing at which laws part (not judged):"
        yield writing.markdown_table(("scene", "landing", *map(_plain, models)), rows)


def _entry(cell: results.Cell | None, judged: bool) -> str:
    if cell is None:
        return ""
    sure = " (not converged)" if cell.converged is False else ""
    if cell.status == "done" and not (judged and cell.checks):
        return f"{_plain(cell.fate)}{sure}"
    numerical = [one for one in cell.checks if one.figure.against and one.kind == "numerical"]
    worst = max(
        numerical,
        key=lambda one: (one.verdict_words == "fail", one.figure.value is not None, used(one)),
        default=None,
    )
    said = _plain(share(worst)) if worst else ""
    return f"{MARKS[cell.verdict]} {said}{sure}".strip()


def _plain(text: str) -> str:
    """Untrusted text as inert Markdown: no tag, link, picture or new line."""
    return (
        re.sub(r"([\\`*\[\]!#~])", r"\\\1", printable(text, 1000))
        .replace("&", "&amp;")
        .replace("<", "&lt;")
        .replace("://", ":&#47;/")
    )
