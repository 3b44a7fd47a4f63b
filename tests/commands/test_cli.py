"""The command line: exit codes, and errors of the user as one line without a traceback."""

import re
from pathlib import Path

import pytest

from rockcheck.commands.cli import main
from rockcheck.validation.execute.models import FAMILIES, not_installed

STILL = "faulty:Still", "--allow-code", "faulty:Still"
pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
SCENE = (
    "duration = 0.2\nblock = { half_width = 0.4, half_height = 1.5 }\nfloor = { friction = 0.5 }\n"
)


AT2 = "PEER\nNAME\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= {}, DT= .01 SEC\n 0.1 0.2\n"
#: Files with a slip each, and what is right beside them.
FILES = {
    "scene.toml": SCENE,
    "negative.toml": SCENE.replace("0.4", "-0.4"),
    "unknown.toml": "colour = 1\n" + SCENE,
    "within.toml": SCENE.replace("half_width", "halfwidth"),
    "table.toml": SCENE.replace("block", "blok"),
    "slippery.toml": SCENE.replace("0.5", "1.4"),
    "walls.toml": SCENE + '[walls]\nside = "left"\ngap = 0.1\n',
    "record.toml": SCENE + '[excitation]\nkind = "record"\nfile = "short.AT2"\n',
    "unit.toml": SCENE + '[excitation]\nkind = "record"\nfile = "short.AT2"\nunit = "kg"\n',
    "wrong.toml": 'reference = "ebm"\nscenes = ["scene.toml"]\n[models.ebm]\n'
    '[[records]]\nfiles = ["one.AT2"]\nscenes = ["seen"]\n',
    **{
        f"pga-{n}.toml": SCENE + f'[excitation]\nkind = "record"\nfile = "one.AT2"\npga = {pga}\n'
        for n, pga in enumerate(("0.5\nscale = 2.0", "-1.0", "1e9", '"0.5 g"'))
    },
    "words.toml": SCENE
    + '[excitation]\nkind = "record"\nunscaled = ["1"]\ntime_step = 0.1\npga = 0.5\n',
    "engine.toml": 'engine = "mine"\ncolour = "red"\n',
    "run.json": '{"format": 99}',
    "short.AT2": AT2.format(3),
    "one.AT2": AT2.format(2),
    "one_V.AT2": AT2.format(2).replace("NAME", "Place, 1/1/2000, Station, UP"),
}


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
        (["compare", "a.csv", "b.csv", "--align=nan"], "--align: 'nan': give seconds"),
        (["compare", "a.csv", "b.csv", "--align"], "--align: needs a value: Shift the candidate"),
        (["validate", "smoke", "--strict"], "--strict: needs a value: worse: figures that left"),
        (["validate", "smoke", "--strict", "x"], "'x' is not one of 'worse', 'both'"),
        (["validate", "--strict", "smoke"], "'smoke' is not one of 'worse', 'both'"),
        (["compare", ".", ".", "--until", "1"], "--until: is for histories, not for finished runs"),
        (["record", "one.AT2", "--read", "column=0"], "rockcheck: column: 0 is not allowed"),
        (["report", "gone"], "no finished run here"),
        (["report", "."], "format 99; this version reads"),
        *(
            ([command, "--out", place], f"{place}: cannot be used as a folder")
            for command in ("stress", "benchmark")
            for place in ("scene.toml", "scene.toml/below")
        ),
        (
            ["simulate", "walls.toml"],
            "walls.toml: walls: must be a list of tables: write [[walls]]",
        ),
        (["simulate", "within.toml"], "block.halfwidth: unknown key; did you mean 'half_width'"),
        (["simulate", "table.toml"], "table.toml: blok: unknown key; did you mean 'block'"),
        (["simulate", "unit.toml"], "unit.toml: excitation.unit"),
        (["simulate", "fig5a", "--model", "ebm", "--model", "cm"], "--model: is given twice"),
        (
            ["simulate", "fig5a", *["--set", "tolerance=1e-8"] * 2],
            "--set: tolerance is given twice",
        ),
        (["conformance", "--export", "x", "--tune", "1"], "--export: does not go with --models"),
        (["conformance", "--histories", "x", "--tune", "1"], "--tune: does not go with"),
        (["stress", "maps", "--runs", "5"], "--runs: is of random scenes, not of maps"),
        (["compare", "a.csv", "b.csv", "--until", "1", "--until=2"], "--until: is given twice"),
        (
            ["simulate", "fig5a", "-o", "x.xlsx"],
            "x.xlsx: a history is written as .csv or .csv.gz, not as .xlsx; its figure as .svg,"
            " .png, .pdf",
        ),
        (["simulate", "fig5a", "-o", "no/a.png"], "--output: no: no such folder"),
        (["accept", "scene.toml"], "scene.toml: is a scene, not a suite; `rockcheck validate`"),
        (
            ["validate", "scene.toml", "--strict", "both"],
            "--strict: scene.toml is a scene, and nothing",
        ),
        (["validate", "scene.toml", "--history", "r"], "--history: scene.toml is a scene, and"),
        (["validate", "smoke", "--history", "no/runs.jsonl"], "--history: no: no such folder"),
        *(
            (["assess", "fig5a", "--models", f"ebm,{name}"], f"--models {name}: ")
            for name in FAMILIES
            if not_installed(name)
        ),
        (["validate", "nothere"], "nothere"),
        (["validate", "scen.toml"], "scen.toml: cannot be read"),
        (["validate", "scene.toml", "--models", "ebm,mujcoo"], "did you mean 'mujoco'"),
        (["validate", "scene.toml", "--models", "measured"], "'measured' is not allowed"),
        (
            ["validate", "scene.toml", "--models", "ebm", "--set", "cm.tolerance=1"],
            "--set: 'cm.tolerance=1': write MODEL.key=value, with MODEL one of ebm",
        ),
        (
            ["validate", "scene.toml", "--models", "ebm", "--set", "ebm.tol=1"],
            "ebm.tol: unknown key",
        ),
        (["validate", "scene.toml", "--read", "unit=g"], "--read: needs records"),
        (["validate", "scene.toml", "--records", "X*.AT2"], "X*.AT2: no such files"),
        (
            ["validate", "scene.toml", "--records", "one.AT2", "--read", "vertical=true"],
            "one.AT2: 0 vertical components in it or in a file of the set that is named alike",
        ),
        (
            ["validate", "scene.toml", "--records", "one_V.AT2"],
            "one_V.AT2: a vertical component, and no horizontal one is given",
        ),
        (["validate", "wrong.toml"], "records.scenes: unknown scene 'seen'; did you mean 'scene'"),
        (["new", "scene.toml"], "scene.toml: is there already"),
        (["new", "mine.txt"], "mine.txt"),
        (["new", "Möbel.toml"], "name: Möbel is not allowed"),
        (["new", "no/such/mine.toml"], "no/such"),
        *((["simulate", f"pga-{n}.toml"], "excitation.pga") for n in range(4)),
        (["simulate", "words.toml"], "excitation.unscaled.0"),
        *(
            ([*command.split(), "--scheduler", address], f"rockcheck: --scheduler: {address!r}")
            for command, address in (
                ("validate smoke", "local:0"),
                ("assess fig5a", "local:two"),
                ("spectrum", "nonsense"),
                ("conformance", ""),
                ("stress", "local:0"),
                ("accept smoke", "local:0"),
            )
        ),
        *(
            (
                ["assess", "bookcase", *words, "--capacity", "0.5"],
                "--capacity: needs records and --levels",
            )
            for words in (["one.AT2"], ["--levels", "1:2:3"], [])
        ),
        (["assess", "fig5a", "--set", "tolerance=1"], "ebm-unilateral.tolerance: 1 is not allowed"),
        (["benchmark", "modles"], "did you mean 'models'"),
        *(
            (["spectrum", *words], said)
            for words, said in (
                (["fig5"], "fig5"),
                (["--size", "0"], "--size: 0 is not allowed"),
                (["--size", "31623"], "--size: 31623 is not allowed"),
                (["--size", "nan"], "--size"),
                (["--frequencies", "8", "0.5"], "--frequencies: 8 to 0.5 is not allowed"),
                (["--amplitudes", "nan", "2"], "--amplitudes: nan to 2"),
                (["--amplitudes", "0", "2"], "--amplitudes: 0 to 2"),
                (["--amplitudes", "1", "inf"], "--amplitudes: 1 to inf"),
                (["--model", "mujcoo"], "did you mean 'mujoco'"),
                (["--model", "cm", "--set", "tolerance"], "--set"),
                (["--set", "tolerance=0"], "ebm.tolerance"),
                (["gone.toml"], "gone.toml: cannot be read"),
                (["scene.toml"], "excitation.kind: 'rest' is not allowed"),
                (["--agreement", "0"], "--agreement: 0 is not allowed"),
                (["--agreement", "9", "--model", "cm"], "--agreement"),
            )
        ),
        *(
            (["conformance", *words.split()], said)
            for words, said in (
                ("--engine ebm", "--models: 'ebm' is not allowed: give one of mujoco"),
                ("--set time_step=0", "mujoco.time_step: 0 is not allowed"),
                ("--set softness=2", "mujoco.softness"),
                ("--set colour=red", "mujoco.colour"),
                ("--histories nowhere", "engine.toml: cannot be read"),
                ("--histories .", "engine.toml: colour"),
                ("--tune 0.5 --set settings=best", "settings"),
                ("--tune 0.5 --engine ebm", "--models: 'ebm' is not allowed: give one of mujoco"),
                ("--tune 2", "--tune: 2.0 is not allowed"),
                ("--tune nan", "--tune: nan is not allowed"),
                ("--tune 0.5 --set time_step=0", "--set time_step: 0 is not allowed"),
                ("--tune 0.5 --set friction=3", "--set friction: 3 is not allowed"),
                ("--tune 0.5 --set friction=red", "--set friction: red is not allowed"),
                ("--tune 0.5 --set step=1", "'step'"),
            )
        ),
    ],
)
def test_bad_input_is_one_line_and_exit_2(words, said, refused):
    """Before anything is played or written."""
    for name, text in FILES.items():
        Path(name).write_text(text, "utf-8")
    assert said in refused(*words)
    left = {path.name: path.read_text("utf-8") for path in Path().rglob("*") if path.is_file()}
    assert {name: left.get(name) for name in left.keys() - {"faulty.py"}} == FILES


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
