"""What a user of the Python interface gets wrong first is answered by what was meant."""

import pickle

import pytest

from rockcheck import (
    Block,
    EventBasedModel,
    History,
    InputError,
    MuJoCo,
    Scene,
    compare,
    load_scene,
)

SCENE = load_scene("fig5a")


def _rocking() -> History:
    return EventBasedModel().simulate(SCENE.replace(duration=1.0))


@pytest.mark.parametrize("kind", [Block, Scene, EventBasedModel, MuJoCo])
def test_values_without_names_are_answered_by_the_names(kind: type) -> None:
    first = next(iter(kind.model_fields))  # type: ignore[attr-defined]
    with pytest.raises(InputError, match=rf"{kind.__name__}\({first}=\.\.\."):
        kind(0.3, 1.0)


def test_an_assigned_field_is_answered_by_replace() -> None:
    with pytest.raises(InputError, match=r"duration: Scene does not change: replace\(duration="):
        SCENE.duration = 3.0  # type: ignore[misc]


def test_a_misspelt_field_that_is_assigned_is_answered_by_its_name() -> None:
    with pytest.raises(InputError, match="did you mean 'half_width'"):
        SCENE.block.half_widht = 1.0  # type: ignore[attr-defined]


def test_a_field_is_not_deleted() -> None:
    with pytest.raises(InputError, match="name: Scene does not change"):
        del SCENE.name


def test_a_scene_is_still_copied_and_pickled() -> None:
    copy = pickle.loads(pickle.dumps(SCENE.replace(duration=3.0)))
    assert copy == SCENE.replace(duration=3.0)


def test_a_misspelt_measure_is_answered_by_its_name() -> None:
    history = _rocking()
    with pytest.raises(InputError, match="did you mean 'theta_rms'"):
        compare(history, history)["theta_rmss"]


def test_a_measure_that_was_not_asked_for_says_how_to_ask() -> None:
    history = _rocking()
    with pytest.raises(InputError, match=r"measures=\['x_rms'\]"):
        compare(history, history, measures=["theta_rms"])["x_rms"]


def test_a_comparison_says_which_measures_it_has() -> None:
    history = _rocking()
    comparison = compare(history, history, measures=["theta_rms"])
    assert "theta_rms" in comparison
    assert "x_rms" not in comparison
