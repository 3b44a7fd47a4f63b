"""A new engine is one file: what others know of it stands in its record, which they ask."""

import importlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import rockcheck
from rockcheck.engines import registry

#: MuJoCo under another name, with a setting more.
ABACUS = '''
"""The made-up engine Abacus."""

from typing import ClassVar

from rockcheck.engines.facts import BenchmarkSteps, EngineFacts, LineLook, SpectrumPlay
from rockcheck.engines.mujoco_engine import MuJoCo


class Abacus(MuJoCo):
    """Abacus."""

    name: ClassVar[str] = "abacus"
    beads: int = 10


FACTS = EngineFacts(
    engine=Abacus,
    label="ABACUS",
    summary="the made-up engine Abacus",
    look=LineLook("#123456", "#abcdef", (9.0, 1.0), "X"),
    spectrum=SpectrumPlay({"time_step": 2e-3}, share=0.5),
    benchmark=BenchmarkSteps((2e-2, 2e-3), (2e-3, 2e-4)),
    in_stress_maps=True,
    in_short_studies=True,
)
'''
#: What a process finds in which the file lies beside the other engines.
SCRIPT = """
import json
from rockcheck import load_scene
from rockcheck.reports import style
from rockcheck.validation.execute import models
from rockcheck.validation.studies.conformance.cards import Conformance
from rockcheck.validation.studies.conformance.players import named
from rockcheck.validation.studies.spectrum import agreement, tiles
from rockcheck.validation.studies.stress import maps, players
from rockcheck.validation.studies.work_precision import lines

scene = load_scene("fig5a").replace(duration=0.1)
work = models.Work(label="abacus", family="abacus", settings={"time_step": 1e-3, "beads": 3})
trials = Conformance((named("abacus", "best", {"time_step": 0.004}),)).tasks({})
(walk,) = [trial for trial in trials if trial.id == "RC-16"]
look = style.looks(["abacus"])["abacus"]
print(json.dumps({
    "models": list(models.FAMILIES),
    "summary": models.FAMILIES["abacus"].summary,
    "libraries": models.FAMILIES["abacus"].libraries,
    "label": style.label_of("abacus"),
    "look": [look.light, look.dark, look.dash, look.marker],
    "settings": models.play(work, scene).record["settings"],
    "trials": len(trials),
    "rest": walk.play().value,
    "candidates": agreement.CANDIDATES,
    "share": agreement.PLAYED_SHARE["abacus"],
    "spectrum": dict(tiles.Request(model="abacus").settings),
    "lines": {label: line.values for label, line in lines.LINES.items() if "abacus" in label},
    "converge": lines.LINES["abacus"].converge,
    "setups": [label for label in maps.SETUPS if "abacus" in label],
    "player": players.PLAYERS["abacus"].words,
}))
"""


@pytest.fixture(scope="module")
def known(tmp_path_factory):
    """What is known of the engine whose file was put into a copy of the folder `engines`."""
    root = tmp_path_factory.mktemp("with-abacus")
    package = root / "rockcheck"
    package.mkdir()
    for part in Path(rockcheck.__file__).parent.iterdir():
        if part.name == "engines":
            shutil.copytree(part.resolve(), package / part.name)
        else:
            (package / part.name).symlink_to(part.resolve())
    (package / "engines" / "abacus_engine.py").write_text(ABACUS)
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT],
        cwd=root,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def test_a_new_engine_is_listed_after_the_others(known):
    assert known["models"][-3:] == [registry.ORDER[-1], "abacus", "measured"]
    assert known["summary"] == "the made-up engine Abacus"


def test_results_of_a_new_engine_depend_on_its_library(known):
    assert known["libraries"][0] == "mujoco"


def test_a_new_engine_has_its_label_and_look(known):
    assert known["label"] == "ABACUS"
    assert known["look"] == ["#123456", "#abcdef", [9.0, 1.0], "X"]


def test_a_new_engine_is_played_with_its_settings(known):
    assert known["settings"]["beads"] == 3


def test_a_new_engine_is_checked_for_conformance(known):
    assert known["trials"] == 29
    assert known["rest"] < 0.1


def test_a_new_engine_plays_spectra(known):
    assert "abacus" in known["candidates"]
    assert known["share"] == 0.5
    assert known["spectrum"] == {"time_step": 2e-3}


def test_a_new_engine_is_measured(known):
    assert known["lines"]["abacus"] == [2e-2, 2e-3]
    assert set(known["lines"]) == {
        "abacus",
        "abacus adaptive",
        "abacus tolerance",
        "abacus default",
    }
    assert known["converge"] == [2e-3, 2e-4]


def test_a_new_engine_is_stressed(known):
    assert known["setups"] == ["abacus default", "abacus", "abacus adaptive"]
    assert known["player"].startswith("ABACUS, best settings")


def test_the_order_names_engines_that_there_are():
    assert set(registry.ORDER) - set(registry.names()) == set()


@pytest.mark.parametrize("name", registry.names())
def test_a_record_is_that_of_its_file(name):
    facts = registry.facts_of(name)
    assert facts.name == name
    assert facts.engine.__module__ == f"rockcheck.engines.{name}_engine"


def test_every_public_engine_has_a_record():
    public = importlib.import_module("rockcheck.engines").__all__
    assert {facts.engine.__name__ for facts in registry.every()} == set(public)


def loaded_after(code: str) -> set[str]:
    """The modules that a new process has loaded after these statements."""
    done = subprocess.run(
        [sys.executable, "-c", f"import sys\n{code}\nprint(*sys.modules)"],
        capture_output=True,
        text=True,
        timeout=100,
        check=True,
    )
    return set(done.stdout.split())


@pytest.mark.parametrize("name", ["", "engine", "../scenes/files", "mujoco_engine"])
def test_no_other_module_is_imported_for_a_name(name):
    with pytest.raises(KeyError):
        registry.facts_of(name)


def test_records_are_read_without_the_engines_libraries():
    loaded = loaded_after("from rockcheck.engines import registry; registry.every()")
    libraries = {facts.engine.module or facts.name for facts in registry.every()}
    assert loaded & {"numba", "pandas", "matplotlib", *libraries} == set()


def test_models_are_listed_without_reading_records():
    loaded = loaded_after("from rockcheck.validation.execute import models; list(models.FAMILIES)")
    assert "rockcheck.engines.registry" in loaded
    assert "rockcheck.engines.engine" not in loaded


def test_the_limits_of_a_contact_parameter_are_in_order():
    for facts in registry.every():
        if parameters := getattr(facts.engine, "contact_parameters", None):
            low, high = parameters.range
            assert 0.0 <= low < high
