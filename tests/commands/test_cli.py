"""The command line: exit codes, and errors of the user as one line without a traceback."""

import re
from pathlib import Path

import pytest

from rockcheck.commands.cli import main

STILL = "faulty:Still", "--allow-code", "faulty:Still"
pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
SCENE = (
    "duration = 0.2\nblock = { half_width = 0.4, half_height = 1.5 }\nfloor = { friction = 0.5 }\n"
)


def test_histories_of_two_blocks_are_not_compared_unless_a_scene_says_how(refused):
    for name, width in (("one", "0.4"), ("same", "0.4000000001"), ("other", "0.40001")):
        Path(f"{name}.toml").write_text(SCENE.replace("0.4", width))
        assert main(["simulate", f"{name}.toml", "--model", *STILL, "-o", f"{name}.csv", "-q"]) == 0
    rows = "".join(f"{0.005 * k},0\n" for k in range(41))
    Path("plain.csv").write_text("t,theta\n" + rows)  # of a block that nothing is known of
    for words in (["same.csv"], ["other.csv", "--scene", "one.toml"], ["plain.csv"]):
        assert main(["compare", "one.csv", *words, "-q"]) == 0
    said = "|".join(
        refused("compare", "one.csv", *words.split())
        for words in ("other.csv", "same.csv --scene other.toml")
    )
    assert re.match(
        r"rockcheck: scene: .*half_width = 0.4,.*half_width = 0.40001,.*\|rockcheck: scene: its",
        said,
    )


SUITE = f"""
reference = "still"
[models.still]
model = "faulty:Still"
[models.near]
model = "faulty:Still"
offset = 1e-3
[[scene]]
name = "short"
{SCENE}"""
LINE = """[tolerances.short.near.still]
theta_peak = {{ expected = 0.0038, limit = {}, drift = 0.0001, why = "a test" }}
"""
OWN = ["mine.toml", *STILL[1:], "--jobs", "1"]


def test_a_run_without_a_verdict_replaces_one_with_a_verdict_and_says_so(typed):
    Path("mine.toml").write_text(SUITE)
    Path("scene.toml").write_text(SCENE)
    alone = ["validate", "scene.toml", "--models", *STILL, "--jobs", "1", "-q"]
    # The second over what nobody judged; then the suite, without a tolerance.
    assert [main(words) for words in (alone, alone, ["validate", *OWN, "-q"])] == [0, 0, 1]
    words = typed(*alone[:-1])[0]
    assert "note: this replaces the report of mine in rockcheck-report; --out keeps both" in words
    assert main([*alone, "--out", "other"]) == 0


def test_validate_keeps_the_run_before_it_tells(typed):
    validate, accept = ["validate", *OWN, "--no-report"], ["accept", *OWN]
    for limit, code, verdict in (("0.01", 0, "pass"), ("0.001", 1, "fail")):
        Path("mine.toml").write_text(SUITE + LINE.format(limit))
        typed(*validate, code=code, holds=[f"verdict: {verdict}"], columns=80)
    folder = Path("rockcheck-report")
    said = {
        "junit.xml": 'failures="1"',
        "checks.csv": "\nshort,near,still,theta_peak,,",
        "figures.csv": "\nshort,near,",
        "summary.md": "theta_peak against still: 0.003837 is more than 0.001",
        "run.json": '"near"',
    }
    assert [name for name in said if said[name] not in (folder / name).read_text()] == []
    Path("mine.toml").write_text(SUITE.replace("1e-3", "1.2e-3") + LINE.format("0.01"))
    typed(*validate)
    typed(*validate, "--strict", "worse", code=1, holds=["verdict: changed"])
    typed(*accept, code=1)
    typed(*accept, "--reason", "it leans more")
    typed(*validate, "--strict", "worse")
