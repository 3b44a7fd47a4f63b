"""Which scenes of a run are shown one by one: the worst ones, at most so many.

In: a finished run. Out: names of scenes. Pages, the terminal and job pages ask.
"""

from rockcheck.validation.suite import results, verdict_scale
from rockcheck.validation.suite.limits_used import used

#: The most scenes that tables and pages show one by one.
MOST_SHOWN = 200


def shown(run: results.Run) -> tuple[str, ...]:
    """The scenes and ensembles shown one by one, in the suite's order: at most `MOST_SHOWN` scenes.

    Those with the worst verdict, and of these the nearest to a limit. Ensembles are always shown.
    """
    cells, ensembles = run.by_scene, {ensemble.name for ensemble in run.ensembles}
    badness = {
        place: (
            max(verdict_scale.SEVERITY.index(cell.verdict) for cell in models.values()),
            max((used(check) for cell in models.values() for check in cell.checks), default=0.0),
        )
        for place, models in cells.items()
        if place not in ensembles
    }
    chosen = ensembles.union(sorted(badness, key=badness.__getitem__, reverse=True)[:MOST_SHOWN])
    return tuple(place for place in cells if place in chosen)


def not_shown(run: results.Run) -> list[str]:
    """A line with the number of scenes that are not `shown`; empty if there are none."""
    more = len(run.by_scene) - len(shown(run))
    said = f"and {more} more scenes, none of them worse; their figures are in figures.csv"
    return [said] if more else []
