"""The pages in a real browser, opened from the file system."""

import dataclasses
import math
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from playwright import sync_api as playwright

from rockcheck.reports.site import write_site
from rockcheck.scenes import History

pytestmark = pytest.mark.browser

WALL = "pages/beside-a-wall.html"


@pytest.fixture
def visit(opened, site):
    return lambda address, **settings: opened(site / address, site, **settings)


def window(page: playwright.Page) -> list[float]:
    return page.evaluate("rockcheckPage.store.window")


def spans(page: playwright.Page) -> list[list[float]]:
    return page.evaluate("rockcheckPage.drawn.slice(1).map(u => [u.scales.x.min, u.scales.x.max])")


def test_a_browser_that_cannot_unpack_the_data_is_told_and_figures_need_no_scripts(
    visitor, visit, site
):
    page = visitor(site)
    page.add_init_script("delete window.DecompressionStream")
    page.goto((site / WALL).as_uri())
    assert [page.locator(one).is_visible() for one in ("#too-old", "#live")] == [True, False]
    page = visit(WALL, java_script_enabled=False)
    assert "need JavaScript" in page.locator("noscript").inner_text()
    shown = [page.locator(one).first.is_visible() for one in ("#live", ".paper img")]
    assert shown == [False, True]


@pytest.mark.parametrize("address", ["index.html", "pages/free.html", WALL, "pages/Free-2.html"])
def test_opens_draws_and_fits_a_phone(visit, eventually, address):
    page = visit(address, viewport={"width": 390, "height": 800})
    width = page.evaluate("document.documentElement.scrollWidth")
    assert page.locator("h1").count() == 1
    assert width == 390
    inked = """() => [...document.querySelectorAll('#live canvas')].map(c =>
        c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some(v => v > 0))"""
    eventually(page, f"({inked})().every(Boolean)")
    drawn = page.evaluate("window.rockcheckPage ? rockcheckPage.drawn.length : 0")
    assert page.locator("#plots canvas").count() == drawn
    assert (drawn > 0) == (address != "index.html")


def test_links_lead_from_page_to_page(visit):
    page = visit("index.html")
    for link, heading in (
        ("free", "free"),
        ("beside a wall", "beside a wall"),
        ("Free", "Free"),
        ("← beside a wall", "beside a wall"),
        ("Overview", re.compile("A model failed")),
    ):
        page.get_by_role("link", name=link, exact=True).first.click()
        playwright.expect(page.locator("h1")).to_have_text(heading)


def test_the_index_is_filtered_and_sorted(visit):
    page = visit("index.html")
    shown = (
        "[...document.querySelectorAll('#matrix tbody tr:not([hidden])')]"
        ".map(row => row.dataset.scene)"
    )
    assert page.evaluate(shown) == ["free", "beside a wall", "Free"]
    for control, choice, rows in (
        ("order", "worst", ["Free", "beside a wall", "free"]),
        ("verdict", "fail", ["beside a wall"]),
        ("model", "cm", []),
        ("verdict", "", ["beside a wall", "free", "Free"]),  # the worst of that model
    ):
        page.locator(f"#pick [name={control}]").select_option(choice)
        assert page.evaluate(shown) == rows
    assert page.locator("#matrix thead th:visible").count() == 2
    page.locator("#pick [name=name]").fill("WALL")
    assert page.evaluate(shown) == ["beside a wall"]
    playwright.expect(page.locator("#pick output")).to_have_text("1 of 3 scenes")


def test_mouse_buttons_and_keys_zoom_and_move_all_plots(visit):
    page = visit(WALL)
    plot = page.locator("#plots .u-over").nth(3)

    def dragged(*shares: float) -> list[float]:
        wide = plot.bounding_box()["width"]
        start, end = ({"x": share * wide, "y": 20.0} for share in shares)
        plot.drag_to(plot, source_position=start, target_position=end)
        return window(page)

    assert dragged(0.25, 0.5) == pytest.approx([3.0, 6.0], abs=0.1)
    for span in spans(page):
        assert span == pytest.approx(window(page))
    page.keyboard.down("Shift")
    assert dragged(0.5, 0.25) == pytest.approx([3.75, 6.75], abs=0.15)
    page.keyboard.up("Shift")
    plot.dblclick()
    assert window(page) == pytest.approx([0.0, 12.0])
    page.evaluate("rockcheckPage.store.change({time: 6})")
    for button, shown in (("Zoom in", [3.0, 9.0]), ("Later", [4.5, 10.5])):
        page.get_by_role("button", name=button).click()
        assert window(page) == pytest.approx(shown)
    for key, shown in (
        ("ArrowRight", [4.5, 10.5]),
        ("Shift+ArrowLeft", [3.9, 9.9]),
        ("-", [0.0, 12.0]),
        ("+", [3.015, 9.015]),
        ("0", [0.0, 12.0]),
    ):
        page.locator("#plots").press(key)
        assert window(page) == pytest.approx(shown)
    assert page.evaluate("rockcheckPage.store.time") == pytest.approx(6.03)


