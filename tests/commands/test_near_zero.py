"""A model that comes nearer to its reference, where next to nothing rotates: from `accept` over
`validate --strict` to `accept`."""

from pathlib import Path

import pytest

from rockcheck.commands.cli import main

SUITE = """
reference = "still"
[models.still]
model = "faulty:Still"
[models.leans]
model = "faulty:Still"
offset = OFFSET
[require]
difference = ["theta_rms", "peak_ratio", "sprague_geers_c"]
figures = ["peak_rotation", "last_rotation"]
[[scene]]
name = "short"
duration = 0.2
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
"""
WORDS = ("mine.toml", "--allow-code", "faulty:Still", "--jobs", "1")


def lean(offset: str) -> None:
    Path("mine.toml").write_text(SUITE.replace("OFFSET", offset), encoding="utf-8")


@pytest.mark.usefixtures("in_an_empty_folder")
def test_a_better_step_passes_and_is_accepted_without_a_reason(typed):
    """The peak falls from 3.1e-4 to 7.7e-5 alpha, nearer to that of a reference that stands: to
    which no ratio is defined."""
    lean("8e-5")
    assert main(["accept", *WORDS]) == 0
    first = Path("mine.tolerances.toml").read_text()
    assert "peak_ratio" not in first
    assert main(["validate", *WORDS, "--no-report", "--strict"]) == 0
    lean("2e-5")
    out = typed("validate", *WORDS, "--no-report", "--strict")[0]
    assert "verdict: pass" in out
    for better in ("theta_rms against still", "peak_rotation", "last_rotation"):
        assert f"short, leans: {better}: 7.67" in out
    assert main(["validate", *WORDS, "--no-report", "--strict", "both"]) == 1
    assert main(["validate", "--strict", *WORDS, "--no-report"]) == 0, (
        "the suite is no value of --strict"
    )
    out = typed("accept", *WORDS)[0]
    assert out.count(": tightened: ") == 3
    assert main(["validate", *WORDS, "--no-report", "--strict", "both"]) == 0
    lean("8e-5")
    assert main(["validate", *WORDS, "--no-report"]) == 1, "back where it was is worse"
    assert "--reason" in typed("accept", *WORDS, code=1)[0]
