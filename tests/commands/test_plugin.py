"""The pytest plugin, in a pytest of its own."""

from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

SUITE = """
reference = "still"
[models.still]
model = "faulty:Still"
[models.near]
model = "faulty:Still"
offset = 1e-3
[models.broken]
model = "faulty:Fails"
[[scene]]
name = "my-scene"
duration = 0.5
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
[[scene]]
name = "odd"
duration = 0.5
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
# a measured history, which plays one scene
[models.table]
model = "measured"
files = { odd = "table.csv" }
# what comes nearer to a reference is not better where that is itself not as expected
[tolerances.odd.still.figures]
last_rotation = { expected = 0.4, limit = 0.01, drift = 0.001, why = "a test" }
[tolerances.odd.near.figures]
last_rotation = { expected = 0.5, limit = 0.01, drift = 0.001, why = "a test" }
[tolerances.my-scene.near.still]
theta_peak = { expected = 0.0038, limit = 0.01, drift = 0.001, why = "a test" }
theta_rms = { expected = 0.001, limit = 0.01, drift = 0.001, why = "a test" }
[tolerances.my-scene.broken.still]
theta_peak = { expected = 0.0, limit = 0.01, drift = 0.001, why = "a test" }
"""
TESTS = """
def test_near(rockcheck_check):
    assert rockcheck_check("my-scene", model="near").figures
def test_strict(rockcheck_check):
    rockcheck_check("my-scene", model="near", strict=True)
def test_broken(rockcheck_check):
    rockcheck_check("my-scene", model="broken")
def test_reference(rockcheck_check):
    rockcheck_check("my-scene", model="still")
def test_unknown(rockcheck_check):
    rockcheck_check("my-scene", model="table")
def test_odd(rockcheck_check):
    rockcheck_check("odd", model="near")
"""


@pytest.fixture
def pytester(pytester):
    models = Path(__file__).parents[1] / "validation" / "models"
    pytester.makepyfile(faulty=(models / "faulty.py").read_text("utf-8"))
    pytester.makefile(".toml", rockcheck=SUITE)
    pytester.makefile(".csv", table="t,theta\n0,0\n0.5,0\n")
    return pytester


def test_check_holds_a_cell_against_its_suite(pytester):
    pytester.makepyfile(TESTS)
    result = pytester.runpytest_subprocess("-p", "no:randomly", "-rf")
    result.assert_outcomes(failed=6)
    result.stdout.fnmatch_lines(
        ["*models.still: 'faulty:Still' is code of your own; it runs only if*"]
    )
    pytester.makeini("[pytest]\nrockcheck_allow_code = faulty:Still\n")
    result = pytester.runpytest_subprocess(
        *("-p", "no:randomly", "-p", "no:cacheprovider", "-rf"),
        *("--rockcheck-allow-code", "faulty:Fails"),
    )
    result.assert_outcomes(passed=1, failed=5)
    result.stdout.fnmatch_lines(
        [
            "*my-scene, near: theta_rms against still: 0.003* was 0.001 (drift allowed 0.001)*",
            "*my-scene, broken: more than 10 events*",
            "*nothing is judged*",
            "*unknown model of the suite 'table'*",
            "*odd, near: last_rotation: 0.003* is more than 0.01 from 0.5*",
        ]
    )
