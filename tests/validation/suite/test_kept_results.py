"""What is kept beside histories is computed again where anything changed that it depends on."""

from functools import cache
from unittest.mock import Mock

import numpy as np
import pytest

from rockcheck import load_scene
from rockcheck.scenes import files
from rockcheck.validation.execute import provenance
from rockcheck.validation.execute.store import Store
from rockcheck.validation.suite import comparing, motions, scene_results, suites
from rockcheck.validation.suite.runner import run_suite
from rockcheck.validation.uncertainty import input_spread

SCENE = load_scene("fig5a")
SPREAD = files.Spread(value=0.4, sd=0.04)
OTHER = files.Spread(value=0.053, sd=0.004)
ALIKE, TIED = np.eye(2), np.array([[1.0, 0.5], [0.5, 1.0]])


@pytest.fixture
def change_code(monkeypatch):
    """Lets the code of a module be another."""
    whole = provenance.code_digest

    def change(module):
        @cache
        def digest(name, *more):
            return "another" if name == module else whole(name, *more)

        monkeypatch.setattr(provenance, "code_digest", digest)

    return change


@pytest.fixture
def propagated(monkeypatch):
    """What was propagated, in place of which nothing is."""
    share = input_spread.Interval(name="overturns", unit="", value=0.0, low=0.0, high=0.0)
    nothing = input_spread.Inputs(
        samples=2, model="ebm", names=(), figures=(), overturns=share, sensitivities=()
    )
    spread = Mock(return_value=nothing)
    monkeypatch.setattr(input_spread, "propagate", spread)
    return spread


def uncertain(correlation=ALIKE, **spreads):
    given = {"floor.friction": SPREAD, "walls.left.gap": OTHER} | spreads
    return files.UncertainScene(SCENE, given, correlation)


def test_the_effect_of_inputs_is_kept(tmp_path, propagated):
    for _ in range(2):
        scene_results.input_effects_of(Store(tmp_path), uncertain())
    assert propagated.call_count == 1


@pytest.mark.parametrize(
    "changed",
    [uncertain(TIED), uncertain(**{"floor.friction": files.Spread(value=0.4, sd=0.05)})],
    ids=["correlation", "spread"],
)
def test_the_effect_of_other_inputs_is_another(tmp_path, propagated, changed):
    for given in (uncertain(), changed):
        scene_results.input_effects_of(Store(tmp_path), given)
    assert propagated.call_count == 2


def test_the_effect_of_inputs_is_computed_again_by_other_code(tmp_path, propagated, change_code):
    scene_results.input_effects_of(Store(tmp_path), uncertain())
    change_code(input_spread.__name__)
    scene_results.input_effects_of(Store(tmp_path), uncertain())
    assert propagated.call_count == 2


@pytest.mark.parametrize(("module", "again"), [(comparing.__name__, 2), ("nobody", 0)])
def test_cells_are_compared_again_by_other_code(tmp_path, monkeypatch, change_code, module, again):
    suite = suites.load_suite("smoke").only("smoke-rocking", "ebm")
    run_suite(suite, tmp_path, jobs=0)
    compared = Mock(wraps=comparing.compare_cell)
    monkeypatch.setattr(comparing, "compare_cell", compared)
    change_code(module)
    cells = run_suite(suite, tmp_path, jobs=0).cells
    assert [cell.read_back for cell in cells] == [True, True]
    assert compared.call_count == again


def test_scenes_that_are_drawn_otherwise_are_played_again(tmp_path, change_code, written):
    path = written(
        "few.toml",
        """reference = "ebm-unilateral"
[models.ebm-unilateral]
[require]
ensemble = []
[[ensemble]]
name = "pulses"
count = 2
pulse = { period = { uniform = [0.4, 1.5] }, amplitude = { lognormal = [6.0, 0.4] } }
[ensemble.scene]
duration = 1.0
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
""",
    )

    def read_back():
        (cell,) = run_suite(suites.load_suite(path), tmp_path / "out", jobs=0).cells
        return cell.read_back

    assert [read_back(), read_back()] == [False, True]
    change_code(motions.__name__)
    assert read_back() is False
