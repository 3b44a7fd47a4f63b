"""Scene files (TOML), and the scenes that come with the package."""

from pathlib import Path

import pytest

from rockcheck.scenes import InputError, Ricker, load_scene, named_scenes
from rockcheck.scenes.errors import MOST_NAMES, suggestion

TEXT = """
duration = 8.0
[block]
half_width = 0.397
half_height = 1.555
[floor]
friction = 0.3
[[walls]]
side = "left"
gap = 0.053
[excitation]
kind = "ricker"
amplitude = 6.0
period = 0.98
"""


def written(folder: Path, text: str, name: str = "bookcase.toml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def fault_of(source: str | Path) -> str:
    with pytest.raises(InputError) as fault:
        load_scene(source)
    assert "\n" not in str(fault.value)
    return str(fault.value)


def test_a_scene_file(tmp_path):
    scene = load_scene(written(tmp_path, TEXT))
    assert scene.name == "bookcase"
    assert scene.excitation == Ricker(amplitude=6.0, period=0.98)
    assert scene.wall("left").gap == 0.053
    assert load_scene(str(written(tmp_path, 'name = "other"\n' + TEXT))).name == "other"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        (
            "duration = 8.0",
            "duration = -8.0",
            "duration: -8.0 is not allowed: input should be greater than 0",
        ),
        ("duration = 8.0", "", "duration: is missing"),
        ("duration = 8.0", "durations = 8.0", "durations: unknown key; did you mean 'duration'"),
        ("duration = 8.0", "duration = 8.0\ncolour = 1", "colour: unknown key"),
        ("duration = 8.0", "duration = nan", "duration: nan is not allowed"),
        (
            "half_width = 0.397",
            "half_width = -0.397",
            "block.half_width: -0.397 is not allowed: input should be greater than 0",
        ),
        ("half_width = 0.397", 'half_width = "0.397"', "block.half_width: 0.397 is not allowed"),
        (
            "friction = 0.3",
            "friction = 1.4",
            "floor.friction: 1.4 is not allowed: must be below 4/3",
        ),
        ('side = "left"', 'side = "top"', "walls.0.side: top is not allowed"),
        ('kind = "ricker"', 'kind = "morlet"', "excitation"),
        ("period = 0.98", "period = 0.98\nfile = 'a.AT2'", "excitation.file: unknown key"),
        ('kind = "ricker"', 'kind = "record"\nfile = "none.AT2"', "none.AT2: cannot be read"),
        ("[floor]", "[floor", "not valid TOML"),
        ("[floor]", "[block]", "not valid TOML"),
    ],
)
def test_faults_name_file_key_and_value(old, new, said, tmp_path):
    fault = fault_of(written(tmp_path, TEXT.replace(old, new)))
    assert "bookcase.toml: " in fault
    assert said in fault


def test_files_that_cannot_be_read(tmp_path):
    assert "cannot be read: No such file" in fault_of(tmp_path / "none.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    assert "not a text file" in fault_of(binary)
    assert "did you mean 'fig4a'?" in fault_of("fig4aa")
    assert "or the path of a .toml file" in fault_of("scene.json")
    assert "not valid TOML" in fault_of(written(tmp_path, "a = " + "[" * 20000))


def test_a_record_is_looked_up_beside_the_file_then_in_the_package(tmp_path):
    text = (
        TEXT.split("[excitation]")[0]
        + '[excitation]\nkind = "record"\nfile = "elcentro_1940_ns.csv"\nscale = 1.6\n'
    )
    path = written(tmp_path, text)
    assert len(load_scene(path).excitation.unscaled) > 1000
    (tmp_path / "elcentro_1940_ns.csv").write_text("time_s,acceleration_g\n0,0.1\n0.1,0.2\n")
    assert len(load_scene(path).excitation.unscaled) == 2
    missing = written(
        tmp_path, text.replace("elcentro_1940_ns.csv", "../elcentro_1940_ns.csv"), "outside.toml"
    )
    assert "cannot be read" in fault_of(missing)


@pytest.mark.parametrize(
    ("name", "friction", "gap", "restitution"),
    [
        ("fig4a", 0.3, None, None),
        ("fig4b", 0.6, None, None),
        ("fig5a", 0.3, 0.053, 0.0),
        ("fig5b", 0.3, 0.053, 0.5),
    ],
)
def test_the_papers_scenes(name, friction, gap, restitution):
    assert name in named_scenes()
    scene = load_scene(name)
    assert (scene.name, scene.floor.friction, scene.duration) == (name, friction, 36.0)
    assert scene.excitation.peak == pytest.approx(1.6 * 0.31882, abs=1e-9)
    assert scene.excitation.time_step == 0.02
    wall = scene.wall("left")
    assert (wall and wall.gap, wall and wall.restitution) == (gap, restitution)
    assert scene.wall("right") is None
    assert scene.block.alpha == pytest.approx(0.25, abs=1e-4)
    assert scene.description


def test_a_message_lists_no_more_names_than_fit_a_line():
    said = suggestion("s7x", [f"s{n}" for n in range(MOST_NAMES + 20)])
    assert said.startswith("; did you mean 's7'? allowed: s0, s1, s10, ")
    assert said.endswith(" and 20 more")
    assert suggestion("ebn", ["ebm", "cm"]) == "; did you mean 'ebm'? allowed: cm, ebm"
