"""Scenes in which `rockcheck stress` once found a fault, by what is special in them; each keeps all
invariants now.

They are pinned as scene files with every digit: a new draw of the generator or of numpy's streams
changes none of them.
"""

from pathlib import Path

import pytest

from rockcheck.ebm import EventBasedModel
from rockcheck.scenes import load_scene
from rockcheck.scenes.files import read_toml
from rockcheck.validation.studies.stress.invariants import check_run

FOLDER = Path(__file__).parents[1] / "data" / "found_faults"
INDEX = read_toml(FOLDER / "index.toml")


def test_every_pinned_scene_is_listed():
    assert {path.stem for path in FOLDER.glob("*.toml")} == {"index", *INDEX["faults"]}


@pytest.mark.parametrize("slug", INDEX["faults"])
def test_a_fault_that_was_found(slug: str):
    entry = INDEX["faults"][slug]
    model = EventBasedModel(**INDEX["limits"] | entry["model"])
    played = check_run(
        model, load_scene(FOLDER / f"{slug}.toml"), seed=entry["seed"], audit=entry["audited"]
    )
    assert played.broken == [], (entry["fault"], played)
    assert ("energy" in played.figures) == entry["audited"]
    assert played.unjudged == ()
