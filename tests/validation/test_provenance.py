"""A key changes with all that a result depends on, and with nothing else."""

import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from rockcheck.scenes import load_scene
from rockcheck.validation.execute import models, provenance

MODULES = {
    "scenes": "rockcheck.scenes.writing",
    "ebm": models.family("ebm").module,
    "cm": models.family("cm").module,
    "engines": models.family("mujoco").module,
    "validation": "rockcheck.validation.suite.comparing",
    "user": "theirs",
}


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with a file in each folder, in place of rockcheck's."""
    for folder in (*provenance.FOLDERS, "reports"):
        (tmp_path / folder / "deep").mkdir(parents=True)
        (tmp_path / folder / "deep" / "code.py").write_text("one = 1\n")
    monkeypatch.setattr(provenance.resources, "files", lambda name: tmp_path)
    return tmp_path


@pytest.fixture
def theirs(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., provenance.UserCode]:
    """The code of `theirs`, a module in a folder with these files."""
    folder = tmp_path_factory.mktemp("user")

    def user_code(**texts: str) -> provenance.UserCode:
        for name, text in texts.items():
            path = folder.joinpath(*name.split("__in__")[::-1]).with_suffix(".py")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
        provenance.read_code_again()
        return provenance.user_code("theirs", (str(folder),))

    return user_code


def digests(user_folder: str) -> dict[str, str]:
    provenance.read_code_again()
    return {
        name: provenance.code_digest(module, (user_folder,)) for name, module in MODULES.items()
    }


@pytest.mark.parametrize(
    ("file", "changed"),
    [
        ("scenes/deep/code.py", {"scenes", "ebm", "cm", "engines", "validation", "user"}),
        ("ebm/deep/code.py", {"ebm", "validation", "user"}),
        ("cm/deep/code.py", {"cm", "validation", "user"}),
        ("engines/deep/code.py", {"engines", "validation", "user"}),
        ("validation/deep/code.py", {"validation", "user"}),
        ("validation/deep/new.py", {"validation", "user"}),
        ("ebm/deep/data.toml", set()),
        ("reports/deep/code.py", set()),
        ("theirs.py", {"user"}),
    ],
)
def test_a_changed_file_changes_the_digest_of_what_can_call_it(package, file, changed):
    (package / "theirs.py").write_text("one = 1\n")
    before = digests(str(package))
    (package / file).write_text("one = 2\n")
    after = digests(str(package))
    provenance.read_code_again()
    assert {name for name in MODULES if before[name] != after[name]} == changed


def test_a_file_that_changes_its_name_changes_the_digest(package):
    before = digests(str(package))
    (package / "ebm" / "deep" / "code.py").rename(package / "ebm" / "deep" / "other.py")
    after = digests(str(package))
    provenance.read_code_again()
    assert before["ebm"] != after["ebm"]


def test_the_folders_that_a_folder_calls_are_those_of_the_layers_below_it():
    text = (Path(__file__).parents[2] / "pyproject.toml").read_text(encoding="utf-8")
    contract, *_ = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    below: tuple[str, ...] = ()
    called = {}
    for layer in reversed(contract["layers"]):
        folders = [module.split(".")[1] for module in layer.split(" | ")]
        for folder in folders:
            called[folder] = {*below, folder}
        below = tuple(dict.fromkeys((*below, *folders)))
    assert {folder: called[folder] for folder in provenance.FOLDERS} == {
        folder: set(calls) for folder, calls in provenance.FOLDERS.items()
    }


def test_a_module_without_a_file_has_another_digest_in_each_run():
    before = digests("")
    assert digests("")["user"] != before["user"]


def test_a_users_code_is_what_its_module_imports_from_its_folder(theirs):
    code = theirs(
        theirs="def later():\n    from package import part\n",
        __init____in__package="",
        part__in__package="from . import other\n",
        other__in__package="",
        unused__in__package="",
        beside="",
    )
    assert sorted(code.files) == ["package", "package.other", "package.part", "theirs"]


def test_a_users_code_is_not_run(theirs):
    code = theirs(theirs="import beside\nraise SystemExit\n", beside="raise SystemExit\n")
    assert sorted(code.files) == ["beside", "theirs"]


def test_the_libraries_of_a_users_code_are_those_that_any_of_it_imports(theirs):
    code = theirs(theirs="import beside, os\nimport numpy.linalg\n", beside="import scipy\n")
    assert code.libraries == ("numpy", "scipy")