def test_models_and_the_reference_of_differences_with_their_running_rms_are_chosen(visit):
    page = visit(WALL)
    # 6 models: the third's running RMS
    running = page.evaluate("rockcheckPage.drawn[3].data[9].filter(v => v !== null)")
    judged = "b => b.model === 'cm' && b.channel === 'theta' && b.against === 'ebm-unilateral'"
    band = page.evaluate(f"rockcheck.bands.find({judged})")
    assert len(running) == round(band["until"] / page.evaluate("rockcheck.step")) + 1
    assert running == [value for value in band["running"] if value is not None]
    shown = "rockcheckPage.drawn.slice(2).map(u => u.series[3].show)"
    assert all(page.evaluate(shown))
    page.get_by_role("checkbox", name="CM").uncheck()
    running = page.evaluate("rockcheckPage.drawn[3].series[9].show")
    assert {running, *page.evaluate(shown)} == {False}
    hidden = page.locator('#block [data-model="cm"], #values tr[data-model="cm"]')
    assert [one.is_visible() for one in hidden.all()] == [False, False]
    largest = """rockcheckPage.drawn[3].data.slice(1, 3)
        .map(line => Math.max(...line.map(v => Math.abs(v ?? 0))))"""
    assert [size > 0.0 for size in page.evaluate(largest)] == [False, True]  # itself is left out
    page.get_by_label("Differences from").select_option("ebm")
    assert [size > 0.0 for size in page.evaluate(largest)] == [True, False]
    page.get_by_role("checkbox", name="CM").check()
    # the reference was chosen while it was off
    assert all(page.evaluate(f"[...{shown}, rockcheckPage.drawn[3].data[9].some(Boolean)]"))
    said = page.locator("#plots").inner_text()
    assert [words for words in ("difference from EBM;", "RMS so far") if words not in said] == []


def test_animation_moves_the_block_and_slow_motion_is_slow(visit, eventually):
    page = visit(WALL)
    block = page.locator('#block [data-model="ebm-unilateral"]')
    start = block.get_attribute("transform")
    page.get_by_label("Speed").select_option("0.01")
    page.get_by_role("button", name="Play").click()
    eventually(page, "rockcheckPage.store.time > 0")
    page.wait_for_timeout(400)
    assert page.evaluate("rockcheckPage.store.time") < 0.1
    page.get_by_label("Speed").select_option("1")
    eventually(page, "rockcheckPage.store.time > 0.3")
    page.get_by_role("button", name="Pause").click()
    time, theta = page.evaluate("""(({models, alpha}, {store}) => [
        store.time, alpha * store.at(models[0], 'theta', store.time)
    ])(rockcheck, rockcheckPage)""")
    turned = block.get_attribute("transform") or ""
    assert turned != start
    assert float(re.search(r"rotate\((\S+)\)", turned)[1]) == pytest.approx(math.degrees(theta))
    eventually(page, f"document.getElementById('now').textContent === '{time:.3f} s'")
    page.locator("#time").fill("2000")
    assert page.evaluate("rockcheckPage.store.time") == pytest.approx(10.0)
    line = page.locator("#plots .plot").nth(2).locator(".cursor-line")
    assert float(re.findall(r"[\d.]+", line.get_attribute("style") or "")[0]) == pytest.approx(
        10.0 / 12.0 * page.evaluate("rockcheckPage.drawn[2].over.clientWidth"), abs=1.0
    )


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("address", ["index.html", WALL])
def test_accessible_and_by_night_no_figure_is_white(visit, barriers, address, scheme):
    page = visit(address, color_scheme=scheme, bypass_csp=True)
    assert barriers(page) == []
    filters = "all => all.map(one => getComputedStyle(one).filter)"
    expected = {"light": "none", "dark": "invert(0.91) hue-rotate(180deg)"}[scheme]
    assert set(page.eval_on_selector_all("main img", filters)) == {expected}


