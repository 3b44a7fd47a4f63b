"""How much of its limit a check uses, and which check is nearest to its limit.

In: checks of finished cells. Out: shares, the worst check, and its words. Pages, the terminal and
job pages ask.
"""

import math
from collections.abc import Iterable

from rockcheck.validation.discrepancy import figures
from rockcheck.validation.suite import results, tolerances, verdicts


def used(check: results.Check) -> float:
    """Share of its limit that a check uses: above 1 only where it is out.

    Infinite where that cannot be said. 0 for a check that is not defined, of a yes-or-no measure,
    and for a better figure whose limit lies around the outdated expected value.
    """
    measure, value, limit = tolerances.known(check.figure.measure), check.figure.value, check.limit
    fails = check.verdict == "fail"
    if check.verdict == "not defined" or (check.verdict == "better" and check.beside is not None):
        return 0.0
    if value is None or limit is None or check.gap:
        return math.inf
    if not limit or measure.yes_no:
        return math.inf if fails else 0.0
    most = math.inf if fails else 1.0
    if check.ideal is None:  # an "at least" measure: the needed share of the value
        return min(limit / value if value > 0.0 else math.inf, most)
    floor = 0.0 if measure.is_error else check.floor
    return min(verdicts.apart(value, check.ideal, floor) / limit, most)


def nearest(checks: Iterable[results.Check]) -> results.Check | None:
    """The check that uses most of its limit: one that fails before one without a tolerance."""
    return max(checks, key=lambda check: (check.verdict_words == "fail", used(check)), default=None)


def share(check: results.Check) -> str:
    """A check in a few words: name, figure, limit."""
    figure = check.figure
    if tolerances.known(figure.measure).yes_no:
        return f"{figure.windowed} {figures.value_words(figure.value, yes_no=True)}"
    value = (
        "-"
        if figure.value is None
        else f"off {abs(figure.value - check.ideal):.1e}"
        if check.ideal
        else f"{figure.value:.2e}"
    )
    limit = "none" if check.limit is None else f"{check.limit:.2g}"
    return f"{figure.windowed} {value} / {limit}"
