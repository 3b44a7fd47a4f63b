"""What is typed or written wrongly is one line and exit 2, before anything is played or written: a
table a command, or a kind of mistake that commands share."""

from pathlib import Path

import pytest

from rockcheck.validation.execute.models import FAMILIES, not_installed

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
SCENE = (
    "duration = 0.2\nblock = { half_width = 0.4, half_height = 1.5 }\nfloor = { friction = 0.5 }\n"
)
AT2 = "PEER\nNAME\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= {}, DT= .01 SEC\n 0.1 0.2\n"
RECORD = '[excitation]\nkind = "record"\n'
#: Files with a slip each, and what is right beside them.
FILES = {
    "scene.toml": SCENE,
    "negative.toml": SCENE.replace("0.4", "-0.4"),
    "unknown.toml": "colour = 1\n" + SCENE,
    "within.toml": SCENE.replace("half_width", "halfwidth"),
    "table.toml": SCENE.replace("block", "blok"),
    "slippery.toml": SCENE.replace("0.5", "1.4"),
    "walls.toml": SCENE + '[walls]\nside = "left"\ngap = 0.1\n',
    "record.toml": SCENE + RECORD + 'file = "short.AT2"\n',
    "unit.toml": SCENE + RECORD + 'file = "short.AT2"\nunit = "kg"\n',
    "wrong.toml": 'reference = "ebm"\nscenes = ["scene.toml"]\n[models.ebm]\n'
    '[[records]]\nfiles = ["one.AT2"]\nscenes = ["seen"]\n',
    **{
        f"pga-{n}.toml": SCENE + RECORD + f'file = "one.AT2"\npga = {pga}\n'
        for n, pga in enumerate(("0.5\nscale = 2.0", "-1.0", "1e9", '"0.5 g"'))
    },
    "words.toml": SCENE + RECORD + 'unscaled = ["1"]\ntime_step = 0.1\npga = 0.5\n',
    "engine.toml": 'engine = "mine"\ncolour = "red"\n',
    "run.json": '{"format": 99}',
    "short.AT2": AT2.format(3),
    "one.AT2": AT2.format(2),
    "one_V.AT2": AT2.format(2).replace("NAME", "Place, 1/1/2000, Station, UP"),
}


@pytest.fixture
def refuses(refused):
    """`refuses(words, said)`: a command beside `FILES` says so in one line, and writes nothing."""
    for name, text in FILES.items():
        Path(name).write_text(text, "utf-8")

    def check(words: str, said: str) -> None:
        assert said in refused(*words.split())
        left = {path.name: path.read_text("utf-8") for path in Path().rglob("*") if path.is_file()}
        assert {name: left.get(name) for name in left.keys() - {"faulty.py"}} == FILES

    return check


