"""The documentation as a site: builds strictly, and a real browser opens every page from the file
system."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote, urlsplit

import gallery
import pytest

import rockcheck

ROOT = Path(__file__).parents[2]
#: Building the site takes half a minute.
pytestmark = pytest.mark.long
GALLERY = ROOT / "docs" / "images" / "gallery"
SOURCES = sorted(path.stem for path in (ROOT / "docs").glob("*.md"))
RUNS = sorted((ROOT / "docs" / "runs").glob("*.json"))


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def page(visitor, site):
    return visitor(site)


def test_every_page_is_in_the_navigation(site):
    index = (site / "index.html").read_text("utf-8")
    assert {name for name in SOURCES if f'href="{name}.html' not in index} <= {"index"}


def test_names_of_the_glossary_are_in_the_code():
    text = (ROOT / "docs" / "glossary.md").read_text("utf-8")
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| **")]
    assert len(rows) >= 20
    words = {
        word
        for folder in ("scenes", "ebm", "engines", "validation")
        for path in (ROOT / folder).rglob("*.py")
        for word in (
            *path.relative_to(ROOT).with_suffix("").parts,
            *re.findall(r"\w+", path.read_text("utf-8")),
        )
    }
    names = [name for *_, place in rows for name in re.findall(r"`([^`]+)`", place)]
    assert [name for name in names if not words.issuperset(re.findall(r"[^\W\d]\w*", name))] == []


@pytest.mark.browser
@pytest.mark.parametrize("name", SOURCES)
def test_pages_open_from_the_file_system_and_fit_a_phone(site, page, name):
    """They ask for nothing. Tables, code and equations scroll by themselves; the page does not."""
    page.set_viewport_size({"width": 390, "height": 800})
    page.goto((site / f"{name}.html").as_uri())
    assert page.locator("h1").count() == 1
    broken = "[...document.images].filter(i => !i.complete || !i.naturalWidth).map(i => i.src)"
    assert page.evaluate(broken) == []
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


@pytest.mark.browser
def test_pictures_are_no_white_slabs_on_a_dark_page(site, page):
    page.emulate_media(color_scheme="dark")
    page.goto((site / "gallery.html").as_uri())
    shown = "all => all.map(image => getComputedStyle(image).filter)"
    filters = page.eval_on_selector_all("article img", shown)
    assert len(filters) > 3
    assert [one for one in filters if not one.startswith("invert")] == []


@pytest.mark.browser
def test_no_number_breaks_at_its_hyphen(site, page):
    """In the narrowest column, too; and what only the tests need is not published."""
    page.set_viewport_size({"width": 320, "height": 800})
    page.goto((site / "choosing.html").as_uri())
    held = page.evaluate(
        "[...document.querySelectorAll('article .unbroken')].map(one => [one.textContent,"
        " one.getClientRects().length])"
    )
    assert {"1e-12", "ebm-unilateral"} <= {text for text, _ in held}
    assert {lines for _, lines in held} == {1}
    assert "<!-- " not in page.locator("article").inner_html()


@pytest.mark.browser
def test_the_sample_report_is_one_click_away(site, page):
    page.goto((site / "index.html").as_uri())
    page.get_by_role("link", name="See a sample report").click()
    assert page.url == (site / "reports" / "smoke" / "index.html").as_uri()
    assert "smoke" in page.inner_text("body")
    links = page.evaluate(
        "[...document.links].map(a => a.href).filter(h => h.startsWith('file:')).map(h =>"
        " h.split(/[?#]/)[0])"
    )
    missing = [link for link in links if not Path(unquote(urlsplit(link).path)).exists()]
    assert len(links) > 5
    assert missing == []


@pytest.mark.parametrize("run", RUNS, ids=lambda path: path.stem)
def test_every_kept_run_has_its_report(site, run):
    blocks = json.loads(run.read_text("utf-8"))["blocks"]
    kept = {f"{table['name']}.csv" for table in blocks if table["block"] == "table"}
    assert {"index.html", *kept} <= {one.name for one in (site / "reports" / run.stem).iterdir()}


@pytest.mark.browser
def test_equations_are_drawn(site, page):
    page.goto((site / "theory.html").as_uri())
    shapes = page.evaluate(
        "[...document.querySelectorAll('math')].map(m => [m.textContent,"
        " m.getBoundingClientRect().height])"
    )
    assert len(shapes) > 100
    for _, height in shapes:
        assert height > 5
    assert [text for text, _ in shapes if "\\" in text] == []
    assert "\\(" not in page.inner_text("article")


@pytest.mark.browser
def test_the_search_finds_without_a_server(site, page):
    page.goto((site / "index.html").as_uri())
    # Keys, as a reader has them: the theme reads the field on keyup and focus, not on the input
    # event that `fill` sends.
    page.locator("input[name=query]").press_sequentially("Housner")
    page.wait_for_selector(".md-search-result__link")
    assert "Theory" in page.inner_text(".md-search-result__list")


def test_the_api_page_has_every_public_name(site):
    shown = set(
        re.findall(r'id="rockcheck(?:\.\w+)?\.(\w+)"', (site / "api.html").read_text("utf-8"))
    )
    assert set(rockcheck.__all__) - shown == {"__version__"}


@pytest.mark.slow
def test_pictures_of_the_gallery_are_those_that_the_code_makes():
    made = {f"{picture.__name__}.png" for picture in gallery.PICTURES}
    assert {path.name for path in GALLERY.iterdir()} == made
    page = (ROOT / "docs" / "gallery.md").read_text("utf-8")
    for name in made:
        assert f"images/gallery/{name}" in page


@pytest.mark.slow
def test_the_gallery_can_be_made(tmp_path):
    subprocess.run([sys.executable, gallery.__file__, str(tmp_path)], check=True)
    assert {path.name for path in tmp_path.iterdir()} == {path.name for path in GALLERY.iterdir()}
