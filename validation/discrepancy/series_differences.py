"""Differences of two histories as curves over time: of rotation, position, slip rate and energy.

In: a `Pair`, reference and candidate on one time axis. Out: a number for each of `DIFFERENCES`;
`Unavailable` is raised where a history lacks a column. `measures` lists them for `compare`.

In the formulas r is the reference, c the candidate, d = c - r, and <.> the mean over the window,
by the trapezoidal rule.
"""

import math

import numpy as np
import scipy  # it loads its parts as they are used

from rockcheck.scenes import Floats
from rockcheck.validation.discrepancy.figures import Measure, Pair, by_name


def _peak_difference(columns: Floats) -> float:
    reference, candidate = columns
    return float(np.max(np.abs(candidate - reference)))


def _hausdorff(pair: Pair) -> float:
    """Hausdorff distance of the graphs of theta in the plane (p t, theta); NaN if not finite."""
    p = pair.known.block.weaker_pivot.frequency_parameter(pair.known.gravity)
    reference, candidate = pair.theta
    if not np.all(np.isfinite(pair.theta)):
        return math.nan
    reference_graph = np.column_stack([p * pair.time, reference])
    candidate_graph = np.column_stack([p * pair.time, candidate])
    return max(
        _largest_distance(reference_graph, candidate_graph),
        _largest_distance(candidate_graph, reference_graph),
    )


def _largest_distance(points: Floats, line: Floats) -> float:
    """Largest distance from `points` to the broken line through `line`, both of shape (n, 2).

    The two segments at the vertex nearest to a point, looked up in a tree, bound its distance from
    above. The point with the largest bound is measured to the whole line, until that is its bound.
    """
    if len(line) == 1:
        return float(np.max(np.linalg.norm(points - line[0], axis=1)))
    last_segment = len(line) - 2
    nearest = scipy.spatial.cKDTree(line).query(points)[1]
    before = np.clip(nearest - 1, 0, last_segment)
    after = np.clip(nearest, 0, last_segment)
    bounds = np.minimum(
        _distances(points, line[before], line[before + 1]),
        _distances(points, line[after], line[after + 1]),
    )
    while True:
        farthest = np.argmax(bounds)
        exact = np.min(_distances(points[farthest], line[:-1], line[1:]))
        if exact >= bounds[farthest]:
            return float(exact)
        bounds[farthest] = exact


def _distances(points: Floats, start: Floats, end: Floats) -> Floats:
    """Distances of points from segments."""
    segment = end - start
    from_start = points - start
    projection = np.sum(from_start * segment, axis=1) / np.sum(segment**2, axis=1)
    fraction = np.clip(projection, 0.0, 1.0)
    return np.asarray(np.linalg.norm(from_start - fraction[:, None] * segment, axis=1))


def _column_rms(name: str, label: str, column: str, unit: str, formula: str) -> Measure:
    """The RMS difference of a column; computed where a suite asks for it."""
    return Measure(
        name,
        f"RMS difference of {label}",
        unit,
        f"sqrt <d^2> of {formula}, {unit}.",
        lambda pair: pair.rms(pair.channels(column)),
        on_request=True,
    )


DIFFERENCES = by_name(
    Measure(
        "theta_rms",
        "RMS difference of rotation",
        "angle",
        "sqrt <d^2> of theta, in alpha.",
        lambda pair: pair.rms(pair.theta),
    ),
    Measure(
        "theta_peak",
        "peak difference of rotation",
        "angle",
        "max |d| of theta, in alpha.",
        lambda pair: _peak_difference(pair.theta),
    ),
    Measure(
        "x_rms",
        "RMS difference of x",
        "m",
        "sqrt <d^2> of the centroid's x, m.",
        lambda pair: pair.rms(pair.channels("x")),
    ),
    Measure(
        "x_peak",
        "peak difference of x",
        "m",
        "max |d| of the centroid's x, m.",
        lambda pair: _peak_difference(pair.channels("x")),
    ),
    Measure(
        "slip_rate_rms",
        "RMS difference of slip rate",
        "m/s",
        "sqrt <d^2> of the pivot corner's horizontal velocity V, m/s.",
        lambda pair: pair.rms(pair.channels("slip_rate")),
    ),
    Measure(
        "slip_rate_peak",
        "peak difference of slip rate",
        "m/s",
        "max |d| of the pivot corner's horizontal velocity V, m/s; where the pivot changes it"
        " jumps, see `theta_hausdorff`.",
        lambda pair: _peak_difference(pair.channels("slip_rate")),
    ),
    _column_rms("rotation_rate_rms", "rotation rate", "theta_dot", "rad/s", "the rate of rotation"),
    _column_rms(
        "x_velocity_rms",
        "horizontal velocity",
        "x_dot",
        "m/s",
        "the centroid's horizontal velocity",
    ),
    _column_rms(
        "y_velocity_rms", "vertical velocity", "y_dot", "m/s", "the centroid's vertical velocity"
    ),
    _column_rms("y_rms", "y", "y", "m", "the centroid's y"),
    _column_rms("slip_rms", "slip", "slip", "m", "the pivot corner's place along the floor"),
    Measure(
        "energy_rms",
        "RMS difference of energy",
        "J/kg",
        "sqrt <d^2> of kinetic plus potential energy per unit mass, J/kg.",
        lambda pair: pair.rms(pair.energies),
    ),
    Measure(
        "energy_peak",
        "peak difference of energy",
        "J/kg",
        "max |d| of kinetic plus potential energy per unit mass, J/kg.",
        lambda pair: _peak_difference(pair.energies),
    ),
    Measure(
        "sprague_geers_m",
        "Sprague-Geers M (magnitude)",
        "1",
        "M = sqrt(<c^2>/<r^2>) - 1 of theta: error of magnitude, blind to phase.\n\nSprague &"
        " Geers, Commun. Numer. Meth. Engng 20 (2004) 467; Schwer, Engng Comput. 23 (2007) 295.",
        lambda pair: pair.sprague_geers[0],
    ),
    Measure(
        "sprague_geers_p",
        "Sprague-Geers P (phase)",
        "1",
        "P = acos(<r c>/sqrt(<r^2><c^2>))/pi of theta: error of phase, blind to magnitude; 0 in"
        " phase, 1 in opposition.\n\nSource as for M.",
        lambda pair: pair.sprague_geers[1],
    ),
    Measure(
        "sprague_geers_c",
        "Sprague-Geers C (both)",
        "1",
        "C = sqrt(M^2 + P^2) of theta. Source as for M.",
        lambda pair: math.hypot(*pair.sprague_geers),
    ),
    Measure(
        "peak_ratio",
        "ratio of peak rotations",
        "1",
        "max |c| / max |r| of theta.",
        lambda pair: pair.peaks[1] / pair.peaks[0],
        ideal=1.0,
    ),
    Measure(
        "theta_hausdorff",
        "Hausdorff distance of rotation's graphs",
        "1",
        "Hausdorff distance of the graphs of theta in the plane (p t, theta/alpha); p is of"
        " the scene's gravity, else of 9.81 m/s^2.\n\nThe largest distance from a sample of one"
        " graph to the other graph, a broken line, either way. An impact that comes a millisecond"
        " late counts as a millisecond, not as the jump that it delays; used so for nonsmooth"
        " mechanics by the authors of cardillo.",
        _hausdorff,
    ),
)
