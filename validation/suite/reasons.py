"""Why a run does not pass, and what its models remark, a line each.

In: a finished run or cell. Out: lines of words. Every rendering of a run ends with them.
"""

from collections.abc import Iterator

from rockcheck.validation.suite import results, verdict_scale


def note_lines(run: results.Run) -> Iterator[str]:
    """What the models say of their runs, such as a physics that they leave out, a line each.

    A note that several models share is a line with their names.
    """
    for scene, cells in run.by_scene.items():
        models: dict[str, list[str]] = {}
        for model, cell in cells.items():
            for note in cell.notes:
                models.setdefault(note, []).append(model)
        for note, names in models.items():
            who = "all models" if len(names) == len(cells) > 1 else ", ".join(names)
            yield f"{scene}, {who}: {note}"


def verdict_lines(run: results.Run) -> Iterator[str]:
    """Why anything is not a pass, a line each."""
    yield from run.wrong
    missing = [cell for cell in run.cells if cell.status in results.MISSING]
    yield from dict.fromkeys(f"{cell.model}: {cell.reason}" for cell in missing)
    for cell in run.cells:
        if cell.status not in results.MISSING:
            yield from cell_lines(cell)


def improvements(run: results.Run) -> Iterator[str]:
    """The figures that are better than expected, a line each."""
    yield from (
        f"{cell.scene}, {cell.model}: {check.figure.title}: {check.reason}"
        for cell, check in run.checks()
        if check.verdict == "better"
    )


def cell_lines(cell: results.Cell, strict: verdict_scale.Strict = True) -> Iterator[str]:
    """Why a cell does not pass in a run of that strictness, a line each."""
    place = f"{cell.scene}, {cell.model}"
    if cell.status != "done":
        yield f"{place}: {cell.reason}"
    yield from (
        f"{place}: {check.figure.title}: {check.reason}"
        for check in cell.checks
        if check.fails(strict)
    )
    if any(check.fails(strict) for check in cell.checks):
        yield from (f"{place}: note: {note}" for note in cell.notes)
