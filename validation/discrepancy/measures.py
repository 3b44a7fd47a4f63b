"""The registry of the measures, each defined once: name, label, unit, formula and source, function.

`DIFFERENCES` are functions of a `Pair`, called by `compare`; `FIGURES` of a `WindowedHistory`,
called by `describe`; `STATISTICS` of `Samples`, called by `suite.ensembles`. Each returns a number,
or a number and a remark, and raises `Unavailable` where a column or an event is missing. A new
measure goes into the module of its kind; pages, suites and tolerances find it here.
"""

from rockcheck.validation.discrepancy import (
    closed_forms,
    ensemble,
    event_differences,
    quantities,
    rating,
    series_differences,
)

DIFFERENCES = series_differences.DIFFERENCES | event_differences.DIFFERENCES | rating.DIFFERENCES
FIGURES = quantities.FIGURES | closed_forms.FIGURES
STATISTICS = ensemble.STATISTICS
