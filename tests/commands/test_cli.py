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


def write(name, text):
    Path(name).write_text(text, encoding="utf-8")
    return name


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["validat"], "Did you mean 'validate'"),
        (["validate", "papre"], "did you mean 'paper'"),
        (["validate", "--jobs", "0"], "--jobs"),
        (["validate", "--job", "2"], "--jobs"),
        (["validate", "paper", "--quick"], "--quick"),
        (["validate", "paper", "--out", "scene.toml"], "scene.toml: cannot be used as a folder"),
        (["simulate", "fig4", "--model", "ebm"], "did you mean 'fig4b'"),
        (["simulate", "fig4a", "--model", "mujcoo"], "did you mean 'mujoco'"),
        (["simulate", "scene.toml", "--model", "ebm", "--set", "tolerance"], "key=value"),
        (["simulate", "scene.toml", "--model", "ebm", "--set", "tolerance=tight"], "ebm.tolerance"),
        (["simulate", "scene.toml", "--model", "ebm", "-o", "no/such/out.csv"], "no such folder"),
        (
            ["simulate", "negative.toml", "--model", "ebm"],
            "negative.toml: block.half_width: -0.4 is not allowed",
        ),
        (["simulate", "unknown.toml", "--model", "ebm"], "unknown.toml: colour: unknown key"),
        (["simulate", "slippery.toml", "--model", "ebm"], "must be below 4/3"),
        (["simulate", "gone.toml", "--model", "ebm"], "gone.toml: cannot be read"),
        (["simulate", "record.toml", "--model", "ebm"], "NPTS says 3, the file has 2 samples"),
        (
            ["simulate", "fig4a", "--model", "mujoco", "--set", "time_stp=1e-3"],
            "mujoco.time_stp: unknown key; did you mean 'time_step'?",
        ),
        (["compare", "gone.csv", "gone.csv"], "gone.csv: cannot be read"),
        (["compare", "scene.toml", "scene.toml"], "scene.toml"),
        (["compare", "a.csv", "b.csv", "--offset=1"], "--offset: is gone: --align SECONDS"),
        (["conformance", "--settings", "best"], "--settings: is gone: --set settings=best"),
        (["compare", "a", "b", "--all"], "--all: is gone: --json"),
        (["simulate", "fig5a", "--plot=a.png"], "--plot: is gone: -o FILE.png"),
        (["spectrum", "fig8", "--force"], "--force: is gone: "),
        (["report", "out", "--against=ebm"], "--against: is gone: "),
        (["benchmark", "--minutes", "5"], "--minutes: is gone: "),
        (["report", "."], "no finished run here"),
        ([], "Missing command"),
    ],
)
def test_bad_input_is_one_line_and_exit_2(words, said, refused):
    write("scene.toml", SCENE)
    write("negative.toml", SCENE.replace("0.4", "-0.4"))
    write("unknown.toml", "colour = 1\n" + SCENE)
    write("slippery.toml", SCENE.replace("0.5", "1.4"))
    write("record.toml", SCENE + '[excitation]\nkind = "record"\nfile = "short.AT2"\n')
    write(
        "short.AT2",
        "PEER\nNAME\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 3, DT= .01 SEC\n 0.1 0.2\n",
    )
    assert said in refused(*words)


def test_histories_of_two_blocks_are_not_compared_unless_a_scene_says_how(refused):
    for name, width in (("one", "0.4"), ("same", "0.4000000001"), ("other", "0.5")):
        write(f"{name}.toml", SCENE.replace("0.4", width))
        assert main(["simulate", f"{name}.toml", "--model", *STILL, "-o", f"{name}.csv", "-q"]) == 0
    assert main(["compare", "one.csv", "same.csv", "-q"]) == 0
    said = refused("compare", "one.csv", "other.csv")
    assert re.match("rockcheck: scene: .*half_width = 0.4,.*half_width = 0.5,", said)
    assert main(["compare", "one.csv", "other.csv", "--scene", "one.toml", "-q"]) == 0
    write(
        "plain.csv", "t,theta\n" + "".join(f"{0.005 * k},0\n" for k in range(41))
    )  # of a block that nothing is known of
    assert main(["compare", "one.csv", "plain.csv", "-q"]) == 0


def test_a_run_without_a_verdict_overwrites_none_with_one(refused):
    suite = (
        'reference = "still"\n[models.still]\nmodel = "faulty:Still"\n[[scene]]\nname = "short"\n'
    )
    write("suite.toml", suite + SCENE)
    write("scene.toml", SCENE)
    alone = ["validate", "scene.toml", "--models", STILL[0], *STILL[1:], "--jobs", "1", "-q"]
    assert main(alone) == 0
    assert main(alone) == 0  # over what nobody judged
    assert main(["validate", "suite.toml", *STILL[1:], "--jobs", "1", "-q"]) == 1  # no tolerance
    before = {path: path.read_bytes() for path in Path("rockcheck-report").glob("*.*")}
    assert Path("rockcheck-report/index.html") in before
    assert refused(*alone).startswith(
        "rockcheck: --out: rockcheck-report holds the judged run of suite 'suite'"
    )
    assert {path: path.read_bytes() for path in Path("rockcheck-report").glob("*.*")} == before
    assert main([*alone, "--out", "other"]) == 0


def test_validate_keeps_the_run_before_it_tells(typed):
    suite = """
reference = "still"
[models.still]
model = "faulty:Still"
[models.near]
model = "faulty:Still"
offset = 1e-3
[[scene]]
name = "short"
duration = 0.2
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
"""
    line = (
        "[tolerances.short.near.still]\n"
        "theta_peak = { expected = 0.0038, limit = %s, drift = 0.0001, why = 'a test' }\n"
    )
    own = ["mine.toml", "--allow-code", "faulty:Still", "--jobs", "1"]
    validate, accept = ["validate", *own, "--no-report"], ["accept", *own]
    for limit, code in {"0.01": 0, "0.001": 1}.items():
        write("mine.toml", suite + line % limit)
        out = typed(*validate, code=code)[0]
        assert max(map(len, out.splitlines())) <= 80
        assert f"verdict: {'pass' if code == 0 else 'fail'}" in out
    kept = {path.name for path in Path("rockcheck-report").iterdir()}
    assert kept >= {"run.json", "checks.csv", "figures.csv", "junit.xml", "summary.md"}
    assert 'failures="1"' in Path("rockcheck-report/junit.xml").read_text()
    summary = Path("rockcheck-report/summary.md").read_text()
    assert "theta_peak against still: 0.003837 is more than 0.001" in summary
    write("mine.toml", suite.replace("offset = 1e-3", "offset = 1.2e-3") + line % "0.01")
    assert main(validate) == 0
    assert "verdict: changed" in typed(*validate, "--strict", code=1)[0]
    assert main(accept) == 1
    assert main([*accept, "--reason", "it leans more"]) == 0
    assert main([*validate, "--strict"]) == 0
