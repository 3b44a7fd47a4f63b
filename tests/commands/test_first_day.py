"""What a user types on the first day with a block, a wall and a test of one's own: what goes wrong
is named, and mended by what is said."""

import json
import re
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from rockcheck.scenes import History, history
from rockcheck.validation.discrepancy.figures import Figure
from rockcheck.validation.discrepancy.measures import DIFFERENCES
from rockcheck.validation.suite.acceptance import _accepted
from rockcheck.validation.suite.tables import percent, used
from rockcheck.validation.suite.tolerances import Tolerance, judge

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
SCENE = """
duration = 2.0
[floor]
friction = 0.5
[block]
half_width = 0.4
half_height = 1.5
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


def write(name: str, text: str) -> str:
    Path(name).write_text(text, encoding="utf-8")
    return name


def suite(other: str = "faulty:Still") -> str:
    return write("mine.toml", SUITE.format(other=other))


def simulated(typed, model: str, output: str, *words: str, **said: tuple[str, ...]) -> str:
    own = "--model", f"faulty:{model}", *CODE, "-o", output
    return typed("simulate", write("rack.toml", SCENE), *own, *words, **said)[0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("[floor]", '[walls]\nside = "left"\ngap = 0.1\n[floor]'), "[[walls]], not [walls]"),
        (("half_width", "halfwidth"), "block.halfwidth: unknown key; did you mean 'half_width'"),
        (("[block]", "[blok]"), "blok: unknown key; did you mean 'block'"),
        (
            ("[floor]", '[excitation]\nkind = "record"\nfile = "a.csv"\nunit = "kg"\n[floor]'),
            "excitation.unit",
        ),
    ],
)
def test_a_slip_in_a_scene_file_is_named(refused, change, said):
    write("a.csv", "time_s,acceleration_g\n0,0\n0.01,0.1\n0.02,0\n")
    line = refused("simulate", write("rack.toml", SCENE.replace(*change)), "--model", "ebm")
    assert re.match(f"rockcheck: rack.toml: .*{re.escape(said)}", line)


def test_a_scene_is_no_suite(refused):
    write("rack.toml", SCENE)
    assert refused("accept", "rack.toml") == (
        "rockcheck: rack.toml: is a scene, not a suite; `rockcheck validate` plays a scene,"
        " and a suite is a file with scenes = ['rack.toml'], and tables [models.NAME]"
    )
    for option in (["--strict"], ["--history", "runs.jsonl"]):
        assert refused("validate", "rack.toml", *option) == (
            f"rockcheck: {option[0]}: rack.toml is a scene, and nothing of it is judged: give a"
            " suite"
        )


@pytest.mark.parametrize(
    "words",
    [
        ("simulate", "fig5a", "--model", "ebm", "--model", "cm"),
        ("compare", "a.csv", "b.csv", "--until", "1", "--until=2"),
    ],
)
def test_an_option_given_twice_is_refused(refused, words):
    assert refused(*words) == (
        f"rockcheck: {words[3] if words[0] == 'compare' else words[2]}:"
        " is given twice: give one value"
    )


def test_without_a_model_the_reference_plays(typed):
    said = "fig5a, ebm-unilateral: at rest, peak rotation 0.1485 alpha"
    typed("simulate", "fig5a", holds=[said, "note: the horizontal record ends at 31.18 s"])
    assert Path("fig5a--ebm-unilateral.csv").exists()


@pytest.mark.parametrize(
    ("file", "said"),
    [
        (
            "x.xlsx",
            "x.xlsx: a history is written as .csv, .csv.gz, .json, .mat or .parquet, not as .xlsx;"
            " its figure as .svg, .png, .pdf",
        ),
        ("x.parquet", "x.parquet: Parquet needs the package pyarrow: pip install pyarrow"),
        ("no/a.png", "--output: no: no such folder"),
    ],
)
def test_what_cannot_be_written_is_refused_before_the_run(refused, monkeypatch, file, said):
    monkeypatch.setattr(history, "find_spec", lambda name: None)
    assert refused("simulate", "fig5a", "-o", file) == f"rockcheck: {said}"
    assert [*Path().glob("*.csv"), *Path().glob("x.*")] == []


@pytest.mark.needs("pyarrow")
def test_a_history_as_parquet_is_that_of_the_csv(typed):
    for name in ("a.csv", "a.parquet"):
        simulated(typed, "Falls", name)
    table, plain = History.load("a.csv"), pd.read_parquet("a.parquet")
    assert list(plain.columns) == list(table.frame.columns)
    for name in plain.columns:
        np.testing.assert_array_equal(plain[name], table.channels[name])
    assert plain.attrs["rockcheck_history"]["outcome"] == table.outcome
    assert list(pd.read_parquet("a.events.parquet")["kind"]) == [
        event.kind for event in table.event_list
    ]


def test_a_history_as_json_and_mat_is_that_of_the_csv(typed):
    from scipy.io import loadmat

    for name in ("a.csv", "a.json", "a.mat"):
        simulated(typed, "Falls", name)
    table = History.load("a.csv")
    plain = json.loads(Path("a.json").read_text())
    matrix = loadmat("a.mat", simplify_cells=True)
    assert plain["outcome"] == matrix["about"]["outcome"] == table.outcome
    for name in ("t", "theta", "x_dot"):
        np.testing.assert_array_equal(plain["channels"][name], table.channels[name])
        np.testing.assert_array_equal(matrix["channels"][name], table.channels[name])
    assert (
        plain["channels"]["mode"]
        == list(matrix["channels"]["mode"])
        == list(table.channels["mode"])
    )
    assert plain["events"]["kind"] == [event.kind for event in table.event_list]


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
    out, _ = typed("compare", "a.csv", "b.csv", holds=["note on the candidate: made to fall"])
    assert re.match(r"outcomes differ, overturned left at 1\.5.* against at rest; rotations", out)
    assert re.search("^outcome agrees +no", out, re.MULTILINE)
    out, _ = typed("compare", "a.csv", "a.csv")
    assert out.startswith("same outcome, at rest; rotations 0 alpha apart (RMS)\n")
    assert max(map(len, out.splitlines())) <= 80


def test_simulate_and_compare_draw(typed):
    drawn = "-o", "a.png", "-o", "a.pdf"
    simulated(typed, "Falls", "a.csv", *drawn, holds=("figure: a.png", "figure: a.pdf"))
    assert History.load("a.csv").outcome == "overturned left"
    simulated(typed, "Still", "b.csv")
    out, _ = typed("compare", "a.csv", "b.csv", "--plot", "c.svg")
    assert out.startswith("outcomes differ, ")
    for name, start in (("a.png", b"\x89PNG"), ("a.pdf", b"%PDF"), ("c.svg", b"<?xml")):
        assert Path(name).read_bytes().startswith(start)
        assert Path(name).stat().st_size > 5000


def test_a_figure_alone_writes_no_history(told):
    write("rack.toml", SCENE)
    found = told("simulate", "rack.toml", "--model", "faulty:Still", *CODE, "-o", "a.svg")
    assert (found["files"], found["history"]) == (["a.svg"], None)
    assert [path.name for path in Path().glob("*.csv")] == []


def test_a_figure_without_tolerance_has_not_failed(typed):
    suite()
    words = ("mine.toml", *CODE, "--jobs", "1")
    validate = "validate", *words, "--no-report"
    typed(*validate, code=1, holds=["verdict: no tolerance yet"], lacks=["fail"])
    before = sorted(path.name for path in Path().iterdir())
    said = "2 changes would be written to mine.tolerances.toml"
    typed("accept", *words, "--dry-run", holds=[said])
    assert before == sorted(path.name for path in Path().iterdir())
    typed("accept", *words)
    text = Path("mine.tolerances.toml").read_text()
    assert "outcome_agrees = {expected = 1.0, limit = 0.0, drift = 0.0," in text
    # what agrees is near to no limit, and not listed
    typed(*validate, "--strict", holds=["verdict: pass"], lacks=["outcome_agrees"])


def test_a_no_is_no_share_of_a_limit(typed):
    suite("faulty:Falls")
    words = ("mine.toml", *CODE, "--jobs", "1")
    out, _ = typed("accept", *words, code=1)
    assert out.count("not accepted: [short.other.still]") == 2
    assert not Path("mine.tolerances.toml").exists()
    write("mine.toml", SUITE.format(other="faulty:Falls") + LINE)
    typed("validate", *words, "--no-report", code=1, lacks=["%"])


def test_a_no_that_is_accepted_may_be_either():
    measure = DIFFERENCES["outcome_agrees"]
    figure = Figure(
        measure="outcome_agrees", label=measure.label, unit="1", value=0.0, against="ebm"
    )
    line = _accepted(judge(figure, None, kind="model form", measure=measure), None)
    assert line == {"expected": 0.0, "limit": 1.0, "drift": 0.0, "why": "first accepted figure"}
    check = judge(figure, Tolerance(**line), kind="model form", measure=measure)
    assert (check.verdict, used(check), percent(check)) == ("pass", 0.0, "no")
    turned = judge(
        figure.model_copy(update={"value": 1.0}),
        Tolerance(**line),
        kind="model form",
        measure=measure,
    )
    assert turned.verdict == "changed"


def test_accept_writes_nothing_that_validate_refuses(typed):
    t = np.linspace(0.5, 2.0, 151)
    write("table.csv", "t,theta\n" + "\n".join(f"{x:.3f},0.0" for x in t) + "\n")
    text = SUITE.format(other="measured").replace(
        "[require]", 'files = { short = "table.csv" }\n[require]'
    )
    words = (write("mine.toml", text), *CODE, "--jobs", "1")
    said = "theta_rms: other starts only at 0.5 s; `offset` of the measured model"
    typed("accept", *words, code=1, holds=[f"not accepted: [short.other.still] {said}"])
    assert not Path("mine.tolerances.toml").exists()
    aligned = text.replace("[require]", "offset = -0.5\n[require]")
    write("mine.toml", aligned.replace('"theta_rms", "outcome_agrees"', '"theta_rms@1s"'))
    typed("accept", *words)
    typed("validate", *words, "--no-report", "--strict")


@pytest.mark.parametrize("command", ["simulate", "validate"])
def test_a_model_of_ones_own_that_returns_no_history_is_told_so(typed, command):
    suite("faulty:Nothing")
    words = (
        ("mine.toml", "--no-report", "--jobs", "1")
        if command == "validate"
        else (write("rack.toml", SCENE), "--model", "faulty:Nothing")
    )
    typed(command, *words, *CODE, code=3, holds=["faulty:Nothing returned NoneType"])