def test_print_shows_the_folded_figures_and_no_controls(visit):
    page = visit(WALL)
    assert page.locator("#form").get_attribute("open") is None
    assert page.locator("#form summary").bounding_box()["height"] < 60.0  # two lines
    assert page.locator("#result tbody tr").count() == 8
    assert not page.locator(".paper img").first.is_visible()
    page.emulate_media(media="print")
    assert not page.locator("#explore").is_visible()
    playwright.expect(page.locator("#paper")).to_have_attribute("open", "")
    # An image is loaded when it comes near.
    page.locator("#paper figcaption").first.scroll_into_view_if_needed()
    playwright.expect(page.locator(".paper img").first).to_be_visible()


def test_the_plots_can_be_taken_as_a_picture(visit):
    """What is shown: the window of time, the models that are on; drawn by itself, with nothing of
    the page around it."""
    page = visit(WALL)
    page.evaluate("rockcheckPage.store.change({ window: [1, 5] })")
    page.get_by_label("CM", exact=True).uncheck()
    pictures = {}
    for kind in ("svg", "png"):
        with page.expect_download() as waiting:
            page.locator(f"#as-{kind}").click()
        assert waiting.value.suggested_filename == f"beside-a-wall.{kind}"
        pictures[kind] = Path(waiting.value.path()).read_bytes()
    assert re.match(rb"\x89PNG(?s:.{20000})", pictures["png"])
    root = ElementTree.fromstring(pictures["svg"])
    said = [text.text for text in root.iter("{http://www.w3.org/2000/svg}text")]
    # In the key, and as a row of the events.
    assert said.count("MuJoCo") == 2
    assert said.count("CM") == 1
    lines = [path.get("d") for path in root.iter("{http://www.w3.org/2000/svg}path")]
    assert max(line.count("L") for line in lines) > 500
    assert b"NaN" not in pictures["svg"]


def test_a_block_that_falls_is_shown_up_to_its_fall(visit):
    page = visit("pages/Free-2.html")
    shown = window(page)
    assert page.evaluate("rockcheck.window") == pytest.approx(shown)
    assert shown[1] < 6.0 < 12.0  # the block lies then
    for span in spans(page):
        assert span == pytest.approx(shown)
    low, high = page.evaluate("(y => [y.min, y.max])(rockcheckPage.drawn[2].scales.y)")
    assert -1.8 < low < high < 1.8
    assert "✕ fell" in page.locator("#plots").inner_text()
    assert page.locator("#result").get_by_text("fell").count() == 2
    page.get_by_role("button", name="Whole").click()
    assert window(page) == pytest.approx([0.0, 12.0])
    page.evaluate("rockcheckPage.store.change({time: 12})")
    block = page.locator('#block [data-model="ebm"]')
    assert "NaN" not in (block.get_attribute("transform") or "NaN")
    assert block.evaluate("e => Number(e.style.opacity)") == 0.4


def test_a_measured_history_is_dots(opened, tmp_path, finished):
    cell = finished.by_scene["free"]["cm"]
    history = History.load(tmp_path / cell.history)
    table = dataclasses.replace(
        history,
        model="table",
        settings={"file": "run7.csv", "offset": 0.0},
        channels={name: history.channels[name][::10] for name in ("t", "theta")},
        event_list=(),
    )
    table.save(tmp_path / "histories" / "table.csv")
    measured = cell.model_copy(update={"model": "table", "history": "histories/table.csv"})
    finished.model_copy(
        update={"models": ("table", *finished.models), "cells": (measured, *finished.cells)}
    ).save(tmp_path)
    write_site(tmp_path)
    page = opened(tmp_path / "pages" / "free.html", tmp_path)
    dots = """(plot => [
        plot.data[1].filter(v => v !== null).length, plot.series[1].points.show(plot, 1)
    ])(rockcheckPage.drawn[2])"""
    assert page.evaluate(dots) == [len(table.channels["t"]), True]
    page.evaluate("rockcheckPage.store.change({time: 3})")
    assert not page.locator('#block [data-model="table"]').is_visible()
    assert "null" not in (page.locator("#close").get_attribute("viewBox") or "null")
