"""An assessment as `--json` says it, from answers made up (`assessed`)."""

from dataclasses import replace

import pytest
from assessed import RUNS, SAFE, gathered, interval, judged

from rockcheck.validation.studies.population import data, results
from rockcheck.validation.studies.population.certainty import Contribution, UncertaintyAnswer
from rockcheck.validation.studies.population.statistics import (
    CaseFalls,
    GapRowAnswer,
    IntensityAnswer,
    RecordIntensity,
)
from rockcheck.validation.uncertainty.lognormal import Lognormal

# Gaps


def gap_search(**change):
    return data.gap_data([replace(SAFE, **change)])["gap_search"]


def test_without_a_search_there_is_no_gap():
    assert data.gap_data([]) == {
        "gaps": [],
        "clearance": None,
        "none_overturns_up_to": None,
        "gap_search": None,
    }


@pytest.mark.parametrize(("every", "said"), [(0.02, 0.02), (0.0, None)])
def test_a_search_without_gaps_beyond_its_fine_ones_has_no_steps_there(every, said):
    assert gap_search(beyond_every=every)["looked_beyond_every"] == said
    assert gap_search(draws_beyond_every=every)["draws_looked_beyond_every"] == said


def test_a_gap_is_known_to_a_tenth_of_a_millimetre():
    assert gap_search()["resolved_to"] == 1e-4


def test_each_fall_has_its_ends():
    falls = (CaseFalls("a", 3, (interval(3, 0.03, 0.04, 0.0299, None),)),)
    assert gap_search(falls=falls)["falls"] == [
        {"record": "a", "draw": 3, "intervals": [[0.03, 0.04]]}
    ]


def test_runs_by_gap_are_those_of_the_first_side_and_searches_those_of_each():
    rows = (GapRowAnswer(0.05, 4, 1, 0, 3, 0.3, 0.5),)
    said = data.gap_data([replace(SAFE, rows=rows), replace(SAFE, side="right")])
    (row,) = said["gaps"]
    assert row["side"] == "left"
    assert row["wall_speed"] == {"median": 0.3, "largest": 0.5}
    assert [search["side"] for search in said["gap_searches"]] == ["left", "right"]


# Intensities


def intensity(fit):
    records = (RecordIntensity("a", 0.4, 0.6, 40.0, ((0.6, 0.7),)),)
    return data.intensity_data(IntensityAnswer("pga", "PGA", "g", records, fit, 2))["intensity"]


def test_a_motion_that_was_not_scaled_has_no_intensity():
    assert data.intensity_data(None) == {"intensity": None}


@pytest.mark.parametrize(
    ("fit", "numbers"),
    [
        (Lognormal(0.5, 0.3, 0.4, 0.6, ()), [0.5, 0.3, 0.4, 0.6]),
        (None, [None] * 4),
    ],
)
def test_a_curve_has_its_median_dispersion_and_interval(fit, numbers):
    said = intensity(fit)
    assert [said[name] for name in ("median", "dispersion", "low", "high")] == numbers


def test_an_island_is_a_pair():
    (record,) = intensity(None)["records"]
    assert record["islands"] == [[0.6, 0.7]]


# How sure

SURE = results.Certainty(numerical=judged(0.0123), depends_on_law_from_s=1.5)


def certainty(everything, of="peak rotation"):
    parts = (Contribution("records", 0.8, 0.2),)
    return data.certainty_data(everything, UncertaintyAnswer(of, parts, ()))


@pytest.mark.parametrize(("of", "unit"), [("peak rotation", "alpha"), ("outcome", "1")])
def test_a_contribution_has_the_unit_of_the_answer(of, unit):
    (part,) = certainty(gathered({"a": RUNS["a"]}), of)["contributions"]
    assert part == {"source": "records", "share": 0.8, "sd": 0.2, "unit": unit}


def test_the_numerical_uncertainty_of_a_single_run_stands_at_the_top_too():
    said = certainty(gathered({"a": RUNS["a"]}, recorded=False, certainty={"a": SURE}))
    assert said["numerical"]["method"] == "by hand"
    assert said["depends_on_law_from_s"] == 1.5
    assert said["quantities"][0]["u_num"] == 0.0123


@pytest.mark.parametrize(
    "everything",
    [
        gathered({"a": RUNS["a"]}, certainty={"a": SURE}),
        gathered({"a": RUNS["a"], "b": RUNS["b"]}, recorded=False),
    ],
    ids=["recorded", "two runs"],
)
def test_of_records_or_several_runs_it_does_not(everything):
    assert "quantities" not in certainty(everything)


def test_without_a_result_nothing_is_converged():
    assert certainty(gathered({"a": RUNS["a"]}))["numerical"] == {
        "converged": False,
        "depends_on_law_from_s": None,
        "method": "",
        "quantities": [],
    }


def test_a_tie_names_its_record():
    tie = ("friction equals B/H", 0.4, ("at rest", "moving"))
    said = certainty(gathered(certainty={"b": results.Certainty(ties=(tie,))}))
    assert said["ties"] == [
        {
            "what": "friction equals B/H",
            "from_s": 0.4,
            "fates": ["at rest", "moving"],
            "record": "b",
        }
    ]
