"""The shipped suites notice a model that is the reference but for one fault.

A faulty model takes the place of a shipped one: its tolerances judge it. So a suite that goes deaf,
by a limit that is loosened or a figure that is judged no more, is noticed.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import planted
import pytest

from rockcheck.validation.execute.models import REFERENCE, Work
from rockcheck.validation.suite import results, suites, verdict_scale
from rockcheck.validation.suite.cells import Suite
from rockcheck.validation.suite.runner import run_suite

#: Shipped models that solve the reference's equations; none of them is played.
PLACES = ("cm", "mujoco", "pybullet")
SUITES = ("smoke", "paper")
NOTICED = [fault for fault in planted.FAULTS if fault not in planted.BELOW_TOLERANCE]
#: What is tried every day, by the smoke suite; all else is tried each night.
EVERY_DAY = (
    "rotation rate 10 % too large",
    "vertical velocity 10 % too large",
    "slip rate 10 % too large",
    "y off by 1 mm",
    "event times 15 ms late",
    "impulses halved",
    "vertical base motion dropped",
    planted.OTHER_LAW,
)


def label(fault: str, place: str) -> str:
    """The model with this fault, judged by the tolerances of the model `place`."""
    return f"{place} with {fault or 'no fault'}"


def with_faults(name: str, faults: Sequence[str], places: Sequence[str]) -> Suite:
    """A shipped suite with faulty models in the places of shipped ones, beside the references."""
    shipped = suites.load_suite(name)
    # what is not judged against the paper's model need not be compared with it either
    model_form = shipped.config.model_form if shipped.config.require.model_form else ""
    references = [REFERENCE, *filter(None, [model_form])]
    models = {reference: shipped.models[reference] for reference in references}
    tolerances = {at: line for at, line in shipped.tolerances.items() if at.model in references}
    for place in places:
        lines = {at: line for at, line in shipped.tolerances.items() if at.model == place}
        for fault in faults:
            planted_model = label(fault, place)
            tolerances |= {at._replace(model=planted_model): line for at, line in lines.items()}
            models[planted_model] = Work(
                label=planted_model,
                family="planted:Planted",
                settings={"fault": fault},
                search_path=(str(Path(planted.__file__).parent),),
            )
    # the numerical error of a fault takes three more runs, and nobody reads it
    config = shipped.config.model_copy(update={"uncertainty": False, "model_form": model_form})
    return replace(shipped, config=config, models=models, tolerances=tolerances)


def out_of_tolerance(
    run: results.Run, fault: str, place: str, strict: verdict_scale.Strict = False
) -> Iterator[str]:
    """Scene and figure by which a run fails the model with a fault."""
    for cell in run.cells:
        if cell.model != label(fault, place):
            continue
        assert cell.status == "done", f"{cell.scene}, {cell.model}: {cell.reason}"
        for check in cell.checks:
            if check.fails(strict):
                yield f"{cell.scene}: {check.figure.title}"


@pytest.fixture(scope="module")
def each_day(tmp_path_factory):
    """The smoke suite with the faults of every day."""
    suite = with_faults("smoke", ["", *EVERY_DAY], ["pybullet"])
    return run_suite(suite, tmp_path_factory.mktemp("faults"), jobs=0)


def test_the_reference_without_a_fault_passes(each_day):
    assert list(out_of_tolerance(each_day, "", "pybullet")) == []


@pytest.mark.parametrize("fault", EVERY_DAY)
def test_smoke_notices(each_day, fault):
    assert list(out_of_tolerance(each_day, fault, "pybullet")) != []


@pytest.fixture(scope="module")
def each_night(tmp_path_factory):
    """Both suites with every fault in every place, by name."""
    return {
        name: run_suite(
            with_faults(name, ["", *planted.FAULTS], PLACES),
            tmp_path_factory.mktemp(name),
            jobs=0,
        )
        for name in SUITES
    }


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("name", SUITES)
def test_each_suite_passes_the_reference_without_a_fault(each_night, name, place):
    assert list(out_of_tolerance(each_night[name], "", place)) == []


@pytest.mark.slow
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("fault", NOTICED)
def test_smoke_or_paper_notices(each_night, fault, place):
    failing = [
        figure for name in SUITES for figure in out_of_tolerance(each_night[name], fault, place)
    ]
    assert failing != []


@pytest.mark.slow
@pytest.mark.parametrize("fault", planted.BELOW_TOLERANCE)
def test_what_no_suite_notices_is_a_change_all_the_same(each_night, fault):
    """As docs/reliability.md says: only `--strict worse` fails it."""
    figures = {
        strict: list(out_of_tolerance(each_night["smoke"], fault, "pybullet", strict))
        for strict in (False, True)
    }
    assert figures[False] == []
    assert figures[True] != []


@pytest.mark.slow
def test_what_only_one_suite_notices(each_night):
    """As docs/reliability.md counts."""
    deaf_to = {
        name: {
            fault
            for fault in NOTICED
            if not any(any(out_of_tolerance(each_night[name], fault, place)) for place in PLACES)
        }
        for name in SUITES
    }
    assert deaf_to == {"smoke": planted.ONLY_BY_PAPER, "paper": planted.ONLY_BY_SMOKE}
