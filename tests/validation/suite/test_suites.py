"""Suite files: combinations of scenes, variants of models, and faults told in one line."""

import pytest

from rockcheck.scenes import InputError
from rockcheck.validation.suite import suites

MODELS = 'reference = "ebm"\n[models.ebm]\n'
SHELF = (
    '[[scene]]\nname = "shelf"\nduration = 1.0\n'
    "block = { half_width = 0.1, half_height = 0.4 }\nfloor = { friction = 0.5 }\n"
)


@pytest.fixture
def suite(written):
    return lambda text: suites.load_suite(written("mine.toml", text))


def test_scenes_by_name_by_table_and_by_file_and_models_by_labels_of_their_own(suite, written):
    written("own.toml", SHELF.replace("[[scene]]\n", "").replace("shelf", "own"))
    models = MODELS + '[models.coarse]\nmodel = "mujoco"\ntime_step = 1e-3\n'
    found = suite('scenes = ["fig4a", "own.toml"]\n' + models + SHELF)
    assert [(scene.name, variant.label, variant.family) for scene, variant, _ in found.cells()] == [
        (name, *model)
        for name in ("fig4a", "own", "shelf")
        for model in (("ebm", "ebm"), ("coarse", "mujoco"))
    ]
    middle = written("middle.toml", 'include = ["smoke"]\n').name
    joined = suite(f'include = ["{middle}"]\n')  # those that it joins are its own parts
    assert [member.name for member in joined.members] == ["smoke"]
    assert found.scenes["shelf"].block.half_width == 0.1


def test_a_grid_is_every_combination(suite):
    found = suite(
        MODELS
        + """
[[grid]]
axes = [
    [{ name = "left", walls = [{ side = "left" }] }, \
{ name = "right", walls = [{ side = "right" }] }],
    [
        { name = "3mm", walls = [{ gap = 0.003 }] },
        { name = "53mm", walls = [{ gap = 0.053 }] },
        { name = "mu09", walls = [{ gap = 0.1 }], floor = { friction = 0.9 } },
    ],
]
[grid.scene]
name = "w"
duration = 1.0
block = { half_width = 0.1, half_height = 0.4 }
floor = { friction = 0.5 }
walls = [{ restitution = 0.5 }]
""",
    )
    assert list(found.scenes) == [
        f"w-{side}-{rest}" for side in ("left", "right") for rest in ("3mm", "53mm", "mu09")
    ]
    scene = found.scenes["w-right-mu09"]
    assert scene.walls[0].side == "right"
    assert scene.walls[0].gap == 0.1
    assert scene.walls[0].restitution == 0.5
    assert scene.floor.friction == 0.9
    assert (
        suite(
            MODELS
            + '[[grid]]\naxes = [[{ name = "free", walls = [] }]]\n'
            + SHELF.replace("[[scene]]", "[grid.scene]")
            + "walls = [{ side = 'left', gap = 0.1 }]\n"
        )
        .scenes["shelf-free"]
        .walls
        == ()
    )


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        (SHELF, "reference: 'ebm-unilateral' is not among the suite's models"),
        ('reference = "x"\n' + SHELF, "reference: 'x' is not among"),
        (MODELS, "scenes: no scene"),
        ('scenes = ["fig4"]\n' + MODELS, "did you mean 'fig4b'"),
        ('scenes = ["fig4a", "fig4a"]\n' + MODELS, "scene 'fig4a' is named twice"),
        ('scenes = ["gone.toml"]\n' + MODELS, "gone.toml: cannot be read"),
        (MODELS + "tollerance = 1e-9\n" + SHELF, "ebm.tollerance: unknown key"),
        (MODELS + 'pivot = "unilateral"\n' + SHELF, "ebm.pivot: is fixed by the name"),
        (MODELS + "[models.mujcoo]\n" + SHELF, "did you mean 'mujoco'"),
        (
            MODELS + '[models.own]\nmodel = "nowhere:Model"\n' + SHELF,
            "models.own: 'nowhere:Model' is code of your own; it runs only if",
        ),
        (MODELS + "[require]\ndifference = ['theta_rsm']\n" + SHELF, "did you mean 'theta_rms'"),
        (MODELS + "[require]\ndifference = ['peak_rotation']\n" + SHELF, "require.difference"),
        (MODELS + "[require]\nmodel_form = ['theta_rms']\n" + SHELF, "needs the key model_form"),
        (MODELS + SHELF.replace("0.1", "-0.1"), "block.half_width: -0.1 is not allowed"),
        (
            MODELS + SHELF + "[tolerances.shelf.ebm.nobody]\ntheta_rms = { limit = 1.0 }\n",
            "unknown reference",
        ),
        ("reference = [\n", "not valid TOML"),
        (MODELS + "[limits]\nmemory_mb = 100\n" + SHELF, "limits.memory_mb: 100 is not allowed"),
        (
            MODELS + "[models.measured]\nfiles = { shelv = 'run.csv' }\n" + SHELF,
            "models.measured.files: unknown scene 'shelv'; did you mean 'shelf'",
        ),
        ('include = ["paper", "paper"]\n', "is in two of the suites"),
        ('include = ["papre"]\n', "did you mean 'paper'"),
        ('include = ["mine.toml"]\n', "joins itself"),
        *(
            ('include = ["smoke"]\n' + own, f"{key}: cannot be given together with include")
            for key, own in (
                ("scene", SHELF),
                ("models", "[models.ebm]\n"),
                ("tolerances", "[tolerances]\n"),
            )
        ),
        ("unknown = 1\n" + MODELS, "unknown: unknown key"),
        ("scene = 3\n" + MODELS, "scene: 3 is not allowed: give a list"),
        (
            MODELS + SHELF + "[tolerances.shelf.ebm.figures]\nhighest_hop = { limit = -1 }\n",
            "highest_hop",
        ),
    ],
)
def test_faults_are_one_line_with_the_file(suite, fault_of, text, fault):
    message = str(fault_of(suite, text))
    assert fault in message
    assert message.count("mine.toml") == ("gone.toml" not in message)


