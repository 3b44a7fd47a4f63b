"""The terminal: help with examples, --quiet, --json, progress, width, colour, completion, new scene
files, nearest names."""

import os
import re
import subprocess
import sys
import time
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

from rockcheck import Block, Floor, History, MuJoCo, Scene, Wall, load_scene
from rockcheck.commands import console, progress_bar
from rockcheck.commands.cli import COMMANDS, HIDDEN
from rockcheck.scenes import progress
from rockcheck.scenes.buildings import Regular

STILL = "faulty:Still", "--allow-code", "faulty:Still"
pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
SUITE = """
reference = "still"
[models.still]
model = "faulty:Still"
[[scene]]
name = "short"
duration = 0.2
block = { half_width = 0.4, half_height = 1.5 }
floor = { friction = 0.5 }
"""


def rockcheck(*words, **environment):
    return subprocess.run(
        [sys.executable, "-m", "rockcheck", *words],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
        timeout=300,
        check=False,
    )


def test_a_first_simulation_does_not_wait_for_the_compiler(tmp_path):
    done = rockcheck("simulate", "fig5a", "-o", "a.csv", NUMBA_CACHE_DIR=str(tmp_path / "empty"))
    assert done.returncode == 0, done.stderr
    assert "a short run is interpreted" in done.stderr
    assert "compiling" not in done.stderr


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_an_example_that_the_command_understands(name, typed):
    explained, _, example = " ".join(typed(name, "--help")[0].split()).partition("Example: ")
    assert example.startswith(f"rockcheck {name}")
    options = {"--quiet", "--json", *re.findall(r"--[a-z]+", example)}
    assert [option for option in options if option not in explained] == []


def test_the_list_of_commands_is_not_cut_off(typed):
    assert typed("--version")[0] == f"rockcheck {version('rockcheck')}\n"
    out = typed("--help", holds=["--install-completion"])[0]
    assert {*COMMANDS} - {*HIDDEN} <= {*re.findall(r"^  ([a-z]+) +\S", out, re.MULTILINE)}
    assert "..." not in out.partition("Commands:")[2]


@pytest.fixture
def mine(told):
    assert told("new", "mine.toml") == {"file": "mine.toml"}
    return Path("mine.toml").read_text()


def test_a_new_scene_file_is_a_scene_with_every_setting(mine):
    assert load_scene("mine.toml").walls
    shown = set(re.findall(r"^(?:# )?\[*([a-z_]+)(?=\]| =)", mine, re.MULTILINE))
    kinds = (Scene, Block, Floor, Wall, Regular)
    settings = {name for kind in kinds for name in kind.model_fields}
    assert settings - shown == {"name"}  # by default the file's
    assert {"kind", "amplitude", "period", "symmetric", "cycles", "file", "scale"} <= shown


def test_settings_shown_as_remarks_are_the_defaults(mine):
    head, rest = mine.split("[excitation]", 1)
    loud = (
        re.sub(r"^# (?=[a-z_]+ += )", "", head, flags=re.MULTILINE)
        .replace("mass = 60.0", "")
        .replace("moment_of_inertia = 0.35", "")
    )
    tables = tomllib.loads(loud)
    assert tables["initial_height"] == 0.0
    assert tables["floor"]["static_friction"] == tables["floor"]["friction"]
    Path("loud.toml").write_text(loud + "[excitation]" + rest)
    own = load_scene("mine.toml")
    assert load_scene("loud.toml").replace(floor=Floor(friction=0.4), name=own.name) == own


def test_quiet_says_nothing_but_errors(mine, typed):
    lean = "--set", "offset=0.001", "-o", "a.csv"
    assert typed("simulate", "mine.toml", "--model", *STILL, *lean, "--quiet") == ("", "")
    assert History.load("a.csv").channels["theta"][0] == 0.001
    fails = "faulty:Fails", "--allow-code", "faulty:Fails", "-q"
    said = typed("simulate", "mine.toml", "--model", *fails, code=3)
    assert said == ("", "rockcheck: faulty:Fails: more than 10 events\n")
    assert not Path("mine--faulty_Fails.csv").exists()


