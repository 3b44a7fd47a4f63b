"""Pages of a finished run: complete, escaped, offline; the scene file plays the same scene; figures
are reproducible."""

import html
import inspect
import re

import numpy as np
import pytest

from rockcheck.commands import assess, studies
from rockcheck.commands.options import OUT
from rockcheck.reports.ensemble_page import EnsembleView
from rockcheck.reports.line_plots import GREY, colours
from rockcheck.reports.manifest import MANIFEST
from rockcheck.reports.overview import PEAKS, glance, matrix
from rockcheck.reports.show.words import duration, number
from rockcheck.reports.site import STUDIES, write_site
from rockcheck.reports.tables import worst_first
from rockcheck.reports.templates import PAGES, folder_argument
from rockcheck.reports.view import slugs_of
from rockcheck.scenes import History, reading, writing
from rockcheck.validation.execute.models import FAMILIES
from rockcheck.validation.suite import limits_used, results
from rockcheck.validation.uncertainty import input_spread


def addresses(text: str) -> list[str]:
    """All that a page asks for or links to, but for what it holds itself."""
    return list(map(html.unescape, re.findall(r'\b(?:href|src)="(?!#|data:)([^"]+)"', text)))


def text_of(page: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", page)).split())


def pages_of(site):
    return [site / "index.html", *sorted((site / PAGES).glob("*.html"))]


def test_every_scene_has_a_page_and_every_address_is_a_file_of_the_folder(site):
    pages = pages_of(site)
    assert [page.stem for page in pages] == ["index", "Free-2", "beside-a-wall", "crowd", "free"]
    targets = {
        (page.name, address): (page.parent / address.partition("#")[0]).resolve()
        for page in pages
        for address in addresses(page.read_text("utf-8"))
    }
    assert [place for place, target in targets.items() if not target.is_file()] == []
    assert [place for place, to in targets.items() if not to.is_relative_to(site.resolve())] == []


def test_pages_of_scenes_with_walls_say_what_the_papers_pivot_forbids(site):
    forbidding = [page for page in pages_of(site) if "forbids the hop" in page.read_text("utf-8")]
    assert [page.stem for page in forbidding] == ["beside-a-wall"]
    said = text_of(forbidding[0].read_text("utf-8"))
    assert "here 4 mm high" in said
    assert "model form, not numerical error" in said


@pytest.mark.parametrize(
    ("model", "role"),
    [
        ("ebm-unilateral", "The reference"),
        ("ebm", "What separates it from the reference is model form"),
    ],
)
def test_the_index_says_what_a_model_is(index, model, role):
    assert f"{FAMILIES[model].summary}. {role}" in text_of(index)


def test_hostile_text_stays_text(site):
    texts = {page.name: page.read_text("utf-8") for page in pages_of(site)}
    assert [name for name, text in texts.items() if "<img src=x" in text] == []
    said = "<img src=x onerror=alert(1)>&\"'</script>"
    assert [name for name, text in texts.items() if said not in text_of(text)] == []
    assert [
        one.name for one in (site / PAGES / "data").glob("*.js") if "<" in one.read_text("utf-8")
    ] == []


def test_index_lists_what_is_wrong_worst_first(run, index):
    (first, _), (second, _), *rest, (last, _) = worst_first(
        run.model_copy(
            update={
                "cells": [
                    *(run.cells[0].model_copy(update={"status": one}) for one in results.MISSING),
                    *run.cells,
                ]
            }
        )
    )
    assert [first.model, second.model, last.status] == ["mujoco", "mujoco", "absent"]
    order = [(check.verdict != "fail", -limits_used.used(check)) for _, check in rest]
    assert order == sorted(order)
    wrong = [check.verdict for _, check in run.checks() if check.verdict in ("fail", "changed")]
    assert sorted(check.verdict for _, check in rest) == sorted(wrong)
    said = ("A model failed", "tolerance [old.cm.ebm: theta_rms] has no cell in the suite")
    assert [words for words in said if words not in index] == []


def test_index_says_how_far_each_model_is(run, index):
    rows = matrix(run)
    assert set(rows) == set(run.scenes)
    late, falling = rows["beside a wall"]["mine:Model"], rows["Free"]["ebm"]
    assert late.rms.window == "8s"
    assert late.rms.value == pytest.approx(0.006)
    assert late.used == pytest.approx(3.0)
    assert "mine:Model" not in rows["free"]
    outcomes = {run.by_scene["Free"][model].outcome for model in ("ebm", "ebm-unilateral")}
    assert falling.why_apart == ""
    assert falling.apart == (len(outcomes) > 1)
    used = re.findall(r'<td data-model="mujoco" data-used="(.*?)"', index)
    assert used == ["0.15", "0.3", "1e+09"]  # of the last one it has no history


def test_index_answers_three_questions_first(run, index):
    found = glance(run, matrix(run))
    farthest = found.farthest.cell
    assert farthest.scene == "beside a wall"
    assert farthest.model == "mine:Model"
    assert [scene for scene, _ in found.apart] == [
        scene for scene, row in matrix(run).items() if any(entry.apart for entry in row.values())
    ]
    verdicts = [check.verdict for _, check in run.checks() if check.expected is not None]
    shares = [limits_used.used(check) for _, check in found.changed]
    assert shares == sorted(shares, reverse=True)
    assert found.judged == len(verdicts)
    assert len(shares) == len(verdicts) - verdicts.count("pass")
    at_a_glance, after = re.search('<dl class="glance"(.*?)</dl>(.*)', index, re.DOTALL).groups()
    said = (
        "mine:Model in beside a wall : 0.006 α RMS (first 8 s), convergence not looked at",
        f"{len(shares)} of {len(verdicts)} figures",
    )
    assert [words for words in said if words not in text_of(at_a_glance)] == []
    assert after.index("Not within") < after.index('id="matrix"')


def test_a_run_without_tolerances_says_how_to_get_them(tmp_path, finished):
    missing = {
        "limit": None,
        "expected": None,
        "drift": None,
        "verdict": "fail",
        "reason": "no tolerance yet",
    }
    cells = [
        cell.model_copy(
            update={
                "checks": tuple(check.model_copy(update=missing) for check in cell.checks),
                "history": None,
            }
        )
        for cell in finished.by_scene["free"].values()
    ]
    finished.model_copy(
        update={
            # a stout block lies before 1.5 alpha
            "scenes": {
                "free": finished.scenes["free"],
                "Free": finished.scenes["Free"]
                | {"block": {"half_width": 1.0, "half_height": 0.5}},
            },
            "cells": (
                *cells,
                finished.by_scene["Free"]["ebm"].model_copy(
                    update={
                        "checks": (),
                        "outcome": "moving",
                        "figures": tuple(
                            cells[0].figures[0].model_copy(update=figure)
                            for figure in (
                                {"measure": "last_rotation", "unit": "alpha", "value": 9.0},
                                {"measure": "peak_ratio", "against": finished.reference},
                            )
                        ),
                    }
                ),
            ),
            "ensembles": (),
            "faults": (),
        }
    ).save(tmp_path)
    index = write_site(tmp_path).read_text("utf-8")
    said = (
        "No tolerance yet",
        f"{sum(len(cell.checks) for cell in cells)} figures have no tolerance yet",
        "rockcheck accept",
        'data-verdict="no-tolerance"',
        'class="banner changed"',  # it has a state of its own, and is not red
    )
    assert [words for words in said if words not in index] == []
    assert "no tolerance yet</span>" in index
    # What waits for a tolerance has not failed, and is counted, not listed. An outcome is
    # known without its history.
    assert [
        words for words in ("out of tolerance</span>", "Not within tolerance") if words in index
    ] + re.findall(
        r"outcome</th><td>(.*?)</td>", (tmp_path / PAGES / "free.html").read_text("utf-8")
    ) + re.findall(
        r"peak .*</th><td>(.*?)</td>", (tmp_path / PAGES / "Free-2.html").read_text("utf-8")
    ) + re.findall("peak ×|falling left", index) == [cells[0].fate, "fell", *["falling left"] * 2]


def test_a_card_says_once_what_models_share(run, index):
    card = index.split('<article class="card">')[1]
    cells = run.by_scene["free"].values()
    words = {(cell.verdict, cell.verdict_words, cell.outcome) for cell in cells}
    assert len(words) < len(cells)
    assert card.count("<li>") == len(words)


def test_the_command_of_the_page_runs_as_it_stands(site, monkeypatch, tmp_path, typed):
    text = (site / PAGES / "beside-a-wall.html").read_text("utf-8")
    found = re.search(r"<code>rockcheck (simulate [^<]+)</code>", text)
    monkeypatch.chdir(site)
    typed(*found[1].split(), "-o", str(tmp_path / "again.csv"))
    assert History.load(tmp_path / "again.csv").model == "ebm-unilateral"


def files_of(site) -> dict[str, bytes]:
    """By name, all that belongs to the scenes' pages, not to the index."""
    return {
        path.relative_to(site / PAGES).as_posix(): path.read_bytes()
        for path in (site / PAGES).rglob("*")
        if path.is_file()
        and path.parent.name != "assets"
        and path.stem != PEAKS
        and path != site / MANIFEST
    }


def test_pages_made_side_by_side_are_those_made_one_by_one(tmp_path, site, finished, monkeypatch):
    monkeypatch.setattr("rockcheck.reports.site.FEW", 0)
    write_site(tmp_path, jobs=2)
    # Commands on a page name its folder.
    here, there = (f"rockcheck report {folder.name}".encode() for folder in (tmp_path, site))
    written = {name: content.replace(here, there) for name, content in files_of(tmp_path).items()}
    assert written == files_of(site)


def test_pages_are_written_again_and_those_of_scenes_that_are_gone_go(tmp_path, finished):
    write_site(tmp_path)
    inputs = input_spread.Inputs(
        samples=7,
        model="ebm",
        names=("mu",),
        figures=(),
        overturns={"name": "overturns", "value": 0.5, "low": 0.2, "high": 0.8, "unit": "1"},
        sensitivities=(),
    )
    change: dict[str, object] = {"created": "2026-01-02T00:00:00+00:00", "inputs": {"Free": inputs}}
    finished.model_copy(update=change).save(tmp_path)
    write_site(tmp_path)
    assert "2026-01-02" in (tmp_path / "index.html").read_text("utf-8")
    assert b"7 draws of mu" in files_of(tmp_path)["Free-2.html"]

    (tmp_path / PAGES / "figures" / "study.svg").touch()  # of another command, in the same folder
    change = {
        "scenes": {"free": finished.scenes["free"]},
        "cells": tuple(finished.by_scene["free"].values()),
        "ensembles": (),
    }
    finished.model_copy(update=change).save(tmp_path)
    write_site(tmp_path)
    assert sorted(files_of(tmp_path)) == [
        "data/free.js",
        *(f"figures/{name}" for name in ("free.svg", "free~small.svg", "study.svg")),
        "free.html",
        "scene-files/free.toml",
    ]


def test_a_page_that_a_user_has_changed_stays(tmp_path, finished):
    write_site(tmp_path)
    (tmp_path / PAGES / "crowd.html").write_text("mine", "utf-8")
    finished.model_copy(
        update={"ensembles": (), "cells": tuple(c for c in finished.cells if c.scene != "crowd")}
    ).save(tmp_path)
    write_site(tmp_path)
    assert files_of(tmp_path)["crowd.html"] == b"mine"


@pytest.mark.long
def test_a_large_run_has_pages_of_the_scenes_that_are_shown_and_of_those_that_are_wanted(
    tmp_path, finished, monkeypatch, fault_of
):
    monkeypatch.setattr("rockcheck.reports.site.shown", lambda run: ("free",))
    index = write_site(tmp_path).read_text("utf-8")
    assert "1 of 3 scenes have a page" in index
    assert f"rockcheck report {folder_argument(tmp_path)} --scene NAME" in html.unescape(index)
    scenes = {f"pages/{slug}.html": name for name, slug in slugs_of(finished.scenes).items()}
    assert {scenes[one] for one in scenes.keys() & addresses(index)} == {"free"}
    assert re.findall('data-scene="(.*?)"', index) == ["free"]

    write_site(tmp_path, wanted=("beside a wall",))
    assert (tmp_path / PAGES / "beside-a-wall.html").is_file()
    assert "did you mean 'free'" in str(fault_of(write_site, tmp_path, wanted=("fre",)))


def test_a_scene_that_no_model_plays_has_no_page(tmp_path, finished):
    """No suite makes such a run, but a file may say so."""
    nobodys = {"nobody's": {**finished.scenes["free"], "name": "nobody's"}}
    finished.model_copy(update={"scenes": finished.scenes | nobodys}).save(tmp_path)
    assert "3 of 4 scenes have a page" in write_site(tmp_path).read_text("utf-8")
    assert not (tmp_path / PAGES / "nobody-s.html").exists()


@pytest.mark.long
def test_figures_for_print_are_drawn_where_the_run_asks_for_them(
    tmp_path, finished, typed, refused
):
    write_site(tmp_path)
    drawn = (tmp_path / PAGES / "figures" / "free.svg").read_bytes()
    finished.model_copy(update={"printed": ("beside a wall",)}).save(tmp_path)
    write_site(tmp_path)
    figures = {path.name for path in (tmp_path / PAGES / "figures").iterdir()}
    assert {name for name in figures if name.startswith(("free", "beside-a-wall."))} == {
        "free~small.svg",
        "beside-a-wall.svg",
    }
    page = (tmp_path / PAGES / "free.html").read_text("utf-8")
    command = f"rockcheck report {folder_argument(tmp_path)} --scene free -o free.pdf"
    assert command in html.unescape(page)
    for name, ending, begins in (
        ("free", ".svg", b"<?xml"),
        ("free", ".png", b"\x89PNG"),
        ("free", ".pdf", b"%PDF"),
        ("crowd", ".svg", b"<?xml"),
    ):
        path = writing.made(tmp_path, "figures") / f"{name}{ending}"
        typed("report", str(tmp_path), "--scene", name, "-o", str(path))
        assert path.read_bytes().startswith(begins)
    assert (tmp_path / "figures" / "free.svg").read_bytes() == drawn
    for asked, said in (
        (
            ["--scene", "nowhere", "-o", "one.pdf"],
            "unknown scene of the run 'nowhere'; allowed: Free, beside a wall, crowd, free",
        ),
        (
            ["--scene", "free", "-o", "free.gif"],
            "free.gif: a figure is written as .svg, .png, .pdf, not as '.gif'",
        ),
        (["--scene", "free", "-o", "none/free.svg"], "--output: none: no such folder"),
    ):
        assert said in refused("report", str(tmp_path), *asked)


@pytest.mark.slow
def test_all_figures_are_written_for_who_asks_and_go_for_who_does_not(tmp_path, finished, typed):
    finished.save(tmp_path)
    figures = tmp_path / PAGES / "figures"
    typed("report", str(tmp_path), "--figures")
    written = {path.name for path in figures.iterdir()}
    assert {"free.svg", "free.pdf", "free.png", "overview~peaks.pdf"} <= written
    assert any("~against-" in name for name in written)
    assert "figures/free.pdf" in addresses((tmp_path / PAGES / "free.html").read_text("utf-8"))
    write_site(tmp_path)
    assert {path.suffix for path in figures.iterdir()} == {".svg"}


def test_an_ensemble_is_shown_by_its_distributions(site, run):
    (record,) = run.ensembles
    view = EnsembleView(run, "crowd", "crowd", record)
    (row,) = view.page().table("data/crowd~against-ebm-unilateral").records()
    reference, other = (np.array(record.peaks[m]) > 1.0 for m in ("ebm-unilateral", "cm"))
    figures = {f.measure: f.value for f in run.by_scene["crowd"]["cm"].figures}
    expected = {
        "both fall": np.sum(reference & other),
        "only the reference falls": np.sum(reference & ~other),
        "only the model falls": np.sum(~reference & other),
        "both stay": np.sum(~reference & ~other),
        "peak_bias": figures["peak_bias"],
    }
    assert {name: row[name] for name in expected} == expected
    page = text_of((site / PAGES / "crowd.html").read_text("utf-8"))
    drawn = ("uniform 0.3 to 0.8", "lognormal, median 6, σ 0.4", "p = ", duration(7.25))
    assert [said for said in (*drawn, number(row["peak_scatter"])) if said not in page] == []
    rows = reading.read_table(site / PAGES / "data" / "crowd.csv")
    columns = ("peak_rotation_alpha", "outcome")
    assert list(rows) == ["scene", *(f"{what} {m}" for m in record.peaks for what in columns)]
    np.testing.assert_array_equal(
        rows["peak_rotation_alpha ebm-unilateral"], np.array(record.peaks["ebm-unilateral"])
    )
    above, below = view.distributions().panels
    assert colours(below)[-1] == GREY  # the band of no difference has no model's colour
    curve = next(one for one in above.series if one.label == "CM")
    sample = view.record.samples["cm"]
    np.testing.assert_allclose(
        curve.y, [np.mean((sample.peaks <= peak) & ~sample.fallen) for peak in curve.x], atol=1e-12
    )
    assert np.max(np.abs(below.series[0].y)) == pytest.approx(figures["ks_distance"], abs=1e-12)


@pytest.mark.parametrize(
    "command",
    [
        assess.assess,
        studies.benchmark,
        studies.conformance,
        studies.spectrum,
        studies.stress,
    ],
    ids=lambda command: command.__name__,
)
def test_the_front_page_links_what_other_commands_write_beside_a_run(command):
    given = inspect.signature(command).parameters
    out = given["out"].default if "out" in given else given["played"].default.out
    assert f"{out.relative_to(OUT)}/index.html" in dict(STUDIES).values()
