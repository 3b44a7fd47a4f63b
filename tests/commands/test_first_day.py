"""What a user types on the first day with a block, a wall and a test of one's own: what goes wrong
is named, and mended by what is said."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.io import loadmat, savemat

from rockcheck.scenes import History

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
SCENE = """
duration = 2.0
[floor]
friction = 0.5
[block]
half_width = 0.4
half_height = 1.5
centre_of_mass = [0.05, -0.25]
"""
SUITE = """
reference = "still"
[models.still]
model = "faulty:Still"
[models.other]
model = "{other}"
[require]
difference = ["theta_rms", "outcome_agrees"]
[[scene]]
name = "short"
duration = 2.0
block = {{ half_width = 0.4, half_height = 1.5 }}
floor = {{ friction = 0.5 }}
"""
LINE = """
[tolerances.short.other.still]
outcome_agrees = { expected = 1.0, limit = 0.0, drift = 0.0, why = "a test" }
theta_rms = { expected = 0.0, limit = 0.1, drift = 0.1, why = "a test" }
"""
CODE = [
    word
    for name in ("Still", "Falls", "Bug", "Nothing")
    for word in ("--allow-code", f"faulty:{name}")
]


def suite(other: str = "faulty:Still", lines: str = "") -> str:
    Path("mine.toml").write_text(SUITE.format(other=other) + lines, "utf-8")
    return "mine.toml"


def simulated(typed, model: str, output: str, *words: str, **said: tuple[str, ...]) -> str:
    Path("rack.toml").write_text(SCENE, "utf-8")
    own = "--model", f"faulty:{model}", *CODE, "-o", output
    return typed("simulate", "rack.toml", *own, *words, **said)[0]


def test_without_a_model_the_reference_plays(typed):
    said = "fig5a, ebm-unilateral: at rest, peak rotation 0.1485 alpha"
    typed("simulate", "fig5a", holds=[said, "note: the horizontal record ends at 31.18 s"])
    assert Path("fig5a--ebm-unilateral.csv").exists()


def test_pandas_takes_a_history_to_other_formats(typed):
    """As docs/tutorial.md says: a file of JSON that `json` reads, and one of MATLAB."""
    simulated(typed, "Falls", "a.csv")
    table = pd.read_csv("a.csv", comment="#")
    table.to_json("a.json", double_precision=15)
    savemat("a.mat", dict(table.items()))
    theta = History.load("a.csv").channels["theta"]
    np.testing.assert_allclose(pd.read_json("a.json")["theta"], theta, atol=1e-14)
    np.testing.assert_array_equal(loadmat("a.mat")["theta"].ravel(), theta)


def test_of_a_fallen_block_the_time_is_told_not_the_peak(typed):
    said = ("overturned left at 1.5", "note: made to fall")
    simulated(typed, "Falls", "a.csv", holds=said, lacks=("peak rotation",))
    told = json.loads(simulated(typed, "Falls", "a.csv", "--json"))
    assert told["peak_rotation_alpha"] is None
    assert (
        told["overturned_at_s"] == History.load("a.csv").overturned_at == pytest.approx(np.pi / 2)
    )


def test_compare_says_first_what_matters(typed):
    simulated(typed, "Still", "a.csv")
    simulated(typed, "Falls", "b.csv")
    said = "note on the candidate: made to fall"
    out, _ = typed("compare", "a.csv", "b.csv", "--plot", "c.svg", holds=[said])
    differ = r"outcomes differ, overturned left at 1\.5.* against at rest; rotations"
    assert re.match(rf"{differ}(?s:.*)\noutcome agrees +no", out)
    assert Path("c.svg").read_bytes().startswith(b"<?xml")
    for said, words, columns in (
        (r"same outcome, at rest; rotations 0 alpha apart \(RMS\)\n", ("a.csv", "a.csv"), 80),
        (
            r"same outcome, .* 2\.07 s against .* 1\.57 s; ",
            ("b.csv", "b.csv", "--align", "0.5"),
            120,
        ),
    ):
        assert re.match(said, typed("compare", *words, columns=columns)[0])


@pytest.mark.parametrize(("first", "history"), [("a.csv", "a.csv"), ("a.svg", None)])
def test_simulate_draws_and_a_figure_alone_writes_no_history(typed, first, history):
    drawn = "-o", "a.png", "-o", "a.pdf"
    simulated(typed, "Falls", first, *drawn, holds=("figure: a.png", "figure: a.pdf"))
    found = json.loads(simulated(typed, "Falls", first, *drawn, "--json"))
    assert found["files"] == [first, "a.png", "a.pdf"]
    assert found["history"] == history
    for name, start in (("a.png", rb"\x89PNG"), ("a.pdf", b"%PDF")):
        assert re.match(start + b"(?s:.{5000})", Path(name).read_bytes())
    assert [path.name for path in Path().glob("a*.csv")] == ["a.csv", "a.events.csv"] * bool(
        history
    )


def test_a_figure_without_tolerance_has_not_failed(typed):
    words = (suite(), *CODE, "--jobs", "1")
    validate = "validate", *words, "--no-report"
    typed(*validate, code=1, holds=["verdict: no tolerance yet"], lacks=["fail"])
    before = set(Path().iterdir())
    typed(
        "accept", *words, "--dry-run", holds=["2 changes would be written to mine.tolerances.toml"]
    )
    assert set(Path().iterdir()) == before
    typed("accept", *words)
    text = Path("mine.tolerances.toml").read_text()
    assert "outcome_agrees = {expected = 1.0, limit = 0.0, drift = 0.0," in text
    # what agrees is near to no limit, and not listed
    typed(*validate, "--strict", "worse", holds=["verdict: pass"], lacks=["outcome_agrees"])


def test_a_no_is_no_share_of_a_limit(typed):
    words = (suite("faulty:Falls"), *CODE, "--jobs", "1")
    out, _ = typed("accept", *words, code=1)
    assert out.count("not accepted: [short.other.still]") == 2
    assert not Path("mine.tolerances.toml").exists()
    suite("faulty:Falls", LINE)
    typed("validate", *words, "--no-report", code=1, lacks=["%"])


#: Of the two models only the one whose block may hop stands.
FALLS = """
reference = "ebm-unilateral"
[models.ebm-unilateral]
[models.ebm]
[require]
difference = ["outcome_agrees"]
[[scene]]
name = "hit"
duration = 5.0
block = { half_width = 0.397, half_height = 1.555 }
floor = { friction = 0.6 }
walls = [{ side = "left", gap = 0.053, restitution = 1.0 }]
excitation = { kind = "ricker", amplitude = 9.0, period = 0.5 }
"""


def test_a_no_that_is_accepted_may_be_either(typed):
    Path("mine.toml").write_text(FALLS)
    typed("accept", "mine.toml", "--jobs", "1")
    text = Path("mine.tolerances.toml").read_text()
    assert "outcome_agrees = {expected = 0.0, limit = 1.0, drift = 0.0," in text
    validate = "validate", "mine.toml", "--jobs", "1", "--no-report"
    typed(*validate, holds=["verdict: pass"], lacks=["%"])
    Path("mine.toml").write_text(re.sub("walls = .*", "", FALLS))
    said = "outcome_agrees against ebm-unilateral: 1 was 0, nearer to 1"
    typed(*validate, holds=["better than expected", said])


def test_a_model_of_ones_own_that_returns_no_history_is_told_so(typed):
    said = ("faulty:Nothing returned NoneType",)
    simulated(typed, "Nothing", "a.csv", code=3, holds=said)
    validate = "validate", suite("faulty:Nothing"), *CODE, "--no-report", "--jobs", "1"
    typed(*validate, code=3, holds=said)


def test_accept_writes_nothing_that_validate_refuses(typed):
    rows = "\n".join(f"{t:.3f},0.0" for t in np.linspace(0.5, 2.0, 151))
    Path("table.csv").write_text(f"t,theta\n{rows}\n", "utf-8")
    text = SUITE.format(other="measured").replace(
        "[require]", 'files = { short = "table.csv" }\n[require]'
    )
    Path("mine.toml").write_text(text, "utf-8")
    words = ("mine.toml", *CODE, "--jobs", "1")
    said = "theta_rms: other starts only at 0.5 s; `offset` of the measured model"
    typed("accept", *words, code=1, holds=[f"not accepted: [short.other.still] {said}"])
    assert not Path("mine.tolerances.toml").exists()
    aligned = text.replace("[require]", "offset = -0.5\n[require]").replace(
        '"theta_rms", "outcome_agrees"', '"theta_rms@1s"'
    )
    Path("mine.toml").write_text(aligned, "utf-8")
    typed("accept", *words)
    typed("validate", *words, "--no-report", "--strict", "worse")