def test_a_fault_names_one_file_also_in_a_folder_called_like_a_key_and_in_the_working_folder(
    written, tmp_path, monkeypatch, fault_of
):
    (tmp_path / "scenes").mkdir()
    monkeypatch.chdir(written("scenes/mine.toml", MODELS).parents[1])
    written("mine.toml", 'scenes = ["gone.toml"]\n' + MODELS)
    *_, one, _, _, two = (  # a process imports one module of a name
        str(written(place + file.replace("NAME", name), text.replace("NAME", name)))
        for place, name in (("scenes/", "one"), ("", "two"))
        for file, text in (
            ("helper.py", ""),
            ("NAME.py", "import helper"),
            (
                "NAME.toml",
                MODELS + '[models.a]\nmodel = "NAME:A"\n' + SHELF.replace("shelf", "NAME"),
            ),
        )
    )
    faults = (
        str(fault_of(suites.load_suite, name, allow_code=["one:A", "two:A"]))
        for name in (
            "scenes/mine.toml",
            "mine.toml",
            written("outer.toml", f"include = {[one, two]}"),
        )
    )
    assert [said.removeprefix(f"{tmp_path}/").split(": ")[:2] for said in faults] == [
        ["scenes/mine.toml", "scenes"],
        ["gone.toml", "cannot be read"],
        ["outer.toml", "include"],
    ]


def test_a_fault_in_a_scene_file_names_that_file_alone(suite, tmp_path):
    folder = tmp_path / "o'brien"
    folder.mkdir()
    scene = folder / "shelf.toml"
    scene.write_text("duration = -1.0\n")
    with pytest.raises(InputError) as caught:
        suite(f'scenes = ["{scene}"]\n' + MODELS)
    assert str(caught.value).startswith(f"{scene}: ")
    assert "mine.toml" not in str(caught.value)
    assert caught.value.file == scene


def test_a_fault_of_the_suite_itself_names_the_suite(suite, tmp_path):
    with pytest.raises(InputError) as caught:
        suite('scenes = ["fig4a"]\nreference = "cm"\n[models.ebm]\n')
    assert str(caught.value).startswith(f"{tmp_path / 'mine.toml'}: reference: 'cm' is not")
    assert caught.value.file == tmp_path / "mine.toml"