@pytest.mark.parametrize(
    ("words", "nearest"),
    [
        ("validat", "Did you mean 'validate'"),
        ("validate --job 2", "--jobs"),
        ("validate papre", "did you mean 'paper'"),
        ("validate scene.toml --models ebm,mujcoo", "did you mean 'mujoco'"),
        ("validate wrong.toml", "records.scenes: unknown scene 'seen'; did you mean 'scene'"),
        ("simulate fig4 --model ebm", "did you mean 'fig4b'"),
        ("simulate fig4a --model mujcoo", "did you mean 'mujoco'"),
        (
            "simulate fig4a --model mujoco --set time_stp=1e-3",
            "mujoco.time_stp: unknown key; did you mean 'time_step'?",
        ),
        ("spectrum --model mujcoo", "did you mean 'mujoco'"),
        ("benchmark modles", "did you mean 'models'"),
    ],
)
def test_a_misspelt_name_is_answered_by_the_nearest(words, nearest, refuses):
    refuses(words, nearest)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("simulate fig5a --model ebm --model cm", "--model: is given twice"),
        (
            "simulate fig5a --set tolerance=1e-8 --set tolerance=1e-8",
            "--set: tolerance is given twice",
        ),
        ("compare a.csv b.csv --until 1 --until=2", "--until: is given twice"),
    ],
)
def test_an_option_given_twice_is_refused(words, said, refuses):
    refuses(words, said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("compare a.csv b.csv --align", "--align: needs a value: Shift the candidate"),
        ("validate smoke --strict", "--strict: needs a value: worse: figures that left"),
    ],
)
def test_an_option_without_its_value_says_what_it_is_for(words, said, refuses):
    refuses(words, said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("conformance --export x --tune 1", "--export: does not go with --models"),
        ("conformance --histories x --tune 1", "--tune: does not go with"),
        ("compare . . --until 1", "--until: is for histories, not for finished runs"),
        ("stress maps --runs 5", "--runs: is of random scenes, not of maps"),
        ("validate scene.toml --strict both", "--strict: scene.toml is a scene, and nothing"),
        ("validate scene.toml --history r", "--history: scene.toml is a scene, and"),
        ("validate scene.toml --read unit=g", "--read: needs records"),
        ("validate paper --quick", "--quick"),
        ("assess fig4a --capacity wall_speed:1", "--capacity: wall_speed:1: the scene has no wall"),
        ("assess fig4a --storeys 1:2", "--storeys: needs a [building] of storeys"),
        ("assess fig4a --capacity slip:50", "--capacity: slip:50: is it in m? At most"),
        ("assess fig4a --capacity slip:5mm", "--capacity: 'slip:5mm' is not allowed"),
    ],
)
def test_an_option_is_refused_where_it_means_nothing(words, said, refuses):
    refuses(words, said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("validate paper --out scene.toml", "scene.toml: cannot be used as a folder"),
        *(
            (f"{command} --out {place}", f"{place}: cannot be used as a folder")
            for command in ("stress", "benchmark")
            for place in ("scene.toml", "scene.toml/below")
        ),
        ("simulate scene.toml --model ebm -o no/such/out.csv", "no such folder"),
        ("simulate fig5a -o no/a.png", "--output: no: no such folder"),
        (
            "simulate fig5a -o x.xlsx",
            "x.xlsx: a history is written as .csv or .csv.gz, not as .xlsx; its figure as .svg,"
            " .png, .pdf",
        ),
        ("validate smoke --history no/runs.jsonl", "--history: no: no such folder"),
        ("new scene.toml", "scene.toml: is there already"),
        ("new mine.txt", "mine.txt"),
        ("new Möbel.toml", "name: Möbel is not allowed"),
        ("new no/such/mine.toml", "no/such"),
    ],
)
def test_what_cannot_be_written_is_told_at_once(words, said, refuses):
    refuses(words, said)


@pytest.mark.parametrize(
    ("file", "said"),
    [
        ("negative.toml", "negative.toml: block.half_width: -0.4 is not allowed"),
        ("unknown.toml", "unknown.toml: colour: unknown key"),
        ("within.toml", "block.halfwidth: unknown key; did you mean 'half_width'"),
        ("table.toml", "table.toml: blok: unknown key; did you mean 'block'"),
        ("walls.toml", "walls.toml: walls: must be a list of tables: write [[walls]]"),
        ("slippery.toml", "must be below 4/3"),
        ("gone.toml", "gone.toml: cannot be read"),
        ("record.toml", "NPTS says 3, the file has 2 samples"),
        ("unit.toml", "unit.toml: excitation.unit"),
        *((f"pga-{n}.toml", "excitation.pga") for n in range(4)),
        ("words.toml", "excitation.unscaled.0"),
    ],
)
def test_a_slip_in_a_scene_file_is_named(file, said, refuses):
    refuses(f"simulate {file} --model ebm", said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("simulate scene.toml --model ebm --set tolerance", "key=value"),
        ("simulate scene.toml --model ebm --set tolerance=tight", "ebm.tolerance"),
        ("assess fig5a --set tolerance=1", "ebm-unilateral.tolerance: 1 is not allowed"),
        (
            "validate scene.toml --models ebm --set cm.tolerance=1",
            "--set: 'cm.tolerance=1': write MODEL.key=value, with MODEL one of ebm",
        ),
        ("validate scene.toml --models ebm --set ebm.tol=1", "ebm.tol: unknown key"),
    ],
)
def test_a_setting_that_a_model_has_not_is_refused(words, said, refuses):
    refuses(words, said)


