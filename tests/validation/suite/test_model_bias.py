"""Which peaks of finished runs count in a model's bias and scatter, and what they make."""

import math

import numpy as np
import pytest

from rockcheck.validation.discrepancy import figures
from rockcheck.validation.discrepancy.ensemble import SMALLEST_PEAK
from rockcheck.validation.suite import model_bias, results


def cell(model, peak, scene="s", status="done", outcome="at rest"):
    figure = figures.Figure(measure="peak_rotation", label="", unit="alpha", value=peak)
    return results.Cell(scene=scene, model=model, status=status, outcome=outcome, figures=(figure,))


def run_of(*cells, **more):
    return results.Run(
        suite="mine",
        created="",
        reference="r",
        scenes={},
        models=("r", "m"),
        cells=cells,
        **more,
    )


def test_a_pair_is_the_reference_s_peak_and_the_model_s():
    run = run_of(cell("r", 0.4), cell("m", 0.5))
    assert model_bias.pairs_of([run]) == {"m": [(0.4, 0.5)]}


def test_pairs_of_several_runs_and_scenes_are_of_one_scene_each():
    first = run_of(cell("r", 0.4), cell("m", 0.5), cell("r", 0.1, "t"), cell("m", 0.2, "t"))
    assert model_bias.pairs_of([first, run_of(cell("r", 0.6), cell("m", 0.7))]) == {
        "m": [(0.4, 0.5), (0.1, 0.2), (0.6, 0.7)]
    }


@pytest.mark.parametrize(
    "other",
    [
        cell("m", SMALLEST_PEAK),
        cell("m", None),
        cell("m", 7.0, outcome="overturned left"),
        cell("m", 0.5, status="failed"),
    ],
    ids=["hardly rocks", "no peak", "falls", "failed"],
)
def test_what_allows_no_ratio_is_left_out(other):
    assert model_bias.pairs_of([run_of(cell("r", 0.4), other)]) == {}


def test_a_scene_in_which_the_reference_falls_is_left_out():
    run = run_of(cell("r", 7.0, outcome="overturned left"), cell("m", 0.5))
    assert model_bias.pairs_of([run]) == {}


def test_scenes_of_an_ensemble_are_paired_by_their_numbers():
    drawn = results.EnsembleRecord(
        name="drawn",
        definition={},
        peaks={"r": (0.1, 0.2, 0.3), "m": (0.4, None, 0.6)},
        outcomes={"r": ("at rest",) * 3, "m": ("at rest", "", "moving")},
    )
    assert model_bias.pairs_of([run_of(ensembles=(drawn,))]) == {"m": [(0.1, 0.4), (0.3, 0.6)]}


def test_a_bias_and_scatter_of_few_pairs_are_not_told():
    assert model_bias.trust_in([(1.0, 1.1)] * (model_bias.FEWEST - 1)) is None


def test_of_the_fewest_pairs_they_are():
    logarithms = np.array([-0.2, -0.1, 0.0, 0.1, 0.7])
    trust = model_bias.trust_in([(2.0, 2.0 * math.exp(one)) for one in logarithms])
    sigma = math.sqrt(sum((logarithms - 0.1) ** 2) / 4)
    assert trust.scatter == pytest.approx(sigma)
    assert trust.bias == pytest.approx(math.exp(0.1 + sigma**2 / 2))
    assert trust.count == model_bias.FEWEST