@pytest.mark.parametrize("beside", ["one =\n", "one = '\0'\n", "import missing\n"])
def test_a_module_that_cannot_be_read_is_left_to_the_cell_that_plays_it(theirs, beside):
    assert "theirs" in theirs(theirs="import beside\n", beside=beside).files
    assert list(theirs(theirs="one =\n").files) == ["theirs"]


def test_a_folder_that_is_no_package_ends_nothing(theirs):
    code = theirs(theirs="import folder.code\n", code__in__folder="")
    assert "theirs" in code.files


@pytest.mark.parametrize("name", models.FAMILIES)
def test_every_kind_of_model_has_a_digest_of_its_code(name):
    assert len(provenance.code_digest(models.family(name).module)) == 16


def test_a_new_version_of_a_models_library_is_another_key(monkeypatch):
    scene = load_scene("bookcase")
    before = provenance.cell_key(scene, "mujoco", {})
    monkeypatch.setattr(
        provenance, "version_of", lambda library: "99" if library == "mujoco" else "1"
    )
    newer = provenance.cell_key(scene, "mujoco", {})
    monkeypatch.setattr(provenance, "version_of", lambda library: "1")
    assert len({before, newer, provenance.cell_key(scene, "mujoco", {})}) == 3


def test_a_measured_history_depends_on_its_tables_and_their_events(tmp_path):
    scene, table = load_scene("bookcase"), tmp_path / "run.csv"
    table.write_text("t,theta\n0,0\n1,0\n")

    def key(files):
        return provenance.cell_key(scene, "measured", {"files": {scene.name: files}})

    before = key(str(table))
    (tmp_path / "run.events.csv").write_text("t,kind\n")
    with_events = key(str(table))
    table.write_text("t,theta\n0,0\n1,0.1\n")
    assert len({before, with_events, key(str(table))}) == 3
    repeats = key([str(table)] * 2)
    assert repeats != key(str(table))


def test_a_user_s_package_is_what_it_imports_from_beside_it(theirs):
    code = theirs(__init____in__theirs="import beside\n", beside="one = 1\n")
    assert sorted(code.files) == ["beside", "theirs"]


def test_a_script_is_its_file_and_what_that_imports(tmp_path, monkeypatch):
    script = tmp_path / "script.py"
    script.write_text("import beside, numpy\n")
    (tmp_path / "beside.py").write_text("one = 1\n")
    main = SimpleNamespace(__file__=str(script), __spec__=None)
    monkeypatch.setitem(sys.modules, "__main__", main)
    provenance.read_code_again()
    code = provenance.user_code("__main__")
    provenance.read_code_again()
    assert sorted(path.name for path in code.files.values()) == ["beside.py", "script.py"]
    assert code.libraries == ("numpy",)


def test_a_machine_that_says_little_of_itself_is_described_by_its_kind(monkeypatch):
    monkeypatch.setattr(provenance.re, "search", lambda *_: None)
    monkeypatch.setattr(provenance.platform, "processor", lambda: "")
    monkeypatch.setattr(provenance.platform, "machine", lambda: "abacus")
    monkeypatch.setattr(provenance.os, "cpu_count", lambda: 7)
    told = provenance.hardware()
    assert told["processor"] == "abacus"
    assert told["cores"] == "7"
    monkeypatch.setattr(provenance.platform, "processor", lambda: "of wood")
    monkeypatch.setattr(provenance.os, "cpu_count", lambda: None)
    told = provenance.hardware()
    assert told["processor"] == "of wood"
    assert told["cores"] == "1"


@pytest.mark.parametrize(
    ("place", "name"),
    [
        ("version_of", "numpy"),
        ("version_of", "scipy"),
        ("version_of", "mujoco"),
        ("platform.python_version", None),
        ("platform.machine", None),
    ],
)
def test_a_key_changes_with_the_libraries_python_and_the_machine(monkeypatch, place, name):
    def key():
        return provenance.cell_key(load_scene("fig5a"), "mujoco", {})

    before = key()
    whole = provenance.version_of
    monkeypatch.setattr(
        f"rockcheck.validation.execute.provenance.{place}",
        (lambda library: "another" if library == name else whole(library))
        if name
        else lambda: "another",
    )
    assert key() != before


def test_a_key_does_not_change_with_the_version_of_another_engine(monkeypatch):
    scene = load_scene("fig5a")
    before = provenance.cell_key(scene, "mujoco", {})
    whole = provenance.version_of
    monkeypatch.setattr(
        provenance, "version_of", lambda library: "new" if library == "pymunk" else whole(library)
    )
    assert provenance.cell_key(scene, "mujoco", {}) == before
