"""Verdicts on the differences of two cells, from figures and uncertainties made by hand."""

import pytest

from rockcheck import Block, Floor, Rest, Scene
from rockcheck.validation.discrepancy import figures
from rockcheck.validation.discrepancy.impacts import SAME_IMPACT
from rockcheck.validation.suite import explain, results
from rockcheck.validation.uncertainty import input_spread, numerical

SCENE = Scene(
    name="s",
    block=Block(half_width=0.2, half_height=1.0),
    floor=Floor(friction=0.5),
    excitation=Rest(),
    duration=2.0,
)
ALPHA = SCENE.block.alpha
NO_SCATTER = {"m": {}, "r": {}}


def figure(measure, value, against=""):
    return figures.Figure(measure=measure, label="", unit="", value=value, against=against)


def errors_of(**uncertainties):
    """The numerical uncertainties of a run by quantity; None of one that is not converged."""
    return numerical.Numerical(
        method="",
        quantities=tuple(
            numerical.Quantity(
                name=name,
                unit="",
                value=0.0,
                u_num=u_num,
                verdict="not converged" if u_num is None else "converged",
                reason="it changes" if u_num is None else "",
            )
            for name, u_num in uncertainties.items()
        ),
    )


SURE = errors_of(theta_rms=0.03, peak_rotation=0.03, last_slip=0.003)
REFERENCE = errors_of(theta_rms=0.04, peak_rotation=0.04, last_slip=0.004)


def cell(model, *of_it, error=SURE, outcome="at rest", end=2.0):
    return results.Cell(
        scene="s",
        model=model,
        status="done",
        outcome=outcome,
        numerical=error,
        figures=(figure("end_time", end), *of_it),
    )


def told(own, reference, scatters=NO_SCATTER, inputs=None):
    """The explanations by their quantities."""
    found = explain.explanations(SCENE, own, [reference], scatters, inputs)
    return {one.quantity: one for one in found}


def peaks(own_peak=0.5, reference_peak=0.2, **more):
    """The two cells of these peak rotations, alpha; `more` is of the first cell."""
    return (
        cell("m", figure("peak_rotation", own_peak), **more),
        cell("r", figure("peak_rotation", reference_peak), error=REFERENCE),
    )


@pytest.mark.parametrize(("own", "reference"), [(0.5, 0.2), (0.2, 0.5)])
def test_the_difference_of_two_peaks_has_no_sign(own, reference):
    assert told(*peaks(own, reference))["peak_rotation"].error == pytest.approx(0.3)


def test_a_figure_against_the_reference_is_a_difference_itself():
    own = cell("m", figure("theta_rms", 0.07, against="r"))
    assert told(own, cell("r", error=REFERENCE))["theta_rms"].error == 0.07


def test_numerical_uncertainties_of_both_runs_add_as_squares():
    assert told(*peaks())["peak_rotation"].u_num == pytest.approx(0.05)


@pytest.mark.parametrize(
    ("own", "reference"), [(errors_of(peak_rotation=None), REFERENCE), (SURE, "unsure")]
)
def test_a_run_that_is_not_converged_explains_nothing_and_says_why(own, reference):
    mine, other = peaks(error=own)
    if reference == "unsure":
        other = other.model_copy(update={"numerical": errors_of(peak_rotation=None)})
    found = told(mine, other)["peak_rotation"]
    assert found.verdict == numerical.NOT_CONVERGED
    assert found.u_num is None
    assert found.reason == "it changes"


def test_a_model_whose_numerical_error_is_unknown_has_no_verdict():
    assert told(*peaks(error=None)) == {}


def test_a_reference_whose_numerical_error_is_unknown_adds_none():
    mine, other = peaks()
    found = told(mine, other.model_copy(update={"numerical": None}))
    assert found["peak_rotation"].u_num == pytest.approx(0.03)


def test_the_scatter_of_tests_is_in_alpha_and_adds_as_squares():
    scatters = {"m": {"peak_rotation": 0.03 * ALPHA}, "r": {"peak_rotation": 0.04 * ALPHA}}
    assert told(*peaks(), scatters)["peak_rotation"].u_data == pytest.approx(0.05)


