"""A run that is read back: pages that show it already stay as they are."""

import json
import shutil
from pathlib import Path

import pytest

from rockcheck.commands.cli import main
from rockcheck.reports.manifest import MANIFEST

SUITE = """
reference = "ebm"
print_figures = true
[models.ebm]
[models.near]
model = "ebm"
tolerance = 1e-6
[require]
difference = ["theta_peak"]
[[scene]]
name = "tilted"
duration = 0.4
initial_rotation = 0.05  # rad
floor = { friction = 0.5 }
block = { half_width = 0.4, half_height = 1.5 }
"""
WORDS = ("validate", "suite.toml", "--out", "report", "--jobs", "1")


@pytest.fixture(scope="module")
def made(tmp_path_factory) -> Path:
    """A folder with a suite and its run, none of whose figures has a tolerance yet."""
    folder = tmp_path_factory.mktemp("made")
    (folder / "suite.toml").write_text(SUITE, "utf-8")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder)
        assert main(list(WORDS)) == 1
    return folder


@pytest.fixture
def pages(made, in_an_empty_folder) -> Path:
    shutil.copytree(made, ".", dirs_exist_ok=True)
    return Path("report")


def times(folder: Path) -> dict[str, int]:
    """When each file of the run and of its pages was written; the store marks what it reads."""
    files = [*folder.glob("*.*"), *(folder / "pages").rglob("*.*")]
    return {
        path.relative_to(folder).as_posix(): path.stat().st_mtime_ns
        for path in files
        if not path.name.startswith(".lock")
    }


def test_nothing_is_written_where_nothing_was_played(pages, typed):
    before = times(pages)
    typed(*WORDS, code=1)
    assert times(pages) == before


def test_the_verdict_is_told_all_the_same(pages, told):
    told_again = told(*WORDS, code=1)
    assert told_again["verdict"] == "fail"
    assert told_again["report"] == "report/index.html"


@pytest.mark.parametrize("name", ["index.html", "pages/assets/models.css", "figures.csv"])
def test_the_folder_stays_whole(pages, typed, name):
    content = (pages / name).read_bytes()
    typed(*WORDS, code=1)
    assert (pages / name).read_bytes() == content


def test_a_page_that_somebody_changed_is_written_anew(pages, typed):
    page = pages / "index.html"
    content = page.read_text("utf-8")
    page.write_text(content + "mine", "utf-8")
    typed(*WORDS, code=1)
    assert "mine" not in page.read_text("utf-8")


def test_a_page_that_is_gone_is_written_again(pages, typed):
    (page,) = (path for path in (pages / "pages").glob("*.html"))
    page.unlink()
    typed(*WORDS, code=1)
    assert page.is_file()


@pytest.mark.parametrize("name", ["figures.csv", "checks.csv", "junit.xml", "summary.md"])
def test_a_file_for_machines_that_is_gone_is_written_again(pages, typed, name):
    (pages / name).unlink()
    typed(*WORDS, code=1)
    assert (pages / name).is_file()


def test_a_table_that_somebody_changed_is_written_anew(pages, typed):
    content = (pages / "figures.csv").read_text("utf-8")
    (pages / "figures.csv").write_text(content + "mine", "utf-8")
    typed(*WORDS, code=1)
    assert (pages / "figures.csv").read_text("utf-8") == content


def test_another_judgement_is_shown(pages, typed):
    before = (pages / "index.html").read_text("utf-8")
    typed("accept", "suite.toml", "--out", "report", "--jobs", "1")
    typed(*WORDS)
    after = (pages / "index.html").read_text("utf-8")
    assert "no tolerance yet" in before
    assert after != before


def test_figures_that_were_not_asked_for_before_are_drawn(pages, typed):
    typed(*WORDS, "--figures", code=1)
    assert json.loads((pages / MANIFEST).read_text("utf-8"))["made_of"]
    assert [path.suffix for path in pages.rglob("*.pdf")] != []


def test_pages_of_other_sources_are_written_anew(pages, typed, monkeypatch):
    before = times(pages)["index.html"]
    monkeypatch.setattr("rockcheck.reports.style.drawn_by", lambda: "other sources")
    typed(*WORDS, code=1)
    assert times(pages)["index.html"] > before