def test_json_is_all_that_is_on_stdout(mine, told):
    assert "fig4a" in told("scenes")["scenes"]
    own = "simulate", "mine.toml", "--model", *STILL
    shifted = told(*own, "--set", "offset=0.001", "-o", "a.csv")
    assert shifted["history"] == "a.csv"
    assert shifted["scene"] == "mine"
    told(*own, "-o", "b.csv")
    found = {one["measure"]: one["value"] for one in told("compare", "b.csv", "a.csv")["figures"]}
    assert found["theta_rms"] == pytest.approx(0.001 / load_scene("mine.toml").block.alpha)
    report = told("spectrum", "mine.toml", "--size", "3")["report"]
    assert report == "rockcheck-report/spectrum/index.html"
    suite = "suite\udcff.toml", *STILL[1:], "--jobs", "1"  # a name that is not UTF-8
    Path(suite[0]).write_text(SUITE)
    run = told("validate", *suite, "--no-report", code=1)
    assert run["verdict"] == "fail"
    assert len(run["reasons"]) == 1
    (cell,) = run["cells"]
    assert cell["outcome"] == "at rest"
    assert cell["checks"] == 0
    assert cell["verdict"] is None
    assert told("accept", *suite)["refused"] == []


def test_without_a_terminal_no_colour_and_no_progress(mine, but_progress):
    scenes, done = rockcheck("scenes"), rockcheck("simulate", "mine.toml", "--model", *STILL)
    assert scenes.returncode == 0
    assert scenes.stderr == ""
    assert "\x1b" not in scenes.stdout
    assert max(map(len, scenes.stdout.splitlines())) <= 80
    assert done.returncode == 0
    assert but_progress(done.stderr) == []
    assert "\x1b" not in done.stdout


FOUR = [(0, 40), 0.1, (4, 40, "fig4a\x1b, cm"), 0.5]
FOUR_DONE = r"validate: 4 of 40, \d+:\d\d left \(fig4a\?, cm\)"


@pytest.mark.parametrize(
    ("voice", "steps", "every", "early", "least", "said"),
    [
        # A tenth in 0.1 s: about 0.9 s are left, more than `every`, so a line comes early; then
        # one every `every` s.
        ("tables", FOUR, 0.2, 0.15, 2, FOUR_DONE),
        ("json", FOUR, 0.2, 0.15, 2, FOUR_DONE),
        ("quiet", FOUR, 0.2, 0.15, 0, ""),
    ],
)
def test_a_long_work_tells_a_log_how_far_it_is(
    voice, steps, every, early, least, said, monkeypatch, capsys
):
    """Of `steps` a number is a time (s), in which the parts said last go on."""
    monkeypatch.setattr(progress_bar, "EVERY", every)
    monkeypatch.setattr(progress_bar, "EARLY", early)
    with console.output_mode(voice), progress_bar.progress("validate") as on_progress:
        for step in steps:
            time.sleep(step) if isinstance(step, float) else on_progress(*step)
    out, err = capsys.readouterr()
    assert out == ""
    assert len(err.splitlines()) >= least
    for line in err.splitlines():
        assert re.fullmatch(f"rockcheck: {said}", line)


@pytest.mark.parametrize("columns", [60, 80])
def test_on_a_terminal_colour_progress_and_its_width(mine, columns):
    terminal = {"TTY_COMPATIBLE": "1", "TERM": "xterm-256color", "COLUMNS": str(columns)}
    words = "simulate mine.toml --model mujoco --set time_step=1e-3 -o a:rocket:[b].csv"
    done = rockcheck(*words.split(), **terminal)
    assert [
        part
        for part in ("left", "mine, mujoco", "\x1b[", "a:rocket:[b].csv")
        if part not in done.stderr + done.stdout
    ] == []
    assert not list(Path().glob("*--*")), "only what was asked for"
    plain = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", rockcheck("scenes", **terminal).stdout)
    assert max(map(len, plain.splitlines())) <= columns


@pytest.mark.parametrize("step", [1e-3, "adaptive"])
def test_models_tell_how_far_they_are(step):
    scene = load_scene("bookcase").replace(duration=4.0)
    heard: list[float] = []
    with progress.within(
        progress.LISTENER, lambda done, total, what="": heard.append(done / total)
    ):
        MuJoCo(time_step=step).simulate(scene)
    assert heard == sorted(heard)
    assert 0.0 <= heard[0] <= heard[-1] < 1.0
    progress.tell(1, 2)  # nobody listens


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("rockcheck val", {"validate"}),
        ("rockcheck validate smo", {"smoke"}),
        ("rockcheck simulate fig5", {"fig5a", "fig5b"}),
        ("rockcheck simulate fig5a --model ebm-", {"ebm-unilateral", "ebm-bouc-wen"}),
        ("rockcheck simulate min", {"mine.toml"}),
        ("rockcheck validate --sch", {"--scheduler"}),
    ],
)
def test_completion(mine, line, offered):
    done = rockcheck(
        COMP_WORDS=line, COMP_CWORD=str(line.count(" ")), _ROCKCHECK_COMPLETE="complete_bash"
    )
    assert set(done.stdout.split()) == offered
