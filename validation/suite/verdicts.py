"""Verdicts: whether a figure is within its tolerance, and why it is not.

In go a figure, its tolerance and its floor; out comes a check with its verdict and reason.
`judging` calls it for the cells of a run, `accepting` for the lines that it would write.

The judgement of a figure depends on its measure:

| measure | distance within `limit` | better, where it moved by more than `drift` |
|---|---|---|
| error (has a perfect value) | from the perfect value | that distance fell by more than it |
| quantity | from `expected`, beyond its floor | it came nearer to the reference's by more |

The move of a figure is its difference from `expected`, counting only the parts beyond their floor
(`floor_of`; a count has none): two values below it do not differ. The limit of an error is not
changed by the floor. A figure that moved by more than `drift` is *better* if the last column holds,
else *changed*; better passes, even for a quantity beyond its limit. A quantity is better only where
the reference solves the same equations and is itself as expected (`judging`). A ratio to zero is
*not defined*.
"""

import math

from rockcheck.scenes import Scene
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.suite import results, verdict_scale
from rockcheck.validation.suite.tolerances import Tolerance
from rockcheck.validation.uncertainty.numerical import Numerical

#: By unit, the quantity whose numerical uncertainty is used for the others.
STANDS_FOR = {"angle": "theta_rms", "m": "last_slip", "s": "end_time"}


def floor_of(measure: figures.Measure, scene: Scene, numerical: Numerical | None) -> float:
    """Smallest meaningful value of a cell's figure, in the measure's unit; 0 for a count.

    The largest of the measure's resolution, the run's numerical uncertainty if known, and, for a
    quantity, the error of a chord between rows (`between_rows`). An error is read at the rows' own
    times.
    """
    if not measure.resolution:
        return 0.0
    between_rows = 0.0
    if not measure.is_error:
        between_rows = figures.between_rows(
            measure.unit, scene.frequency_parameter, scene.gravity, scene.output_step
        )
    return max(measure.resolution, between_rows, _numerical_uncertainty(measure, numerical))


def _numerical_uncertainty(measure: figures.Measure, numerical: Numerical | None) -> float:
    """That of the measure's figure, else of the quantity that stands for it; 0 if not known."""
    if numerical is None:
        return 0.0
    for name in (measure.name, STANDS_FOR.get(measure.unit, "")):
        uncertainty = numerical.u_num(name)
        if uncertainty is not None:
            return uncertainty
    return 0.0


def judge(
    figure: figures.Figure,
    tolerance: Tolerance | None,
    *,
    kind: results.Kind,
    measure: figures.Measure,
    gap: str = "",
    floor: float | None = None,
    beside: float | None = None,
) -> results.Check:
    """The verdict on a figure: a missing, infinite or incompletely compared one never passes.

    `floor` is the figure's (None: its measure's resolution), `beside` the reference's same figure,
    where that is a yardstick.
    """
    line = tolerance or Tolerance(limit=0.0)
    floor = measure.resolution if floor is None else floor
    value = figure.value
    verdict: verdict_scale.CheckVerdict = "fail"
    if figure.undefined:
        verdict, reason = "not defined", figure.note
    elif value is None or not math.isfinite(value):
        reason = figure.note or "not a number"
    elif gap or tolerance is None:
        reason = gap or "no tolerance yet"
    else:
        perfect = measure.ideal if measure.is_error else beside
        verdict, reason = _verdict(figure, value, tolerance, measure, floor, kind, perfect)
    return results.Check(
        figure=figure,
        kind=kind,
        verdict=verdict,
        reason=reason,
        ideal=measure.ideal if measure.is_error else line.expected,
        expected=line.expected,
        limit=None if tolerance is None else tolerance.limit,
        drift=line.drift,
        why=line.why,
        gap=gap,
        floor=floor,
        beside=beside,
    )


def _verdict(
    figure: figures.Figure,
    value: float,
    line: Tolerance,
    measure: figures.Measure,
    floor: float,
    kind: results.Kind,
    perfect: float | None,
) -> tuple[verdict_scale.CheckVerdict, str]:
    """The verdict by the table at the top of this module, and why the figure is no plain pass.

    `perfect`: the value to which a better one is nearer, None where it is not known.
    """
    expected = line.expected
    drift = math.inf if line.drift is None else line.drift
    moved = 0.0 if expected is None else apart(value, expected, floor, measure.ideal or 0.0)
    outside = _outside(figure, value, line, measure, moved)
    if outside and measure.is_error:
        return "fail", outside
    if expected is None or not (outside or moved > drift):
        return "pass", ""
    if kind != "model form" and _gain(value, expected, measure, perfect) > (line.drift or 0.0):
        nearer_to = f", nearer to {perfect:.6g}" if perfect else ""
        return "better", f"{value:.6g} was {expected:.6g}{nearer_to}"
    if outside:
        return "fail", outside
    return "changed", f"{value:.6g} was {expected:.6g} (drift allowed {drift:.2g})"


def _gain(value: float, expected: float, measure: figures.Measure, perfect: float | None) -> float:
    """By how much a figure is better than expected, in the measure's unit; negative if worse."""
    if measure.sense == "at least":
        return value - expected
    if perfect is None:
        return 0.0
    return abs(expected - perfect) - abs(value - perfect)


def _outside(
    figure: figures.Figure, value: float, line: Tolerance, measure: figures.Measure, moved: float
) -> str:
    """Why a figure is beyond its limit, empty if not; `moved` is its distance from `expected`."""
    limit = line.limit
    unit = "" if figure.unit == "1" else f" {figure.unit}"
    if measure.sense == "at least":
        return "" if value >= limit else f"{value:.4g} is below the limit {limit:.4g}{unit}"
    ideal = measure.ideal if measure.is_error else line.expected
    if ideal is None:
        distance = math.inf
    elif measure.is_error:
        distance = abs(value - ideal)
    else:
        distance = moved
    if distance <= limit:
        return ""
    if limit:
        origin = f" from {ideal:.6g}" if ideal else ""
        return f"{value:.4g} is more than {limit:.4g}{origin}{unit}"
    note = f" ({figure.note})" if figure.note else ""
    return f"{value:.6g}, not {ideal:.6g}{note}"


def apart(value: float, expected: float, floor: float, zero: float = 0.0) -> float:
    """Distance of two values, counting of each only the part beyond `floor` around `zero`.

    The full distance if both are beyond the floor on the same side.
    """
    size, expected_size = value - zero, expected - zero
    if min(abs(size), abs(expected_size)) > floor and size * expected_size > 0.0:
        return abs(value - expected)
    return abs(_beyond(size, floor) - _beyond(expected_size, floor))


def _beyond(size: float, floor: float) -> float:
    """The part of a value beyond the floor, with its sign."""
    return math.copysign(max(abs(size) - floor, 0.0), size)