def test_the_scatter_of_slips_is_in_metres():
    own, reference = (cell(model, figure("last_slip", 0.1)) for model in "mr")
    scatters = {"m": {"last_slip": 0.02}, "r": {}}
    assert told(own, reference, scatters)["last_slip"].u_data == pytest.approx(0.02)


def test_a_model_without_repeats_has_no_scatter():
    own, reference = (cell(model, figure("last_slip", 0.1)) for model in "mr")
    scatters = {"m": {}, "r": {"last_slip": 0.02}}
    assert told(own, reference, scatters)["last_slip"].u_data == pytest.approx(0.02)


def test_without_uncertain_inputs_there_is_no_spread():
    assert told(*peaks())["peak_rotation"].u_input == 0.0


def spread_of(share=0.0):
    """Inputs of a peak between 0.1 and 0.6 alpha about 0.5, of which this share of draws falls."""
    peak = input_spread.Interval(name="peak_rotation", unit="alpha", value=0.5, low=0.1, high=0.6)
    falls = input_spread.Interval(name="overturns", unit="1", value=share, low=0.0, high=1.0)
    return input_spread.Inputs(
        samples=64, model="", names=(), figures=(peak,), overturns=falls, sensitivities=()
    )


def test_the_spread_of_inputs_is_that_of_the_quantity():
    assert told(*peaks(), inputs=spread_of())["peak_rotation"].u_input == pytest.approx(0.4)


def test_a_quantity_that_the_inputs_do_not_have_is_not_spread():
    own, reference = (cell(model, figure("last_slip", 0.1)) for model in "mr")
    assert told(own, reference, inputs=spread_of())["last_slip"].u_input == 0.0


def test_where_one_history_ends_before_the_other_there_are_no_peaks():
    end = 2.0 - 1.01 * SAME_IMPACT
    assert told(*peaks(end=end)) == {}


def test_ends_within_an_impact_s_time_are_the_same():
    end = 2.0 - 0.99 * SAME_IMPACT
    assert list(told(*peaks(end=end))) == ["peak_rotation"]


@pytest.mark.parametrize(
    ("outcomes", "quantities"),
    [
        (("overturned left", "at rest"), ["outcome"]),
        (("at rest", "overturned left"), ["outcome"]),
        (("overturned right", "overturned left"), ["outcome"]),
        (("overturned left", "overturned left"), []),
        (("at rest", "moving"), ["peak_rotation"]),
    ],
)
def test_where_a_block_falls_its_outcome_is_explained_in_place_of_its_peak(outcomes, quantities):
    mine, other = peaks()
    found = told(
        mine.model_copy(update={"outcome": outcomes[0]}),
        other.model_copy(update={"outcome": outcomes[1]}),
    )
    assert list(found) == quantities


def test_another_outcome_is_an_error_of_one():
    mine, other = peaks(outcome="overturned left")
    assert told(mine, other)["outcome"].error == 1.0


def test_another_outcome_without_numerical_error_is_model_form():
    mine, other = peaks(outcome="overturned left")
    found = told(mine, other)["outcome"]
    assert found.u_num == 0.0
    assert found.verdict == explain.OTHER_OUTCOME


@pytest.mark.parametrize(
    ("share", "verdict"),
    [
        (0.0, explain.OTHER_OUTCOME),
        (1.0, explain.OTHER_OUTCOME),
        (0.01, numerical.INPUTS),
        (0.99, numerical.INPUTS),
    ],
)
def test_inputs_explain_an_outcome_if_both_occur_among_the_draws(share, verdict):
    mine, other = peaks(outcome="overturned left")
    assert told(mine, other, inputs=spread_of(share))["outcome"].verdict == verdict


def test_an_outcome_that_is_not_converged_is_not_explained():
    mine, other = peaks(outcome="overturned left", error=errors_of(peak_rotation=None))
    found = told(mine, other)["outcome"]
    assert found.verdict == numerical.NOT_CONVERGED
    assert found.reason == "it changes"


def test_each_reference_has_its_verdicts():
    mine, other = peaks()
    found = explain.explanations(SCENE, mine, [other, other], NO_SCATTER, None)
    assert [one.against for one in found] == ["r", "r"]