@pytest.mark.parametrize("name", [name for name in FAMILIES if not_installed(name)])
def test_a_model_that_is_not_installed_is_named(name, refuses):
    refuses(f"assess fig5a --models ebm,{name}", f"--models {name}: ")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("gone.csv gone.csv", "gone.csv: cannot be read"),
        ("scene.toml scene.toml", "scene.toml"),
        ("a.csv b.csv --align=nan", "--align: 'nan': give seconds"),
    ],
)
def test_compare_refuses(words, said, refuses):
    refuses(f"compare {words}", said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--jobs 0", "--jobs"),
        ("smoke --strict x", "'x' is not one of 'worse', 'both'"),
        ("--strict smoke", "'smoke' is not one of 'worse', 'both'"),
        ("nothere", "nothere"),
        ("scen.toml", "scen.toml: cannot be read"),
        ("scene.toml --models measured", "'measured' is not allowed"),
        ("scene.toml --records X*.AT2", "X*.AT2: no such files"),
        (
            "scene.toml --records one.AT2 --read vertical=true",
            "one.AT2: 0 vertical components in it or in a file of the set that is named alike",
        ),
        (
            "scene.toml --records one_V.AT2",
            "one_V.AT2: a vertical component, and no horizontal one is given",
        ),
    ],
)
def test_validate_refuses(words, said, refuses):
    refuses(f"validate {words}", said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("accept scene.toml", "scene.toml: is a scene, not a suite; `rockcheck validate`"),
        ("record one.AT2 --read column=0", "rockcheck: column: 0 is not allowed"),
        ("report gone", "no finished run here"),
        ("report .", "format 99; this version reads"),
    ],
)
def test_what_a_command_cannot_use_is_named(words, said, refuses):
    refuses(words, said)


@pytest.mark.parametrize(
    ("command", "address"),
    [
        ("validate smoke", "local:0"),
        ("assess fig5a", "local:two"),
        ("spectrum", "nonsense"),
        ("conformance", ""),
        ("stress", "local:0"),
        ("accept smoke", "local:0"),
    ],
)
def test_a_scheduler_that_is_none_is_refused(command, address, refuses):
    refuses(f"{command} --scheduler={address}", f"rockcheck: --scheduler: {address!r}")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("fig5", "fig5"),
        ("gone.toml", "gone.toml: cannot be read"),
        ("scene.toml", "excitation.kind: 'rest' is not allowed"),
        ("--size 0", "--size: 0 is not allowed"),
        ("--size 31623", "--size: 31623 is not allowed"),
        ("--size nan", "--size"),
        ("--frequencies 8 0.5", "--frequencies: 8 to 0.5 is not allowed"),
        ("--amplitudes nan 2", "--amplitudes: nan to 2"),
        ("--amplitudes 0 2", "--amplitudes: 0 to 2"),
        ("--amplitudes 1 inf", "--amplitudes: 1 to inf"),
        ("--model cm --set tolerance", "--set"),
        ("--set tolerance=0", "ebm.tolerance"),
        ("--agreement 0", "--agreement: 0 is not allowed"),
        ("--agreement 9 --model cm", "--agreement"),
    ],
)
def test_spectrum_refuses(words, said, refuses):
    refuses(f"spectrum {words}", said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("--engine ebm", "--models: 'ebm' is not allowed: give one of mujoco"),
        ("--set time_step=0", "mujoco.time_step: 0 is not allowed"),
        ("--set softness=2", "mujoco.softness"),
        ("--set colour=red", "mujoco.colour"),
        ("--histories nowhere", "engine.toml: cannot be read"),
        ("--histories .", "engine.toml: colour"),
    ],
)
def test_conformance_refuses(words, said, refuses):
    refuses(f"conformance {words}", said)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("2", "--tune: 2.0 is not allowed"),
        ("nan", "--tune: nan is not allowed"),
        ("0.5 --engine ebm", "--models: 'ebm' is not allowed: give one of mujoco"),
        ("0.5 --set settings=best", "settings"),
        ("0.5 --set time_step=0", "--set time_step: 0 is not allowed"),
        ("0.5 --set friction=3", "--set friction: 3 is not allowed"),
        ("0.5 --set friction=red", "--set friction: red is not allowed"),
        ("0.5 --set step=1", "'step'"),
    ],
)
def test_conformance_tunes_nothing_for(words, said, refuses):
    refuses(f"conformance --tune {words}", said)
